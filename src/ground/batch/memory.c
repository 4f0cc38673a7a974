/* What the ground of a batch remembers, from and to mild/ground.h. */
#define MILD_REAL_FLOAT

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "device/device.h"
#include "ground/batch/batch.h"
#include "ground/batch/bodies_batch.h"
#include "ground/batch/contact.h"
#include "ground/batch/element_memory.h"
#include "ground/step/inside.h"
#include "ground/step/state.h"

enum { MEMORY_ROBOTS = 256 }; /* copied at once */

/* Elements that a robot has room for. */
static int places(const BatchShape *shape) {
    return shape->groups * shape->stride;
}

size_t batch_memory_numbers(const BatchShape *shape) {
    return (size_t)contact_memory_numbers(places(shape), shape->map);
}

size_t batch_worn_numbers(const BatchShape *shape) {
    return (size_t)places(shape);
}

MildStatus batch_memory_open(BatchArrays *arrays, const BatchShape *shape, int device, int worn,
                             MildError *error) {
    const size_t robots = (size_t)shape->robots, numbers = robots * batch_memory_numbers(shape);
    const size_t wear = worn ? robots * batch_worn_numbers(shape) : 0;
    arrays->memory = device_alloc(device, (numbers + wear) * sizeof(float), error);
    arrays->worn = arrays->memory && worn ? arrays->memory + numbers : NULL;
    return arrays->memory ? MILD_OK : MILD_ERROR_MEMORY;
}

/* Number n of a foot's elements, or with a map of what follows them. */
static float *numbers_at(const BatchShape *shape, float *memory, int n, int foot) {
    return memory + n * places(shape) + foot * shape->stride;
}

/* The five numbers of a foot, `groups` apart. */
static float *foot_at(const BatchShape *shape, float *memory, int foot) {
    return numbers_at(shape, memory, CONTACT_MAP_MEMORY, 0) + foot;
}

/* What the ground remembers of its unevenness and materials. Planes count from the world's origin
 * there, and from where the foot was here; so that the first step finds them the same, the foot was
 * at the origin. */
static void planes_of(const BatchShape *shape, const MildGround *ground, const Memory *of, int f,
                      float *memory) {
    float *plane = numbers_at(shape, memory, CONTACT_MEMORY, f);
    float *slope_x = numbers_at(shape, memory, CONTACT_MEMORY + 1, f);
    float *slope_y = numbers_at(shape, memory, CONTACT_MEMORY + 2, f);
    float *label = numbers_at(shape, memory, CONTACT_MEMORY + 3, f);
    const int uneven = ground->uneven[f];
    foot_at(shape, memory, f)[4 * shape->groups] = uneven ? 1.0f : 0.0f;
    for (int e = 0; e < shape->elements[f]; e++) {
        const int there = uneven && of->material[e] != MATERIAL_NONE;
        plane[e] = there ? (float)of->plane[e] : (float)CONTACT_NO_PLANE;
        slope_x[e] = there ? (float)of->slope_x[e] : 0.0f;
        slope_y[e] = there ? (float)of->slope_y[e] : 0.0f;
        label[e] = of->material[e] > 0 ? (float)(of->material[e] & 0xff) : 0.0f;
    }
}

void batch_memory_of(const BatchShape *shape, const MildGround *ground, float *memory,
                     float *worn) {
    memset(memory, 0, batch_memory_numbers(shape) * sizeof *memory);
    if (worn) {
        memset(worn, 0, batch_worn_numbers(shape) * sizeof *worn);
    }
    for (int f = 0; f < shape->feet; f++) {
        const Memory of = mild_inside_memory(ground, f);
        for (int e = 0; e < shape->elements[f]; e++) {
            element_load(&of, e, numbers_at(shape, memory, 0, f) + e, places(shape));
            if (worn) {
                worn[f * shape->stride + e] = (float)of.worn[e];
            }
        }
        if (shape->map) {
            planes_of(shape, ground, &of, f, memory);
        }
    }
}

/* The other way: planes from where the foot was to the world's origin. */
static int store_planes(const BatchShape *shape, float *memory, int f, const Memory *of) {
    const float *plane = numbers_at(shape, memory, CONTACT_MEMORY, f);
    const float *slope_x = numbers_at(shape, memory, CONTACT_MEMORY + 1, f);
    const float *slope_y = numbers_at(shape, memory, CONTACT_MEMORY + 2, f);
    const float *label = numbers_at(shape, memory, CONTACT_MEMORY + 3, f);
    const float *last = foot_at(shape, memory, f);
    const double x = (double)last[0];
    const double y = (double)last[shape->groups];
    const double z = (double)last[2 * shape->groups] - (double)last[3 * shape->groups];
    const int stepped = last[4 * shape->groups] > 0.0f;
    for (int e = 0; e < shape->elements[f]; e++) {
        const int there = stepped && (double)plane[e] < CONTACT_NO_PLANE / 2;
        of->slope_x[e] = there ? (double)slope_x[e] : 0.0;
        of->slope_y[e] = there ? (double)slope_y[e] : 0.0;
        of->plane[e] = (double)plane[e] - of->slope_x[e] * x - of->slope_y[e] * y + z;
        of->plane[e] = there ? of->plane[e] : 0.0;
        of->material[e] = of->depth_max[e] > 0.0 ? (int32_t)label[e]
                          : there                ? MATERIAL_FREE
                                                 : MATERIAL_NONE;
    }
    return stepped;
}

/* Moves the memory of a robot to a ground. worn: NULL: nothing is. */
static void ground_remember(const BatchShape *shape, const MapView *map, float *memory,
                            const float *worn, MildGround *ground) {
    mild_ground_reset(ground);
    for (int f = 0; f < shape->feet; f++) {
        const Memory of = mild_inside_memory(ground, f);
        int loaded = 0;
        for (int e = 0; e < shape->elements[f]; e++) {
            element_store(numbers_at(shape, memory, 0, f) + e, places(shape), &of, e);
            of.worn[e] = worn ? (double)worn[f * shape->stride + e] : 0.0;
            of.material[e] = of.depth_max[e] > 0.0 ? 0 : MATERIAL_NONE;
            loaded += of.depth_max[e] > 0.0;
        }
        const int stepped = shape->map && store_planes(shape, memory, f, &of);
        const int uneven = batch_map_is_lowered(map) ? GROUND_LOWERED : map->uneven;
        ground->uneven[f] = stepped ? uneven : 0;
        ground->touched[f] = ground->uneven[f] ? shape->elements[f] : loaded;
    }
}

/* ---- what fits ---- */

static MildStatus check_robots(const BatchShape *shape, int first, int count, MildError *error) {
    if (first < 0 || first >= shape->robots) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: robot %d is outside 0 .. %d", first,
                         shape->robots - 1);
    }
    if (count < 0 || count > shape->robots - first) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: %d robots from %d on; there are %d",
                         count, first, shape->robots);
    }
    return MILD_OK;
}

/* Bool: the soles of a ground are plane and shells as those of a batch, with as many elements. */
static int is_of(const BatchShape *shape, const MildGround *ground) {
    int same = ground->feet == shape->soles;
    for (int f = 0; same && f < shape->soles; f++) {
        const int shell = ground->shells >> f & 1;
        same = ground->elements[f] == shape->elements[f] && shell == (f >= shape->feet);
    }
    return same;
}

/* Whether a ground may take part: the same soles, no imprints. */
static MildStatus check_soles(const BatchShape *shape, int robot, const MildGround *ground,
                              MildError *error) {
    if (!is_of(shape, ground)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "batch: the ground of robot %d was made for other soles", robot);
    }
    if (ground->tiles > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "batch: the ground of robot %d keeps imprints, which batches do not yet; "
                         "use mild_ground_init",
                         robot);
    }
    return MILD_OK;
}

/* Whether a batch knows everything that a ground remembers. */
static MildStatus check_memory(const MildBatch *batch, int robot, const MildGround *ground,
                               MildError *error) {
    const BatchShape *shape = &batch->shape;
    const int labels = shape->map ? batch->arrays.map.labels : 1;
    for (int f = 0; f < shape->soles; f++) {
        const Memory memory = mild_inside_memory(ground, f);
        if (ground->uneven[f] && !(shape->map && batch->arrays.map.uneven)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "batch: the ground of robot %d is uneven, the batch's is not: call "
                             "mild_batch_set_map",
                             robot);
        }
        for (int e = 0; e < shape->elements[f]; e++) {
            const int32_t material = memory.material[e];
            if (material >> 16 > 0) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "batch: robot %d stands on a mixture of materials, which is not "
                                 "there in batches yet",
                                 robot);
            }
            if (material >= 0 && (material & 0xff) >= labels) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "batch: robot %d stands on material %d; the batch's ground has "
                                 "%d: call mild_batch_set_map",
                                 robot, material & 0xff, labels);
            }
            if (f < shape->feet && memory.worn[e] > 0.0 && !batch->arrays.worn) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "batch: robot %d has worn its ground, and no material of the "
                                 "batch wears: call mild_batch_set_materials",
                                 robot);
            }
        }
    }
    return MILD_OK;
}

/* ---- load and store ---- */

/* Memory of the robots that are copied at once, on the CPU. */
typedef struct {
    float *memory; /* NULL: none could be had */
    float *worn;   /* behind it; NULL as in BatchArrays */
} Some;

static Some some_robots(const MildBatch *batch, int count, MildError *error) {
    const size_t most = (size_t)(count < MEMORY_ROBOTS ? count : MEMORY_ROBOTS);
    const size_t numbers = most * batch_memory_numbers(&batch->shape);
    float *memory = malloc(most > 0 ? most * mild_batch_robot_bytes(batch) : 1);
    if (!memory) {
        mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    return (Some){memory, memory && batch->arrays.worn ? memory + numbers : NULL};
}

/* Copies them to robots first .. first + count - 1, or with `back` from these. */
static MildStatus copy_robots(const MildBatch *batch, int first, int count, const Some *some,
                              int back, MildError *error) {
    const BatchArrays at = batch_slice(batch, first, count).arrays;
    const size_t robots = (size_t)count * sizeof(float);
    const size_t bytes = robots * batch_memory_numbers(&batch->shape);
    const size_t worn = robots * batch_worn_numbers(&batch->shape);
    MildStatus status = device_copy(batch->device, back ? some->memory : at.memory,
                                    back ? at.memory : some->memory, bytes, error);
    return status == MILD_OK && some->worn ? device_copy(batch->device, back ? some->worn : at.worn,
                                                         back ? at.worn : some->worn, worn, error)
                                           : status;
}

/* Robot k of them. */
static Some some_at(const BatchShape *shape, const Some *some, int k) {
    return (Some){some->memory + (size_t)k * batch_memory_numbers(shape),
                  some->worn ? some->worn + (size_t)k * batch_worn_numbers(shape) : NULL};
}

MildStatus mild_batch_load_robots(MildBatch *batch, int first, int count,
                                  const MildGround *const *grounds, MildError *error) {
    const BatchShape *shape = &batch->shape;
    MildStatus status = check_robots(shape, first, count, error);
    for (int i = 0; i < count && status == MILD_OK; i++) {
        status = check_soles(shape, first + i, grounds[i], error);
        if (status == MILD_OK) {
            status = check_memory(batch, first + i, grounds[i], error);
        }
    }
    if (status != MILD_OK) {
        return status;
    }
    const Some robots = some_robots(batch, count, error);
    if (!robots.memory) {
        return MILD_ERROR_MEMORY;
    }
    for (int i = 0; i < count && status == MILD_OK; i += MEMORY_ROBOTS) {
        const int some = count - i < MEMORY_ROBOTS ? count - i : MEMORY_ROBOTS;
        for (int k = 0; k < some; k++) {
            const Some to = some_at(shape, &robots, k);
            batch_memory_of(shape, grounds[i + k], to.memory, to.worn);
        }
        status = copy_robots(batch, first + i, some, &robots, 0, error);
    }
    free(robots.memory);
    return status == MILD_OK && batch->bodies.setup
               ? batch_bodies_load(batch, first, count, grounds, error)
               : status;
}

MildStatus mild_batch_store_robots(const MildBatch *batch, int first, int count,
                                   MildGround *const *grounds, MildError *error) {
    const BatchShape *shape = &batch->shape;
    MildStatus status = check_robots(shape, first, count, error);
    for (int i = 0; i < count && status == MILD_OK; i++) {
        status = check_soles(shape, first + i, grounds[i], error);
    }
    if (status != MILD_OK) {
        return status;
    }
    const Some robots = some_robots(batch, count, error);
    if (!robots.memory) {
        return MILD_ERROR_MEMORY;
    }
    for (int i = 0; i < count && status == MILD_OK; i += MEMORY_ROBOTS) {
        const int some = count - i < MEMORY_ROBOTS ? count - i : MEMORY_ROBOTS;
        status = copy_robots(batch, first + i, some, &robots, 1, error);
        for (int k = 0; k < some && status == MILD_OK; k++) {
            const Some from = some_at(shape, &robots, k);
            ground_remember(shape, &batch->arrays.map, from.memory, from.worn, grounds[i + k]);
        }
    }
    free(robots.memory);
    return status == MILD_OK && batch->bodies.setup
               ? batch_bodies_store(batch, first, count, grounds, error)
               : status;
}

MildStatus mild_batch_load(MildBatch *batch, int robot, const MildGround *ground,
                           MildError *error) {
    return mild_batch_load_robots(batch, robot, 1, &ground, error);
}

MildStatus mild_batch_store(const MildBatch *batch, int robot, MildGround *ground,
                            MildError *error) {
    return mild_batch_store_robots(batch, robot, 1, &ground, error);
}

/* Materials that change under standing robots: what their ground remembers goes to the CPU, where
 * mild_ground_change has one text for all, and back. */

/* Copies of what all robots remember. */
typedef struct {
    char *block;          /* [robots] of mild_ground_size */
    MildGround **grounds; /* [robots] */
} Robots;

static void robots_free(Robots *robots) {
    free(robots->block);
    free(robots->grounds);
}

static MildStatus robots_take(const MildBatch *batch, Robots *robots, MildError *error) {
    const size_t count = (size_t)batch->shape.robots, bytes = mild_ground_size(batch->blank);
    robots->block = aligned_alloc(64, count * bytes);
    robots->grounds = malloc(count * sizeof *robots->grounds);
    if (!robots->block || !robots->grounds) {
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    for (size_t i = 0; i < count; i++) {
        robots->grounds[i] = memcpy(robots->block + i * bytes, batch->blank, bytes);
    }
    return mild_batch_store_robots(batch, 0, batch->shape.robots, robots->grounds, error);
}

/* What a robot stands on, a material a label, of which there are at most MILD_MATERIALS_MAX. index:
 * [labels], or NULL as in MildBatchInput. */
static void terrain_of(MildTerrain *terrain, int labels, const MildMaterial *materials, int count,
                       const int32_t *index) {
    terrain->material_count = labels;
    for (int i = 0; i < labels; i++) {
        const int m = index ? index[i] : 0;
        if (m >= 0 && m < count) {
            terrain->materials[i] = materials[m];
        }
    }
}

/* A ground has room for MILD_MATERIALS_MAX materials, a label of a map is a byte. */
static MildStatus check_labels(int labels, MildError *error) {
    return labels <= MILD_MATERIALS_MAX
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "batch: a map of %d labels; materials can change under robots on one of "
                           "at most %d: use mild_batch_set_materials and mild_batch_reset",
                           labels, MILD_MATERIALS_MAX);
}

/* Bool: the ground lies lower under an element. */
static int is_lowered(const MildGround *ground) {
    int lowered = 0;
    for (int f = 0; f < ground->feet; f++) {
        lowered |= ground->uneven[f] == GROUND_LOWERED;
    }
    return lowered;
}

/* Re-expresses what the robots remember. labels: of the map, 1 without. Returns bool: some ground
 * lies lower. */
static int robots_change(const MildBatch *batch, const Robots *robots, int labels,
                         const MildMaterial *materials, int count, const int32_t *material) {
    const MildMaterial sand = mild_material_default();
    MildTerrain from = mild_terrain_uniform(&sand), to = from;
    int lowered = 0;
    for (int i = 0; i < batch->shape.robots; i++) {
        const int32_t *index = material ? material + (size_t)i * (size_t)labels : NULL;
        terrain_of(&from, labels, batch->stands, batch->shape.materials, index);
        terrain_of(&to, labels, materials, count, index);
        mild_ground_change(robots->grounds[i], &from, &to, batch->scratch);
        lowered |= is_lowered(robots->grounds[i]);
    }
    return lowered;
}

MildStatus mild_batch_change_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                       const int32_t *material, MildError *error) {
    Robots robots = {NULL, NULL};
    MildError own = {0};
    error = error ? error : &own;
    const int labels = batch->shape.map ? batch->arrays.map.labels : 1;
    MildStatus status = check_labels(labels, error);
    status = status == MILD_OK ? robots_take(batch, &robots, error) : status;
    const int lowered = status == MILD_OK && count > 0 &&
                        robots_change(batch, &robots, labels, materials, count, material);
    if (status == MILD_OK) {
        status = mild_batch_set_materials(batch, materials, count, error);
    }
    if (status == MILD_OK && lowered && !batch->arrays.map.uneven) {
        status = batch_lower(batch, error);
    }
    if (status == MILD_OK) {
        status = mild_batch_load_robots(batch, 0, batch->shape.robots,
                                        (const MildGround *const *)robots.grounds, error);
    }
    robots_free(&robots);
    return status;
}
