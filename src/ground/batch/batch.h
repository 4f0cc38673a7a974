/* Inside of a batch, for the layers that step it together with an engine. */
#ifndef MILD_BATCH_PRIVATE_H
#define MILD_BATCH_PRIVATE_H

#include "ground/terrain/map_view.h"
#include "mild/batch.h"
#include "mild/ground.h"

/* A material as a batch keeps it: the numbers of ContactMaterial, in float whatever Real is. The
 * laws are derived in double. */

#define MATERIAL_LAW_NUMBERS 14

typedef struct {
    float law[MATERIAL_LAW_NUMBERS];                             /* in the order of Law */
    float recovery, mu, k_drift, b_drift, exit_drag, entry_drag; /* as in ContactMaterial */
    float cohesion, shear_length;
    float projects, slip_rate, regain_rate, grip, growth, side;
    int curves;
} MaterialNumbers;

/* [count + 1][soles] of materials [count] under soles of these pitches and widths [soles] [m]
 * (mild_sole_width), in the memory of a device; the last is not a number. Adds the LawCurve bits of
 * all to *curves. NULL when a material is refused by mild_material_check or by the width of a sole,
 * or when out of memory. */
MaterialNumbers *material_table(int device, const double *pitch, const double *width, int soles,
                                const MildMaterial *materials, int count, int *curves,
                                MildError *error);

/* The same for all robots; in float whatever Real is. */
typedef struct {
    int robots;
    int soles;  /* of a robot: feet, then shells */
    int feet;   /* with plane soles */
    int groups; /* of lanes in a warp: feet rounded up to a power of two */
    int per;    /* elements of a lane */
    int stride; /* elements of a foot in memory */
    float dt, tolerance;
    int limit;
    int materials; /* in the table; behind them one that is not a number */
    int map;       /* bool: on BatchArrays.map, not on level ground */
    int points;    /* bool: as MildBatchDef.points */
    int triangle;  /* bool: of each inverse_inertia there is the lower triangle alone, row by row */
    int elements[MILD_BATCH_FEET_MAX]; /* [soles] */
    float z[MILD_BATCH_PLANES_MAX];    /* [feet] [m] of a sole's plane */
    float area[MILD_BATCH_PLANES_MAX]; /* [feet] [m^2] of an element */
} BatchShape;

/* Where a batch keeps what; on its device. */
typedef struct {
    float *elements;            /* [feet][CONTACT_PLACES][stride], see contact.h */
    MaterialNumbers *materials; /* [materials + 1][feet] */
    float *memory;              /* [robots] of contact.h */
    float *worn;                /* [robots][groups][stride] [-] wear, behind `memory`; NULL until
                                   there is a material that wears */
    MapView map;                /* all 0 without a map */
    const uint16_t *skip; /* [robots] not 0: a step leaves it alone; NULL: none. Of the caller */
    int beside; /* bool: the kernel before in the stream steps the robots of `skip` and nothing
                   else, so that a GPU may work on both at once. Of the caller */
} BatchArrays;

struct BodiesSetup; /* of bodies.h */

/* The shells of a batch's robots; on its device. */
typedef struct {
    struct BodiesSetup *setup; /* in float; NULL: there are none */
    float *memory;             /* [robots][numbers] of the shells */
    size_t numbers;            /* of a robot */
    size_t bytes;              /* of the device, without memory */
    /* what the setup points to */
    float *places;
    MaterialNumbers *materials; /* [count + 1][shells] */
    /* of mild_batch_step */
    uint16_t *near; /* [robots] bit s: shell s may touch the ground in this step */
} BatchBodies;

struct MildBatch {
    BatchShape shape;
    BatchArrays arrays;
    BatchBodies bodies;
    int device;
    int curves;                        /* LawCurve bits of all materials */
    double pitch[MILD_BATCH_FEET_MAX]; /* [soles] [m] */
    double width[MILD_BATCH_FEET_MAX]; /* [soles] [m] mild_sole_width */
    /* of mild_batch_change_materials, on the CPU */
    MildMaterial *stands; /* [shape.materials] */
    MildScratch *scratch;
    MildGround *blank; /* of a robot that remembers nothing */
};

/* [numbers] of a robot's memory, without wear. */
size_t batch_memory_numbers(const BatchShape *shape);
/* [numbers] of its wear. */
size_t batch_worn_numbers(const BatchShape *shape);
/* The memory of a ground as that of one robot, [batch_memory_numbers] and, or NULL,
 * [batch_worn_numbers]. */
void batch_memory_of(const BatchShape *shape, const MildGround *ground, float *memory, float *worn);
/* Gives the robots a memory in which nothing is remembered. worn: bool, with their wear. */
MildStatus batch_memory_open(BatchArrays *arrays, const BatchShape *shape, int device, int worn,
                             MildError *error);
/* `count` robots of a batch from `first` on, as a batch that borrows its memory. */
MildBatch batch_slice(const MildBatch *batch, int first, int count);

/* ---- a map: map.c ---- */
/* Makes a view of a map whose arrays are copies in the memory of a device. Fails for a map that a
 * batch does not know yet. error: not NULL. */
MildStatus batch_map_open(MapView *view, const MildMap *map, int device, MildError *error);
/* [-] Upper bound on the gradient of a map; NULL: 0. */
double batch_map_steepest(const MildMap *map);
void batch_map_close(const MapView *view, int device);
/* Gives every element a plane of its own, as on uneven ground: a batch on level ground goes on as
 * one on a map without heights. The robots forget. */
MildStatus batch_lower(MildBatch *batch, MildError *error);
/* Bool: the planes are there for that alone. */
static inline int batch_map_is_lowered(const MapView *view) {
    return view->uneven && !view->height && view->slope.high == 0 && view->slope.low == 0;
}

/* ---- the CPU: host.c ---- */
void host_step(const BatchShape *shape, const BatchArrays *arrays, const MildBatchInput *input,
               const MildBatchOutput *output, int advance);

/* ---- a GPU: kernel.cu and reset.cu, or without_cuda.c ---- */
/* A step in `stream`. */
typedef MildStatus (*BatchStep)(const MildBatch *batch, const MildBatchInput *input,
                                const MildBatchOutput *output, int advance, MildStream stream,
                                MildError *error);
/* The step compiled for one size of a batch. */
typedef struct {
    int groups; /* as in BatchShape */
    int per;
    int points; /* bool: only for such a batch */
    int curves; /* LawCurve and LawMotion bits that the materials may have */
    BatchStep step;
} BatchKernel;
/* Those of this build, NULL behind them. A batch takes the first that fits (cmake/Batch.cmake). */
extern const BatchKernel *const batch_kernels[];
MildStatus batch_gpu_reset(const MildBatch *batch, const uint8_t *which, MildStream stream,
                           MildError *error);

#endif
