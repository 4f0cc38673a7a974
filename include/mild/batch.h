/* Soft ground under many robots at once: the contact step of mild/ground.h, in float, on a GPU or
 * on the CPU, from one text.
 *
 * Arrays of all robots lie behind each other, in the memory of the batch's device: a simulator on
 * the GPU hands over its own. A step is
 *
 *     A, V_free                    of all robots, by the engine (mild/ground.h)
 *     mild_batch_step(...)         wrenches on the feet and twists after the step
 *     tau += J^T wrench            then integrate
 *
 * A foot is any body with a sole, as in mild/ground.h: shins, thighs, the base and wheels too, by
 * mild_sole_surface. Plane soles come first in all arrays. Where a robot has shells, feet and the
 * shells near the ground are solved at once, by a slower method on a GPU (four warps a robot in
 * the place of one). A robot whose shells are all away from the ground in a step takes the fast
 * method for its feet.
 *
 * Values are those of mild_ground_solve and mild_ground_advance within the rounding of float. Along
 * a walk, forces differ by less than 1e-4 of their size in 99 of 100 steps. A step that plain
 * Newton steps do not solve keeps the best point seen, with its residual, and one in which friction
 * would create energy is not solved again; mild_ground_solve does more in both cases.
 *
 * The ground is level, or has the heights and the labels of one map (mild_batch_set_map), in which
 * each robot has a place, a height and materials of its own. There are no patches, blended borders
 * or imprints yet, and no results for the elements of robots with shells. Blended borders are
 * refused by name. Materials may be of any model but rigid, which has none; materials of several
 * models may be in one table, if the soles are those of each (mild_sole_concentric).
 *
 * World coordinates are floats: 50 m from the origin they are in steps of 4e-6 m. The place on the
 * map follows from them without further loss, so that a depth is wrong by what the foot's own
 * coordinates are, times the slope.
 *
 * Thread safety: a batch belongs to one thread at a time, and on a GPU to one stream. SI units. */
#ifndef MILD_BATCH_H
#define MILD_BATCH_H

#include <stddef.h>
#include <stdint.h>

#include "mild/ground.h"

MILD_API_BEGIN

#define MILD_BATCH_HOST (-1)    /* the CPU in the place of a device */
#define MILD_BATCH_FEET_MAX 9   /* feet of a robot */
#define MILD_BATCH_PLANES_MAX 4 /* of them with plane soles */

/* Ground under `robots` robots; see mild_batch_create. */
typedef struct MildBatch MildBatch;

/* What a batch is made from. */
typedef struct {
    int robots;                   /* at least 1 */
    int feet;                     /* of each, 1 .. MILD_BATCH_FEET_MAX */
    const MildSole *const *soles; /* [feet] plane soles, then shells; not kept */
    double dt;                    /* [s] 1e-6 .. 0.1 */
    double tolerance;             /* [-] of the residual, below 1; 0: 1e-4 */
    int max_iterations;           /* bound of Newton steps; 0: 20 */
    int device;                   /* a CUDA device, from 0, or MILD_BATCH_HOST */
    /* bool: no plane sole transmits a moment, as a ball does: its rows and columns of moments in
     * every inverse_inertia are 0. On three or four plane soles of up to eight elements a step is
     * then faster, and without shells they are not read; otherwise the flag changes nothing. */
    int points;
} MildBatchDef;

/* What the engine knows before the step. Arrays in the memory of the device. */
typedef struct {
    const float *position;        /* [robots][feet][3] [m] reference point, world */
    const float *rotation;        /* [robots][feet][9] [-] foot to world, row major */
    const float *velocity;        /* [robots][feet][6] [m/s, rad/s] twist: linear, angular */
    const float *inverse_inertia; /* [robots][6 feet][6 feet] A; see MildContactInput */
    const float *free_velocity;   /* [robots][6 feet] [m/s, rad/s] V_free */
    /* [robots], with a map [robots][labels]: index of mild_batch_set_materials; NULL: 0. A robot
     * with an index that is none gets results that are not numbers where it touches such ground. */
    const int32_t *material;
    const float *height;     /* [robots] [m] of the surface, added to the map's; NULL: 0 */
    const float *map_origin; /* [robots][2] [m] world position of the map's origin; NULL: 0 */
} MildBatchInput;

/* Sums over the loaded elements of a foot, as in MildFootResult. */
typedef struct {
    float pressure_center[3]; /* [m] world; 0 without load */
    float depth_max;          /* [m] */
    float depth_mean;         /* [m] */
    float area;               /* [m^2] */
} MildBatchFoot;

/* Where the results go. Arrays in the memory of the device; those from `foot` on may be NULL.
 * wrench may be the input's velocity, and velocity its free_velocity; nothing else may overlap. */
typedef struct {
    float *wrench;       /* [robots][feet][6] [N, N m] force, torque at the reference point */
    float *velocity;     /* [robots][feet][6] [m/s, rad/s] twists after the step */
    MildBatchFoot *foot; /* [robots][feet] */
    float *elements;     /* [robots][4][feet][stride] depth [m], normal, tangent_x, tangent_y [N] of
                            the elements, in their order; behind a sole's elements, up to
                            mild_batch_stride, a depth of -1000 and no force. On uneven ground
                            the depth that the law takes (docs/model.md section 6). NULL where a
                            sole is a shell */
    /* [robots] [-] relative, in the metric of kinetic energy; 0 in the air; NaN where a number of
     * the problem or of the results is none, or a rotation turns nothing: the ground then remembers
     * what it did before. */
    float *residual;
    int32_t *iterations; /* [robots] Newton steps; 0 in the air */
} MildBatchOutput;

/* Makes a batch on which nothing has stepped yet, with the material sand_loose. NULL, with the
 * field's name and the remedy in *error, when a number is out of range, when a plane sole is behind
 * a shell or has more elements than a warp takes (256, 128 or 64 with one, two or more plane
 * soles), when a robot with shells has more than 1536 elements, without the device or memory.
 * This build may be without CUDA: then only MILD_BATCH_HOST is there. */
MildBatch *mild_batch_create(const MildBatchDef *def, MildError *error);
/* Frees a batch; NULL is allowed. Waits for the device. */
void mild_batch_destroy(MildBatch *batch);
/* [B] Memory of one robot on the device. */
size_t mild_batch_robot_bytes(const MildBatch *batch);
/* Room for the elements of a foot, at least those of the largest plane sole: distance of feet in
 * MildBatchOutput.elements. */
int mild_batch_stride(const MildBatch *batch);

/* Replaces the table of materials that MildBatchInput.material points into. materials: [count], of
 * any model, checked by mild_material_check and, of bekker, by the width of every sole. The first
 * material of mild_merged, or with a slip_length, gives the elements of all plane soles a wear to
 * remember, 4 B each; those of shells have it. Waits for the device. A graph captured before
 * holds the old table: capture it again. Fails with the table unchanged. */
MildStatus mild_batch_set_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                    MildError *error);
/* The same under robots that stand, which a material that stiffens would throw: re-expresses what
 * their ground remembers, as mild_ground_change does. material: as in MildBatchInput, of the last
 * step, but on the CPU. What the robots remember goes to the CPU and back, 9 kB for a foot of 77
 * elements. Where the new ground must lie lower under a robot, a batch on level ground goes on as
 * one on a map, whose steps take longer, until mild_batch_set_map. Fails as
 * mild_batch_set_materials does, and on a map of more than MILD_MATERIALS_MAX labels; without
 * memory for these planes with the new materials, and what the robots remember as it was. */
MildStatus mild_batch_change_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                       const int32_t *material, MildError *error);

/* Puts the robots on a map, which is copied to the device; NULL, or a map without heights and
 * labels: on level ground. Each robot forgets what its ground remembers. With labels,
 * MildBatchInput.material has mild_map_label_count numbers for a robot. Waits for the device; a
 * graph captured before must be captured again. Fails, with everything unchanged, for a map whose
 * borders are blended, or when out of memory. */
MildStatus mild_batch_set_map(MildBatch *batch, const MildMap *map, MildError *error);

/* Solves a contact step of every robot and, with `advance`, moves the memory of the ground to its
 * end: do that once for each step that the engine keeps. On a GPU it only puts the work into
 * `stream`, allocates nothing and waits for nothing, so it may be captured in a graph. Fails when
 * the device does, and with nothing done when output->elements is asked for and a sole is a
 * shell. */
MildStatus mild_batch_step(MildBatch *batch, const MildBatchInput *input,
                           const MildBatchOutput *output, int advance, MildStream stream,
                           MildError *error);
/* Sets what the ground under robot 0 .. robots - 1 remembers to what `ground`, of the same soles,
 * remembers, to go on with a simulation that began on the CPU; materials of that ground are labels
 * here. Waits for the device. Fails, with the memory unchanged, when the ground has other soles,
 * imprints, mixtures, materials without a label, wear that no material of the batch has, or is
 * uneven and the batch is not. */
MildStatus mild_batch_load(MildBatch *batch, int robot, const MildGround *ground, MildError *error);
/* The other way: `ground`, of the same soles and without imprints, forgets everything and remembers
 * what the ground under a robot does. Waits for the device. Fails like mild_batch_load. */
MildStatus mild_batch_store(const MildBatch *batch, int robot, MildGround *ground,
                            MildError *error);
/* Both for robots first .. first + count - 1 at once. grounds: [count]. Fails, with nothing
 * changed, when one of them does not fit; the device may fail later. */
MildStatus mild_batch_load_robots(MildBatch *batch, int first, int count,
                                  const MildGround *const *grounds, MildError *error);
MildStatus mild_batch_store_robots(const MildBatch *batch, int first, int count,
                                   MildGround *const *grounds, MildError *error);
/* Robots whose flag is not 0 forget everything, as after they were moved to another place. which:
 * [robots] in the memory of the device; NULL: all. In `stream`, as mild_batch_step. */
MildStatus mild_batch_reset(MildBatch *batch, const uint8_t *which, MildStream stream,
                            MildError *error);

MILD_API_END

#endif
