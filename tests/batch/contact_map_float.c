#define MILD_REAL_FLOAT
#define CONTACT_MAP 1
#define CONTACT_CASE contact_map_float
#define FEET_ROBOT host_feet_map
#define POINTS_ROBOT host_points_map
#include "contact_case.inc"
