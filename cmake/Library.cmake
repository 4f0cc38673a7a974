# libmild and libmild_batch for other programs: each a shared and a static library, with pkg-config and a CMake target.
#
# libmild is the ground for a simulator on the CPU: the layer ground and, of the layer base, what the public headers and the
# ground call. It depends on libc and libm only. libmild_batch is mild/batch.h, the layers batch and device. It links libmild
# and, with MILD_CUDA, what the CUDA runtime needs.
# MILD_MARCH decides where an installed library runs: `native` is this machine only, x86-64-v3 any of the last decade.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set_target_properties(layer_base layer_device layer_law layer_terrain layer_sole layer_step layer_models layer_batch PROPERTIES
  C_VISIBILITY_PRESET hidden) # MILD_API_BEGIN makes visible
set(mild_objects $<FILTER:$<TARGET_OBJECTS:layer_base>,INCLUDE,/\(error|field|text\)\\.c\\.o$>)
foreach(wing ${ground_wings})
  list(APPEND mild_objects $<TARGET_OBJECTS:layer_${wing}>)
endforeach()
set(mild_batch_objects $<TARGET_OBJECTS:layer_batch> $<TARGET_OBJECTS:layer_device>)
if(MILD_CUDA)
  list(APPEND mild_batch_objects $<TARGET_OBJECTS:batch_device> $<TARGET_OBJECTS:device_gpu>)
endif()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/mild)
file(RELATIVE_PATH prefix_from_pc /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" prefix_from_pc ${prefix_from_pc})

# An archive whose members see each other, for a static link takes the members that it calls, but hide what is not of the
# interface: its symbols get the prefix NAME_inside_. Needs GNU's or LLVM's objcopy.
function(mild_archive name output objects)
  if(NOT CMAKE_OBJCOPY)
    add_library(${name} STATIC ${objects})
    return()
  endif()
  set(archive ${CMAKE_BINARY_DIR}/generated/lib${output}.a)
  add_custom_command(OUTPUT ${archive}
    COMMAND ${CMAKE_COMMAND} -DARCHIVE=${archive} -DAR=${CMAKE_AR} -DNM=${CMAKE_NM} -DOBJCOPY=${CMAKE_OBJCOPY} -DPREFIX=${output}_inside_
      -P ${CMAKE_SOURCE_DIR}/cmake/Archive.cmake -- ${objects}
    DEPENDS ${ARGN} ${objects} ${CMAKE_SOURCE_DIR}/cmake/Archive.cmake COMMAND_EXPAND_LISTS VERBATIM)
  # CMake makes an archive only of what it compiles: of an empty unit, in whose place this one is put
  set(unit ${CMAKE_BINARY_DIR}/generated/lib${output}.c)
  file(CONFIGURE OUTPUT ${unit} CONTENT "typedef int mild_archive;\n")
  set_source_files_properties(${unit} PROPERTIES OBJECT_DEPENDS ${archive})
  add_library(${name} STATIC ${unit})
  add_custom_command(TARGET ${name} POST_BUILD COMMAND ${CMAKE_COMMAND} -E copy ${archive} $<TARGET_FILE:${name}>)
endfunction()

# Of the addresses in tables, to which the loader adds the library's own, a bit each: 7 kB. Loaders do so since glibc 2.36.
include(CheckCSourceCompiles)
set(CMAKE_REQUIRED_LINK_OPTIONS -Wl,-z,pack-relative-relocs)
check_c_source_compiles("#include <features.h>
#if !__GLIBC_PREREQ(2, 36)
#error
#endif
int main(void) { return 0; }" mild_packs_addresses)
unset(CMAKE_REQUIRED_LINK_OPTIONS)

# mild_library(NAME DESCRIPTION OBJECTS REQUIRES LAYERS...): the targets NAME_shared and NAME_static.
function(mild_library name description objects requires)
  add_library(${name}_shared SHARED ${objects})
  if(NOT MILD_SANITIZE AND NOT MILD_FUZZ) # a call of anything else does not link
    target_link_options(${name}_shared PRIVATE -Wl,--no-undefined)
  endif()
  target_link_options(${name}_shared PRIVATE -Wl,-z,noseparate-code) # no pages of padding: 4 kB
  target_link_options(${name}_shared PRIVATE -Wl,-Bsymbolic-functions) # calls inside need no table of addresses: 2 kB
  target_link_options(${name}_shared PRIVATE -Wl,--gc-sections) # what no function of the interface calls: 1 kB
  target_link_options(${name}_shared PRIVATE -Wl,-z,now) # with -fno-plt: no table of jumps to libc: 1 kB
  if(mild_packs_addresses)
    target_link_options(${name}_shared PRIVATE -Wl,-z,pack-relative-relocs)
  endif()
  mild_archive(${name}_static ${name} "${objects}" ${ARGN})
  # while the version begins with 0, a new minor version may change the interface
  set_target_properties(${name}_shared PROPERTIES VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  foreach(library ${name}_shared ${name}_static)
    set_target_properties(${library} PROPERTIES OUTPUT_NAME ${name} LINKER_LANGUAGE C)
    target_include_directories(${library} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_link_libraries(${library} PUBLIC m)
  endforeach()
  install(TARGETS ${name}_shared ${name}_static EXPORT mild COMPONENT library)

  string(REPLACE _ - pc ${name})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/${pc}.pc @ONLY CONTENT [=[
prefix=${pcfiledir}/@prefix_from_pc@
libdir=${prefix}/@CMAKE_INSTALL_LIBDIR@
includedir=${prefix}/@CMAKE_INSTALL_INCLUDEDIR@

Name: @pc@
Description: @description@
Version: @PROJECT_VERSION@
Requires: @requires@
Cflags: -I${includedir}
Libs: -L${libdir} -l@name@
Libs.private: -lm
]=])
  install(FILES ${CMAKE_BINARY_DIR}/generated/${pc}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT library)
endfunction()

mild_library(mild "Soft ground for legged robots: two-way, per-element contact forces" "${mild_objects}" ""
  layer_base layer_law layer_terrain layer_sole layer_step layer_models)
mild_library(mild_batch "Soft ground under many robots at once, on a CPU or a GPU" "${mild_batch_objects}"
  "mild = ${PROJECT_VERSION}" layer_batch layer_device)
set_target_properties(mild_shared PROPERTIES EXPORT_NAME mild)
set_target_properties(mild_batch_shared PROPERTIES EXPORT_NAME batch INSTALL_RPATH "$ORIGIN")
set_target_properties(mild_batch_static PROPERTIES EXPORT_NAME batch_static)
target_link_libraries(mild_batch_shared PUBLIC mild_shared)
target_link_libraries(mild_batch_static PUBLIC mild_static)
if(MILD_CUDA)
  target_link_libraries(mild_batch_shared PUBLIC CUDA::cudart_static stdc++)
  target_link_libraries(mild_batch_static PUBLIC CUDA::cudart_static stdc++)
endif()

set(package_version ${CMAKE_BINARY_DIR}/generated/mildConfigVersion.cmake)
write_basic_package_version_file(${package_version} COMPATIBILITY SameMinorVersion)
install(EXPORT mild FILE mildConfig.cmake NAMESPACE mild:: DESTINATION ${package} COMPONENT library)
install(FILES ${package_version} DESTINATION ${package} COMPONENT library)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/include/mild DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
