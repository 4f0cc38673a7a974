# The ground that a simulator links, in five wings: the law of an element, the terrain, the soles, the step that joins them, and the
# models, whose rows fill the table of law/models.h. `layer_ground` is all of them.
mild_layer(ground/law layer_base)
mild_layer(ground/terrain layer_base)
mild_layer(ground/sole layer_law)
mild_layer(ground/step layer_terrain layer_sole)
mild_layer(ground/models layer_step)
target_link_libraries(layer_step INTERFACE $<LINK_ONLY:layer_models>) # the table's rows
set(ground_wings law terrain sole step models)
add_library(layer_ground INTERFACE)
set(ground_sources)
foreach(wing ${ground_wings})
  target_link_libraries(layer_ground INTERFACE layer_${wing})
  get_target_property(sources layer_${wing} SOURCES)
  list(APPEND ground_sources ${sources})
endforeach()
# Slots lie in blocks of a vector (step/slots.h): of eight lanes where gcc takes vectors of 512 bits.
if(CMAKE_C_COMPILER_ID STREQUAL GNU)
  separate_arguments(flags NATIVE_COMMAND "${CMAKE_C_FLAGS}")
  execute_process(COMMAND ${CMAKE_C_COMPILER} -march=${MILD_MARCH} ${flags} -Q --help=target OUTPUT_VARIABLE said ERROR_QUIET)
  if(said MATCHES "-mprefer-vector-width=[ \t]+(none|512)")
    target_compile_definitions(mild_options INTERFACE MILD_WIDEST_VECTORS)
  endif()
endif()
# Small, because every simulator loads it: -O2 for the loops that take most of a step, -Os for the rest.
# No exception passes through C, so no tables to unwind it by. A section for each function and table: a program that links the
# archive with -Wl,--gc-sections takes only what it calls.
set(loops "derivative|locate|newton|newton_step|pass|solve|sweep")
set(ground_base_sources) # what libmild has of the layer base (cmake/Library.cmake)
foreach(name error field text)
  list(APPEND ground_base_sources ${CMAKE_CURRENT_SOURCE_DIR}/base/${name}.c)
endforeach()
foreach(source ${ground_sources} ${ground_base_sources})
  get_filename_component(name ${source} NAME_WE)
  if(name MATCHES "^(${loops})$")
    set(level -O2)
  else()
    set(level -Os)
  endif()
  set_property(SOURCE ${source} APPEND PROPERTY COMPILE_OPTIONS
    "$<$<CONFIG:Release>:-fno-asynchronous-unwind-tables;-ffunction-sections;-fdata-sections;-fno-plt>"
    "$<$<AND:$<CONFIG:Release>,$<NOT:${mild_sanitized}>>:${level}>")
endforeach()
# The element's law uses fused multiply-add, and one instruction for each maximum. NaN is therefore detected elsewhere: in
# solve.c, and for materials in mixture.c.
set_property(SOURCE ${CMAKE_CURRENT_SOURCE_DIR}/ground/step/pass.c ${CMAKE_CURRENT_SOURCE_DIR}/ground/step/derivative_free.c
  APPEND PROPERTY COMPILE_OPTIONS -ffp-contract=fast -ffinite-math-only -fno-signed-zeros)
set_property(SOURCE ${CMAKE_CURRENT_SOURCE_DIR}/ground/step/derivative.c APPEND PROPERTY COMPILE_OPTIONS -ffp-contract=fast)
