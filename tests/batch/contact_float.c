#define MILD_REAL_FLOAT
#define CONTACT_MAP 0
#define CONTACT_CASE contact_case_float
#include "contact_case.inc"
