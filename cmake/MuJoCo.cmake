# MuJoCo from -DMUJOCO_ROOT= (a release folder, or the package `mujoco` of a Python environment) or from the wheel in the private environment .venv.
set(MUJOCO_ROOT "" CACHE PATH "MuJoCo release folder (include/, lib/), or Python package; empty: the wheel in .venv")
if(MUJOCO_ROOT)
  file(GLOB mujoco_library ${MUJOCO_ROOT}/lib/libmujoco.so.* ${MUJOCO_ROOT}/lib/libmujoco.so
    ${MUJOCO_ROOT}/libmujoco.so.*)
  set(mujoco_include ${MUJOCO_ROOT}/include)
else()
  file(GLOB mujoco_library ${CMAKE_SOURCE_DIR}/.venv/lib/python3*/site-packages/mujoco/libmujoco.so.*)
  file(GLOB mujoco_include ${CMAKE_SOURCE_DIR}/.venv/lib/python3*/site-packages/mujoco/include)
endif()
if(NOT mujoco_library)
  message(FATAL_ERROR "MuJoCo not found: run `make setup` (installs the wheel into .venv) or pass -DMUJOCO_ROOT=FOLDER")
endif()
list(GET mujoco_library 0 mujoco_library)
file(REAL_PATH ${mujoco_library} mujoco_file)
if(mujoco_file MATCHES "\\.so\\.([0-3]\\.[0-9.]+)$")
  if(MILD_APP) # src/robot/engine.c hands it a log handler
    message(FATAL_ERROR "MuJoCo ${CMAKE_MATCH_1} (${mujoco_file}): the program needs 4.0 or newer; libmild alone needs none (-DMILD_APP=OFF)")
  elseif(CMAKE_MATCH_1 VERSION_LESS 3.3.7)
    message(FATAL_ERROR "MuJoCo ${CMAKE_MATCH_1} (${mujoco_file}): the plugin needs 3.3.7 or newer")
  endif()
endif()
get_filename_component(mujoco_folder ${mujoco_library} DIRECTORY)
add_library(mujoco::mujoco SHARED IMPORTED GLOBAL)
set_target_properties(mujoco::mujoco PROPERTIES IMPORTED_LOCATION ${mujoco_library}
  INTERFACE_INCLUDE_DIRECTORIES ${mujoco_include})

# What the layers link: the library, or in a wheel the headers alone (cmake/Wheel.cmake).
if(SKBUILD)
  set(mild_mujoco mujoco_headers)
else()
  set(mild_mujoco mujoco::mujoco)
endif()
