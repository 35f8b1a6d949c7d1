# The images for the board and for the emulator, by arm-none-eabi-gcc: target `firmware`, files in build/firmware.
find_program(ARM_GCC arm-none-eabi-gcc)
find_program(ARM_OBJCOPY arm-none-eabi-objcopy)
find_package(Python3 COMPONENTS Interpreter)
if(NOT ARM_GCC OR NOT Python3_FOUND)
  message(STATUS "no arm-none-eabi-gcc or python3: the firmware image is not built")
  return()
endif()

set(image_folder ${CMAKE_BINARY_DIR}/firmware)
file(MAKE_DIRECTORY ${image_folder})
set(describe "unknown")
find_package(Git QUIET)
if(Git_FOUND AND EXISTS ${CMAKE_SOURCE_DIR}/.git)
  execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty --abbrev=10
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR} OUTPUT_VARIABLE describe OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
string(SUBSTRING "${describe}" 0 40 describe)

set(arm_flags -std=c11 -mcpu=cortex-m4 -mthumb -mfloat-abi=soft -O2 -g -ffreestanding -ffunction-sections -fdata-sections
  -fno-tree-loop-distribute-patterns -fstack-usage -fno-common
  -Wall -Wextra -Wconversion -Wshadow -Wundef -Wstrict-prototypes -Wvla -Werror
  -I${CMAKE_CURRENT_SOURCE_DIR}/board/include -I${CMAKE_CURRENT_SOURCE_DIR}/board -I${CMAKE_CURRENT_SOURCE_DIR}/core
  -I${CMAKE_CURRENT_SOURCE_DIR}/wire
  -nostdlib -Wl,--gc-sections -Wl,--fatal-warnings -T ${CMAKE_CURRENT_SOURCE_DIR}/board/f405.ld)
set(core_sources core/commands.c core/decimator.c core/rig_board.c core/ring.c core/usb_descriptors.c core/usb_device.c
  board/startup.c)
file(GLOB image_headers ${CMAKE_CURRENT_SOURCE_DIR}/*/*.h ${CMAKE_CURRENT_SOURCE_DIR}/board/include/*.h)

# tunnelrig_image(<name> SOURCES … DEFINES …)
function(tunnelrig_image name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEFINES" ${ARGN})
  list(TRANSFORM core_sources PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/ OUTPUT_VARIABLE sources)
  list(TRANSFORM arg_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/board/)
  list(TRANSFORM arg_DEFINES PREPEND -D)
  set(out ${image_folder}/${name})
  add_custom_command(OUTPUT ${out}.elf ${out}.bin ${out}.dfu
    COMMAND ${ARM_GCC} ${arm_flags} ${arg_DEFINES} -Wl,-Map=${out}.map -o ${out}.elf ${sources} ${arg_SOURCES} -lgcc
    COMMAND ${ARM_OBJCOPY} -O binary ${out}.elf ${out}.bin
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/board/make_dfu.py ${out}.bin ${out}.dfu
    DEPENDS ${sources} ${arg_SOURCES} ${image_headers} ${CMAKE_CURRENT_SOURCE_DIR}/board/f405.ld
      ${CMAKE_CURRENT_SOURCE_DIR}/board/make_dfu.py
    WORKING_DIRECTORY ${image_folder} VERBATIM)
  set_property(GLOBAL APPEND PROPERTY TUNNELRIG_IMAGES ${out}.elf)
endfunction()

set(f405_sources clock.c main_f405.c otg_fs.c sampling.c)
tunnelrig_image(tunnelrig-f405 SOURCES ${f405_sources} DEFINES "GIT_DESCRIBE=\"${describe}\"" CRYSTAL_HZ=8000000u)
tunnelrig_image(tunnelrig-f405-12MHz SOURCES ${f405_sources} DEFINES "GIT_DESCRIBE=\"${describe}\"" CRYSTAL_HZ=12000000u)
tunnelrig_image(tunnelrig-emulator SOURCES main_emulator.c)
get_property(images GLOBAL PROPERTY TUNNELRIG_IMAGES)
add_custom_target(firmware ALL DEPENDS ${images})
