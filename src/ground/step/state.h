/* The state block of a ground: what every foot's elements remember, and the imprints behind it.
 *
 *     MildGround | memory of foot 0 | memory of foot 1 | imprints
 *
 * The block has no pointers, so a copy of its bytes is a copy of the ground. */
#ifndef MILD_GROUND_STATE_H
#define MILD_GROUND_STATE_H

#include "ground/terrain/imprint.h"
#include "mild/ground.h"

#define VECTOR_LANES 8 /* arrays over elements are padded to the widest vector */

struct MildGround {
    int32_t feet;                    /* 1 .. MILD_FEET_MAX */
    int32_t elements[MILD_FEET_MAX]; /* number for each foot */
    int32_t padded[MILD_FEET_MAX];   /* elements rounded up to whole vectors */
    int32_t touched[MILD_FEET_MAX];  /* number of elements that remember something */
    int32_t uneven[MILD_FEET_MAX];   /* bool: Memory.plane and slopes are those of the last step; or
                                        GROUND_LOWERED */
    int32_t tiles;                   /* of imprints; 0: the ground forgets at lift-off */
    uint32_t imprint_time;           /* counts the steps that could change an imprint */
    double imprint_cell;             /* [m] edge of a cell */
    int32_t shells;                  /* bit f: foot f is a shell */
    int32_t reserved[9];             /* pads to 320 bytes, so that the arrays behind are aligned */
};

/* MildGround.uneven of a foot under which the surface may lie lower than the terrain, as the planes
 * say (change.c). Its steps are those of uneven ground until it has come out. */
#define GROUND_LOWERED 2

/* What an element stands on: the index of a material, or first | second << 8 | share << 16 for a
 * mixture of two (share 255: all of the second). Negative: the element carries no load. */
#define MATERIAL_NONE (-1)   /* no load, and nothing is remembered of the last step */
#define MATERIAL_FREE (-2)   /* no load, but it was near the ground in the last step */
#define MATERIAL_BURIED (-3) /* of a shell: faced up near the ground, and found no way out since */

/* Added to the material of a slot: its law has been scaled to nothing, and the element remembers
 * MATERIAL_FREE (slots_imprints). */
#define SLOT_BARRED (1 << 24)

/* Memory of one foot: arrays [padded] inside the state block. The first nine are explained at
 * ElementMemory in element.h. */
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
    double *worn;           /* [-] Share.worn, share.h */
    double *plane;      /* [m] uneven ground: the last step had u = plane + slope . (x, y) - z */
    double *slope_x;    /* [-] gradient of that plane, world axes */
    double *slope_y;    /* [-] */
    double *area_share; /* [-] of a shell (else NULL): the slot's at touchdown; 0 without load */
    int32_t *material;  /* the material it touched down on, encoded as above */
} Memory;

/* The memory of a foot. Callers with a const ground must only read through it. */
Memory ground_memory(const MildGround *ground, int foot);
/* The header of a ground that remembers nothing. */
MildGround ground_layout(const MildSole *const *soles, int feet, int tiles);
/* Bool: the block, which may hold any bytes, is the memory of a ground with the header `layout`. It
 * must be as large as such a ground. Everything that a step follows is then within bounds. */
int ground_is_valid(const MildGround *ground, const MildGround *layout);
/* Clears the memory of an element, but for its plane and area share, and sets its material. */
void memory_forget(const Memory *memory, int e, int32_t material);
/* The imprints, under the same condition as ground_memory. */
Imprints ground_imprints(const MildGround *ground);
/* Elements of a sole, rounded up to whole vectors. */
int sole_padded(const MildSole *sole);

#endif
