# Controllers are found by name in layer control, so they are a part of it.
include(${CMAKE_CURRENT_LIST_DIR}/control/Daqp.cmake)
set(root ${CMAKE_BINARY_DIR}/layers/paper)
file(MAKE_DIRECTORY ${root}/paper)
file(CREATE_LINK ${CMAKE_CURRENT_LIST_DIR}/control ${root}/paper/control SYMBOLIC)
file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/control/*.c)
target_sources(layer_control PRIVATE ${sources})
target_include_directories(layer_control PRIVATE ${root})
target_link_libraries(layer_control PUBLIC daqp)
install(FILES ${daqp_folder}/../LICENSE DESTINATION share/doc/mild RENAME LICENSE-DAQP COMPONENT program OPTIONAL)

if(MILD_TESTS)
  include_directories(${root})
  mild_tests(paper layer_control)
endif()
if(MILD_TESTS AND NOT MILD_SANITIZE AND NOT MILD_FUZZ) # scripts: the same in every build
  set(tests ${CMAKE_CURRENT_LIST_DIR}/tests)
  foreach(test exam transitions) # with the program
    add_test(NAME paper/${test} COMMAND python3 ${tests}/test_${test}.py $<TARGET_FILE:mild> ${CMAKE_SOURCE_DIR})
  endforeach()
  foreach(test intended factorial elements sweep learners)
    add_test(NAME paper/${test} COMMAND python3 ${tests}/test_${test}.py ${CMAKE_SOURCE_DIR})
  endforeach()
  set_tests_properties(paper/learners PROPERTIES SKIP_RETURN_CODE 77) # no PyTorch here; make python-check runs it
  add_test(NAME paper/scripts COMMAND ${tests}/test_scripts.sh $<TARGET_FILE:mild>)
endif()
