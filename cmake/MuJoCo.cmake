# MuJoCo from -DMUJOCO_ROOT= (a release folder) or from the wheel in the private environment .venv.
set(MUJOCO_ROOT "" CACHE PATH "MuJoCo release folder (include/, lib/); empty: the wheel in .venv")
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
get_filename_component(mujoco_folder ${mujoco_library} DIRECTORY)
add_library(mujoco::mujoco SHARED IMPORTED GLOBAL)
set_target_properties(mujoco::mujoco PROPERTIES IMPORTED_LOCATION ${mujoco_library}
  INTERFACE_INCLUDE_DIRECTORIES ${mujoco_include})
