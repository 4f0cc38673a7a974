#define BODIES_RUN bodies_double
#define BODIES_REGISTER_ROWS 18 /* of thirty: both solutions of the equations */
#include "bodies_case.inc"
