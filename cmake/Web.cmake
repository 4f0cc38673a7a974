# The walk in a browser (docs/web.md), but for WebAssembly, which scripts/web.sh makes: the program that packs the robots,
# and the core for this machine, which the tests step.
add_executable(web_pack ${CMAKE_SOURCE_DIR}/web/pack.c)
target_link_libraries(web_pack PRIVATE layer_config layer_belief mild_options)
target_include_directories(web_pack PRIVATE ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/layers/control)
add_library(web_core STATIC ${CMAKE_SOURCE_DIR}/web/core.c ${CMAKE_SOURCE_DIR}/web/window.c
  ${CMAKE_SOURCE_DIR}/src/identify/belief/belief.c ${CMAKE_SOURCE_DIR}/src/control/speed_hold.c)
target_link_libraries(web_core PUBLIC layer_env layer_soil PRIVATE mild_options)
target_include_directories(web_core PUBLIC ${CMAKE_SOURCE_DIR} PRIVATE ${CMAKE_BINARY_DIR}/layers/learn
  ${CMAKE_BINARY_DIR}/layers/view PUBLIC ${CMAKE_BINARY_DIR}/layers/belief ${CMAKE_BINARY_DIR}/layers/control)
# as env/batch_host.c; options of the file, which come behind those of mild_options
set_source_files_properties(${CMAKE_SOURCE_DIR}/web/core.c ${CMAKE_SOURCE_DIR}/web/window.c PROPERTIES COMPILE_OPTIONS
  "$<$<NOT:${mild_sanitized}>:-O2>;-Wno-float-conversion;$<$<C_COMPILER_ID:Clang>:-Wno-implicit-float-conversion>")
set(web_robots ${CMAKE_BINARY_DIR}/generated/web)
file(MAKE_DIRECTORY ${web_robots})
# MILD_HOME: a build for elsewhere (scripts/deb.sh) has its data where nothing is yet
function(web_robot name file policy config)
  set(shipped ${CMAKE_SOURCE_DIR}/policies/${policy}.safetensors ${CMAKE_SOURCE_DIR}/configs/${config}.ini)
  set(robot ${CMAKE_SOURCE_DIR}/robots/${name})
  add_custom_command(OUTPUT ${web_robots}/${file}.bin
    COMMAND ${CMAKE_COMMAND} -E env MILD_HOME=${CMAKE_SOURCE_DIR}
      $<TARGET_FILE:web_pack> ${robot} ${shipped} ${web_robots}/${file}.bin
    DEPENDS web_pack ${shipped} ${CMAKE_SOURCE_DIR}/policies/knows.safetensors ${CMAKE_SOURCE_DIR}/configs/default.ini
    ${robot}/robot.ini ${robot}/${name}.xml VERBATIM)
endfunction()
web_robot(sa01 sa01 mild walk)
web_robot(g1 g1 g1 g1)
web_robot(g1 g1_run g1_run g1_run)
web_robot(g1 g1_jump g1_jump g1_jump)
web_robot(go1 go1 go1 go1)
add_custom_target(web_robots DEPENDS ${web_robots}/sa01.bin ${web_robots}/g1.bin ${web_robots}/g1_run.bin ${web_robots}/g1_jump.bin
  ${web_robots}/go1.bin)
