# The layer env, with its robots on a GPU when MILD_CUDA is on.
mild_layer(env layer_task layer_engine)
# lanes in loops: nothing gains from -O3 but the time to compile
# an environment keeps floats, and computes in double where it reads a definition
set_source_files_properties(env/batch_host.c PROPERTIES COMPILE_OPTIONS
    "$<IF:${mild_sanitized},-O0,-O2>;-Wno-float-conversion;$<$<C_COMPILER_ID:Clang>:-Wno-implicit-float-conversion>")
set(generated ${CMAKE_BINARY_DIR}/generated/env)
set(envs_names "")
set(envs_list "")
if(MILD_CUDA)
  # The kernels, compiled once for each robot, whose sizes the program `engine_sizes` reads from its folder, and once for
  # any robot, last.
  set(MILD_CUDA_ROBOTS "" CACHE STRING
    "robots that a GPU has kernels for besides those of robots/: folders, relative ones from the source tree")
  set(MILD_ENGINE_SIZES engine_sizes CACHE STRING
    "program that reads a robot's sizes: this build's, or its path in a build with a MILD_MARCH that runs here")
  if(MILD_ENGINE_SIZES STREQUAL "engine_sizes")
    add_executable(engine_sizes robot/engine/sizes.c)
    target_link_libraries(engine_sizes PRIVATE layer_engine mujoco::mujoco mild_options)
  endif()
  add_library(envs_device STATIC)
  function(envs_kernels name sizes) # sizes: text that includes those of a robot
    set(file ${generated}/${name}.cu)
    file(CONFIGURE OUTPUT ${file} CONTENT [=[
@sizes@
#define ENVS_KERNELS envs_kernels_@name@
#include "env/batch_device.cu"
]=] @ONLY)
    target_sources(envs_device PRIVATE ${file} ${ARGN})
    set(envs_list "${envs_list} &envs_kernels_${name}," PARENT_SCOPE)
    set(envs_names "${envs_names}extern const EnvsKernels envs_kernels_${name};\n" PARENT_SCOPE)
  endfunction()
  file(GLOB robots CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/robots/*/robot.ini)
  list(TRANSFORM robots REPLACE "/robot.ini$" "")
  foreach(robot ${MILD_CUDA_ROBOTS})
    get_filename_component(folder ${robot} ABSOLUTE BASE_DIR ${CMAKE_SOURCE_DIR})
    list(APPEND robots ${folder})
  endforeach()
  list(REMOVE_DUPLICATES robots)
  foreach(folder ${robots})
    if(NOT EXISTS ${folder}/robot.ini)
      message(FATAL_ERROR "MILD_CUDA_ROBOTS: ${folder} is no folder of a robot: it has no robot.ini")
    endif()
    get_filename_component(name ${folder} NAME)
    string(MAKE_C_IDENTIFIER ${name} name)
    if(envs_list MATCHES "_kernels_${name}," OR name STREQUAL "any")
      message(FATAL_ERROR "MILD_CUDA_ROBOTS: a second robot has the folder name ${name}; rename ${folder}")
    endif()
    file(GLOB sources CONFIGURE_DEPENDS ${folder}/robot.ini ${folder}/*.xml)
    add_custom_command(OUTPUT ${generated}/${name}.h
      COMMAND ${MILD_ENGINE_SIZES} ${folder} ${generated}/${name}.h DEPENDS ${MILD_ENGINE_SIZES} ${sources} VERBATIM)
    envs_kernels(${name} "#include \"${generated}/${name}.h\"" ${generated}/${name}.h)
  endforeach()
  envs_kernels(any "/* sizes: the largest */")
  target_include_directories(envs_device PRIVATE ${CMAKE_BINARY_DIR}/layers/env)
  target_link_libraries(envs_device PRIVATE layer_task layer_engine)
  # as the kernels of the layer batch
  target_compile_options(envs_device PRIVATE -ftz=true -prec-div=false -prec-sqrt=false)
  set_target_properties(envs_device PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(layer_env PUBLIC envs_device CUDA::cudart_static stdc++)
endif()
# The list of the kernels: none without CUDA.
file(CONFIGURE OUTPUT ${generated}/kernels.c CONTENT [=[
#define MILD_REAL_FLOAT
#include "env/kernels.h"

@envs_names@
const EnvsKernels *const envs_kernels[] = {@envs_list@ NULL};
]=] @ONLY)
target_sources(layer_env PRIVATE ${generated}/kernels.c)
