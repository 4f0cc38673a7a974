# libmild for other programs: a shared and a static library, and their installation. It carries the layers ground and
# batch and, of the layer base, what the public headers and the ground call. It depends on libc and libm only; with
# MILD_CUDA, whose kernels it then carries too, on what the CUDA runtime needs.
# MILD_MARCH decides where the installed library runs: `native` is this machine only, x86-64-v3 any of the last decade.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set_target_properties(layer_base layer_ground layer_batch PROPERTIES C_VISIBILITY_PRESET hidden) # MILD_API_BEGIN makes visible
set(mild_objects $<TARGET_OBJECTS:layer_ground> $<TARGET_OBJECTS:layer_batch>
  $<FILTER:$<TARGET_OBJECTS:layer_base>,INCLUDE,/\(error|field|text\)\\.c\\.o$>)
if(MILD_CUDA)
  list(APPEND mild_objects $<TARGET_OBJECTS:batch_device>)
endif()
add_library(mild_shared SHARED ${mild_objects})
if(NOT MILD_SANITIZE AND NOT MILD_FUZZ) # a call of anything else in base does not link
  target_link_options(mild_shared PRIVATE -Wl,--no-undefined)
endif()

# A static library is an archive of objects, and what they call each other is global in each: one object of all, in which
# hidden symbols become local, exports what the shared library does. Needs GNU's or LLVM's objcopy.
if(CMAKE_OBJCOPY)
  set(mild_object ${CMAKE_BINARY_DIR}/generated/mild.o)
  add_custom_command(OUTPUT ${mild_object}
    COMMAND ${CMAKE_C_COMPILER} -r -nostdlib -o ${mild_object}.all ${mild_objects}
    COMMAND ${CMAKE_OBJCOPY} --localize-hidden ${mild_object}.all ${mild_object}
    DEPENDS layer_base layer_ground layer_batch ${mild_objects} COMMAND_EXPAND_LISTS VERBATIM)
  set_source_files_properties(${mild_object} PROPERTIES EXTERNAL_OBJECT TRUE GENERATED TRUE)
  add_library(mild_static STATIC ${mild_object})
else()
  add_library(mild_static STATIC ${mild_objects})
endif()
# while the version begins with 0, a new minor version may change the interface
set_target_properties(mild_shared PROPERTIES EXPORT_NAME mild VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
foreach(library mild_shared mild_static)
  set_target_properties(${library} PROPERTIES OUTPUT_NAME mild LINKER_LANGUAGE C)
  target_include_directories(${library} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${library} PUBLIC m $<$<BOOL:${MILD_CUDA}>:CUDA::cudart_static> $<$<BOOL:${MILD_CUDA}>:stdc++>)
endforeach()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/mild)
set(package_version ${CMAKE_BINARY_DIR}/generated/mildConfigVersion.cmake)
write_basic_package_version_file(${package_version} COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH prefix_from_pc /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" prefix_from_pc ${prefix_from_pc})
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/mild.pc @ONLY CONTENT [=[
prefix=${pcfiledir}/@prefix_from_pc@
libdir=${prefix}/@CMAKE_INSTALL_LIBDIR@
includedir=${prefix}/@CMAKE_INSTALL_INCLUDEDIR@

Name: mild
Description: Soft ground for legged robots: two-way, per-element contact forces
Version: @PROJECT_VERSION@
Cflags: -I${includedir}
Libs: -L${libdir} -lmild
Libs.private: -lm
]=])

install(TARGETS mild_shared mild_static EXPORT mild COMPONENT library)
install(EXPORT mild FILE mildConfig.cmake NAMESPACE mild:: DESTINATION ${package} COMPONENT library)
install(FILES ${package_version} DESTINATION ${package} COMPONENT library)
install(FILES ${CMAKE_BINARY_DIR}/generated/mild.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT library)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/include/mild DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
