/* Version of this program and the machine it runs on, for --version, info and result files. */
#ifndef MILD_BUILD_H
#define MILD_BUILD_H

#include <stddef.h>

const char *build_version(void);  /* "0.1.0+g018ed4f" */
const char *build_compiler(void); /* "GNU 12.2.0" */
const char *build_flags(void);
const char *build_type(void);

/* Processor and core count, e.g. "AMD EPYC 9B45, 2 cores"; returns `text`. */
const char *build_machine(char *text, size_t size);
double build_memory_bytes(void); /* of the machine; 0 when unknown */

#endif
