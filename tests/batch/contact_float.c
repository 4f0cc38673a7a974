#define MILD_REAL_FLOAT
#define CONTACT_CASE contact_case_float
#include "contact_case.inc"
