#define BODIES_RUN bodies_double
#include "bodies_case.inc"
