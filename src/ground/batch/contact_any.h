/* contact.inc for the CPU, for robots of any size: contact_NAME_feet, and contact_NAME_points for
 * feet that transmit no moment. Before the inclusion: CONTACT_MAP. */
#include "ground/batch/contact.h"
#include "ground/batch/contact_shapes.h"

#define CONTACT_CURVES LAW_ANY
#define CONTACT_HEAP 1
#define CONTACT_POINTS 0
#define CONTACT(name) contact_##name##_feet
#include "ground/batch/contact.inc"
#undef CONTACT_POINTS
#define CONTACT_POINTS 1
#define CONTACT(name) contact_##name##_points
#include "ground/batch/contact.inc"
#undef CONTACT_POINTS
#undef CONTACT_HEAP
#undef CONTACT_CURVES
