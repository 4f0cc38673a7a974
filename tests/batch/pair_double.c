#define PAIR pair_double
#include "pair.inc"
