# The layer batch, with its steps on a GPU when MILD_CUDA is on.
mild_layer(batch layer_ground layer_device)
if(MILD_CUDA)
  add_library(batch_device STATIC ${CMAKE_SOURCE_DIR}/src/batch/device.cu
    ${CMAKE_SOURCE_DIR}/src/batch/device_map.cu)
  target_include_directories(batch_device PRIVATE ${CMAKE_BINARY_DIR}/layers/batch)
  target_link_libraries(batch_device PRIVATE layer_ground layer_device)
  # quotients and roots within two units in the last place, and no denormal numbers
  target_compile_options(batch_device PRIVATE -ftz=true -prec-div=false -prec-sqrt=false)
  set_target_properties(batch_device PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(layer_batch PUBLIC batch_device CUDA::cudart_static stdc++)
endif()
