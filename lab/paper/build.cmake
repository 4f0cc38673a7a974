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
