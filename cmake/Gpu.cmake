# The layer gpu. Only its kernels are CUDA C++; everything else is C that calls the CUDA runtime and cuBLAS.
if(NOT MILD_CUDA)
  mild_layer(learn/cuda layer_learn)
  return()
endif()
# -fmad=false: the random numbers equal the processor's bit for bit; these kernels wait for memory, not for arithmetic
add_library(gpu_kernels STATIC ${CMAKE_SOURCE_DIR}/src/learn/cuda/kernels.cu ${CMAKE_SOURCE_DIR}/src/learn/cuda/update.cu)
target_include_directories(gpu_kernels PRIVATE ${CMAKE_BINARY_DIR}/layers/cuda)
target_link_libraries(gpu_kernels PRIVATE layer_learn)
target_compile_options(gpu_kernels PRIVATE -fmad=false)
set_target_properties(gpu_kernels PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
mild_layer(learn/cuda layer_learn gpu_kernels CUDA::cudart_static CUDA::cublas stdc++)
