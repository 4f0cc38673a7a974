#define CONTACT_MAP 1
#define CONTACT_CASE contact_map_double
#define FEET_ROBOT feet_map_double
#define POINTS_ROBOT points_map_double
#include "contact_case.inc"
