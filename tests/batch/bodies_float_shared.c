#define MILD_REAL_FLOAT
#define BODIES_RUN bodies_float_shared
#define BODIES_REGISTER_ROWS 0
#include "bodies_case.inc"
