#define CONTACT_MAP 1
#define CONTACT_CASE contact_map_double
#include "contact_case.inc"
