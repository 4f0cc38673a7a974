# Installation of the program, its data and manual page, and the Debian package (`make deb`, docs/install.md).
# MuJoCo has no Debian package: its library goes into lib/mild, where only this program looks for it.
set(MILD_MUJOCO_PLACE lib/mild)
set_target_properties(mild PROPERTIES INSTALL_RPATH "$ORIGIN/../${MILD_MUJOCO_PLACE}")
install(TARGETS mild RUNTIME DESTINATION bin COMPONENT program)
install(FILES ${mujoco_file} DESTINATION ${MILD_MUJOCO_PLACE} COMPONENT program)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/robots ${CMAKE_SOURCE_DIR}/configs ${CMAKE_SOURCE_DIR}/policies
  DESTINATION share/mild COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/scripts/draw.py DESTINATION share/mild/scripts COMPONENT program) # --figure, --pressure
install(FILES ${CMAKE_SOURCE_DIR}/python/mild/report.py DESTINATION share/mild/python/mild COMPONENT program) # mild report
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/schema DESTINATION share/mild COMPONENT program)
install(DIRECTORY ${CMAKE_BINARY_DIR}/web DESTINATION share/mild/build COMPONENT program OPTIONAL) # where scripts/web.sh ran
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION share/doc/mild RENAME copyright COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/NOTICE ${CMAKE_SOURCE_DIR}/README.md ${CMAKE_SOURCE_DIR}/CHANGELOG.md
  DESTINATION share/doc/mild COMPONENT program)
file(GLOB mujoco_licences ${mujoco_folder}/../mujoco*.dist-info/licenses/*)
install(FILES ${mujoco_licences} DESTINATION share/doc/mild/mujoco COMPONENT program)

# The manual page is the program's help, by help2man where there is one.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/manual.cmake.in @ONLY CONTENT [=[
execute_process(COMMAND @HELP2MAN@ --no-info --name "soft ground for legged robots" --output mild.1 $<TARGET_FILE:mild>
  COMMAND_ERROR_IS_FATAL ANY WORKING_DIRECTORY @CMAKE_BINARY_DIR@/generated)
execute_process(COMMAND gzip -9nf mild.1 COMMAND_ERROR_IS_FATAL ANY WORKING_DIRECTORY @CMAKE_BINARY_DIR@/generated)
]=])
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/manual.cmake INPUT ${CMAKE_BINARY_DIR}/generated/manual.cmake.in)
  install(SCRIPT ${CMAKE_BINARY_DIR}/generated/manual.cmake COMPONENT program)
  install(FILES ${CMAKE_BINARY_DIR}/generated/mild.1.gz DESTINATION share/man/man1 COMPONENT program)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mild)
set(CPACK_PACKAGE_CONTACT "the mild authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "soft ground for legged robots")
set(CPACK_PACKAGE_DESCRIPTION "Simulated legged robots on foam, rubber, grass, sand and snow, element by element, and the
 training that teaches them to walk there: the program mild and the library libmild.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
get_filename_component(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${mujoco_file} DIRECTORY)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ffmpeg, libegl1, libgl1-mesa-dri, libglfw3, python3, python3-matplotlib")
include(CPack)
