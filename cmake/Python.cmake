# The Python package (python/, docs/python.md): the modules mild._ground and mild._envs, which in this build lie in
# build/python/mild beside links to the package's files. A wheel (cmake/Wheel.cmake) has a module _envs for each MuJoCo, and
# the program. Its modules are for the stable interface of CPython 3.11 and newer: nanobind is a package of its own there.
if(MILD_PYTHON STREQUAL "AUTO" AND (NOT MILD_APP OR MILD_SANITIZE OR MILD_FUZZ))
  return() # the library alone, and what an interpreter does not load
endif()
if(NOT SKBUILD)
  set(Python_EXECUTABLE ${CMAKE_SOURCE_DIR}/.venv/bin/python)
  find_package(Python 3.11 QUIET COMPONENTS Interpreter Development.Module)
endif()
if(Python_Development.Module_FOUND)
  execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir OUTPUT_VARIABLE nanobind_DIR
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT nanobind_DIR)
  if(MILD_PYTHON STREQUAL "AUTO")
    message(STATUS "no Python package: `make setup` installs Python's headers and nanobind")
    return()
  endif()
  message(FATAL_ERROR "MILD_PYTHON: needs Python's headers (apt-get install python3-dev) and nanobind")
endif()
enable_language(CXX)
find_package(nanobind CONFIG REQUIRED)

# ---- modules ----
set(package ${CMAKE_BINARY_DIR}/python/mild)
set(python ${CMAKE_SOURCE_DIR}/python)
if(NOT SKBUILD)
  set(mild_package mild)
endif()
file(MAKE_DIRECTORY ${package})
add_custom_target(python ALL)
# In mild_cuda modules and program share the kernels, which are most of their size. Linked before the archives that hold them.
set(kernels "")
if(mild_package STREQUAL "mild_cuda")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/kernels_empty.c CONTENT "typedef int empty;\n")
  add_library(mild_kernels SHARED ${CMAKE_BINARY_DIR}/generated/kernels_empty.c)
  target_link_libraries(mild_kernels PRIVATE -Wl,--whole-archive $<TARGET_FILE:batch_device> $<TARGET_FILE:device_gpu>
    $<TARGET_FILE:envs_device> $<TARGET_FILE:gpu_kernels> -Wl,--no-whole-archive layer_base CUDA::cudart_static stdc++)
  target_link_options(mild_kernels PRIVATE -Wl,--as-needed -Wl,--no-undefined)
  add_dependencies(mild_kernels batch_device device_gpu envs_device gpu_kernels)
  install(TARGETS mild_kernels LIBRARY DESTINATION ${mild_package}/lib COMPONENT python)
  set(kernels -Wl,--push-state,--no-as-needed mild_kernels -Wl,--pop-state)
endif()
# mild_python_module(NAME FOLDER SOURCE...): mild.NAME, in a folder of the package; with a version in NAME, as
# _envs-4.0.0, it is the module _envs for that version of MuJoCo.
function(mild_python_module name folder)
  if(SKBUILD)
    nanobind_add_module(${name} BACKEND_MODULE nanobind_backend ${ARGN})
  else()
    nanobind_add_module(${name} NB_STATIC ${ARGN})
  endif()
  string(REGEX REPLACE "-.*" "" module ${name})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME ${module} LIBRARY_OUTPUT_DIRECTORY ${package}/${folder} CXX_STANDARD 17)
  target_compile_options(${name} PRIVATE -Wall -Wextra -march=${MILD_MARCH})
  target_link_options(${name} PRIVATE -Wl,--exclude-libs,ALL -Wl,--as-needed)
  install(TARGETS ${name} DESTINATION ${mild_package}/${folder} COMPONENT python)
  add_dependencies(python ${name})
endfunction()
function(mild_python_stub name module folder)
  nanobind_add_stub(${name}_stub MODULE ${module} OUTPUT ${package}/${module}.pyi PYTHON_PATH ${package}/${folder} DEPENDS ${name})
  install(FILES ${package}/${module}.pyi DESTINATION mild COMPONENT python_data)
  add_dependencies(python ${name}_stub)
endfunction()
set(source ${python}/src)
mild_python_module(_ground . ${source}/ground.cpp ${source}/material.cpp ${source}/terrain.cpp ${source}/press.cpp
  ${source}/fit.cpp ${source}/batch.cpp ${source}/xla.cpp)
mild_python_stub(_ground _ground .)
target_link_libraries(_ground PRIVATE ${kernels} layer_identify layer_soil layer_batch)
if(kernels)
  set_target_properties(_ground PROPERTIES INSTALL_RPATH "$ORIGIN/lib")
endif()
target_compile_definitions(_ground PRIVATE MILD_VERSION="${PROJECT_VERSION}")
if(MILD_APP AND NOT SKBUILD)
  mild_python_module(_envs . ${source}/envs.cpp)
  mild_python_stub(_envs _envs .)
  target_link_libraries(_envs PRIVATE layer_envs)
elseif(MILD_APP) # a module for each version whose structs are those of the newest (tests/plugin/test_wheel.sh)
  # linked before the layer of the same functions with a learner, so oneDNN is not in the process
  add_library(envs_plain OBJECT ${CMAKE_SOURCE_DIR}/src/env/actuator/without_learner.c)
  target_link_libraries(envs_plain PRIVATE layer_actuator mild_options)
  set_target_properties(envs_plain PROPERTIES POSITION_INDEPENDENT_CODE ON)
  get_target_property(here mujoco::mujoco IMPORTED_LOCATION)
  foreach(version ${mujoco_versions})
    if(version VERSION_GREATER_EQUAL 4.0)
      set(name _envs-${version})
      mild_python_module(${name} mujoco/${version} ${source}/envs.cpp)
      target_link_libraries(${name} PRIVATE envs_plain ${kernels} layer_envs)
      set_target_properties(${name} PROPERTIES INSTALL_RPATH "$ORIGIN/../../../mujoco:$ORIGIN/../../lib") # a neighbour in site-packages
      set(library mujoco_${version})
      if(here MATCHES "\\.so\\.${version}$")
        set(library mujoco::mujoco)
        mild_python_stub(${name} _envs mujoco/${version})
      endif()
      target_link_libraries(${name} PRIVATE -Wl,--push-state,--no-as-needed ${library} -Wl,--pop-state)
    endif()
  endforeach()
  # The program, with the MuJoCo that it was built with: that of the user may be another.
  add_dependencies(python mild)
  set_target_properties(mild PROPERTIES OUTPUT_NAME mild-${MILD_MARCH} INSTALL_RPATH "$ORIGIN/../lib")
  if(mild_package STREQUAL "mild_cuda") # cuBLAS is a package of its own
    set_target_properties(mild PROPERTIES
      INSTALL_RPATH "$ORIGIN/../../lib:$ORIGIN/../../../mild/data/lib:$ORIGIN/../../../nvidia/cu13/lib")
    target_link_libraries(mild PRIVATE ${kernels})
  elseif(MILD_CUDA) # that of the toolkit here
    set_target_properties(mild PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
  endif()
  install(TARGETS mild RUNTIME DESTINATION ${mild_package}/data/bin COMPONENT python)
  install(FILES ${mujoco_file} DESTINATION mild/data/lib COMPONENT python_data)
endif()

# ---- a copy of what is compiled, for another processor ----
if(SKBUILD AND MILD_SECOND_MARCH)
  include(ExternalProject)
  set(second ${CMAKE_BINARY_DIR}/${MILD_SECOND_MARCH})
  set(arguments "")
  foreach(name SKBUILD SKBUILD_PROJECT_NAME SKBUILD_STATE SKBUILD_SOABI SKBUILD_SOSABI SKBUILD_SABI_COMPONENT SKBUILD_SABI_VERSION CMAKE_BUILD_TYPE
      CMAKE_MAKE_PROGRAM CMAKE_PREFIX_PATH Python_EXECUTABLE MUJOCO_ROOT DAQP_ROOT MILD_DATA_DIR MILD_MPI MILD_PLUGIN MILD_PYTHON
      MILD_TESTS MILD_WERROR)
    if(DEFINED ${name})
      list(APPEND arguments "-D${name}:STRING=${${name}}")
    endif()
  endforeach()
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  ExternalProject_Add(second SOURCE_DIR ${CMAKE_SOURCE_DIR} BINARY_DIR ${second} BUILD_ALWAYS ON EXCLUDE_FROM_ALL ON
    CMAKE_ARGS ${arguments} -DMILD_MARCH=${MILD_SECOND_MARCH}
    BUILD_COMMAND ${CMAKE_COMMAND} --build <BINARY_DIR> --parallel ${cores} --target python
    INSTALL_COMMAND ${CMAKE_COMMAND} --install <BINARY_DIR> --component python --strip --prefix ${second}/prefix)
  add_dependencies(python second)
  set(compiled ${second}/prefix/mild)
  install(DIRECTORY ${compiled}/ DESTINATION mild/${MILD_SECOND_MARCH} USE_SOURCE_PERMISSIONS COMPONENT python_data
    PATTERN data EXCLUDE)
  install(DIRECTORY ${compiled}/data DESTINATION mild USE_SOURCE_PERMISSIONS COMPONENT python_data)
endif()

# ---- what else is in the package of this build ----
file(GLOB modules CONFIGURE_DEPENDS ${python}/mild/*)
foreach(module ${modules})
  get_filename_component(file ${module} NAME)
  file(CREATE_LINK ${module} ${package}/${file} SYMBOLIC)
endforeach()
file(CREATE_LINK ${CMAKE_SOURCE_DIR} ${package}/data SYMBOLIC)
