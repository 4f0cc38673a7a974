#define MILD_REAL_FLOAT
#define CONTACT_MAP 1
#define CONTACT_CASE contact_map_float
#include "contact_case.inc"
