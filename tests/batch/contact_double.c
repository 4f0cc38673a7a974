#define CONTACT_MAP 0
#define CONTACT_CASE contact_case_double
#include "contact_case.inc"
