#include "paper/control/walk.h"

#include <math.h>
#include <string.h>

void dcm_point(const DcmSegment *segment, double point[3]) {
    for (int k = 0; k < 3; k++) {
        point[k] = segment->from[k] + segment->sway[k] * cos(segment->angle);
    }
}

/* The solution of b xi' = xi - p that does not run away, less the straight part of p: with the
 * velocity w of that part
 *
 *     b w + sway (cos(angle) - b rate sin(angle)) / (1 + (b rate)^2). */
static double bounded_part(const DcmSegment *segment, int k, double angle, double b) {
    const double straight = b * (segment->to[k] - segment->from[k]) / segment->duration;
    const double turn = b * segment->rate;
    return straight + segment->sway[k] * (cos(angle) - turn * sin(angle)) / (1 + turn * turn);
}

/* Every other solution differs from the bounded one by a multiple of exp(t / b). */
void dcm_plan(const DcmSegment *segments, int count, double b, double xi[3]) {
    memcpy(xi, segments[count - 1].to, 3 * sizeof *xi);
    for (int s = count - 1; s >= 0; s--) {
        const DcmSegment *segment = &segments[s];
        if (segment->duration <= 0) {
            continue;
        }
        const double decay = exp(-segment->duration / b);
        const double last = segment->angle + segment->rate * segment->duration;
        for (int k = 0; k < 3; k++) {
            const double end = segment->to[k] + bounded_part(segment, k, last, b);
            const double start = segment->from[k] + bounded_part(segment, k, segment->angle, b);
            xi[k] = start + (xi[k] - end) * decay;
        }
    }
}

#define GRAVITY 9.81
#define PI 3.141592653589793
#define PREVIEW 6    /* steps of the plan; exp(-6 step_time / b) is below 1e-3 */
#define STILL 0.03   /* [m/s, rad/s] below this a command is to stand */
#define ALIGNED 0.02 /* [m] feet this much ahead of each other are side by side */
#define EARLY 0.6    /* [-] of the swing, from which on a touch ends it */

WalkDef walk_def_default(void) {
    WalkDef def = {
        .height = 0.55,
        .acceleration = 0.3,
        .settle_time = 0.5,
        .step_time = 0.40,
        .double_support = 0.15,
        .start_time = 0.40,
        .width = 0.16,
        .width_least = 0.12,
        .clearance = 0.06,
        .search_speed = 0.2,
        .search_time = 0.15,
        .touch_force = 20,
        .adjust = 1,
        .sway = 0.008,
        .adjust_most = 0.08,
    };
    def.b = sqrt(def.height / GRAVITY);
    return def;
}

/* ---- footholds ---- */

/* 1: a foot on the left, -1: on the right. */
static double side(const Walk *walk, int foot) {
    return foot == walk->left ? 1 : -1;
}

static int is_still(const double command[3]) {
    return fabs(command[0]) < STILL && fabs(command[1]) < STILL && fabs(command[2]) < STILL;
}

/* Foothold of `foot` beside the other one at `stance` [m], a step of the command later. */
static void next_foothold(const Walk *walk, const WalkDef *def, double heading, int foot,
                          const double stance[3], double foothold[3]) {
    const double c = cos(heading), s = sin(heading), time = def->step_time;
    const double sign = side(walk, foot), *command = walk->command;
    const double shift = command[1] * time;
    const double lateral = fmax(def->width, def->width_least + fabs(shift)) + sign * shift;
    const double ahead = command[0] * time, left = sign * lateral;
    foothold[0] = stance[0] + c * ahead - s * left;
    foothold[1] = stance[1] + s * ahead + c * left;
    foothold[2] = stance[2];
}

static void middle(const WalkState *state, double point[3]) {
    for (int k = 0; k < 3; k++) {
        point[k] = 0.5 * (state->support[0][k] + state->support[1][k]);
    }
}

/* ---- phases ---- */

static double single_time(const WalkDef *def) {
    return (1 - def->double_support) * def->step_time;
}

static void begin_double(Walk *walk, int stance, const double from[3], double duration) {
    walk->phase = WALK_DOUBLE;
    walk->time = 0;
    walk->duration = duration;
    walk->stance = stance;
    memcpy(walk->from, from, sizeof walk->from);
}

static void begin_single(Walk *walk, const WalkDef *def, const WalkState *state) {
    const int swing = 1 - walk->stance;
    walk->phase = WALK_SINGLE;
    walk->starts = 0;
    walk->time = 0;
    walk->duration = single_time(def);
    walk->before = walk->heading;
    walk->heading += walk->command[2] * def->step_time;
    memcpy(walk->lift, state->support[swing], sizeof walk->lift);
    walk->lift_yaw = state->yaw[swing];
}

static int feet_aligned(const Walk *walk, const WalkState *state) {
    const double *a = state->support[0], *b = state->support[1];
    const double ahead = cos(walk->heading) * (a[0] - b[0]) + sin(walk->heading) * (a[1] - b[1]);
    return fabs(ahead) < ALIGNED;
}

static void begin_stand(Walk *walk, const WalkState *state) {
    walk->phase = WALK_STAND;
    walk->time = 0;
    memcpy(walk->rest, state->support[walk->stance], sizeof walk->rest);
}

void walk_start(Walk *walk, const WalkDef *def, const WalkState *state) {
    memset(walk, 0, sizeof *walk);
    memcpy(walk->rest, state->dcm, sizeof walk->rest);
    walk->rest[2] -= def->height;
    walk->heading = walk->before = state->base_yaw;
    const double *a = state->support[0], *b = state->support[1];
    walk->left = cos(walk->heading) * (a[1] - b[1]) < sin(walk->heading) * (a[0] - b[0]);
}

static int single_is_over(const Walk *walk, const WalkDef *def, const WalkState *state) {
    const int touches = state->force[1 - walk->stance] > def->touch_force;
    return (touches && walk->time > EARLY * walk->duration) ||
           walk->time > walk->duration + def->search_time;
}

/* The foothold of the swing foot, moved by what the DCM's error will be. */
static void plan_foothold(Walk *walk, const WalkDef *def, const WalkState *state) {
    next_foothold(walk, def, walk->heading, 1 - walk->stance, state->support[walk->stance],
                  walk->foothold);
    WalkTarget target;
    walk_target(walk, def, state, &target);
    for (int k = 0; k < 2; k++) {
        const double move = def->adjust * (state->dcm[k] - target.dcm[k]);
        walk->moved[k] = fmin(fmax(move, -def->adjust_most), def->adjust_most);
    }
}

void walk_advance(Walk *walk, const WalkDef *def, const WalkState *state, const double command[3],
                  double dt) {
    for (int k = 0; k < 3; k++) {
        const double change = command[k] - walk->command[k], most = def->acceleration * dt;
        walk->command[k] += fmin(fmax(change, -most), most);
    }
    walk->time += dt;
    if (walk->phase == WALK_STAND) {
        double point[3];
        middle(state, point);
        for (int k = 0; k < 3; k++) {
            walk->rest[k] += fmin(dt / def->settle_time, 1) * (point[k] - walk->rest[k]);
        }
    }
    if (walk->phase == WALK_STAND && !is_still(command)) {
        /* the foot on the side that the robot goes to swings first */
        begin_double(walk, command[1] > 0 ? 1 - walk->left : walk->left, walk->rest,
                     def->start_time);
        walk->starts = 1;
    } else if (walk->phase == WALK_DOUBLE && walk->time >= walk->duration) {
        begin_single(walk, def, state);
    } else if (walk->phase == WALK_SINGLE && single_is_over(walk, def, state)) {
        const int stance = walk->stance;
        if (is_still(command) && feet_aligned(walk, state)) {
            begin_stand(walk, state);
        } else {
            begin_double(walk, 1 - stance, state->support[stance],
                         def->double_support * def->step_time);
        }
    }
    if (walk->phase == WALK_SINGLE) {
        plan_foothold(walk, def, state);
    }
}

/* ---- target ---- */

static DcmSegment *add_segment(DcmSegment *segment, const double from[3], const double to[3],
                               double duration, double height) {
    memset(segment, 0, sizeof *segment);
    memcpy(segment->from, from, sizeof segment->from);
    memcpy(segment->to, to, sizeof segment->to);
    segment->from[2] += height;
    segment->to[2] += height;
    segment->duration = duration;
    return segment;
}

/* A single support on `stance` from `time` on, in which the other foot swings from `lift` to
 * `foothold`. Its acceleration is that of blend(). */
static void add_swing(DcmSegment *segment, const WalkDef *def, const double stance[3],
                      const double lift[3], const double foothold[3], double time,
                      double duration) {
    const double left = fmax(duration - time, 0);
    add_segment(segment, stance, stance, left, def->height);
    segment->rate = PI / duration;
    segment->angle = fmin(time, duration) * segment->rate;
    for (int k = 0; k < 2; k++) {
        segment->sway[k] =
            -def->sway * 0.5 * segment->rate * segment->rate * (foothold[k] - lift[k]);
    }
}

/* The way of the virtual repellent point from now on: the rest of this step, and PREVIEW more. */
static int preview(const Walk *walk, const WalkDef *def, const WalkState *state,
                   DcmSegment *segments) {
    const double *stance = state->support[walk->stance], *other = state->support[1 - walk->stance];
    const double double_time = def->double_support * def->step_time;
    double back[3], at[3], next[3], heading = walk->heading;
    int count = 0, foot = 1 - walk->stance;
    memcpy(at, stance, sizeof at);
    if (walk->phase == WALK_STAND) {
        add_segment(&segments[0], walk->rest, walk->rest, 1, def->height);
        return 1;
    }
    if (walk->phase == WALK_DOUBLE) {
        const double share = fmin(walk->time / walk->duration, 1);
        double now[3];
        for (int k = 0; k < 3; k++) {
            now[k] = walk->from[k] + share * (stance[k] - walk->from[k]);
        }
        add_segment(&segments[count++], now, stance, fmax(walk->duration - walk->time, 0),
                    def->height);
        heading += walk->command[2] * def->step_time;
        next_foothold(walk, def, heading, foot, at, next);
        add_swing(&segments[count++], def, stance, other, next, 0, single_time(def));
    } else {
        memcpy(next, walk->foothold, sizeof next);
        add_swing(&segments[count++], def, stance, walk->lift, next, walk->time, walk->duration);
    }
    for (int i = 0; i < PREVIEW; i++) {
        memcpy(back, at, sizeof back);
        memcpy(at, next, sizeof at);
        foot = 1 - foot;
        heading += walk->command[2] * def->step_time;
        next_foothold(walk, def, heading, foot, at, next);
        add_segment(&segments[count++], back, at, double_time, def->height);
        add_swing(&segments[count++], def, at, back, next, 0, single_time(def));
    }
    return count;
}

/* s in [0, 1] -> (1 - cos(pi s)) / 2 and its two derivatives: of all ways between two points at
 * rest one with a small greatest acceleration, and a DCM in closed form. */
static void blend(double s, double value[3]) {
    value[0] = 0.5 * (1 - cos(PI * s));
    value[1] = 0.5 * PI * sin(PI * s);
    value[2] = 0.5 * PI * PI * cos(PI * s);
}

/* 64 s^3 (1 - s)^3 and its two derivatives: at rest at both ends, 1 in the middle. */
static void bump(double s, double value[3]) {
    const double r = s * (1 - s), slope = 1 - 2 * s;
    value[0] = 64 * r * r * r;
    value[1] = 192 * r * r * slope;
    value[2] = 384 * r * (slope * slope - r);
}

static void swing_target(const Walk *walk, const WalkDef *def, WalkTarget *target) {
    const double T = walk->duration, s = fmin(walk->time / T, 1);
    const double late = fmax(walk->time - T, 0);
    double way[3], rise[3];
    blend(s, way);
    bump(s, rise);
    for (int k = 0; k < 3; k++) {
        const double span = walk->foothold[k] + (k < 2 ? walk->moved[k] : 0) - walk->lift[k];
        target->position[k] = walk->lift[k] + span * way[0];
        target->velocity[k] = span * way[1] / T;
        target->acceleration[k] = span * way[2] / (T * T);
    }
    target->position[2] += def->clearance * rise[0] - def->search_speed * late;
    target->velocity[2] += def->clearance * rise[1] / T - (late > 0 ? def->search_speed : 0);
    target->acceleration[2] += def->clearance * rise[2] / (T * T);
    target->yaw = walk->lift_yaw + remainder(walk->heading - walk->lift_yaw, 2 * PI) * way[0];
    target->level = fmin(2 * s, 1);
}

void walk_target(const Walk *walk, const WalkDef *def, const WalkState *state, WalkTarget *target) {
    DcmSegment segments[2 + 2 * PREVIEW];
    memset(target, 0, sizeof *target);
    const int count = preview(walk, def, state, segments);
    dcm_plan(segments, count, def->b, target->dcm);
    dcm_point(&segments[0], target->point);
    target->swing = walk->phase == WALK_SINGLE ? 1 - walk->stance : -1;
    target->still = walk->phase == WALK_STAND || walk->starts;
    target->base_yaw = walk->heading;
    for (int f = 0; f < WALK_FEET; f++) {
        target->stands[f] = f != target->swing;
        target->share[f] = 1;
    }
    if (walk->phase == WALK_DOUBLE) {
        const double share = fmin(walk->time / walk->duration, 1);
        target->share[1 - walk->stance] = 1 - share;
        target->share[walk->stance] = fmin(0.1 + 3 * share, 1);
    }
    if (walk->phase == WALK_SINGLE) {
        const double share = fmin(walk->time / walk->duration, 1);
        target->base_yaw = walk->before + share * (walk->heading - walk->before);
        target->base_yaw_rate = (walk->heading - walk->before) / walk->duration;
        swing_target(walk, def, target);
    }
}
