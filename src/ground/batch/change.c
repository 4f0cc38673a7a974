/* Materials that change under standing robots: what their ground remembers goes to the CPU, where
 * mild_ground_change has one text for all, and back. */
#include <stdlib.h>
#include <string.h>

#include "ground/batch/batch.h"
#include "ground/step/state.h"

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

/* What a robot stands on, a material a label. index: [labels], or NULL as in MildBatchInput. */
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

/* Bool: the ground lies lower under an element. */
static int is_lowered(const MildGround *ground) {
    int lowered = 0;
    for (int f = 0; f < ground->feet; f++) {
        lowered |= ground->uneven[f] == GROUND_LOWERED;
    }
    return lowered;
}

/* Re-expresses what the robots remember. Returns bool: some ground lies lower. */
static int robots_change(const MildBatch *batch, const Robots *robots,
                         const MildMaterial *materials, int count, const int32_t *material) {
    const int labels = batch->shape.map ? batch->arrays.map.labels : 1;
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
    MildStatus status = robots_take(batch, &robots, error);
    const int lowered =
        status == MILD_OK && count > 0 && robots_change(batch, &robots, materials, count, material);
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
