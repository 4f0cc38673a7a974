# The layer float: the ground a second time, in float and with all names behind the prefix float_. No part of libmild.
if(NOT CMAKE_OBJCOPY)
  message(FATAL_ERROR "objcopy not found, of binutils or LLVM: the ground in float needs it; install it, or give -DMILD_APP=OFF")
endif()
add_library(ground_float OBJECT ${ground_sources})
target_include_directories(ground_float PRIVATE $<TARGET_PROPERTY:layer_ground,INTERFACE_INCLUDE_DIRECTORIES>
  $<TARGET_PROPERTY:layer_base,INTERFACE_INCLUDE_DIRECTORIES>)
target_compile_definitions(ground_float PRIVATE MILD_REAL_FLOAT)
# it reads in double what it keeps in float, as env/batch_host.c; after the warnings of mild_options, where clang looks for the last word
add_library(float_reads_double INTERFACE)
target_compile_options(float_reads_double INTERFACE -Wno-float-conversion $<$<C_COMPILER_ID:Clang>:-Wno-implicit-float-conversion>)
target_link_libraries(ground_float PRIVATE mild_options float_reads_double)
set_target_properties(ground_float PROPERTIES POSITION_INDEPENDENT_CODE ON C_VISIBILITY_PRESET hidden)
set(archive ${CMAKE_BINARY_DIR}/generated/libground_float.a)
add_custom_command(OUTPUT ${archive}
  COMMAND ${CMAKE_COMMAND} -DARCHIVE=${archive} -DAR=${CMAKE_AR} -DNM=${CMAKE_NM} -DOBJCOPY=${CMAKE_OBJCOPY} -DPREFIX=float_ -DALL=ON
    -P ${CMAKE_SOURCE_DIR}/cmake/Archive.cmake -- $<TARGET_OBJECTS:ground_float>
  DEPENDS ground_float $<TARGET_OBJECTS:ground_float> ${CMAKE_SOURCE_DIR}/cmake/Archive.cmake COMMAND_EXPAND_LISTS VERBATIM)
add_custom_target(ground_float_archive DEPENDS ${archive})
add_library(ground_float_renamed STATIC IMPORTED GLOBAL)
set_target_properties(ground_float_renamed PROPERTIES IMPORTED_LOCATION ${archive} INTERFACE_LINK_LIBRARIES "layer_base;m")
add_dependencies(ground_float_renamed ground_float_archive)
mild_layer(robot/float layer_robot)
target_link_libraries(layer_float PUBLIC ground_float_renamed)
