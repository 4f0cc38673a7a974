# CUDA, and the batch's steps on a GPU.
set(CMAKE_CUDA_ARCHITECTURES 90 CACHE STRING "CUDA architectures; each also as PTX for newer ones")
enable_language(CUDA)
find_package(CUDAToolkit REQUIRED)
add_library(batch_device STATIC ${CMAKE_SOURCE_DIR}/src/batch/device.cu)
target_include_directories(batch_device PRIVATE ${CMAKE_BINARY_DIR}/layers/batch)
target_link_libraries(batch_device PRIVATE layer_ground)
set_target_properties(batch_device PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
target_link_libraries(layer_batch PUBLIC batch_device CUDA::cudart_static stdc++)
