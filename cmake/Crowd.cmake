# The layer crowd, with its robots on a GPU when MILD_CUDA is on.
mild_layer(crowd layer_task layer_engine)
# lanes in loops: nothing gains from -O3 but the time to compile
# an environment keeps floats, and computes in double where it reads a definition
set_source_files_properties(crowd/host.c PROPERTIES COMPILE_OPTIONS
    "-O2;-Wno-float-conversion;$<$<C_COMPILER_ID:Clang>:-Wno-implicit-float-conversion>")
if(MILD_CUDA)
  # compiled for the robots of this size (engine_model_sizes)
  set(MILD_CUDA_ROBOT ENGINE_JOINTS=12 ENGINE_FEET=2 ENGINE_CORNERS=8 ENGINE_ENTRIES=135 ENGINE_CHAIN=12
    CACHE STRING "sizes of the robot that a GPU steps; empty: any, several times slower")
  add_library(crowd_device STATIC ${CMAKE_SOURCE_DIR}/src/crowd/device.cu)
  target_include_directories(crowd_device PRIVATE ${CMAKE_BINARY_DIR}/layers/crowd)
  target_link_libraries(crowd_device PRIVATE layer_task layer_engine)
  target_compile_definitions(crowd_device PRIVATE ${MILD_CUDA_ROBOT})
  # as the kernels of the layer batch
  target_compile_options(crowd_device PRIVATE -ftz=true -prec-div=false -prec-sqrt=false)
  set_target_properties(crowd_device PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(layer_crowd PUBLIC crowd_device CUDA::cudart_static stdc++)
endif()
