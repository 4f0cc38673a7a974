# Installation of the program, its data, man page and completion, and the Debian package (`make deb`, docs/install.md).
# MuJoCo has no Debian package: its library goes into lib/mild, where only this program looks for it.
set(MILD_MUJOCO_PLACE lib/mild)
set_target_properties(mild PROPERTIES INSTALL_RPATH "$ORIGIN/../${MILD_MUJOCO_PLACE}")
install(TARGETS mild RUNTIME DESTINATION bin COMPONENT program)
install(FILES ${mujoco_file} DESTINATION ${MILD_MUJOCO_PLACE} COMPONENT program)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/robots ${CMAKE_SOURCE_DIR}/configs ${CMAKE_SOURCE_DIR}/policies
  DESTINATION share/mild COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/scripts/press.py ${CMAKE_SOURCE_DIR}/scripts/fit.py
  ${CMAKE_SOURCE_DIR}/scripts/pressure.py DESTINATION share/mild/scripts COMPONENT program) # --figure, --pressure
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/schema DESTINATION share/mild COMPONENT program)
install(DIRECTORY ${CMAKE_BINARY_DIR}/web DESTINATION share/mild/build COMPONENT program OPTIONAL) # where scripts/web.sh ran
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION share/doc/mild RENAME copyright COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/NOTICE ${CMAKE_SOURCE_DIR}/README.md ${CMAKE_SOURCE_DIR}/CHANGELOG.md
  DESTINATION share/doc/mild COMPONENT program)
file(GLOB mujoco_licences ${mujoco_folder}/../mujoco*.dist-info/licenses/*)
install(FILES ${mujoco_licences} DESTINATION share/doc/mild/mujoco COMPONENT program)
install(FILES ${daqp_folder}/../LICENSE DESTINATION share/doc/mild RENAME LICENSE-DAQP COMPONENT program OPTIONAL)

# The program prints both from the tables of its help.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/pages.cmake.in @ONLY CONTENT [=[
set(pages @CMAKE_BINARY_DIR@/generated/pages)
file(MAKE_DIRECTORY ${pages})
execute_process(COMMAND $<TARGET_FILE:mild> info completion OUTPUT_FILE ${pages}/mild RESULT_VARIABLE one)
execute_process(COMMAND $<TARGET_FILE:mild> info man OUTPUT_FILE ${pages}/mild.1 RESULT_VARIABLE two)
execute_process(COMMAND gzip -9nf ${pages}/mild.1 RESULT_VARIABLE three)
if(one OR two OR three)
  message(FATAL_ERROR "mild info man, or completion, failed: ${one} ${two} ${three}")
endif()
]=])
file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/pages.cmake INPUT ${CMAKE_BINARY_DIR}/generated/pages.cmake.in)
install(SCRIPT ${CMAKE_BINARY_DIR}/generated/pages.cmake COMPONENT program)
install(FILES ${CMAKE_BINARY_DIR}/generated/pages/mild DESTINATION share/bash-completion/completions COMPONENT program)
install(FILES ${CMAKE_BINARY_DIR}/generated/pages/mild.1.gz DESTINATION share/man/man1 COMPONENT program)

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
