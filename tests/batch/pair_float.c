#define MILD_REAL_FLOAT
#define PAIR pair_float
#include "pair.inc"
