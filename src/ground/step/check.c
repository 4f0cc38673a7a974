/* What a contact step takes on trust, checked number by number: for whoever writes an engine. */
#include <math.h>
#include <stdlib.h>

#include "ground/step/state.h"
#include "ground/terrain/grid.h"

#define TURN 1e-6     /* [-] products of a rotation's columns may be off by this */
#define SYMMETRY 1e-6 /* [-] difference of two mirrored numbers of A, over its scale */
#define DEFINITE 1e-5 /* [-] an eigenvalue of A may be negative by this, over its scale */
#define DT_MIN 1e-9   /* [s] */

static MildStatus check_finite(const char *name, int foot, const double *numbers, int count,
                               MildError *error) {
    for (int i = 0; i < count; i++) {
        if (!isfinite(numbers[i])) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "input.%s of foot %d: number %d is %g",
                             name, foot, i, numbers[i]);
        }
    }
    return MILD_OK;
}

/* R^T R = 1 and det R = 1. */
static MildStatus check_rotation(int foot, const double *r, MildError *error) {
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++) {
            const double product = r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j];
            if (!(fabs(product - (i == j)) < TURN)) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "input.rotation of foot %d is not orthonormal: columns %d and %d "
                                 "multiply to %g; it is 3 x 3, row major, foot to world",
                                 foot, i, j, product);
            }
        }
    }
    const double determinant = r[0] * (r[4] * r[8] - r[5] * r[7]) -
                               r[1] * (r[3] * r[8] - r[5] * r[6]) +
                               r[2] * (r[3] * r[7] - r[4] * r[6]);
    return determinant > 0 ? MILD_OK
                           : mild_fail(error, MILD_ERROR_ARGUMENT,
                                       "input.rotation of foot %d is a mirror image", foot);
}

/* One foot: what it is given as. */
static MildStatus check_foot(const MildContactInput *input, int foot, MildError *error) {
    MildStatus status = check_finite("position", foot, input->position[foot], 3, error);
    if (status == MILD_OK) {
        status = check_finite("velocity", foot, input->velocity[foot], 6, error);
    }
    if (status == MILD_OK) {
        status = check_finite("free_velocity", foot, input->free_velocity + 6 * foot, 6, error);
    }
    return status == MILD_OK ? check_rotation(foot, input->rotation[foot], error) : status;
}

static MildStatus not_definite(int row, MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "input.inverse_inertia is not positive semidefinite, seen at row %d; it is "
                     "A = J M^-1 J^T with the rows of all feet in one J",
                     row);
}

/* scaled = A_ij / sqrt(A_ii A_jj), free of units, 1 on the diagonal. */
static MildStatus scale_inertia(const double *a, int rows, double *scaled, MildError *error) {
    for (int i = 0; i < rows; i++) {
        if (!(a[i * rows + i] >= 0) || !isfinite(a[i * rows + i])) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "input.inverse_inertia: row %d has %g on the diagonal; A = J M^-1 J^T "
                             "has nothing below 0 there",
                             i, a[i * rows + i]);
        }
    }
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < rows; j++) {
            const double scale = sqrt(a[i * rows + i]) * sqrt(a[j * rows + j]);
            const double here = a[i * rows + j], there = a[j * rows + i];
            if (!(fabs(here - there) <= SYMMETRY * scale)) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "input.inverse_inertia is not symmetric: row %d column %d is %g, "
                                 "row %d column %d is %g; a row has 6 feet = %d numbers",
                                 i, j, here, j, i, there, rows);
            }
            if (scale == 0 && here != 0) {
                return not_definite(i, error);
            }
            scaled[i * rows + j] = scale > 0 ? here / scale : i == j;
        }
    }
    return MILD_OK;
}

/* Cholesky's factor of the scaled A + DEFINITE 1 exists, whatever the rounding, when A is positive
 * semidefinite to that precision. */
static MildStatus check_definite(double *a, int rows, MildError *error) {
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = a[i * rows + j] + (i == j ? DEFINITE : 0);
            for (int k = 0; k < j; k++) {
                sum -= a[i * rows + k] * a[j * rows + k];
            }
            if (i == j && !(sum > 0)) {
                return not_definite(i, error);
            }
            a[i * rows + j] = i == j ? sqrt(sum) : sum / a[j * rows + j];
        }
    }
    return MILD_OK;
}

/* The rows of A, of the feet that have some. */
static MildStatus check_inertia(const MildContactInput *input, MildError *error) {
    const uint32_t all = (1u << input->feet) - 1;
    if (input->rows & ~all) {
        return mild_fail(error, MILD_ERROR_RANGE, "input.rows = 0x%x names feet beyond %d",
                         (unsigned)input->rows, input->feet);
    }
    if (!input->inverse_inertia) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "input.inverse_inertia is NULL");
    }
    int rows = 0;
    for (uint32_t left = input->rows ? input->rows : all; left; left &= left - 1) {
        rows += 6;
    }
    double *scaled = malloc((size_t)(rows * rows) * sizeof *scaled);
    if (!scaled) {
        return mild_fail(error, MILD_ERROR_MEMORY, "contact: out of memory for %d rows", rows);
    }
    MildStatus status = scale_inertia(input->inverse_inertia, rows, scaled, error);
    if (status == MILD_OK) {
        status = check_definite(scaled, rows, error);
    }
    free(scaled);
    return status;
}

/* Patches and map: that each place has a material. */
static MildStatus check_places(const MildTerrain *terrain, MildError *error) {
    const int materials = terrain->material_count;
    if (terrain->patch_count < 0 || terrain->patch_count > MILD_PATCHES_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "terrain.patch_count = %d is outside 0 .. %d",
                         terrain->patch_count, MILD_PATCHES_MAX);
    }
    for (int i = 0; i < terrain->patch_count; i++) {
        const int material = terrain->patches[i].material;
        if (material < 0 || material >= materials) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "terrain.patches: patch %d has material %d of %d", i, material,
                             materials);
        }
    }
    if (!terrain->map) {
        return MILD_OK;
    }
    if (terrain->map->label_count > materials) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.map: label %d has no material, the terrain has only %d",
                         terrain->map->label_count - 1, materials);
    }
    return isfinite(terrain->map_x) && isfinite(terrain->map_y)
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT, "terrain.map_x = %g, map_y = %g",
                           terrain->map_x, terrain->map_y);
}

static MildStatus check_terrain(const MildTerrain *terrain, MildError *error) {
    if (terrain->material_count < 1 || terrain->material_count > MILD_MATERIALS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "terrain.material_count = %d is outside 1 .. %d",
                         terrain->material_count, MILD_MATERIALS_MAX);
    }
    if (!isfinite(terrain->height)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "terrain.height = %g", terrain->height);
    }
    MildStatus status = check_places(terrain, error);
    for (int i = 0; i < terrain->material_count && status == MILD_OK; i++) {
        status = mild_material_check(&terrain->materials[i], error);
    }
    return status;
}

MildStatus mild_contact_check(const MildGround *ground, const MildTerrain *terrain,
                              const MildContactInput *input, MildError *error) {
    MildStatus status = check_terrain(terrain, error);
    if (status == MILD_OK && input->feet != ground->feet) {
        status = mild_fail(error, MILD_ERROR_ARGUMENT, "input.feet = %d, but the ground has %d",
                           input->feet, ground->feet);
    }
    if (status == MILD_OK && (!(input->dt >= DT_MIN) || !isfinite(input->dt))) {
        status = mild_fail(error, MILD_ERROR_RANGE, "input.dt = %g must be at least %g s",
                           input->dt, DT_MIN);
    }
    for (int f = 0; f < ground->feet && status == MILD_OK; f++) {
        status = check_foot(input, f, error);
    }
    return status == MILD_OK ? check_inertia(input, error) : status;
}
