# What `cmake --install` puts where, and the package for Debian that CPack makes of it (docs/packages.md).

set(TUNNELRIG_MAINTAINER "tunnelrig maintainers <maintainers@localhost>" CACHE STRING "Whom the package names as its maintainer")

install(TARGETS tunnelrig RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${CMAKE_SOURCE_DIR}/daq/60-tunnelrig.rules DESTINATION lib/udev/rules.d)
install(DIRECTORY ${CMAKE_BINARY_DIR}/manual/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} FILES_MATCHING PATTERN "*.1.gz")
install(FILES ${CMAKE_BINARY_DIR}/manual/completion/tunnelrig DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${CMAKE_SOURCE_DIR}/README.md ${CMAKE_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tunnelrig)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${TUNNELRIG_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "rotor-rig data acquisition and analysis suite")
set(CPACK_PACKAGE_DESCRIPTION
  "Logs the load cells of a static-thrust rig without losing a frame
silently, calibrates them, turns volts into thrust coefficients with error
bars, and makes maps of the disturbance that a quadcopter meets in a narrow
tunnel. Holds the model against the measurement, and flies controllers
through the map in simulation.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gnuplot-nox")  # pictures of maps, the paper's figures
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "bash-completion, man-db")
include(CPack)
