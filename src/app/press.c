#include "app/press.h"

#include <math.h>
#include <stdlib.h>

static const double paper_pitch = 0.0195; /* [m] */

typedef struct {
    MildTerrain terrain;
    MildContactInput input;
    MildContactResult contact;
    MildGround *ground;
    MildScratch *scratch;
    void *block;
    double offset[3]; /* [m] ankle -> reference point, world */
} Press;

MildSole *press_plate_create(double length, double width, MildError *error) {
    double x = 0.5 * length, y = 0.5 * width;
    const double outline[] = {-x, -y, x, -y, x, y, -x, y};
    MildSoleDef def = {.outline = outline, .points = 4, .pitch = paper_pitch};
    return mild_sole_create(&def, error);
}

static void press_close(Press *press) {
    mild_scratch_destroy(press->scratch);
    free(press->block);
}

/* A = 0: an infinitely heavy foot, so that the twist after each step is the prescribed one. */
static MildStatus press_open(Press *press, const PressDef *def, const MildSole *sole, MildError *error) {
    *press = (Press){.terrain = mild_terrain_uniform(&def->material)};
    size_t bytes = mild_ground_bytes(&sole, 1);
    press->block = aligned_alloc(64, bytes);
    press->scratch = press->block ? mild_scratch_create(&sole, 1, error) : NULL;
    if (!press->block) return mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory");
    if (!press->scratch) {
        press_close(press);
        return MILD_ERROR_MEMORY;
    }
    press->ground = mild_ground_init(press->block, &sole, 1);
    double c = cos(def->tilt), s = sin(def->tilt);
    const double rotation[9] = {c, 0, s, 0, 1, 0, -s, 0, c}; /* about y */
    press->input.feet = 1;
    press->input.solver = def->solver;
    for (int i = 0; i < 9; i++) press->input.rotation[0][i] = rotation[i];
    for (int i = 0; i < 3; i++) press->offset[i] = rotation[3 * i + 2] * mild_sole_z(sole);
    return MILD_OK;
}

/* Height of the lowest element above the reference point [m], at most 0. */
static double lowest_element(const Press *press, const MildSole *sole) {
    const double *down = &press->input.rotation[0][6]; /* third row: world z of a foot vector */
    double lowest = 0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        lowest = fmin(lowest, down[0] * mild_sole_x(sole)[i] + down[1] * mild_sole_y(sole)[i]);
    }
    return lowest;
}

/* Moments move from the ankle to the reference point: M_ref = M - offset x F. */
static PressRow press_row(const Press *press, double time, double depth) {
    const MildFootResult *foot = &press->contact.foot[0];
    const double *p = press->offset, *f = foot->force;
    PressRow row = {.time = time, .depth = depth, .force = f[2], .contacts = foot->contacts};
    row.moment_x = foot->torque[0] - (p[1] * f[2] - p[2] * f[1]);
    row.moment_y = foot->torque[1] - (p[2] * f[0] - p[0] * f[2]);
    row.zmp_x = f[2] > 0 ? foot->zmp_sole[0] - p[0] : NAN;
    row.zmp_y = f[2] > 0 ? foot->zmp_sole[1] - p[1] : NAN;
    return row;
}

/* One step from `depth` at downward speed `speed`: solve, then move the ground's memory. */
static void press_step(Press *press, double depth, double speed) {
    MildContactInput *input = &press->input;
    input->position[0][2] = press->terrain.height - depth - press->offset[2];
    input->velocity[0][2] = input->free_velocity[2] = -speed;
    mild_ground_solve(press->ground, &press->terrain, input, press->scratch, &press->contact);
    mild_ground_advance(press->ground, &press->terrain, input, press->scratch, &press->contact);
}

static void press_sum_up(PressResult *result) {
    const PressRow *rows = result->rows;
    result->print_depth = rows[PRESS_STEPS].depth;
    for (int i = 1; i < PRESS_ROWS; i++) {
        double way = rows[i].depth - rows[i - 1].depth;
        *(way > 0 ? &result->work_in : &result->work_out) += rows[i].force * fabs(way);
        result->peak_force = fmax(result->peak_force, rows[i].force);
        if (i > PRESS_STEPS && rows[i].force > 0) result->print_depth = rows[i].depth;
    }
}

MildStatus press_run(const PressDef *def, const MildSole *sole, PressResult *result, MildError *error) {
    Press press;
    MildStatus status = mild_material_check(&def->material, error);
    if (status == MILD_OK) status = press_open(&press, def, sole, error);
    if (status != MILD_OK) return status;
    double pitch = mild_sole_pitch(sole), start = lowest_element(&press, sole);
    double dt = (def->depth - start) / def->speed / PRESS_STEPS;
    *result = (PressResult){.elements = mild_sole_elements(sole), .area = mild_sole_elements(sole) * pitch * pitch};
    press.input.dt = dt;
    result->rows[0] = press_row(&press, 0, start);
    for (int i = 1; i < PRESS_ROWS; i++) {
        int steps_down = i <= PRESS_STEPS ? i : PRESS_ROWS - 1 - i;
        press_step(&press, result->rows[i - 1].depth, i <= PRESS_STEPS ? def->speed : -def->speed);
        double depth = start + (def->depth - start) * steps_down / PRESS_STEPS;
        result->rows[i] = press_row(&press, i * dt, depth);
    }
    press_sum_up(result);
    press_close(&press);
    return MILD_OK;
}
