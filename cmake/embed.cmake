# What the pages embed. Packages of npm are fetched once, as the package-lock.json of the calling folder pins them.
set(TUNNELRIG_FETCH_NPM ${CMAKE_CURRENT_LIST_DIR}/fetch_npm.cmake)
find_program(TUNNELRIG_NPM npm DOC "npm, which fetches what the pages embed and what drives the browser in the tests")
if(NOT TUNNELRIG_NPM)
  message(FATAL_ERROR "npm was not found. It fetches the plots that the pages embed: install nodejs and npm "
    "(`./rig setup` does), or set TUNNELRIG_NPM to where it is.")
endif()

# tunnelrig_npm(<variable> <name to a person> <file under node_modules>…): sets the variable to the files' full names.
function(tunnelrig_npm variable what)
  list(TRANSFORM ARGN PREPEND ${CMAKE_CURRENT_BINARY_DIR}/node_modules/ OUTPUT_VARIABLE results)
  list(JOIN results "," joined)
  add_custom_command(OUTPUT ${results}
    COMMAND ${CMAKE_COMMAND} -DNPM=${TUNNELRIG_NPM} -DFROM=${CMAKE_CURRENT_SOURCE_DIR} -DTO=${CMAKE_CURRENT_BINARY_DIR}
      -DRESULTS=${joined} -DWHAT=${what} -P ${TUNNELRIG_FETCH_NPM}
    DEPENDS package.json package-lock.json ${TUNNELRIG_FETCH_NPM}
    COMMENT "Fetching ${what}" VERBATIM)
  set(${variable} ${results} PARENT_SCOPE)
endfunction()

# "cmake/embed.h", which takes files into a program.
add_library(tunnelrig_embed INTERFACE)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/include/embed)
file(CREATE_LINK ${CMAKE_CURRENT_LIST_DIR} ${CMAKE_BINARY_DIR}/include/embed/cmake SYMBOLIC)
target_include_directories(tunnelrig_embed INTERFACE ${CMAKE_BINARY_DIR}/include/embed)
