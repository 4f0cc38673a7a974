find_package(ZLIB REQUIRED)
find_library(MILD_SODIUM sodium) # seals of packets
if(NOT MILD_SODIUM)
  message(FATAL_ERROR "libsodium not found: run `make setup`, or install libsodium-dev")
endif()
mild_layer(drive layer_app layer_control layer_belief ZLIB::ZLIB ${MILD_SODIUM})
target_link_libraries(mild PRIVATE layer_drive)

if(MILD_TESTS)
  set(tests ${CMAKE_CURRENT_LIST_DIR}/tests)
  mild_tests(drive layer_drive layer_eval layer_config)
  mild_fuzz(packet layer_drive)
endif()
if(MILD_TESTS AND EXISTS ${python})
  add_test(NAME drive/drive COMMAND ${tests}/test_drive.sh $<TARGET_FILE:mild> ${python})
  add_test(NAME drive/attack COMMAND ${python} ${tests}/attack.py $<TARGET_FILE:mild>)
  set_tests_properties(drive/drive drive/attack PROPERTIES COST 1000) # they wait for the clock, and begin first
endif()
if(MILD_TESTS AND TARGET _envs)
  add_test(NAME drive/clients COMMAND ${python} ${tests}/test_clients.py $<TARGET_FILE:mild>)
  add_test(NAME drive/edges COMMAND ${python} ${tests}/test_edges.py)
  add_test(NAME install/deploy COMMAND ${python} ${CMAKE_SOURCE_DIR}/tests/install/test_tutorials.py
    ${CMAKE_SOURCE_DIR} $<TARGET_FILE:mild> ${CMAKE_BINARY_DIR}/python deploy)
  set_tests_properties(drive/clients PROPERTIES COST 1000)
  set_tests_properties(drive/clients drive/edges install/deploy PROPERTIES ENVIRONMENT
    "${lab_package};MPLBACKEND=agg;MILD_PROGRAM=$<TARGET_FILE:mild>;MILD_PLUGIN=$<$<TARGET_EXISTS:mild_plugin>:$<TARGET_FILE:mild_plugin>>")
endif()
