# The walk in a browser (docs/web.md), but for WebAssembly, which scripts/web.sh makes: the program that packs the robot,
# and the core for this machine, which the tests step.
add_executable(web_pack ${CMAKE_SOURCE_DIR}/web/pack.c)
target_link_libraries(web_pack PRIVATE layer_config layer_belief mild_options)
target_include_directories(web_pack PRIVATE ${CMAKE_SOURCE_DIR})
add_library(web_core STATIC ${CMAKE_SOURCE_DIR}/web/core.c ${CMAKE_SOURCE_DIR}/web/window.c
  ${CMAKE_SOURCE_DIR}/src/identify/belief/belief.c)
target_link_libraries(web_core PUBLIC layer_env layer_soil PRIVATE mild_options)
target_include_directories(web_core PUBLIC ${CMAKE_SOURCE_DIR} PRIVATE ${CMAKE_BINARY_DIR}/layers/learn
  ${CMAKE_BINARY_DIR}/layers/view PUBLIC ${CMAKE_BINARY_DIR}/layers/belief)
# as env/batch_host.c; options of the file, which come behind those of mild_options
set_source_files_properties(${CMAKE_SOURCE_DIR}/web/core.c ${CMAKE_SOURCE_DIR}/web/window.c PROPERTIES COMPILE_OPTIONS
  "$<$<NOT:${mild_sanitized}>:-O2>;-Wno-float-conversion;$<$<C_COMPILER_ID:Clang>:-Wno-implicit-float-conversion>")
set(web_robot ${CMAKE_BINARY_DIR}/generated/web/robot.bin)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/generated/web)
set(shipped ${CMAKE_SOURCE_DIR}/policies/mild.safetensors ${CMAKE_SOURCE_DIR}/configs/walk.ini)
set(web_knows ${CMAKE_SOURCE_DIR}/policies/knows.safetensors)
# MILD_HOME: a build for elsewhere (scripts/deb.sh) has its data where nothing is yet
add_custom_command(OUTPUT ${web_robot}
  COMMAND ${CMAKE_COMMAND} -E env MILD_HOME=${CMAKE_SOURCE_DIR}
    $<TARGET_FILE:web_pack> ${CMAKE_SOURCE_DIR}/robots/sa01 ${shipped} ${web_robot}
  DEPENDS web_pack ${shipped} ${web_knows} ${CMAKE_SOURCE_DIR}/configs/default.ini ${CMAKE_SOURCE_DIR}/robots/sa01/robot.ini
  ${CMAKE_SOURCE_DIR}/robots/sa01/sa01.xml VERBATIM)
add_custom_target(web_robot DEPENDS ${web_robot})
