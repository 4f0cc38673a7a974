# The layer batch, with its steps on a GPU when MILD_CUDA is on.

# Kernels of a robot's contact step, one unit each: groups of lanes, at least as many as feet; elements of a lane; feet,
# `flat` for any or `points` for those that transmit no moment; curves of the ground, `all` or the only ones, which is less
# text and fewer registers, or `heap` for cones that merge or wear, `any` for all of these; robots of a multiprocessor. A
# batch takes the first that fits; materials that create energy (passive = false) have `all` or `any`. The rows `flat all` are the sizes that a batch can have, smallest first. On the CPU the same sizes are numbers of one step.
#
# Of one element a lane only points have kernels for cones: there is little to gain otherwise. Resistive force theory has
# those for the feet of most robots.
set(batch_kernels
  "4 1 points cone   16"
  "4 1 points all    12"
  "1 3 flat   cone   12"
  "1 8 flat   cone   12"
  "2 5 flat   cone   16"
  "2 8 flat   cone   12"
  "4 4 flat   cone   12"
  "4 8 flat   cone   12"
  "2 5 flat   resist 8"
  "4 4 flat   resist 8"
  "1 1 flat   all    8"
  "1 3 flat   all    8"
  "1 8 flat   all    8"
  "2 1 flat   all    8"
  "2 5 flat   all    8"
  "2 8 flat   all    8"
  "4 1 flat   all    8"
  "4 4 flat   all    8"
  "4 8 flat   all    8"
  "2 5 flat   heap   16"
  "1 1 flat   any    8"
  "1 3 flat   any    8"
  "1 8 flat   any    8"
  "2 1 flat   any    8"
  "2 5 flat   any    8"
  "2 8 flat   any    8"
  "4 1 flat   any    8"
  "4 4 flat   any    8"
  "4 8 flat   any    8")
set(generated ${CMAKE_BINARY_DIR}/generated/batch)
# mild_unit(UNIT INCLUDED NAME=VALUE...): writes a unit of INCLUDED with these macros.
function(mild_unit unit included)
  list(TRANSFORM ARGN REPLACE "(.*)=(.*)" "#define \\1 \\2")
  list(JOIN ARGN "\n" macros)
  file(CONFIGURE OUTPUT ${unit} CONTENT "@macros@\n#include \"@included@\"\n" @ONLY)
endfunction()
mild_layer(ground/batch layer_ground layer_device)
# lanes in loops, as in cmake/Env.cmake: nothing gains from -O3 but the time to compile, and with sanitizers nothing from -O1
set_source_files_properties(ground/batch/host.c PROPERTIES COMPILE_OPTIONS "$<IF:${mild_sanitized},-O0,-O2>")
# The step of one robot on the CPU, a unit for each version of contact.inc, since they take long to compile.
set(host_units "")
foreach(version "feet 0 0" "feet_map 1 0" "points 0 1" "points_map 1 1")
  separate_arguments(version UNIX_COMMAND ${version})
  list(POP_FRONT version name map points)
  list(APPEND host_units ${generated}/host_${name}.c)
  mild_unit(${generated}/host_${name}.c ground/batch/host.inc
    MILD_REAL_FLOAT=1 HOST_ROBOT=host_${name} CONTACT_MAP=${map} CONTACT_POINTS=${points})
endforeach()
target_sources(layer_batch PRIVATE ${host_units})
set_source_files_properties(${host_units} PROPERTIES COMPILE_OPTIONS "$<${mild_sanitized}:-O0>")
target_include_directories(layer_batch PUBLIC ${generated})

# contact_shapes.h: lists of the sizes. The CPU has one step for all of them (host.inc)
set(contact_per_max 1)
set(contact_flat "")
set(contact_points "")
set(units "")
set(kernel_names "")
set(kernel_list "")
foreach(row ${batch_kernels})
  separate_arguments(row UNIX_COMMAND ${row})
  list(GET row 0 groups)
  list(GET row 1 per)
  list(GET row 2 feet)
  list(GET row 3 curves)
  list(GET row 4 robots)
  set(points 0)
  set(name ${groups}_${per})
  if(feet STREQUAL "points")
    set(points 1)
    string(APPEND name _points)
  endif()
  if(curves STREQUAL "all")
    string(APPEND contact_${feet} " KIND(${groups}, ${per})")
    if(per GREATER contact_per_max)
      set(contact_per_max ${per})
    endif()
  else()
    string(APPEND name _${curves})
  endif()
  set(unit ${generated}/contact_${name}.cu)
  string(TOUPPER "LAW_${curves}" curves)
  if(curves STREQUAL "LAW_HEAP")
    set(curves "(LAW_CONE | LAW_HEAP)")
  endif()
  file(CONFIGURE OUTPUT ${unit} CONTENT [=[
#define KERNEL contact_@name@
#define KERNEL_GROUPS @groups@
#define KERNEL_PER @per@
#define KERNEL_POINTS @points@
#define KERNEL_CURVES @curves@
#define KERNEL_ROBOTS @robots@
#include "ground/batch/kernel.cu"
]=] @ONLY)
  list(APPEND units ${unit})
  string(APPEND kernel_names "extern const BatchKernel contact_${name};\n")
  string(APPEND kernel_list " &contact_${name},")
endforeach()
file(CONFIGURE OUTPUT ${generated}/ground/batch/contact_shapes.h @ONLY CONTENT [=[
/* Groups of lanes and elements of a lane that a batch can have. */
#define CONTACT_KINDS(KIND)@contact_flat@
#define CONTACT_POINT_KINDS(KIND)@contact_points@
#define CONTACT_PER_MAX @contact_per_max@ /* elements of a lane */
]=])
if(MILD_CUDA)
  add_library(batch_device STATIC ${units} ${CMAKE_SOURCE_DIR}/src/ground/batch/reset.cu
    ${CMAKE_SOURCE_DIR}/src/ground/batch/bodies.cu)
  target_include_directories(batch_device PRIVATE ${CMAKE_BINARY_DIR}/layers/batch ${generated})
  target_link_libraries(batch_device PRIVATE layer_ground layer_device)
  # quotients and roots within two units in the last place, and no denormal numbers
  target_compile_options(batch_device PRIVATE -ftz=true -prec-div=false -prec-sqrt=false)
  set_target_properties(batch_device PROPERTIES CUDA_STANDARD 17 POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(layer_batch PUBLIC batch_device CUDA::cudart_static stdc++)
  file(CONFIGURE OUTPUT ${generated}/kernels.c @ONLY CONTENT [=[
#include "ground/batch/batch.h"

@kernel_names@
const BatchKernel *const batch_kernels[] = {@kernel_list@ NULL};
]=])
  target_sources(layer_batch PRIVATE ${generated}/kernels.c)
endif()
