#include "identify/press.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/law/width.h"

static const double paper_pitch = 0.0195, gravity = 9.81; /* [m], [m/s^2] */

#define HAND_TINY 1e-4 /* [-] of a step */

enum { WAY_STEPS = 1000, ROWS_MAX = 2500000 };

/* ---- a free body over a sole ---- */

typedef struct {
    double mass;
    double center[3];  /* [m] centre of mass in the foot frame, from the ankle */
    double inertia[9]; /* [kg m^2] about it, foot frame */
    double inverse[9]; /* [1/(kg m^2)] */
} PressBody;

static void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* out = R m R^T v for a tensor m of the foot frame. */
static void tensor_apply(const double *R, const double *m, const double *v, double *out) {
    double body[3], turned[3];
    for (int i = 0; i < 3; i++) {
        body[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
    }
    for (int i = 0; i < 3; i++) {
        turned[i] = m[3 * i] * body[0] + m[3 * i + 1] * body[1] + m[3 * i + 2] * body[2];
    }
    for (int i = 0; i < 3; i++) {
        out[i] = R[3 * i] * turned[0] + R[3 * i + 1] * turned[1] + R[3 * i + 2] * turned[2];
    }
}

/* The body is flat. Every element is a square of mass/count, so I_zz = I_xx + I_yy and z does not
 * couple. */
static PressBody press_body(const MildSole *sole, double mass) {
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole), pitch = mild_sole_pitch(sole);
    int count = mild_sole_elements(sole);
    double share = mass / count, own = mass * pitch * pitch / 12, cx = 0, cy = 0, xx = own,
           yy = own, xy = 0;
    for (int i = 0; i < count; i++) {
        cx += x[i] / count;
        cy += y[i] / count;
    }
    for (int i = 0; i < count; i++) {
        xx += share * (y[i] - cy) * (y[i] - cy);
        yy += share * (x[i] - cx) * (x[i] - cx);
        xy -= share * (x[i] - cx) * (y[i] - cy);
    }
    double det = xx * yy - xy * xy, zz = xx + yy;
    return (PressBody){.mass = mass,
                       .center = {cx, cy, mild_sole_z(sole)},
                       .inertia = {xx, xy, 0, xy, yy, 0, 0, 0, zz},
                       .inverse = {yy / det, -xy / det, 0, -xy / det, xx / det, 0, 0, 0, 1 / zz}};
}

/* Vector from the ankle to the centre of mass, world. */
static void body_center(const PressBody *body, const double *R, double *r) {
    const double *c = body->center;
    for (int k = 0; k < 3; k++) {
        r[k] = R[3 * k] * c[0] + R[3 * k + 1] * c[1] + R[3 * k + 2] * c[2];
    }
}

/* Column k of A: the twist that a unit wrench at the ankle gives; a = F/m - alpha x r, alpha = I^-1
 * (tau - r x F). */
static void body_inverse_inertia(const PressBody *body, const double *R, const double *r,
                                 double *A) {
    for (int k = 0; k < 6; k++) {
        double wrench[6] = {0}, lever[3], torque[3], turn[3], swing[3];
        wrench[k] = 1;
        cross(r, wrench, lever);
        for (int j = 0; j < 3; j++) {
            torque[j] = wrench[3 + j] - lever[j];
        }
        tensor_apply(R, body->inverse, torque, turn);
        cross(turn, r, swing);
        for (int j = 0; j < 3; j++) {
            A[6 * j + k] = wrench[j] / body->mass - swing[j];
            A[6 * (3 + j) + k] = turn[j];
        }
    }
}

/* Fills A = J M^-1 J^T and the free twist at the ankle under gravity for foot 0 of `input`, from
 * its pose and twist. Free: the centre falls, alpha = -I^-1 (omega x I omega), and the ankle's
 * acceleration is g - alpha x r - omega x (omega x r). */
static void press_body_free(const PressBody *body, double gravity, MildContactInput *input) {
    const double *R = input->rotation[0], *V = input->velocity[0], *spin = V + 3;
    double r[3], moment[3], gyro[3], turn[3], swing[3], along[3], centripetal[3];
    body_center(body, R, r);
    body_inverse_inertia(body, R, r, input->inverse_inertia);
    tensor_apply(R, body->inertia, spin, moment);
    cross(moment, spin, gyro); /* -omega x I omega */
    tensor_apply(R, body->inverse, gyro, turn);
    cross(turn, r, swing);
    cross(spin, r, along);
    cross(spin, along, centripetal);
    for (int k = 0; k < 3; k++) {
        double acceleration = -(k == 2 ? gravity : 0) - swing[k] - centripetal[k];
        input->free_velocity[k] = V[k] + input->dt * acceleration;
        input->free_velocity[3 + k] = V[3 + k] + input->dt * turn[k];
    }
}

/* R <- exp([dt omega]x) R by Rodrigues' formula. */
static void turn_by(double *R, const double *spin, double dt) {
    double rate = sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]),
           angle = rate * dt;
    if (angle == 0) {
        return;
    }
    double x = spin[0] / rate, y = spin[1] / rate, z = spin[2] / rate, c = cos(angle),
           s = sin(angle), t = 1 - c;
    const double Q[9] = {t * x * x + c,     t * x * y - s * z, t * x * z + s * y,
                         t * x * y + s * z, t * y * y + c,     t * y * z - s * x,
                         t * x * z - s * y, t * y * z + s * x, t * z * z + c};
    double out[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = Q[3 * i] * R[j] + Q[3 * i + 1] * R[3 + j] + Q[3 * i + 2] * R[6 + j];
        }
    }
    memcpy(R, out, sizeof out);
}

/* Moves foot 0 by dt at its new twist. */
static void press_body_move(MildContactInput *input, const double *velocity) {
    memcpy(input->velocity[0], velocity, sizeof input->velocity[0]);
    for (int k = 0; k < 3; k++) {
        input->position[0][k] += input->dt * velocity[k];
    }
    turn_by(input->rotation[0], velocity + 3, input->dt);
}

/* ---- press ---- */

typedef struct {
    const PressDef *def;
    const MildSole *sole;
    PressResult *result;
    MildTerrain terrain;
    MildContactInput input;
    double inverse_inertia[36]; /* of the input */
    MildContactResult contact;
    MildGround *ground;
    MildScratch *scratch;
    void *block; /* the ground, followed by space for a copy */
    void *spare;
    double offset[3]; /* [m] ankle -> reference point, world */
    double start;     /* [m] depth at which the lowest element touches */
    double time;
} Press;

MildSole *press_plate_create(double length, double width, MildError *error) {
    double x = 0.5 * length, y = 0.5 * width;
    const double outline[] = {-x, -y, x, -y, x, y, -x, y};
    MildSoleDef def = {.outline = outline, .points = 4, .pitch = paper_pitch};
    return mild_sole_create(&def, error);
}

MildSole *press_disc_create(double diameter, MildError *error) {
    enum { CORNERS = 96 };
    double outline[2 * CORNERS];
    for (int i = 0; i < CORNERS; i++) {
        const double angle = 2 * 3.141592653589793 * (i + 0.5) / CORNERS;
        outline[2 * i] = 0.5 * diameter * cos(angle);
        outline[2 * i + 1] = 0.5 * diameter * sin(angle);
    }
    MildSoleDef def = {.outline = outline, .points = CORNERS, .pitch = paper_pitch};
    return mild_sole_create(&def, error);
}

double press_disc_area(double diameter) {
    return 0.25 * 3.141592653589793 * diameter * diameter;
}

void press_result_close(PressResult *result) {
    free(result->rows);
    result->rows = NULL;
}

/* ---- the ground under the sole ---- */

static void press_close(Press *press) {
    mild_scratch_destroy(press->scratch);
    free(press->block);
}

static void press_pose(Press *press) {
    for (int i = 0; i < 3; i++) {
        press->offset[i] = press->input.rotation[0][3 * i + 2] * mild_sole_z(press->sole);
    }
}

/* [m] Height of the lowest element relative to the reference point, at most 0. */
static double lowest_element(const Press *press) {
    const double *down = &press->input.rotation[0][6]; /* third row: world z of a foot vector */
    double lowest = 0;
    for (int i = 0; i < mild_sole_elements(press->sole); i++) {
        lowest = fmin(lowest, down[0] * mild_sole_x(press->sole)[i] +
                                  down[1] * mild_sole_y(press->sole)[i]);
    }
    return lowest;
}

static MildStatus press_open(Press *press, const PressDef *def, const MildSole *sole,
                             PressResult *result, MildError *error) {
    *press = (Press){.def = def,
                     .sole = sole,
                     .result = result,
                     .terrain = mild_terrain_uniform(&def->material)};
    if (mild_terrain_set_map(&press->terrain, def->map, error) != MILD_OK) {
        return error->status;
    }
    press->terrain.height = -mild_terrain_height_at(&press->terrain, 0, 0);
    size_t bytes = mild_ground_bytes_imprints(&sole, 1, def->imprint_tiles);
    press->block = aligned_alloc(64, 2 * bytes);
    if (!press->block) {
        return mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory");
    }
    press->scratch = mild_scratch_create(&sole, 1, error);
    if (!press->scratch) {
        free(press->block);
        return MILD_ERROR_MEMORY;
    }
    press->ground = mild_ground_init_imprints(press->block, &sole, 1, def->imprint_tiles);
    press->spare = (char *)press->block + bytes;
    double c = cos(def->tilt), s = sin(def->tilt);
    const double rotation[9] = {c, 0, s, 0, 1, 0, -s, 0, c}; /* about y */
    press->input.feet = 1;
    press->input.inverse_inertia = press->inverse_inertia;
    press->input.solver = def->solver;
    for (int i = 0; i < 9; i++) {
        press->input.rotation[0][i] = rotation[i];
    }
    press_pose(press);
    press->start = lowest_element(press);
    return MILD_OK;
}

static double press_depth(const Press *press) {
    return -press->input.position[0][2] - press->offset[2];
}

static void press_place(Press *press, double depth) {
    press->input.position[0][2] = -depth - press->offset[2];
}

static void press_solve(Press *press) {
    mild_ground_solve(press->ground, &press->terrain, &press->input, press->scratch,
                      &press->contact);
}

static void press_advance(Press *press) {
    mild_ground_advance(press->ground, &press->terrain, &press->input, press->scratch,
                        &press->contact);
}

/* ---- rows ---- */

/* Moments move from the ankle to the reference point: M_ref = M - offset x F. */
static PressRow press_row(const Press *press) {
    const MildFootResult *foot = &press->contact.foot[0];
    const double *p = press->offset, *f = foot->force, *R = press->input.rotation[0];
    PressRow row = {.time = press->time,
                    .depth = press_depth(press),
                    .force = f[2],
                    .contacts = foot->contacts};
    row.force_x = f[0];
    row.force_y = f[1];
    row.x = press->input.position[0][0] + p[0];
    row.tilt = atan2(-R[6], R[8]);
    row.moment_x = foot->torque[0] - (p[1] * f[2] - p[2] * f[1]);
    row.moment_y = foot->torque[1] - (p[2] * f[0] - p[0] * f[2]);
    row.way = press->result->ways;
    return row;
}

/* Also before the first step, because so many take minutes. */
static MildStatus rows_check(double rows, MildError *error) {
    return rows <= ROWS_MAX
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "press: more than %d rows; use fewer or longer steps", ROWS_MAX);
}

static MildStatus rows_add(PressResult *result, PressRow row, MildError *error) {
    if (rows_check(result->count + 1.0, error) != MILD_OK) {
        return MILD_ERROR_RANGE;
    }
    if (result->count == result->room) {
        int room = 2 * result->room + 2 * WAY_STEPS + 1;
        PressRow *more = realloc(result->rows, sizeof *more * (size_t)room);
        if (!more) {
            return mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory for %d rows", room);
        }
        result->rows = more;
        result->room = room;
    }
    row.zmp_x =
        row.force > 0 ? -row.moment_y / row.force : NAN; /* at the height of the reference point */
    row.zmp_y = row.force > 0 ? row.moment_x / row.force : NAN;
    result->rows[result->count++] = row;
    result->peak_force = fmax(result->peak_force, row.force);
    return MILD_OK;
}

/* Adds the work of the step just solved. */
static void work_add(Press *press, const PressRow *step, double down, double forward) {
    PressResult *result = press->result;
    *(down > 0 ? &result->work_in : &result->work_out) += step->force * fabs(down);
    result->work_drag -= step->force_x * forward;
    if (down < 0 && step->force > 0) {
        result->print_depth = step->depth + down;
    }
}

/* ---- prescribed path: A = 0, so the foot has the prescribed twist after each step ---- */

/* A step of `dt` from here at the given speeds; changes nothing. */
static PressRow hand_solve(Press *press, double dt, double forward, double down) {
    MildContactInput *input = &press->input;
    input->dt = dt;
    input->velocity[0][0] = input->free_velocity[0] = forward;
    input->velocity[0][2] = input->free_velocity[2] = -down;
    press_solve(press);
    return press_row(press);
}

/* Accepts the step just solved, which ends at depth `to`. */
static MildStatus hand_take(Press *press, const PressRow *step, double forward, double to,
                            PressRow row, MildError *error) {
    double dt = press->input.dt;
    PressRow mean = *step;
    mean.force = 0.5 * (step->force + row.force);
    mean.force_x = 0.5 * (step->force_x + row.force_x);
    work_add(press, &mean, to - step->depth, forward * dt);
    return rows_add(press->result, row, error);
}

/* Accepts a step at constant depth. The force of a step is the mean about its start, so the
 * force at its end is that of the step that would follow. */
static MildStatus hand_accept(Press *press, const PressRow *step, double forward,
                              MildError *error) {
    double dt = press->input.dt;
    press_advance(press);
    press->time += dt;
    press->input.position[0][0] += forward * dt;
    return hand_take(press, step, forward, step->depth, hand_solve(press, dt, forward, 0), error);
}

/* The row at the end of the step just solved. Its force is that at the depth `to` itself, computed
 * by a tiny step after a tiny step. The mean over a whole step would smooth the kink where the
 * ground yields. Does not change the state. */
static PressRow hand_end(Press *press, const PressRow *step, double to) {
    double dt = press->input.dt, down = (to - step->depth) / dt, tiny = HAND_TINY * dt;
    size_t bytes = mild_ground_size(press->ground);
    memcpy(press->spare, press->ground, bytes);
    press_advance(press);
    press_place(press, to);
    hand_solve(press, tiny, 0, down);
    press_advance(press);
    press_place(press, to + tiny * down);
    PressRow row = hand_solve(press, tiny, 0, down);
    memcpy(press->ground, press->spare, bytes);
    press_place(press, step->depth);
    hand_solve(press, dt, 0, down);
    row.depth = to;
    row.time = press->time + dt;
    return row;
}

/* Shortens a step that would pass `force`, so that it ends there. */
static PressRow hand_cut(Press *press, double dt, double down, double force) {
    double low = 0, high = dt, from = press_depth(press);
    PressRow step = {0};
    for (int i = 0; i < 40; i++) {
        double middle = 0.5 * (low + high);
        step = hand_solve(press, middle, 0, down);
        int passes = (hand_end(press, &step, from + middle * down).force - force) * down >= 0;
        *(passes ? &high : &low) = middle;
    }
    return step;
}

/* Goes down or up to a depth, or stops earlier where the force reaches `force` (NaN: never). Then
 * *reached is true. */
static MildStatus hand_vertical(Press *press, double to, double force, int *reached,
                                MildError *error) {
    double from = press_depth(press), way = to - from, speed = press->def->speed,
           down = copysign(speed, way);
    const double steps = fmax(ceil(fabs(way) / speed / press->def->step - 1e-6), 1);
    MildStatus status = rows_check(isnan(force) ? steps : 1, error);
    *reached = 0;
    for (int i = 1; i <= steps && status == MILD_OK && !*reached; i++) {
        double next = i < steps ? from + way * i / steps : to,
               dt = (next - press_depth(press)) / down;
        PressRow step = hand_solve(press, dt, 0, down), end = hand_end(press, &step, next);
        *reached = (end.force - force) * down >= 0;
        if (*reached) {
            step = hand_cut(press, dt, down, force);
            next = step.depth + press->input.dt * down;
            end = hand_end(press, &step, next);
        }
        press_advance(press);
        press->time += press->input.dt;
        press_place(press, next);
        status = hand_take(press, &step, 0, next, end, error);
    }
    press->result->ways++;
    return status;
}

static MildStatus hand_drag(Press *press, MildError *error) {
    const PressDef *def = press->def;
    MildStatus status = MILD_OK;
    for (int i = 0; i < WAY_STEPS && status == MILD_OK; i++) {
        PressRow step =
            hand_solve(press, def->drag / def->drag_speed / WAY_STEPS, def->drag_speed, 0);
        status = hand_accept(press, &step, def->drag_speed, error);
    }
    press->result->ways++;
    return status;
}

static MildStatus hand_out(Press *press, MildError *error) {
    int reached;
    return press_depth(press) > press->start
               ? hand_vertical(press, press->start, NAN, &reached, error)
               : MILD_OK;
}

/* Even turns end a way down, odd turns a way up. */
static MildStatus hand_turn(Press *press, int index, MildError *error) {
    const PressDef *def = press->def;
    int reached, ends_down = index % 2 == 0;
    double depth = def->by_force ? press->start + ends_down * PRESS_DEEPEST
                                 : fmax(def->turn[index], press->start);
    MildStatus status =
        hand_vertical(press, depth, def->by_force ? def->turn[index] : NAN, &reached, error);
    if (status != MILD_OK || !def->by_force || !ends_down || reached) {
        return status;
    }
    return mild_fail(error, MILD_ERROR_RANGE,
                     "--force: the ground pushes with at most %g N, at a depth of %g m",
                     press->result->peak_force, PRESS_DEEPEST);
}

static MildStatus hand_run(Press *press, MildError *error) {
    const PressDef *def = press->def;
    int cycles = def->cycles > 0 ? def->cycles : 1;
    press_place(press, press->start);
    MildStatus status = rows_add(press->result, press_row(press), error);
    for (int cycle = 0; cycle < cycles && status == MILD_OK; cycle++) {
        for (int i = 0; i < def->turns && status == MILD_OK; i++) {
            status = hand_turn(press, i, error);
            if (status == MILD_OK && i == 0 && cycle == 0 && def->drag > 0) {
                status = hand_drag(press, error);
            }
        }
        if (status == MILD_OK && def->turns % 2) {
            status = hand_out(press, error);
        }
    }
    return status == MILD_OK ? hand_out(press, error) : status;
}

/* ---- dropped ---- */

static int untouched(const Press *press) {
    const double *deepest = mild_ground_depth_max(press->ground, 0);
    for (int i = 0; i < mild_sole_elements(press->sole); i++) {
        if (deepest[i] > 0) {
            return 0;
        }
    }
    return 1;
}

/* One semi-implicit step, as in an engine. The row gets the time and depth at the start of the
 * step, because the force is a mean centred there. */
static MildStatus drop_step(Press *press, const PressBody *body, MildError *error) {
    PressResult *result = press->result;
    MildContactInput *input = &press->input;
    double before = press_depth(press), x = input->position[0][0] + press->offset[0],
           dt = input->dt;
    press_body_free(body, gravity, input);
    press_solve(press);
    PressRow row = press_row(press);
    press_advance(press);
    press_body_move(input, press->contact.velocity);
    press_pose(press);
    press->time += dt;
    double depth = press_depth(press), way = input->position[0][0] + press->offset[0] - x;
    work_add(press, &row, depth - before, way);
    if (result->stop_time == 0 && input->velocity[0][2] >= 0 && depth > press->start) {
        result->stop_time = press->time;
        result->stop_depth = fmax(before, depth);
    }
    if (untouched(press)) {
        result->print_depth = 0;
    }
    return rows_add(result, row, error); /* with the time and depth before the step */
}

static MildStatus drop_run(Press *press, MildError *error) {
    const PressDef *def = press->def;
    PressBody body = press_body(press->sole, def->mass);
    const double steps = ceil(def->seconds / def->step - 1e-6);
    press->input.dt = def->step;
    press->input.velocity[0][2] = -def->impact;
    press_place(press, press->start - def->height);
    MildStatus status = rows_check(steps, error);
    for (int i = 0; i < steps && status == MILD_OK; i++) {
        status = drop_step(press, &body, error);
    }
    const double *V = press->input.velocity[0];
    press->result->rest_speed = sqrt(V[0] * V[0] + V[1] * V[1] + V[2] * V[2]);
    return status;
}

MildStatus press_run(const PressDef *def, const MildSole *sole, PressResult *result,
                     MildError *error) {
    Press press;
    PressDef whole = *def;
    double pitch = mild_sole_pitch(sole);
    int elements = mild_sole_elements(sole);
    *result = (PressResult){.elements = elements, .area = elements * pitch * pitch};
    MildStatus status = mild_material_check(&def->material, error);
    if (status == MILD_OK) {
        status = width_check(&def->material, mild_sole_width(sole), error);
    }
    if (status == MILD_OK) {
        status = press_open(&press, &whole, sole, result, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    double way = def->by_force ? 0.02e-3 * WAY_STEPS : def->turn[0] - press.start;
    if (!(whole.step > 0)) {
        whole.step = def->mass > 0 ? 1e-4 : way / def->speed / WAY_STEPS;
    }
    status = def->mass > 0 ? drop_run(&press, error) : hand_run(&press, error);
    press_close(&press);
    return status;
}
