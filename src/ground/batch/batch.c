#define MILD_REAL_FLOAT
#include "device/device.h"
#include "ground/batch/bodies_batch.h"
#include "ground/batch/contact.h"
#include "ground/batch/contact_shapes.h"
#include "ground/law/law.h"
#include "ground/step/inside.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BATCH_TOLERANCE 1e-4
#define BATCH_LIMIT 20
#define BATCH_MATERIALS_MAX 1000000
#define BATCH_DT_MIN 1e-6 /* [s] */
#define BATCH_DT_MAX 0.1

#define BATCH_SIZE(groups, per) {groups, per},
static const int batch_sizes[][2] = {CONTACT_KINDS(BATCH_SIZE)};
/* NOLINTNEXTLINE(misc-redundant-expression): it is what this asserts */
_Static_assert(MILD_BATCH_HOST == DEVICE_HOST, "the same number");
_Static_assert(MILD_BATCH_PLANES_MAX == 4, "feet take 1, 2 or 4 groups");

/* Plane soles, which are first. */
static int count_planes(const MildBatchDef *def) {
    int planes = 0;
    while (planes < def->feet && !mild_sole_surface_z(def->soles[planes])) {
        planes++;
    }
    return planes;
}

static MildStatus check_soles(const MildBatchDef *def, MildError *error) {
    const int planes = count_planes(def);
    if (planes > MILD_BATCH_PLANES_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "batch: %d soles are plane; at most %d can be: make the others by "
                         "mild_sole_surface",
                         planes, MILD_BATCH_PLANES_MAX);
    }
    for (int f = planes; f < def->feet; f++) {
        if (!mild_sole_surface_z(def->soles[f])) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "batch: soles[%d] is plane and behind a shell; put plane soles "
                             "first",
                             f);
        }
    }
    return MILD_OK;
}

static MildStatus check_def(const MildBatchDef *def, MildError *error) {
    if (def->robots < 1) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: robots = %d; it must be at least 1",
                         def->robots);
    }
    if (def->feet < 1 || def->feet > MILD_BATCH_FEET_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: feet = %d is outside 1 .. %d", def->feet,
                         MILD_BATCH_FEET_MAX);
    }
    if (!(def->dt >= BATCH_DT_MIN && def->dt <= BATCH_DT_MAX)) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: dt = %g s is outside %g .. %g", def->dt,
                         BATCH_DT_MIN, BATCH_DT_MAX);
    }
    if (!(def->tolerance >= 0.0 && def->tolerance < 1.0)) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: tolerance = %g is outside 0 .. 1",
                         def->tolerance);
    }
    if (def->max_iterations < 0) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: max_iterations = %d is negative",
                         def->max_iterations);
    }
    if (def->device < MILD_BATCH_HOST) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "batch: device = %d; devices count from 0, MILD_BATCH_HOST is the CPU",
                         def->device);
    }
    return check_soles(def, error);
}

/* How the elements are dealt to lanes. */
static MildStatus shape_lanes(BatchShape *shape, MildError *error) {
    int most = 1;
    shape->groups = 1;
    while (shape->groups < shape->feet) {
        shape->groups *= 2;
    }
    for (int f = 0; f < shape->feet; f++) {
        most = shape->elements[f] > most ? shape->elements[f] : most;
    }
    for (size_t i = 0; i < sizeof batch_sizes / sizeof *batch_sizes; i++) {
        if (batch_sizes[i][0] == shape->groups) {
            shape->per = batch_sizes[i][1];
            shape->stride = 32 / shape->groups * shape->per;
            if (shape->stride >= most) {
                return MILD_OK;
            }
        }
    }
    return mild_fail(error, MILD_ERROR_RANGE,
                     "batch: a sole of %d elements; a robot of %d feet has at most %d a foot: take "
                     "a larger pitch",
                     most, shape->feet, shape->stride);
}

static void shape_def(MildBatch *batch, const MildBatchDef *def) {
    BatchShape *shape = &batch->shape;
    batch->device = def->device;
    shape->robots = def->robots;
    shape->soles = def->feet;
    shape->feet = count_planes(def);
    shape->points = def->points;
    shape->dt = (float)def->dt;
    shape->tolerance = (float)(def->tolerance > 0.0 ? def->tolerance : BATCH_TOLERANCE);
    shape->limit = def->max_iterations > 0 ? def->max_iterations : BATCH_LIMIT;
    for (int f = 0; f < def->feet; f++) {
        batch->pitch[f] = mild_sole_pitch(def->soles[f]);
        batch->width[f] = mild_sole_width(def->soles[f]);
        shape->elements[f] = mild_sole_elements(def->soles[f]);
    }
    for (int f = 0; f < shape->feet; f++) {
        shape->z[f] = (float)mild_sole_z(def->soles[f]);
        shape->area[f] = (float)(batch->pitch[f] * batch->pitch[f]);
    }
}

static size_t element_bytes(const BatchShape *shape) {
    return CONTACT_PLACES * (size_t)shape->groups * (size_t)shape->stride * sizeof(float);
}

static MildStatus store_elements(MildBatch *batch, const MildSole *const *soles, MildError *error) {
    const BatchShape *shape = &batch->shape;
    const size_t feet = (size_t)shape->feet, stride = (size_t)shape->stride;
    float *elements = calloc(1, element_bytes(shape));
    if (!elements) {
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    for (size_t f = 0; f < feet; f++) {
        float *own = elements + CONTACT_PLACES * f * stride;
        for (size_t i = 0; i < stride; i++) {
            const int in = (int)i < shape->elements[f];
            const SoleHeap heap = in ? mild_inside_heap(soles[f], (int)i) : (SoleHeap){0.0, 1.0};
            own[CONTACT_X * stride + i] = in ? (float)mild_sole_x(soles[f])[i] : 0.0f;
            own[CONTACT_Y * stride + i] = in ? (float)mild_sole_y(soles[f])[i] : 0.0f;
            own[CONTACT_BEGIN * stride + i] = (float)heap.begin;
            own[CONTACT_WIDTH * stride + i] = (float)heap.width;
        }
    }
    MildStatus status =
        device_copy(batch->device, batch->arrays.elements, elements, element_bytes(shape), error);
    free(elements);
    return status;
}

static MildStatus open_change(MildBatch *batch, const MildBatchDef *def, MildError *error) {
    batch->blank = mild_ground_init(aligned_alloc(64, mild_ground_bytes(def->soles, def->feet)),
                                    def->soles, def->feet);
    batch->scratch = mild_scratch_create(def->soles, def->feet, error);
    return batch->blank && batch->scratch
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
}

static MildStatus batch_open(MildBatch *batch, const MildBatchDef *def, MildError *error) {
    MildStatus status = device_open(batch->device, error);
    if (status != MILD_OK) {
        return status;
    }
    const BatchShape *shape = &batch->shape;
    BatchArrays *arrays = &batch->arrays;
    arrays->map.labels = 1;
    arrays->elements = device_alloc(batch->device, element_bytes(shape), error);
    status = arrays->elements ? batch_memory_open(arrays, shape, batch->device, 0, error)
                              : MILD_ERROR_MEMORY;
    if (status != MILD_OK) {
        return status;
    }
    status = store_elements(batch, def->soles, error);
    if (status != MILD_OK) {
        return status;
    }
    status = open_change(batch, def, error);
    if (status != MILD_OK) {
        return status;
    }
    const MildMaterial sand = mild_material_default();
    const int shells = shape->soles - shape->feet;
    status = mild_batch_set_materials(batch, &sand, 1, error);
    if (status == MILD_OK && shells > 0) {
        status =
            batch_bodies_open(&batch->bodies, batch, def->soles, shells, NULL, &sand, 1, 1, error);
        status = status == MILD_OK ? batch_bodies_ready(batch, error) : status;
    }
    return status;
}

MildBatch *mild_batch_create(const MildBatchDef *def, MildError *error) {
    MildError own = {0};
    error = error ? error : &own; /* says which status */
    if (check_def(def, error) != MILD_OK) {
        return NULL;
    }
    MildBatch *batch = calloc(1, sizeof *batch);
    if (!batch) {
        mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
        return NULL;
    }
    shape_def(batch, def);
    if (shape_lanes(&batch->shape, error) != MILD_OK || batch_open(batch, def, error) != MILD_OK) {
        mild_batch_destroy(batch);
        return NULL;
    }
    return batch;
}

void mild_batch_destroy(MildBatch *batch) {
    if (!batch) {
        return;
    }
    device_free(batch->device, batch->arrays.elements);
    device_free(batch->device, batch->arrays.materials);
    device_free(batch->device, batch->arrays.memory);
    batch_map_close(&batch->arrays.map, batch->device);
    batch_bodies_close(&batch->bodies, batch->device);
    mild_scratch_destroy(batch->scratch);
    free(batch->blank);
    free(batch->stands);
    free(batch);
}

size_t mild_batch_robot_bytes(const MildBatch *batch) {
    const BatchShape *shape = &batch->shape;
    const size_t worn = batch->arrays.worn ? batch_worn_numbers(shape) : 0;
    return (batch_memory_numbers(shape) + worn + batch->bodies.numbers) * sizeof(float);
}

int mild_batch_stride(const MildBatch *batch) {
    return batch->shape.stride;
}

/* Wear for the robots, behind all that they remember. */
static MildStatus begin_wear(MildBatch *batch, MildError *error) {
    const BatchShape *shape = &batch->shape;
    BatchArrays arrays = batch->arrays;
    if (batch_memory_open(&arrays, shape, batch->device, 1, error) != MILD_OK) {
        return MILD_ERROR_MEMORY;
    }
    float *before = batch->arrays.memory;
    const size_t bytes = (size_t)shape->robots * batch_memory_numbers(shape) * sizeof *before;
    MildStatus status = device_wait(batch->device, error);
    if (status == MILD_OK) {
        status = device_copy(batch->device, arrays.memory, before, bytes, error);
    }
    if (status == MILD_OK) {
        batch->arrays = arrays;
    }
    device_free(batch->device, status == MILD_OK ? before : arrays.memory);
    return status;
}

MildStatus mild_batch_set_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                    MildError *error) {
    if (count < 1 || count > BATCH_MATERIALS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: %d materials; 1 .. %d are possible",
                         count, BATCH_MATERIALS_MAX);
    }
    MildError own = {0};
    error = error ? error : &own; /* says which status */
    MildBatch next = *batch;
    const int feet = batch->shape.feet;
    MildStatus status = MILD_OK;
    next.shape.materials = count;
    next.curves = 0;
    next.stands = malloc((size_t)count * sizeof *materials);
    if (!next.stands) {
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    memcpy(next.stands, materials, (size_t)count * sizeof *materials);
    if (feet > 0) {
        next.arrays.materials = material_table(batch->device, batch->pitch, batch->width, feet,
                                               materials, count, &next.curves, error);
        status = next.arrays.materials ? MILD_OK : error->status;
    }
    if (status == MILD_OK && (next.curves & LAW_HEAP) && !batch->arrays.worn) {
        status = begin_wear(batch, error); /* which changes nothing that a step sees */
        next.arrays.memory = batch->arrays.memory;
        next.arrays.worn = batch->arrays.worn;
    }
    if (status == MILD_OK && batch->bodies.setup) {
        status = batch_bodies_set_materials(&next, materials, count, error);
    }
    if (feet > 0) { /* waits until no step reads it */
        device_free(batch->device,
                    status == MILD_OK ? batch->arrays.materials : next.arrays.materials);
    }
    free(status == MILD_OK ? batch->stands : next.stands);
    *batch = status == MILD_OK ? next : *batch;
    return status;
}

MildBatch batch_slice(const MildBatch *batch, int first, int count) {
    MildBatch slice = *batch;
    slice.shape.robots = count;
    slice.arrays.memory += (size_t)first * batch_memory_numbers(&batch->shape);
    if (slice.arrays.worn) {
        slice.arrays.worn += (size_t)first * batch_worn_numbers(&batch->shape);
    }
    return slice;
}

/* The kernel that fits, or NULL. */
static const BatchKernel *batch_kernel(const MildBatch *batch) {
    const BatchShape *shape = &batch->shape;
    for (int i = 0; batch_kernels[i]; i++) {
        const BatchKernel *k = batch_kernels[i];
        if (k->groups == shape->groups && k->per == shape->per && (shape->points || !k->points) &&
            !(batch->curves & ~k->curves)) {
            return k;
        }
    }
    return NULL;
}

static MildStatus batch_gpu_step(const MildBatch *batch, const MildBatchInput *input,
                                 const MildBatchOutput *output, int advance, MildStream stream,
                                 MildError *error) {
    const BatchKernel *k = batch_kernel(batch);
    return k ? k->step(batch, input, output, advance, stream, error)
             : device_open(batch->device, error);
}

/* The step of the feet. */
static MildStatus step_feet(const MildBatch *batch, const MildBatchInput *input,
                            const MildBatchOutput *output, int advance, MildStream stream,
                            MildError *error) {
    if (batch->device != MILD_BATCH_HOST) {
        return batch_gpu_step(batch, input, output, advance, stream, error);
    }
    host_step(&batch->shape, &batch->arrays, input, output, advance);
    return MILD_OK;
}

MildStatus mild_batch_step(MildBatch *batch, const MildBatchInput *input,
                           const MildBatchOutput *output, int advance, MildStream stream,
                           MildError *error) {
    if (!batch->bodies.setup) {
        return step_feet(batch, input, output, advance, stream, error);
    }
    if (output->elements) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "batch: elements are not there yet where a sole is a shell; set "
                         "output.elements = NULL");
    }
    MildStatus status = batch_bodies_begin(batch, input, output, advance, stream, error);
    if (status == MILD_OK && batch->shape.feet > 0) {
        status = step_feet(batch, input, output, advance, stream, error);
    }
    return status == MILD_OK ? batch_bodies_end(batch, input, output, advance, stream, error)
                             : status;
}

MildStatus mild_batch_reset(MildBatch *batch, const uint8_t *which, MildStream stream,
                            MildError *error) {
    if (batch->device != MILD_BATCH_HOST) {
        return batch_gpu_reset(batch, which, stream, error);
    }
    const BatchArrays *arrays = &batch->arrays;
    const size_t numbers = batch_memory_numbers(&batch->shape);
    const size_t worn = batch_worn_numbers(&batch->shape);
    for (size_t robot = 0; robot < (size_t)batch->shape.robots; robot++) {
        if (!which || which[robot]) {
            memset(arrays->memory + robot * numbers, 0, numbers * sizeof(float));
            batch_bodies_reset(&batch->bodies, robot);
        }
        if (arrays->worn && (!which || which[robot])) {
            memset(arrays->worn + robot * worn, 0, worn * sizeof(float));
        }
    }
    return MILD_OK;
}
