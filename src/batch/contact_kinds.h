/* contact.inc for the shapes that are compiled: groups of lanes, elements of a lane. A batch takes
 * the first that fits. Before the inclusion: CONTACT_MAP, 1 for ground with a map. */
#ifndef MILD_BATCH_CONTACT_KINDS_H
#define MILD_BATCH_CONTACT_KINDS_H

#include "batch/contact.h"

#define CONTACT_KINDS(KIND)                                                                        \
    KIND(1, 1)                                                                                     \
    KIND(1, 3) KIND(1, 8) KIND(2, 1) KIND(2, 5) KIND(2, 8) KIND(4, 1) KIND(4, 4) KIND(4, 8)

#define CONTACT_POINTS 0
#define CONTACT_CURVES LAW_ALL
#define CONTACT_FEET 1
#define CONTACT_PER 1
#define CONTACT(name) contact_##name##_1_1
#include "batch/contact.inc"
#define CONTACT_FEET 1
#define CONTACT_PER 3
#define CONTACT(name) contact_##name##_1_3
#include "batch/contact.inc"
#define CONTACT_FEET 1
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_1_8
#include "batch/contact.inc"
#define CONTACT_FEET 2
#define CONTACT_PER 1
#define CONTACT(name) contact_##name##_2_1
#include "batch/contact.inc"
#define CONTACT_FEET 2
#define CONTACT_PER 5
#define CONTACT(name) contact_##name##_2_5
#include "batch/contact.inc"
#define CONTACT_FEET 2
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_2_8
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 1
#define CONTACT(name) contact_##name##_4_1
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 4
#define CONTACT(name) contact_##name##_4_4
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_4_8
#include "batch/contact.inc"
#undef CONTACT_POINTS

/* For feet that transmit no moment, in the shape that those of quadrupeds have. */
#define CONTACT_POINT_KINDS(KIND) KIND(4, 1)

#define CONTACT_POINTS 1
#define CONTACT_FEET 4
#define CONTACT_PER 1
#define CONTACT(name) contact_##name##_4_1_points
#include "batch/contact.inc"
#undef CONTACT_CURVES

/* On a GPU also for ground that is all cones and lines: half the text, and fewer registers. Of one
 * element a lane only for points; there is little to gain otherwise. */
#ifdef __CUDACC__
#define CONTACT_CONE_KINDS(KIND) KIND(1, 3) KIND(1, 8) KIND(2, 5) KIND(2, 8) KIND(4, 4) KIND(4, 8)

#define CONTACT_CURVES LAW_CONE
#define CONTACT_FEET 4
#define CONTACT_PER 1
#define CONTACT(name) contact_##name##_4_1_points_cone
#include "batch/contact.inc"
#undef CONTACT_POINTS
#define CONTACT_POINTS 0
#define CONTACT_FEET 1
#define CONTACT_PER 3
#define CONTACT(name) contact_##name##_1_3_cone
#include "batch/contact.inc"
#define CONTACT_FEET 1
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_1_8_cone
#include "batch/contact.inc"
#define CONTACT_FEET 2
#define CONTACT_PER 5
#define CONTACT(name) contact_##name##_2_5_cone
#include "batch/contact.inc"
#define CONTACT_FEET 2
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_2_8_cone
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 4
#define CONTACT(name) contact_##name##_4_4_cone
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 8
#define CONTACT(name) contact_##name##_4_8_cone
#include "batch/contact.inc"
#undef CONTACT_CURVES

/* And for resistive force theory alone, on the feet of most robots. */
#define CONTACT_RESIST_KINDS(KIND) KIND(2, 5) KIND(4, 4)

#define CONTACT_CURVES LAW_RESIST
#define CONTACT_FEET 2
#define CONTACT_PER 5
#define CONTACT(name) contact_##name##_2_5_resist
#include "batch/contact.inc"
#define CONTACT_FEET 4
#define CONTACT_PER 4
#define CONTACT(name) contact_##name##_4_4_resist
#include "batch/contact.inc"
#undef CONTACT_CURVES
#endif
#undef CONTACT_POINTS

#endif
