if(MILD_TESTS AND TARGET _ground AND EXISTS ${python})
  add_test(NAME see/see COMMAND ${python} ${CMAKE_CURRENT_LIST_DIR}/tests/test_see.py)
  set_tests_properties(see/see PROPERTIES ENVIRONMENT "${lab_package};MILD=$<TARGET_FILE:mild>;OPENBLAS_NUM_THREADS=1")
endif()
