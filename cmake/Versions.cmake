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
