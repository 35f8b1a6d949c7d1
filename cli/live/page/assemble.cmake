# Puts the parts into the template: TEMPLATE, STYLES, LIBRARY, LICENCE and SCRIPTS are files (several: separated by commas),
# RESULT is the page.
function(join variable files)
  string(REPLACE "," ";" files "${files}")
  set(text "")
  foreach(file IN LISTS files)
    file(READ "${file}" part)
    string(APPEND text "${part}\n")
  endforeach()
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

file(READ "${TEMPLATE}" page)
foreach(part STYLES LIBRARY LICENCE SCRIPTS)
  join(text "${${part}}")
  string(REPLACE "{{${part}}}" "${text}" page "${page}")
endforeach()
file(WRITE "${RESULT}" "${page}")
