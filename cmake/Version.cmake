# Version of the program: the project's (CMakeLists.txt says it, CITATION.cff and CHANGELOG.md repeat it), and the commit it
# was built from when git knows it: 0.2.0+g1234567ab. On a commit with the tag v0.2.0 it is 0.2.0; a tag that says something
# else is an error.
# Included: makes the target `version`, which runs this same file at every build; as a script it writes the header,
# and only when something changed, so that nothing is compiled again without need.
if(NOT CMAKE_SCRIPT_MODE_FILE)
  set(version_header ${CMAKE_BINARY_DIR}/generated/app/version.h)
  add_custom_target(version BYPRODUCTS ${version_header}
    COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DBASE=${PROJECT_VERSION} -DHEADER=${version_header}
            -P ${CMAKE_SOURCE_DIR}/cmake/Version.cmake VERBATIM)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
  string(STRIP "${CMAKE_C_FLAGS} ${CMAKE_C_FLAGS_${build_type}}" build_flags)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/app/build_info.h CONTENT [=[
#define MILD_BUILD_COMPILER "@CMAKE_C_COMPILER_ID@ @CMAKE_C_COMPILER_VERSION@"
#define MILD_BUILD_FLAGS "@build_flags@ -march=@MILD_MARCH@ -ffp-contract=off"
#define MILD_BUILD_TYPE "@CMAKE_BUILD_TYPE@"
]=] @ONLY)
  return()
endif()

set(text ${BASE})
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty=.dirty --abbrev=9 --exclude=*
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(NOT failed AND commit)
  set(text "${BASE}+g${commit}")
  execute_process(COMMAND git -C ${SOURCE} tag --points-at HEAD --list "v[0-9]*"
    OUTPUT_VARIABLE tag OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(tag AND NOT tag STREQUAL "v${BASE}")
    message(FATAL_ERROR "the commit has the tag ${tag}, but CMakeLists.txt says VERSION ${BASE}: change one of the two")
  endif()
  if(tag AND NOT commit MATCHES "dirty$")
    set(text ${BASE})
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#define MILD_VERSION \"${text}\"\n" @ONLY)
