/* The state block of a ground: what every foot's elements remember, and the imprints behind it.
 *
 *     MildGround | memory of foot 0 | memory of foot 1 | imprints
 *
 * The block has no pointers, so a copy of its bytes is a copy of the ground. */
#ifndef MILD_GROUND_STATE_H
#define MILD_GROUND_STATE_H

#include "ground/imprint.h"
#include "mild/ground.h"

#define VECTOR_LANES 8 /* arrays over elements are padded to the widest vector */

struct MildGround {
    int32_t feet;                    /* 1 .. MILD_FEET_MAX */
    int32_t elements[MILD_FEET_MAX]; /* of each foot */
    int32_t padded[MILD_FEET_MAX];   /* elements rounded up to whole vectors */
    int32_t touched[MILD_FEET_MAX];  /* elements that remember something */
    int32_t uneven[MILD_FEET_MAX];   /* bool: the planes below are those of the step before */
    int32_t tiles;                   /* of imprints; 0: the ground forgets at lift-off */
    uint32_t imprint_time;           /* counts the steps that could change an imprint */
    double imprint_cell;             /* [m] edge of a cell */
    int32_t reserved[10];            /* to 128 bytes, so that the arrays behind are aligned */
};

/* What an element stands on: index of a material, or first | second << 8 | share << 16 of two that
 * blend (share 255: all of the second). Negative: it carries nothing. */
#define MATERIAL_NONE (-1) /* and nothing is known of the step before */
#define MATERIAL_FREE (-2) /* but it was near the ground in the step before */

/* Memory of one foot: arrays [padded] inside the state block. ElementMemory in element.h says what
 * the first nine mean. */
typedef struct {
    double *depth_max;      /* [m] */
    double *middle;         /* [m] */
    double *front_speed;    /* [m/s] */
    double *drift;          /* [m] */
    double *pending_x;      /* [m] */
    double *pending_y;      /* [m] */
    double *held_x;         /* [N] */
    double *held_y;         /* [N] */
    double *held_stiffness; /* [N/m] */
    double *plane; /* [m] uneven ground: u = plane + slope . (x, y) - z in the step before, world */
    double *slope_x;   /* [-] */
    double *slope_y;   /* [-] */
    int32_t *material; /* the material it touched down on, coded as above */
} Memory;

/* Callers of a const ground only read through it. */
Memory ground_memory(const MildGround *ground, int foot);
/* The element forgets everything; its material becomes `material`. */
void memory_forget(const Memory *memory, int e, int32_t material);
/* The imprints, read as ground_memory is. */
Imprints ground_imprints(const MildGround *ground);
/* Elements of a sole, rounded up to whole vectors. */
int sole_padded(const MildSole *sole);

#endif
