# A wheel (pyproject.toml, docs/install.md): the Python package for every supported MuJoCo and, where their libraries are, the
# environments and the program. Compiled for MILD_MARCH and, when it is given, for MILD_SECOND_MARCH too; what is imported
# or run is what the processor can (python/mild/_processor.py).
string(REPLACE "mildground" "mild" mild_package ${SKBUILD_PROJECT_NAME}) # the name on the package index is no module's
string(REPLACE "-" "_" mild_package ${mild_package}) # mild, or mild_cuda (python/cuda)
set(MILD_SECOND_MARCH "" CACHE STRING "x86-64-v4: the wheel has a second copy for such processors; empty: it has not")
add_compile_definitions(MILD_WHEEL) # device/gpu.h
find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module)
if(NOT EXISTS "${MUJOCO_ROOT}") # the wheel that pip installed for this build
  execute_process(COMMAND ${Python_EXECUTABLE} -c "import importlib.util as u; print(u.find_spec('mujoco').origin)"
    OUTPUT_VARIABLE mujoco_init OUTPUT_STRIP_TRAILING_WHITESPACE)
  get_filename_component(mujoco_wheel ${mujoco_init} DIRECTORY)
  set(MUJOCO_ROOT ${mujoco_wheel} CACHE PATH "MuJoCo release folder, or Python package" FORCE)
endif()
# For a wheel, which works with every supported version of MuJoCo: its headers of each (scripts/headers.py makes the archive),
# mujoco_VERSION with headers and, in the place of the library, an empty one of the same soname. The process that loads
# what is linked with it has the real one already.
set(mujoco_headers ${CMAKE_BINARY_DIR}/mujoco)
file(ARCHIVE_EXTRACT INPUT ${CMAKE_SOURCE_DIR}/plugin/headers.tar.xz DESTINATION ${mujoco_headers})
file(GLOB mujoco_versions RELATIVE ${mujoco_headers} ${mujoco_headers}/[0-9]*)
list(SORT mujoco_versions COMPARE NATURAL)
if(NOT mujoco_versions)
  message(FATAL_ERROR "plugin/headers.tar.xz: no headers in it; make it by scripts/headers.py")
endif()
set(mujoco_versions ${mujoco_versions} CACHE INTERNAL "") # for plugin/
file(CONFIGURE OUTPUT ${mujoco_headers}/empty.c CONTENT "typedef int empty;\n")
foreach(version ${mujoco_versions})
  add_library(mujoco_${version} SHARED EXCLUDE_FROM_ALL ${mujoco_headers}/empty.c)
  target_include_directories(mujoco_${version} INTERFACE ${mujoco_headers}/${version})
  set_target_properties(mujoco_${version} PROPERTIES OUTPUT_NAME mujoco SOVERSION ${version}
    LIBRARY_OUTPUT_DIRECTORY ${mujoco_headers}/lib-${version})
endforeach()
list(GET mujoco_versions -1 newest)
add_library(mujoco_headers INTERFACE)
target_include_directories(mujoco_headers INTERFACE ${mujoco_headers}/${newest})

if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  # what glibc 2.35 has a newer version of is taken in the older one, so that the wheel runs with 2.34 (Enterprise Linux 9)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/glibc.h CONTENT "__asm__(\".symver hypot, hypot@GLIBC_2.2.5\");\n")
  add_compile_options("$<$<COMPILE_LANGUAGE:C,CXX>:SHELL:-include ${CMAKE_BINARY_DIR}/generated/glibc.h>")
endif()

set(lacking "")
foreach(library dnnl inih cjson png sodium z)
  find_library(MILD_FOUND_${library} ${library})
  if(NOT MILD_FOUND_${library})
    list(APPEND lacking lib${library})
  endif()
endforeach()
file(GLOB daqp ${DAQP_ROOT}/csrc ${CMAKE_SOURCE_DIR}/.venv/daqp-*/csrc)
if(NOT daqp)
  list(APPEND lacking "DAQP's sources")
endif()
if(lacking)
  list(JOIN lacking ", " lacking)
  message(WARNING "mild without its program and environments, because there is no ${lacking}; `make setup` installs these")
  set(MILD_APP OFF)
elseif(NOT DEFINED MILD_APP)
  set(MILD_APP ON)
endif()

file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/VERSION CONTENT "${PROJECT_VERSION}\n")
install(FILES ${CMAKE_BINARY_DIR}/generated/VERSION DESTINATION ${mild_package} COMPONENT python)

# What else is in the package: data where the program finds it, two folders above itself.
install(DIRECTORY ${CMAKE_SOURCE_DIR}/configs ${CMAKE_SOURCE_DIR}/robots DESTINATION mild/data COMPONENT python_data)
if(MILD_APP)
  file(GLOB policies ${CMAKE_SOURCE_DIR}/policies/*.safetensors) # not the paper's, 12 MB
  install(FILES ${policies} DESTINATION mild/data/policies COMPONENT python_data)
  install(FILES ${CMAKE_SOURCE_DIR}/scripts/draw.py
    DESTINATION mild/data/scripts COMPONENT python_data OPTIONAL) # --figure, --pressure
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/schema DESTINATION mild/data/docs COMPONENT python_data OPTIONAL)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/build/web DESTINATION mild/data/build COMPONENT python_data OPTIONAL) # `make web` ran
  find_library(MILD_FOUND_glfw libglfw.so.3) # for windows: loaded where there is a display
  if(MILD_FOUND_glfw)
    file(REAL_PATH ${MILD_FOUND_glfw} glfw)
    install(FILES ${glfw} DESTINATION mild/data/lib RENAME libglfw.so.3 COMPONENT python_data)
  endif()
  # Licences of what comes along, as Debian has them.
  foreach(library libdnnl2 libgomp1 libinih1 libcjson1 libpng16-16 libsodium23 libprotobuf-c1 ocl-icd-libopencl1 libglfw3)
    install(FILES /usr/share/doc/${library}/copyright DESTINATION mild/data/licences RENAME ${library} COMPONENT python_data OPTIONAL)
  endforeach()
  file(GLOB mujoco_licences ${MUJOCO_ROOT}/../mujoco*.dist-info/licenses/*)
  install(FILES ${mujoco_licences} DESTINATION mild/data/licences/mujoco COMPONENT python_data)
  list(GET daqp 0 daqp)
  install(FILES ${daqp}/../LICENSE DESTINATION mild/data/licences RENAME daqp COMPONENT python_data OPTIONAL)
endif()
