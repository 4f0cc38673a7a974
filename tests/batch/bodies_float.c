#define MILD_REAL_FLOAT
#define BODIES_RUN bodies_float
#include "bodies_case.inc"
