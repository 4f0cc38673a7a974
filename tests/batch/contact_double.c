#define CONTACT_MAP 0
#define CONTACT_CASE contact_case_double
#define FEET_ROBOT feet_double
#define POINTS_ROBOT points_double
#include "contact_case.inc"
