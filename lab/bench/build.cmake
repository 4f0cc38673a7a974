mild_layer(bench layer_app layer_train layer_eval layer_env)
target_link_libraries(mild PRIVATE layer_bench)

if(MILD_TESTS)
  mild_tests(bench layer_bench)
  target_link_options(bench_test_train PRIVATE -Wl,--wrap=clock_seconds,--wrap=train_iterate)
  target_link_options(bench_test_ground PRIVATE
    -Wl,--wrap=clock_thread_seconds,--wrap=mild_ground_solve,--wrap=mild_ground_advance,--wrap=mild_ground_derivative)
  target_link_options(bench_test_step PRIVATE
    -Wl,--wrap=mj_step,--wrap=robot_sim_step,--wrap=robot_sim_set_solver,--wrap=bench_record_walk)
  target_link_options(bench_test_update PRIVATE -Wl,--wrap=clock_seconds,--wrap=ppo_act,--wrap=ppo_update,--wrap=product)
  target_link_options(bench_test_robots PRIVATE
    -Wl,--wrap=clock_seconds,--wrap=envs_create,--wrap=envs_reset,--wrap=envs_step,--wrap=envs_sums)
  target_link_options(bench_test_batch PRIVATE
    -Wl,--wrap=clock_seconds,--wrap=bench_record_walk,--wrap=robot_sim_step,--wrap=mild_batch_step)
  add_test(NAME bench/bench COMMAND ${CMAKE_CURRENT_LIST_DIR}/tests/test_bench.sh $<TARGET_FILE:mild> ${CMAKE_SOURCE_DIR})
  if(NOT MILD_SANITIZE AND NOT MILD_FUZZ) # numbers: the same in every build
    add_test(NAME bench/numbers COMMAND python3 ${CMAKE_CURRENT_LIST_DIR}/tests/test_numbers.py $<TARGET_FILE:mild>)
    add_test(NAME bench/record COMMAND python3 ${CMAKE_CURRENT_LIST_DIR}/tests/test_record.py $<TARGET_FILE:mild> ${CMAKE_SOURCE_DIR})
  endif()
endif()
