/* One robot of the batch engine (env/batch_step.h) on the ground of mild/ground.h, whose solver
 * is much faster on one processor than the batch's and which remembers prints. */
#define MILD_REAL_FLOAT

#include "env/batch_step.h"

#include <stdlib.h>

#include "learn/vector.h"
#include "web/core.h"

#define SEED 1
#define FOOT_FAR 100.0 /* [m] above the ground: nothing touches */
#define HEADS_MAX 512  /* numbers that the encoder gives */

/* of the picture */
#define WINDOW_STRIDE 32    /* cells that the window moves at once */
#define WINDOW_LEAST 1e-4f  /* [m] a smaller change is not drawn */
#define OUTLINE_STEP 0.005  /* [m] */
#define OUTLINE_MARGIN 0.12 /* [m] ground around a sole that it may draw down */
#define UNDER_SOLE 0.0015   /* [m] gap below a sole, which prevents flicker */
#define SLOPE_SAND 0.45     /* [-] width of the slope around a print, over its depth */
#define SLOPE_FOAM 0.55     /* [-] the same of ground that springs back */
#define SLOPE_LEAST 0.006   /* [m] */

_Static_assert(offsetof(WebModel, task) % 8 == 0, "as TaskDef");
_Static_assert(offsetof(WebModel, geom) - offsetof(WebModel, geoms) == 4, "as web_picture says");

/* Distances from the outline of a sole, negative inside [m]. */
typedef struct {
    double x, y; /* [m] the first node */
    int columns, rows;
    float *distance; /* [rows][columns] */
} Outline;

static struct {
    const WebModel *file;
    /* the policy */
    float *weight;
    float *wide[2]; /* [widest layer] */
    /* the batch engine */
    EnvsTask task;
    EnvsGround drawn; /* the only ground to draw */
    EnvsTrial trial;
    EnvRobot *robot;
    EnvWork *env_scratch;
    EnvsArrays all;
    EnvsStep call;
    float history[TASK_HISTORY_MAX];
    /* the ground */
    int feet;
    MildSole *sole[ROBOT_FEET_MAX];
    MildScratch *scratch;
    MildGround *ground;
    MildMap *map;
    MildTerrain terrain;
    MildMaterial plain[MILD_MATERIALS_MAX]; /* before web_change */
    double stiffness;                       /* [-] factors of web_change */
    double friction;
    MildContactInput input;
    double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX]; /* of the input */
    MildContactResult result;
    /* the picture */
    WebView view;
    Outline outline[ROBOT_FEET_MAX];
    int window[2]; /* first cell that is drawn */
    float *shown;  /* [WEB_WINDOW][WEB_WINDOW] [m] depth of the surface */
    float *kept;   /* the same without feet */
    float *hills;
} web;

static TaskEnv *web_env(void) {
    return env_at(&web.all, 0);
}

/* ---- the policy ---- */

/* [numbers] of a network's weights; -1: its widths are not possible. */
static long network_numbers(const WebNetwork *network) {
    long sum = 0;
    if (network->layers < 1 || network->layers > WEB_LAYERS_MAX) {
        return -1;
    }
    for (int l = 0; l <= network->layers; l++) {
        if (network->width[l] < 1 || network->width[l] > 4096) {
            return -1;
        }
    }
    for (int l = 0; l < network->layers; l++) {
        sum += (network->width[l] + 1L) * network->width[l + 1];
    }
    return sum;
}

/* y = W x + b, then ELU; weight: [in][out], then b. */
static void apply_layer(const float *restrict weight, int in, int out, int last,
                        const float *restrict x, float *restrict y) {
    memcpy(y, weight + (size_t)in * (size_t)out, (size_t)out * sizeof *y);
    for (int i = 0; i < in; i++) {
        const float *row = weight + (size_t)i * (size_t)out;
        const float factor = x[i];
#pragma omp simd
        for (int j = 0; j < out; j++) {
            y[j] += factor * row[j];
        }
    }
#pragma omp simd
    for (int j = 0; j < (last ? 0 : out); j++) {
        y[j] = vector_elu(y[j]);
    }
}

/* Returns the weights behind those of the network. */
static const float *apply(const WebNetwork *network, const float *weight, const float *x,
                          float *y) {
    for (int l = 0; l < network->layers; l++) {
        const int in = network->width[l], out = network->width[l + 1];
        const int last = l == network->layers - 1;
        float *to = last ? y : web.wide[l % 2];
        apply_layer(weight, in, out, last, x, to);
        weight += (in + 1) * out;
        x = to;
    }
    return weight;
}

/* As network_forward of learn/network.c. */
void web_act(const float *history, float *action) {
    const WebPolicy *policy = &web.file->policy;
    const int observation = web.file->shape.observation, estimates = policy->estimates;
    float head[HEADS_MAX], theta[HEADS_MAX], input[TASK_OBSERVATION_MAX + HEADS_MAX];
    const float *weight = apply(&policy->encoder, web.weight, history, head);
    weight = apply(&policy->modulation, weight, head + policy->feet_velocity, theta);
    memcpy(input, history + web.file->shape.history - observation,
           (size_t)observation * sizeof *input);
    memcpy(input + observation, head, (size_t)estimates * sizeof *input);
    for (int j = 0; j < policy->latent; j++) {
        const int at = policy->per_dimension ? j : 0;
        const int shift = policy->per_dimension ? policy->latent + j : 1;
        input[observation + estimates + j] = theta[at] * head[estimates + j] + theta[shift];
    }
    apply(&policy->actor, weight, input, action);
}

/* ---- the picture: poses ---- */

static void show_links(void) {
    const EngineWork *work = &web.env_scratch->work;
    web.view.links = engine_links(&web.all.model->tree);
    for (int i = 0; i < web.view.links; i++) {
        for (int k = 0; k < 3; k++) {
            memcpy(web.view.link[i] + 4 * k, work->rotation[i] + 3 * k, 3 * sizeof(float));
            web.view.link[i][4 * k + 3] = work->base[k] + work->position[i][k];
        }
    }
    const Real *R = work->rotation[0];
    web.view.yaw = atan2f(R[3], R[0]);
    for (int i = 0; i < 3; i++) {
        web.view.velocity[i] = web_env()->smooth_velocity[i];
    }
}

static void show_foot(int f) {
    WebView *view = &web.view;
    const MildElements elements = mild_scratch_elements(web.scratch, f);
    const MildFootResult *foot = &web.result.foot[f];
    const double area = mild_sole_pitch(web.sole[f]) * mild_sole_pitch(web.sole[f]);
    const int rigid = web.trial.rigid;
    view->load[f] = web.robot->reading.foot[f].force[2];
    view->depth[f] = rigid ? 0 : (float)foot->depth_max;
    for (int e = 0; e < view->elements; e++) {
        view->pressure[f][e] = rigid ? 0 : (float)(elements.normal[e] / area);
    }
    for (int k = 0; k < 2; k++) {
        view->center[f][k] = 0;
        for (int i = 0; i < 3; i++) {
            view->center[f][k] += (float)(web.input.rotation[f][3 * i + k] *
                                          (foot->pressure_center[i] - web.input.position[f][i]));
        }
    }
}

/* ---- the picture: the window of ground around the robot ---- */

static double window_cell(void) {
    return 0.5 * mild_sole_pitch(web.sole[0]); /* as prints have */
}

static size_t window_at(int i, int j) {
    return (size_t)(j & (WEB_WINDOW - 1)) * WEB_WINDOW + (size_t)(i & (WEB_WINDOW - 1));
}

static void mark(int x, int y, int width, int height) {
    WebView *view = &web.view;
    if (view->dirty_count >= WEB_DIRTY_MAX || view->dirty_count < 0) {
        view->dirty_count = -1;
        return;
    }
    view->dirty[view->dirty_count++] = (WebDirty){x, y, width, height};
}

/* Marks cells i0 .. i1 - 1, j0 .. j1 - 1 of the world, which lie in up to four pieces. */
static void mark_cells(int i0, int i1, int j0, int j1) {
    for (int j = j0; j < j1;) {
        const int y = j & (WEB_WINDOW - 1);
        const int height = j1 - j < WEB_WINDOW - y ? j1 - j : WEB_WINDOW - y;
        for (int i = i0; i < i1;) {
            const int x = i & (WEB_WINDOW - 1);
            const int width = i1 - i < WEB_WINDOW - x ? i1 - i : WEB_WINDOW - x;
            mark(x, y, width, height);
            i += width;
        }
        j += height;
    }
}

static const MildMaterial *material_at(double x, double y) {
    return &web.terrain.materials[mild_terrain_material_at(&web.terrain, x, y)];
}

/* What the ground remembers there. */
static void recall_cells(int i0, int i1, int j0, int j1) {
    const double cell = window_cell();
    for (int j = j0; j < j1; j++) {
        for (int i = i0; i < i1; i++) {
            const double x = (i + 0.5) * cell, y = (j + 0.5) * cell;
            const double depth = mild_ground_imprint_at(web.ground, x, y);
            const double stays = depth > 0 ? 1 - material_at(x, y)->recovery : 0;
            web.kept[window_at(i, j)] = web.shown[window_at(i, j)] = (float)(depth * stays);
        }
    }
    mark_cells(i0, i1, j0, j1);
}

/* Moves the window so that the robot is in its middle. */
static void follow(void) {
    int first[2], again = 0;
    for (int k = 0; k < 2; k++) {
        const double middle = (double)web.env_scratch->work.base[k] / window_cell();
        first[k] = WINDOW_STRIDE * (int)floor(middle / WINDOW_STRIDE) - WEB_WINDOW / 2;
        again |= abs(first[k] - web.window[k]) >= WEB_WINDOW / 2;
    }
    const int x = web.window[0], y = web.window[1];
    const int i0 = first[0], i1 = i0 + WEB_WINDOW, j0 = first[1], j1 = j0 + WEB_WINDOW;
    web.window[0] = i0;
    web.window[1] = j0;
    if (again) {
        recall_cells(i0, i1, j0, j1);
        web.view.dirty_count = -1;
        return;
    }
    if (i0 != x) {
        recall_cells(i0 > x ? x + WEB_WINDOW : i0, i0 > x ? i1 : x, j0, j1);
    }
    if (j0 != y) {
        recall_cells(i0, i1, j0 > y ? y + WEB_WINDOW : j0, j0 > y ? j1 : y);
    }
}

/* [m] From the outline, at a point of the foot's frame. */
static double outline_distance(const Outline *outline, double x, double y) {
    const double u = (x - outline->x) / OUTLINE_STEP, v = (y - outline->y) / OUTLINE_STEP;
    if (!(u >= 0 && v >= 0 && u < outline->columns - 1 && v < outline->rows - 1)) {
        return OUTLINE_MARGIN;
    }
    const int i = (int)u, j = (int)v;
    const double s = u - i, t = v - j;
    const float *at = outline->distance + (size_t)j * (size_t)outline->columns + i;
    const float *above = at + outline->columns;
    return (1 - t) * ((1 - s) * (double)at[0] + s * (double)at[1]) +
           t * ((1 - s) * (double)above[0] + s * (double)above[1]);
}

/* [m] Depth of the deepest point of a sole. */
static double sole_deepest(int f) {
    const WebSole *sole = &web.file->sole[f];
    const double *p = web.input.position[f], *R = web.input.rotation[f];
    double deepest = 0;
    for (int i = 0; i < sole->points; i++) {
        const double *at = sole->outline + 2 * i;
        const double x = p[0] + R[0] * at[0] + R[1] * at[1] + R[2] * sole->z;
        const double y = p[1] + R[3] * at[0] + R[4] * at[1] + R[5] * sole->z;
        const double z = p[2] + R[6] * at[0] + R[7] * at[1] + R[8] * sole->z;
        deepest = fmax(deepest, mild_terrain_height_at(&web.terrain, x, y) - z);
    }
    return deepest;
}

/* [m] Depth of the surface under a sole, and on the slope around it, at a cell. most: of the sole,
 * whose plane goes on beyond it. */
static double sole_depth(int f, double most, double x, double y, double *stays) {
    const double *p = web.input.position[f], *R = web.input.rotation[f];
    const double dx = x - p[0], dy = y - p[1];
    const double dz = (mild_sole_z(web.sole[f]) - R[2] * dx - R[5] * dy) / R[8];
    const double depth = fmin(mild_terrain_height_at(&web.terrain, x, y) - p[2] - dz, most);
    if (depth <= 0) {
        return 0;
    }
    const double away = outline_distance(&web.outline[f], R[0] * dx + R[3] * dy + R[6] * dz,
                                         R[1] * dx + R[4] * dy + R[7] * dz);
    const double recovery = material_at(x, y)->recovery;
    const double slope = SLOPE_SAND + recovery * (SLOPE_FOAM - SLOPE_SAND);
    const double width = fmin(SLOPE_LEAST + depth * slope, 0.9 * OUTLINE_MARGIN);
    const double share = fmin(fmax(1 - away / width, 0), 1);
    *stays = 1 - recovery;
    return share > 0 ? (depth + UNDER_SOLE) * share * share : 0;
}

/* Draws the soles in a box of cells. most: [feet] [m] their depths. */
static void press_cells(const int box[4], const double *most) {
    const double cell = window_cell();
    for (int j = box[2]; j < box[3]; j++) {
        for (int i = box[0]; i < box[1]; i++) {
            const size_t at = window_at(i, j);
            double deepest = 0, stays = 0;
            for (int f = 0; f < web.feet; f++) {
                const double x = (i + 0.5) * cell, y = (j + 0.5) * cell;
                deepest = fmax(deepest, most[f] > 0 ? sole_depth(f, most[f], x, y, &stays) : 0);
            }
            web.kept[at] = fmaxf(web.kept[at], (float)(deepest * stays));
            const float depth = fmaxf(web.kept[at], (float)deepest);
            if (fabsf(depth - web.shown[at]) > WINDOW_LEAST || deepest == 0) {
                web.shown[at] = depth;
            }
        }
    }
    mark_cells(box[0], box[1], box[2], box[3]);
}

static void show_ground(void) {
    const double cell = window_cell();
    double most[ROBOT_FEET_MAX];
    follow();
    for (int f = 0; f < web.feet; f++) {
        most[f] = sole_deepest(f);
    }
    for (int f = 0; f < web.feet && !web.trial.rigid; f++) {
        const double *p = web.input.position[f], *R = web.input.rotation[f];
        const Outline *outline = &web.outline[f];
        const double reach = 0.5 * OUTLINE_STEP * outline->columns, x = outline->x + reach;
        const int box[4] = {(int)floor((p[0] + R[0] * x - reach) / cell),
                            (int)ceil((p[0] + R[0] * x + reach) / cell),
                            (int)floor((p[1] + R[3] * x - reach) / cell),
                            (int)ceil((p[1] + R[3] * x + reach) / cell)};
        if (R[8] > 0.3) { /* not on its side */
            press_cells(box, most);
        }
    }
}

/* [m] From a point to the polygon, negative inside. */
static double polygon_distance(const WebSole *sole, double x, double y) {
    double least = OUTLINE_MARGIN * OUTLINE_MARGIN;
    int inside = 0;
    for (int i = 0; i < sole->points; i++) {
        const double *a = sole->outline + 2 * i;
        const double *b = sole->outline + 2 * ((i + 1) % sole->points);
        const double ex = b[0] - a[0], ey = b[1] - a[1];
        const double along = ((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey);
        const double share = fmin(fmax(along, 0), 1);
        const double dx = x - a[0] - share * ex, dy = y - a[1] - share * ey;
        least = fmin(least, dx * dx + dy * dy);
        if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / ey * ex) {
            inside = !inside;
        }
    }
    return inside ? -sqrt(least) : sqrt(least);
}

static int open_outline(const WebSole *sole, Outline *outline) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (int i = 0; i < 2 * sole->points; i++) {
        low[i % 2] = fmin(low[i % 2], sole->outline[i]);
        high[i % 2] = fmax(high[i % 2], sole->outline[i]);
    }
    outline->x = low[0] - OUTLINE_MARGIN;
    outline->y = low[1] - OUTLINE_MARGIN;
    outline->columns = (int)ceil((high[0] - low[0] + 2 * OUTLINE_MARGIN) / OUTLINE_STEP) + 1;
    outline->rows = (int)ceil((high[1] - low[1] + 2 * OUTLINE_MARGIN) / OUTLINE_STEP) + 1;
    const int nodes = outline->columns * outline->rows;
    outline->distance = malloc((size_t)nodes * sizeof *outline->distance);
    for (int n = 0; n < nodes && outline->distance; n++) {
        const double x = outline->x + OUTLINE_STEP * (n % outline->columns);
        const double y = outline->y + OUTLINE_STEP * (n / outline->columns);
        outline->distance[n] = (float)polygon_distance(sole, x, y);
    }
    return outline->distance != NULL;
}

/* ---- physics ---- */

static void widen(const float *from, int count, double *to) {
    for (int i = 0; i < count; i++) {
        to[i] = (double)from[i];
    }
}

/* From the engine's feet to the ground. */
static void give_feet(void) {
    const EnvsContact *contact = &web.all.contact;
    const int feet = web.feet;
    MildContactInput *input = &web.input;
    widen(contact->position, 3 * feet, input->position[0]);
    widen(contact->rotation, 9 * feet, input->rotation[0]);
    widen(contact->velocity, 6 * feet, input->velocity[0]);
    widen(contact->inverse_inertia, 36 * feet * feet, input->inverse_inertia);
    widen(contact->free_velocity, 6 * feet, input->free_velocity);
}

static void solve_ground(void) {
    mild_ground_solve(web.ground, &web.terrain, &web.input, web.scratch, &web.result);
    mild_ground_advance(web.ground, &web.terrain, &web.input, web.scratch, &web.result);
}

/* And back, as mild_batch_step. */
static void take_feet(void) {
    const EnvsContact *contact = &web.all.contact;
    for (int f = 0; f < web.feet; f++) {
        const MildFootResult *foot = &web.result.foot[f];
        for (int k = 0; k < 3; k++) {
            contact->velocity[6 * f + k] = (float)foot->force[k];
            contact->velocity[6 * f + 3 + k] = (float)foot->torque[k];
        }
        contact->foot[f].depth_mean = (float)foot->depth_mean;
    }
}

/* Lets the ground forget the feet, but not their prints. */
static void lift_feet(void) {
    static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    MildContactInput *input = &web.input;
    memset(input, 0, sizeof *input);
    input->feet = web.feet;
    input->inverse_inertia = web.inverse_inertia;
    input->dt = web.task.task.physics_dt;
    input->tolerance = web.task.task.contact_tolerance;
    input->max_iterations = web.task.task.contact_iterations;
    for (int f = 0; f < web.feet; f++) {
        input->position[f][2] = FOOT_FAR;
        memcpy(input->rotation[f], level, sizeof level);
    }
    solve_ground();
}

int web_move(const float *action, const float command[3]) {
    TaskEnv *env = web_env();
    const int steps = env_physics_steps(&web.task);
    const TaskView view = {.history = web.history};
    memcpy(env->command, command, sizeof env->command);
    web.call.action = action;
    for (int k = 0; k <= steps; k++) {
        if (k > 0 && !web.trial.rigid) {
            give_feet();
            solve_ground();
            take_feet();
        }
        env_part(&web.all, &web.call, 0, k, 0, 0, web.env_scratch);
    }
    const TaskStep step = task_end_step(env, &web.task.task, &web.task.robot, &web.robot->reading,
                                        env->torque, web.robot->diverged);
    task_observe(env, &web.task.task, &web.task.robot, &web.robot->reading, NULL,
                 &web.robot->sensors, 0, &view);
    return step.done;
}

int web_step(float vx, float vy, float wz) {
    const float command[3] = {vx, vy, wz};
    float action[ROBOT_JOINTS_MAX];
    web_act(web.history, action);
    const int fallen = web_move(action, command);
    show_links();
    for (int f = 0; f < web.feet; f++) {
        show_foot(f);
    }
    show_ground();
    return fallen;
}

/* ---- where it walks ---- */

void web_change(double stiffness, double friction) {
    web.stiffness = stiffness;
    web.friction = friction;
    for (int m = 0; m < web.terrain.material_count; m++) {
        MildMaterial *material = &web.terrain.materials[m];
        *material = web.plain[m];
        material->k_pen *= stiffness;
        material->sigma_cone *= stiffness;
        material->mu *= friction;
    }
    web_env()->variation.rigid_friction = REAL(TASK_RIGID_FRICTION * friction);
}

/* Stands the robot up at a place [m, m, rad]. Its sensors' noise goes on. */
static void stand_up(double x, double y, double yaw) {
    TaskEnv *env = web_env();
    const double load = web.task.robot.total_mass * web.file->gravity / web.feet;
    memset(env->command, 0, sizeof env->command);
    env->command_frozen = 1;
    web.drawn.depth = mild_sole_sinkage(web.sole[0], material_at(x, y), load);
    env_begin(&web.all, 0);
    env->step_limit = UINT32_MAX;
    env->robot.qpos[0] = (float)x;
    env->robot.qpos[1] = (float)y;
    env->robot.qpos[3] = (float)cos(0.5 * yaw);
    env->robot.qpos[6] = (float)sin(0.5 * yaw);
    env_pose(&web.all, 0, web.env_scratch);
    env_observe(&web.all, &web.call, 0);
    web_change(web.stiffness, web.friction);
    lift_feet();
    show_links();
}

void web_again(void) {
    const float *at = web_env()->robot.qpos;
    stand_up((double)at[0], (double)at[1], (double)web.view.yaw);
    show_ground();
}

static MildMapDef map_of(int ground, int relief) {
    MildMapDef def = mild_map_def_default();
    def.kind = relief == WEB_WAVES   ? MILD_MAP_WAVES
               : relief == WEB_ROUGH ? MILD_MAP_ROUGH
                                     : MILD_MAP_FLAT;
    def.wavelength = relief == WEB_WAVES ? 2.0 : 1.0;
    def.amplitude = relief == WEB_WAVES ? 0.06 : 0.04;
    if (ground == WEB_STRIPES) {
        def.patches = MILD_PATTERN_STRIPES;
        def.patch_size = WEB_STRIPE;
        def.patch_count = mild_material_preset_count();
    }
    return def;
}

/* Gives the terrain its materials and its map. */
static const char *lay(int ground, int relief) {
    static MildError error;
    const MildMapDef def = map_of(ground, relief);
    MildMap *map = mild_map_create(&def, &error);
    const int presets = mild_material_preset_count(), all = ground == WEB_STRIPES;
    if (!map) {
        return error.text;
    }
    mild_map_destroy(web.map);
    web.map = map;
    web.terrain = (MildTerrain){.material_count = all ? presets : 1};
    for (int m = 0; m < web.terrain.material_count; m++) {
        const int preset = all ? m : ground < presets ? ground : 0;
        mild_material_preset(mild_material_preset_name(preset), &web.plain[m]);
        web.terrain.materials[m] = web.plain[m];
    }
    mild_terrain_set_map(&web.terrain, map, NULL);
    web.task.has_map = web.task.uneven = !mild_map_is_level(map);
    web.task.map = map_view(map);
    web.trial.rigid = ground == WEB_RIGID;
    web.view.period = (float)(relief == WEB_WAVES ? def.wavelength : def.size);
    return NULL;
}

static void show_hills(void) {
    const double step = (double)web.view.period / WEB_HILLS;
    for (int n = 0; n < WEB_HILLS * WEB_HILLS; n++) {
        const double x = (n % WEB_HILLS + 0.5) * step, y = (n / WEB_HILLS + 0.5) * step;
        web.hills[n] = (float)mild_terrain_height_at(&web.terrain, x, y);
    }
}

const char *web_start(int ground, int relief, int prints) {
    if (!web.file) {
        return "web_open comes first";
    }
    if (ground < 0 || ground > WEB_STRIPES || relief < 0 || relief >= WEB_RELIEFS) {
        return "no such ground";
    }
    const MildSole *const *soles = (const MildSole *const *)web.sole;
    const int tiles = prints ? WEB_TILES : 0;
    void *block = aligned_alloc(64, mild_ground_bytes_imprints(soles, web.feet, tiles));
    if (!block) {
        return "out of memory";
    }
    const char *wrong = lay(ground, relief);
    if (wrong) {
        free(block);
        return wrong;
    }
    free(web.ground);
    web.ground = mild_ground_init_imprints(block, soles, web.feet, tiles);
    show_hills();
    stand_up(ground == WEB_STRIPES ? WEB_STRIPE / 2 : 0, 0, 0);
    memset(web.shown, 0, 2 * sizeof *web.shown * WEB_WINDOW * WEB_WINDOW);
    web.window[0] = web.window[1] = -WEB_WINDOW / 2;
    web.view.dirty_count = -1;
    return NULL;
}

/* ---- the file ---- */

static int output_of(const WebNetwork *network) {
    return network->width[network->layers];
}

/* Bool: each network takes what web_act gives it, and web_act has room for it. */
static int policy_fits(const WebModel *file) {
    const WebPolicy *policy = &file->policy;
    const int estimates = policy->estimates, latent = policy->latent;
    return estimates >= 0 && latent >= 0 && output_of(&policy->encoder) <= HEADS_MAX &&
           output_of(&policy->encoder) == estimates + 2 * latent &&
           policy->encoder.width[0] == file->shape.history &&
           file->shape.history <= TASK_HISTORY_MAX &&
           file->shape.observation <= TASK_OBSERVATION_MAX && policy->feet_velocity >= 0 &&
           policy->feet_velocity + policy->modulation.width[0] <= estimates &&
           output_of(&policy->modulation) == (policy->per_dimension ? 2 * latent : 2) &&
           policy->actor.width[0] == file->shape.observation + estimates + latent &&
           output_of(&policy->actor) == file->shape.actions;
}

static const char *check_file(const WebModel *file, size_t bytes) {
    if (bytes < sizeof *file || memcmp(file->magic, WEB_MAGIC, sizeof file->magic) != 0) {
        return "not a robot for this page";
    }
    if (file->bytes != (int32_t)sizeof *file ||
        bytes < sizeof *file + (size_t)file->weights * sizeof(uint16_t)) {
        return "a robot of another build, or cut short; build the page again";
    }
    const WebPolicy *policy = &file->policy;
    const long encoder = network_numbers(&policy->encoder);
    const long modulation = network_numbers(&policy->modulation);
    const long actor = network_numbers(&policy->actor);
    if (encoder < 0 || modulation < 0 || actor < 0 ||
        encoder + modulation + actor != file->weights || !policy_fits(file)) {
        return "its policy does not fit together";
    }
    return NULL;
}

static int widest(const WebNetwork *network, int least) {
    for (int l = 0; l <= network->layers; l++) {
        least = network->width[l] > least ? network->width[l] : least;
    }
    return least;
}

static int open_policy(const WebModel *file) {
    const uint16_t *half = (const uint16_t *)(const void *)(file + 1);
    const WebPolicy *policy = &file->policy;
    const int wide =
        widest(&policy->actor, widest(&policy->modulation, widest(&policy->encoder, 0)));
    web.weight = malloc((size_t)file->weights * sizeof *web.weight);
    web.wide[0] = malloc((size_t)wide * sizeof(float));
    web.wide[1] = malloc((size_t)wide * sizeof(float));
    for (int32_t i = 0; i < file->weights && web.weight; i++) {
        web.weight[i] = frame_unpack(half[i]);
    }
    return web.weight && web.wide[0] && web.wide[1];
}

static int open_soles(const WebModel *file) {
    WebView *view = &web.view;
    web.feet = file->model.tree.feet;
    for (int f = 0; f < web.feet; f++) {
        const WebSole *sole = &file->sole[f];
        const MildSoleDef def = {sole->outline, sole->points, sole->pitch, sole->z, sole->elements};
        web.sole[f] = mild_sole_create(&def, NULL);
        if (!web.sole[f] || !open_outline(sole, &web.outline[f])) {
            return 0;
        }
        view->elements = mild_sole_elements(web.sole[f]);
        for (int e = 0; e < view->elements; e++) {
            view->x[f][e] = (float)mild_sole_x(web.sole[f])[e];
            view->y[f][e] = (float)mild_sole_y(web.sole[f])[e];
        }
    }
    view->bytes = (int32_t)sizeof *view;
    view->pitch = (float)mild_sole_pitch(web.sole[0]);
    view->cell = (float)window_cell();
    web.scratch = mild_scratch_create((const MildSole *const *)web.sole, web.feet, NULL);
    return web.scratch != NULL;
}

/* The arrays of one environment; all 0. */
static int open_arrays(void) {
    EnvsArrays *all = &web.all;
    EnvsContact *contact = &all->contact;
    const size_t feet = (size_t)web.feet, labels = MILD_MATERIALS_MAX;
    all->envs = 1;
    all->stride = env_stride(&web.task.task, &web.task.shape);
    all->env = calloc(1, all->stride);
    web.robot = aligned_alloc(16, (sizeof *web.robot + 15) / 16 * 16);
    all->robot = (char *)web.robot;
    web.env_scratch = aligned_alloc(16, (sizeof *web.env_scratch + 15) / 16 * 16);
    all->material = calloc(labels, sizeof *all->material);
    all->map_origin = calloc(2, sizeof *all->map_origin);
    all->reset = calloc(2, 1);
    all->rigid = all->reset ? all->reset + 1 : NULL;
    float *block = contact->position =
        calloc((3 + 9 + 6 + 6) * feet + 36 * feet * feet + 1, sizeof *block);
    contact->foot = calloc(feet, sizeof *contact->foot);
    web.shown = calloc(2 * (size_t)WEB_WINDOW * WEB_WINDOW, sizeof *web.shown);
    web.hills = calloc((size_t)WEB_HILLS * WEB_HILLS, sizeof *web.hills);
    if (!all->env || !web.robot || !web.env_scratch || !all->material || !all->map_origin ||
        !all->reset || !contact->position || !contact->foot || !web.shown || !web.hills) {
        return 0;
    }
    memset(web.env_scratch, 0, sizeof *web.env_scratch);
    web.kept = web.shown + (size_t)WEB_WINDOW * WEB_WINDOW;
    contact->rotation = block + 3 * feet;
    contact->velocity = contact->rotation + 9 * feet;
    contact->free_velocity = contact->velocity + 6 * feet;
    contact->inverse_inertia = contact->free_velocity + 6 * feet;
    contact->height = contact->inverse_inertia + 36 * feet * feet;
    return 1;
}

static void close_all(void) {
    for (int f = 0; f < ROBOT_FEET_MAX; f++) {
        mild_sole_destroy(web.sole[f]);
        free(web.outline[f].distance);
    }
    mild_scratch_destroy(web.scratch);
    mild_map_destroy(web.map);
    void *const blocks[] = {web.weight,
                            web.wide[0],
                            web.wide[1],
                            web.all.env,
                            web.robot,
                            web.env_scratch,
                            web.all.material,
                            web.all.map_origin,
                            web.all.reset,
                            web.all.contact.position,
                            web.all.contact.foot,
                            web.shown,
                            web.hills,
                            web.ground};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
        free(blocks[i]);
    }
    memset(&web, 0, sizeof web);
}

const char *web_open(const WebModel *file, size_t bytes) {
    const char *wrong = check_file(file, bytes);
    if (wrong) {
        return wrong;
    }
    EnvsTask *task = &web.task;
    close_all();
    memcpy(&task->task, file->task, sizeof file->task);
    task->robot = file->robot;
    task->shape = file->shape;
    task->gains = file->gains;
    task->seed = SEED;
    task->ground = &web.drawn;
    task->grounds = task->labels = 1;
    web.stiffness = web.friction = 1;
    if (!open_policy(file) || !open_soles(file) || !open_arrays()) {
        return "out of memory, or a sole without elements";
    }
    web.file = file;
    web.all.task = task;
    web.all.model = &file->model;
    web.all.trial = &web.trial;
    web.call.next.history = web.history;
    env_create(&web.all, 0);
    return NULL;
}

WebView *web_view(void) {
    return &web.view;
}

const int32_t *web_picture(void) {
    return &web.file->geoms;
}

const float *web_history(void) {
    return web.history;
}

const float *web_window(void) {
    return web.shown;
}

const float *web_hills(void) {
    return web.hills;
}
