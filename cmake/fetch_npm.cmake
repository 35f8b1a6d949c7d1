# npm ci in the build tree: NPM is the program, FROM the folder of the lock file, TO where node_modules goes, RESULTS the files
# that are wanted of it, separated by commas, WHAT their name to a person. Silent unless it fails.
foreach(file package.json package-lock.json)
  configure_file(${FROM}/${file} ${TO}/${file} COPYONLY)
endforeach()
execute_process(
  # npm's own patience with a network that is not there is over a minute.
  COMMAND ${NPM} ci --ignore-scripts --prefer-offline --no-audit --no-fund
    --fetch-retries=2 --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=4000
  WORKING_DIRECTORY ${TO} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${WHAT} could not be fetched from npm. The network, or an npm cache that holds the package, is needed once, at the "
    "first build; see ${FROM}/package.json. npm ci said:\n${output}")
endif()
string(REPLACE "," ";" RESULTS "${RESULTS}")
foreach(result IN LISTS RESULTS)
  file(TOUCH_NOCREATE ${result})  # packages carry old dates, and the file must be newer than the lock
endforeach()
