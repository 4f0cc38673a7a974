/* Shells: elements that cover the shapes of a body (docs/model.md, section 20). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/law/element_law.h"
#include "ground/sole/sole.h"
#include "ground/sole/sole_inside.h"

#define SHAPES_MAX 256
#define MESH_MOST (1 << 20)
#define SHAPE_FAR 10.0  /* [m] */
#define SHAPE_ROUND 8   /* least elements around a circle: 8 have 2 % too much projected area */
#define SHAPE_SKIN 1e-6 /* [m] shapes closer than this touch */

/* Number of elements of about that pitch along a length. */
static int divide(double length, double pitch, int least) {
    return (int)fmax(fmin(round(length / pitch), SOLE_ELEMENTS_MAX), least);
}

static void box_sample(const MildShape *box, double pitch, Samples *samples) {
    for (int face = 0; face < 6 && samples->status == MILD_OK; face++) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const double side = face % 2 ? 1.0 : -1.0;
        const double a = 2.0 * box->size[u], b = 2.0 * box->size[v];
        const int columns = divide(a, pitch, 1), rows = divide(b, pitch, 1);
        Sample sample = {.area = a / columns * (b / rows)};
        sample.at[axis] = side * box->size[axis];
        sample.normal[axis] = side;
        for (int i = 0; i < columns && samples->status == MILD_OK; i++) {
            for (int j = 0; j < rows; j++) {
                sample.at[u] = a * ((i + 0.5) / columns - 0.5);
                sample.at[v] = b * ((j + 0.5) / rows - 0.5);
                samples_add(samples, &sample);
            }
        }
    }
}

/* A ring of elements around z at the height z. sine, cosine: of the normal to z. */
static void ring_sample(double radius, double z, double sine, double cosine, double area,
                        double pitch, Samples *samples) {
    const double around = radius * sine;
    const int count = divide(2.0 * LAW_PI * around, pitch, SHAPE_ROUND);
    for (int i = 0; i < count && samples->status == MILD_OK; i++) {
        const double angle = 2.0 * LAW_PI * (i + 0.5) / count;
        const double c = cos(angle), s = sin(angle);
        const Sample sample = {.at = {around * c, around * s, z + radius * cosine},
                               .normal = {sine * c, sine * s, cosine},
                               .area = area / count};
        samples_add(samples, &sample);
    }
}

/* A sphere is a capsule without a cylinder. */
static void round_sample(double radius, double half, double pitch, Samples *samples) {
    const int rings = half > 0.0 ? divide(2.0 * half, pitch, 1) : 0;
    for (int i = 0; i < rings && samples->status == MILD_OK; i++) {
        const double z = 2.0 * half * ((i + 0.5) / rings - 0.5);
        ring_sample(radius, z, 1.0, 0.0, 4.0 * LAW_PI * radius * half / rings, pitch, samples);
    }
    const int bands = divide(0.5 * LAW_PI * radius, pitch, SHAPE_ROUND / 4);
    for (int i = 0; i < 2 * bands && samples->status == MILD_OK; i++) {
        const double from = 0.5 * LAW_PI * i / bands, to = 0.5 * LAW_PI * (i + 1) / bands;
        const double area = 2.0 * LAW_PI * radius * radius * (cos(from) - cos(to));
        const double middle = 0.5 * (from + to);
        ring_sample(radius, i < bands ? half : -half, sin(middle), cos(middle), area, pitch,
                    samples);
    }
}

/* A shape's frame in that of the body. */
typedef struct {
    double at[3];
    double turn[9]; /* row major */
} Frame;

static Frame frame_of(const MildShape *shape) {
    const double *q = shape->quat;
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double scale = length > 0.0 ? 1.0 / length : 0.0;
    const double w = length > 0.0 ? q[0] * scale : 1.0;
    const double x = q[1] * scale, y = q[2] * scale, z = q[3] * scale;
    const Frame frame = {{shape->pos[0], shape->pos[1], shape->pos[2]},
                         {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                          2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                          2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    return frame;
}

static void frame_turn(const Frame *frame, const double *in, double *out) {
    for (int k = 0; k < 3; k++) {
        const double *row = frame->turn + 3 * k;
        out[k] = row[0] * in[0] + row[1] * in[1] + row[2] * in[2];
    }
}

/* Bool: the shape has an inside. */
static int shape_closed(const MildShape *shape) {
    double volume;
    return shape->type != MILD_SHAPE_MESH || mesh_closed(shape, &volume);
}

/* Bool: a point of the body lies inside a shape that has an inside. */
static int shape_contains(const MildShape *shape, const double point[3]) {
    const Frame frame = frame_of(shape);
    double at[3];
    for (int k = 0; k < 3; k++) {
        at[k] = 0.0;
        for (int j = 0; j < 3; j++) {
            at[k] += frame.turn[3 * j + k] * (point[j] - frame.at[j]);
        }
    }
    if (shape->type == MILD_SHAPE_BOX) {
        return fabs(at[0]) < shape->size[0] && fabs(at[1]) < shape->size[1] &&
               fabs(at[2]) < shape->size[2];
    }
    if (shape->type == MILD_SHAPE_MESH) {
        return mesh_contains(shape, at);
    }
    const double half = shape->type == MILD_SHAPE_CAPSULE ? shape->size[1] : 0.0;
    const double z = fmax(fabs(at[2]) - half, 0.0);
    return at[0] * at[0] + at[1] * at[1] + z * z < shape->size[0] * shape->size[0];
}

/* Bool: the element lies inside another shape. Of two faces that coincide the first shape's stays,
 * and none where they face each other. closed: [count] shape_closed. */
static int sample_hidden(const MildSurfaceDef *def, const int *closed, const Sample *sample) {
    for (int other = 0; other < def->count; other++) {
        double out[3], in[3];
        for (int k = 0; k < 3; k++) {
            out[k] = sample->at[k] + SHAPE_SKIN * sample->normal[k];
            in[k] = sample->at[k] - SHAPE_SKIN * sample->normal[k];
        }
        if (closed[other] && other != sample->key &&
            (shape_contains(&def->shapes[other], out) ||
             (other < sample->key && shape_contains(&def->shapes[other], in)))) {
            return 1;
        }
    }
    return 0;
}

static double spacing_of(const MildSurfaceDef *def) {
    return def->spacing > 0.0 ? def->spacing : def->pitch;
}

static void shape_sample(const MildSurfaceDef *def, const int *closed, int index,
                         Samples *samples) {
    const double spacing = spacing_of(def);
    const MildShape *shape = &def->shapes[index];
    const Frame frame = frame_of(shape);
    const int first = samples->count;
    switch (shape->type) {
    case MILD_SHAPE_BOX: box_sample(shape, spacing, samples); break;
    case MILD_SHAPE_CAPSULE: round_sample(shape->size[0], shape->size[1], spacing, samples); break;
    case MILD_SHAPE_SPHERE: round_sample(shape->size[0], 0.0, spacing, samples); break;
    default: mesh_sample(shape, spacing, samples); break;
    }
    if (samples->status != MILD_OK) {
        return;
    }
    int kept = first;
    for (int i = first; i < samples->count; i++) {
        const Sample own = samples->list[i];
        Sample *sample = &samples->list[kept];
        sample->area = own.area;
        sample->key = index;
        frame_turn(&frame, own.at, sample->at);
        frame_turn(&frame, own.normal, sample->normal);
        for (int k = 0; k < 3; k++) {
            sample->at[k] += frame.at[k];
        }
        kept += !sample_hidden(def, closed, sample);
    }
    samples->count = kept;
}

static MildStatus check_number(const char *name, int shape, int index, double value, int positive,
                               MildError *error) {
    if (fabs(value) <= SHAPE_FAR && (!positive || value > 0.0)) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_RANGE, "surface.shapes[%d].%s[%d] = %g is not %s 10 m",
                     shape, name, index, value, positive ? "above 0 and at most" : "within");
}

static MildStatus check_mesh(const MildShape *mesh, int shape, MildError *error) {
    MildStatus status = MILD_OK;
    double volume;
    if (!mesh->vertices || !mesh->triangles || mesh->vertex_count < 3 || mesh->triangle_count < 1 ||
        mesh->vertex_count > MESH_MOST || mesh->triangle_count > MESH_MOST) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "surface.shapes[%d]: a mesh needs 3 .. %d vertices and 1 .. %d triangles",
                         shape, MESH_MOST, MESH_MOST);
    }
    for (int i = 0; i < 3 * mesh->vertex_count && status == MILD_OK; i++) {
        status = check_number("vertices", shape, i / 3, mesh->vertices[i], 0, error);
    }
    for (int i = 0; i < 3 * mesh->triangle_count && status == MILD_OK; i++) {
        if (mesh->triangles[i] < 0 || mesh->triangles[i] >= mesh->vertex_count) {
            status = mild_fail(error, MILD_ERROR_RANGE,
                               "surface.shapes[%d].triangles[%d] has vertex %d of %d", shape, i / 3,
                               mesh->triangles[i], mesh->vertex_count);
        }
    }
    if (status == MILD_OK && mesh_closed(mesh, &volume) && volume < 0.0) {
        status =
            mild_fail(error, MILD_ERROR_ARGUMENT,
                      "surface.shapes[%d].triangles face inward; they must be counterclockwise "
                      "seen from outside",
                      shape);
    }
    return status;
}

static MildStatus check_shape(const MildShape *shape, int index, MildError *error) {
    static const int sizes[] = {3, 2, 1, 0}; /* of MildShapeType */
    if (shape->type < MILD_SHAPE_BOX || shape->type > MILD_SHAPE_MESH) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "surface.shapes[%d].type = %d is no MildShapeType", index, shape->type);
    }
    MildStatus status = MILD_OK;
    for (int k = 0; k < sizes[shape->type] && status == MILD_OK; k++) {
        status = check_number("size", index, k, shape->size[k], 1, error);
    }
    for (int k = 0; k < 3 && status == MILD_OK; k++) {
        status = check_number("pos", index, k, shape->pos[k], 0, error);
    }
    for (int k = 0; k < 4 && status == MILD_OK; k++) {
        status = check_number("quat", index, k, shape->quat[k], 0, error);
    }
    return status == MILD_OK && shape->type == MILD_SHAPE_MESH ? check_mesh(shape, index, error)
                                                               : status;
}

static MildStatus check_def(const MildSurfaceDef *def, MildError *error) {
    if (!def->shapes || def->count < 1 || def->count > SHAPES_MAX) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "surface.count = %d: 1 .. %d shapes are needed", def->count, SHAPES_MAX);
    }
    if (!(def->pitch >= 1e-3 && def->pitch <= 1.0)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "surface.pitch = %g is outside 0.001 .. 1: [m] edge of an element",
                         def->pitch);
    }
    if (def->spacing != 0.0 && !(def->spacing >= 1e-3 && def->spacing <= 1.0)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "surface.spacing = %g is outside 0.001 .. 1, nor 0: [m] distance of the "
                         "elements",
                         def->spacing);
    }
    MildStatus status = MILD_OK;
    for (int i = 0; i < def->count && status == MILD_OK; i++) {
        status = check_shape(&def->shapes[i], i, error);
    }
    return status;
}

/* The second longest of the sides of the bounding box. */
static double samples_width(const Samples *samples) {
    double side[3];
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < samples->count; i++) {
            low = fmin(low, samples->list[i].at[k]);
            high = fmax(high, samples->list[i].at[k]);
        }
        side[k] = high - low;
    }
    return fmax(fmin(side[0], side[1]), fmin(fmax(side[0], side[1]), side[2]));
}

static MildSole *sole_of(const Samples *samples, double pitch) {
    const int n = samples->count;
    MildSole *sole = malloc(sizeof *sole + SOLE_ARRAYS * (size_t)n * sizeof(double));
    if (!sole) {
        return NULL;
    }
    *sole = (MildSole){.elements = n, .shell = 1, .pitch = pitch, .width = samples_width(samples)};
    for (int i = 0; i < n; i++) {
        const Sample *sample = &samples->list[i];
        for (int k = 0; k < 3; k++) {
            sole->values[(SOLE_X + k) * n + i] = sample->at[k];
            sole->values[(SOLE_NORMAL + k) * n + i] = sample->normal[k];
        }
        sole->values[SOLE_AREA * n + i] = sample->area;
        sole->z += sample->at[2];
    }
    sole->z /= n;
    return sole;
}

MildSole *mild_sole_surface(const MildSurfaceDef *def, MildError *error) {
    if (check_def(def, error) != MILD_OK) {
        return NULL;
    }
    Samples samples = {.most = SOLE_ELEMENTS_MAX};
    MildSole *sole = NULL;
    int closed[SHAPES_MAX];
    for (int i = 0; i < def->count; i++) {
        closed[i] = shape_closed(&def->shapes[i]);
    }
    for (int i = 0; i < def->count && samples.status == MILD_OK; i++) {
        shape_sample(def, closed, i, &samples);
    }
    if (samples.status == MILD_ERROR_RANGE) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "surface.spacing = %g makes too many elements, at most %d", spacing_of(def),
                  SOLE_ELEMENTS_MAX);
    } else if (samples.status == MILD_OK && samples.count == 0) {
        mild_fail(error, MILD_ERROR_RANGE, "surface.shapes have no outer surface");
    } else if (samples.status != MILD_OK || !(sole = sole_of(&samples, def->pitch))) {
        mild_fail(error, MILD_ERROR_MEMORY, "surface: out of memory for %d elements",
                  samples.count);
    }
    free(samples.list);
    return sole;
}

static const double *surface_array(const MildSole *sole, int array) {
    return sole->shell ? sole->values + (size_t)array * (size_t)sole->elements : NULL;
}

const double *mild_sole_surface_z(const MildSole *sole) {
    return surface_array(sole, SOLE_Z);
}

const double *mild_sole_surface_normal(const MildSole *sole, int axis) {
    return surface_array(sole, SOLE_NORMAL + axis);
}

const double *mild_sole_surface_area(const MildSole *sole) {
    return surface_array(sole, SOLE_AREA);
}
