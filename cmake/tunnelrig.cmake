# Warnings, sanitizers, and the one function that makes a folder a library.

add_library(tunnelrig_options INTERFACE)
target_compile_options(tunnelrig_options INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor -Woverloaded-virtual>
  # gcc 12 sees overlaps and overflows in std::string's own code (its bug 105651); clang and AddressSanitizer look for real ones
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread>
  # gcc 12 warns of designated initialisers that leave defaulted members out, which is what they are for
  -Wno-missing-field-initializers)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)  # ccache needs it to see through precompiled headers
endif()
if(TUNNELRIG_SANITIZE)
  add_compile_options(-fsanitize=${TUNNELRIG_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TUNNELRIG_SANITIZE})
endif()

# For folders that parse what comes from outside: with the fuzz targets (tests/fuzz) they count their branches, by which libFuzzer
# finds its way. Elsewhere that would take a sixth more of the time to compile, and every comparison a call.
macro(tunnelrig_count_branches)
  if(TUNNELRIG_FUZZ)
    add_compile_options(-fsanitize=fuzzer-no-link)
  endif()
endmacro()

# For folders that wait, parse options or are run once: what is compiled takes a third of the time.
macro(tunnelrig_optimise_less)
  add_compile_options($<$<CONFIG:Release>:-O1>)
endmacro()

# And for the verbs and the tests: templates of options, JSON and assertions take most of the time there, twice as long where
# sanitizers instrument what an optimiser has inlined.
macro(tunnelrig_optimise_least)
  tunnelrig_optimise_less()
  add_compile_options($<$<CONFIG:RelWithDebInfo>:-O0>)
endmacro()

# For folders whose loops pass over every sample, or run in the control loop: wider vectors, deeper inlining.
macro(tunnelrig_optimise_more)
  add_compile_options($<$<CONFIG:Release>:-O3>)
endmacro()

# For folders full of Eigen: checks of every access that AddressSanitizer makes as well would triple the time that they take to
# compile, and Eigen steps along the null pointer of an empty matrix. Folders that read bytes from outside keep them.
macro(tunnelrig_fewer_checks)
  if(TUNNELRIG_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize=null,alignment,object-size,vptr,pointer-overflow)
  endif()
endmacro()

# Headers stand beside their sources and are included as "folder/name.h". So that CMake, not good manners, keeps
# dependencies one way, each folder is seen through an include directory of its own that holds a link to it alone.
# PRECOMPILED: the target with the same options whose precompiled header it takes; else it makes its own.
function(tunnelrig_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS;PRIVATE_LIBRARIES;PRECOMPILED" ${ARGN})
  set(seen ${CMAKE_BINARY_DIR}/include/${name})
  file(MAKE_DIRECTORY ${seen})
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${seen}/${name} SYMBOLIC)
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC ${seen})
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS} PRIVATE tunnelrig_options ${arg_PRIVATE_LIBRARIES})
  if(arg_PRECOMPILED)
    target_precompile_headers(${name} REUSE_FROM ${arg_PRECOMPILED})
  else()
    target_precompile_headers(${name} PRIVATE ${CMAKE_SOURCE_DIR}/cmake/precompiled/numeric.h)
  endif()
endfunction()

# tunnelrig_part(<name> [STATIC] FOLDERS … SOURCES … DEPENDS … [PRIVATE_LIBRARIES …] PRECOMPILED …): a part of analysis. Its headers,
# those of FOLDERS (named from analysis/), are seen through an include directory that holds links to them alone. Its objects go
# into the library analysis, unless it is a STATIC library of its own.
function(tunnelrig_part name)
  cmake_parse_arguments(arg "STATIC" "" "FOLDERS;SOURCES;DEPENDS;PRIVATE_LIBRARIES;PRECOMPILED" ${ARGN})
  set(seen ${CMAKE_BINARY_DIR}/include/${name})
  foreach(folder ${arg_FOLDERS})
    file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR} ${CMAKE_SOURCE_DIR}/analysis/${folder}/*.h)
    foreach(header ${headers})
      cmake_path(GET header PARENT_PATH path)
      file(MAKE_DIRECTORY ${seen}/${path})
      file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${header} ${seen}/${header} SYMBOLIC)
    endforeach()
  endforeach()
  set(kind OBJECT)
  if(arg_STATIC)
    set(kind STATIC)
  endif()
  add_library(${name} ${kind} ${arg_SOURCES})
  target_include_directories(${name} PUBLIC ${seen})
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS} PRIVATE tunnelrig_options ${arg_PRIVATE_LIBRARIES})
  target_precompile_headers(${name} REUSE_FROM ${arg_PRECOMPILED})
endfunction()
