# The layer device: memory, copies and streams, of a GPU too when MILD_CUDA is on.
mild_layer(device layer_base)
if(MILD_CUDA)
  add_library(device_gpu STATIC ${CMAKE_SOURCE_DIR}/src/device/gpu.cu)
  target_include_directories(device_gpu PRIVATE ${CMAKE_BINARY_DIR}/layers/device)
  target_link_libraries(device_gpu PRIVATE layer_base)
  set_target_properties(device_gpu PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(layer_device PUBLIC device_gpu CUDA::cudart_static stdc++)
endif()
