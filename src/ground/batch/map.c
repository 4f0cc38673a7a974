/* The map that the robots of a batch stand on, in the memory of its device. */
#include <stdlib.h>

#include "device/device.h"
#include "ground/batch/bodies_batch.h"
#include "ground/step/inside.h"
#include "ground/terrain/grid.h"

/* First labels of all cells; NULL when out of memory or when a border is blended. */
static unsigned char *first_labels(const MildMap *map, size_t cells, MildError *error) {
    unsigned char *labels = malloc(cells);
    if (!labels) {
        mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory: %zu bytes are needed", cells);
        return NULL;
    }
    for (size_t i = 0; i < cells; i++) {
        labels[i] = map->label[i].first;
        if (map->label[i].share > 0) {
            mild_fail(error, MILD_ERROR_ARGUMENT,
                      "batch: a map whose materials blend at their borders is not there in batches "
                      "yet; use terrain.border = 0");
            free(labels);
            return NULL;
        }
    }
    return labels;
}

static void *copy_of(const void *from, size_t bytes, int device, MildError *error) {
    void *to = device_alloc(device, bytes, error);
    if (to && device_copy(device, to, from, bytes, error) != MILD_OK) {
        device_free(device, to);
        return NULL;
    }
    return to;
}

void batch_map_close(const MapView *view, int device) {
    device_free(device, (void *)view->height);
    device_free(device, (void *)view->label);
}

MildStatus batch_map_open(MapView *view, const MildMap *map, int device, MildError *error) {
    MapView opened = mild_inside_map(map);
    const size_t points = (size_t)(opened.x.cells + 1) * (size_t)(opened.y.cells + 1);
    const size_t cells = (size_t)opened.label_x.cells * (size_t)opened.label_y.cells;
    opened.height = NULL;
    if (map->label) {
        unsigned char *labels = first_labels(map, cells, error);
        opened.label = labels ? copy_of(labels, cells, device, error) : NULL;
        free(labels);
        if (!opened.label) {
            return error->status;
        }
    }
    if (map->height) {
        opened.height = copy_of(map->height, points * sizeof *map->height, device, error);
        if (!opened.height) {
            batch_map_close(&opened, device);
            return error->status;
        }
    }
    *view = opened;
    return MILD_OK;
}

double batch_map_steepest(const MildMap *map) {
    return map ? map->steepest : 0.0;
}

/* Bool: nothing differs from place to place. */
static int map_is_plain(const MildMap *map) {
    return !map || (mild_map_is_level(map) && !map->label);
}

/* Goes on as `next`, on the map of that view. steepest: [-] of it. keeps: bool, the map is that of
 * the batch. */
static MildStatus go_on(MildBatch *batch, MildBatch *next, double steepest, int keeps,
                        MildError *error) {
    MildStatus status = batch_memory_open(&next->arrays, &next->shape, batch->device,
                                          batch->arrays.worn != NULL, error);
    if (status == MILD_OK && batch->bodies.setup) {
        status = batch_bodies_set_map(next, steepest, error);
    }
    const MildBatch *left = status == MILD_OK ? batch : next;
    device_free(batch->device, left->arrays.memory); /* waits until no step uses it */
    if (!keeps) {
        batch_map_close(&left->arrays.map, batch->device);
    }
    *batch = status == MILD_OK ? *next : *batch;
    return status;
}

MildStatus mild_batch_set_map(MildBatch *batch, const MildMap *map, MildError *error) {
    MildError own = {0};
    error = error ? error : &own; /* says which status */
    MildBatch next = *batch;
    next.shape.map = !map_is_plain(map);
    next.arrays.map = (MapView){.labels = 1};
    if (next.shape.map) {
        MildStatus status = batch_map_open(&next.arrays.map, map, batch->device, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return go_on(batch, &next, batch_map_steepest(map), 0, error);
}

MildStatus batch_lower(MildBatch *batch, MildError *error) {
    MildBatch next = *batch;
    next.shape.map = 1;
    next.arrays.map.uneven = 1;
    return go_on(batch, &next, 0.0, 1, error);
}
