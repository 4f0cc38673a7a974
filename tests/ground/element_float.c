#define MILD_REAL_FLOAT
#define ELEMENT_STEP element_step_float
#include "element_step.inc"
