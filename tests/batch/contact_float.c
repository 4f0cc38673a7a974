#define MILD_REAL_FLOAT
#define CONTACT_MAP 0
#define CONTACT_CASE contact_case_float
#define FEET_ROBOT host_feet
#define POINTS_ROBOT host_points
#include "contact_case.inc"
