/* One robot of the batch engine (env/batch_step.h) on the ground of mild/ground.h, whose solver
 * is much faster on one processor than the batch's and which remembers prints. */
#define MILD_REAL_FLOAT

#include "env/batch_step.h"

#include <stdlib.h>

#include "ground/soil/soil.h"
#include "ground/terrain/terrain.h"
#include "learn/vector.h"
#include "web/core.h"

#define SEED 1
#define FOOT_FAR 100.0 /* [m] above the ground: nothing touches */
#define HEADS_MAX 512  /* numbers that the encoder gives */
#define CLOCK 2        /* last numbers of a frame */
/* Feet, then bodies with shells: who stands on the ground. */
#define STANDING_MAX (ROBOT_FEET_MAX + ENGINE_BODIES_MAX)

_Static_assert(offsetof(WebModel, task) % 8 == 0, "as TaskDef");
_Static_assert(STANDING_MAX <= MILD_FEET_MAX, "the ground has a place for all");
_Static_assert(3 * BELIEF_PARAMETERS == sizeof((WebView *)0)->known / sizeof(float),
               "WebView.known");
_Static_assert(offsetof(WebModel, geom) - offsetof(WebModel, geoms) == 4, "as web_picture says");

static struct {
    const WebModel *file;
    /* the policy */
    float *weight;
    float *wide[2]; /* [widest layer] */
    float estimate[HEADS_MAX];
    SpeedHold hold;
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
    int standing; /* feet and bodies with shells */
    MildSole *sole[STANDING_MAX];
    MildScratch *scratch;
    MildGround *ground;
    MildMap *map;
    MildTerrain terrain;
    MildMaterial plain[MILD_MATERIALS_MAX]; /* before web_change */
    double stiffness;                       /* [-] factors of web_change */
    double friction;
    MildContactInput input;
    double inverse_inertia[36 * STANDING_MAX * STANDING_MAX]; /* of the input */
    MildContactResult result;
    EngineSavedLinks links; /* while shells are near the ground, as `shells` */
    EngineShells shells;
    /* shells on rigid ground */
    EnvShells down;
    EnvFloorWork floor;
    BodiesSetup setup; /* its gradient alone */
    uint16_t near;
    uint8_t held;
    /* what the robot knows of it */
    Belief belief;
    /* the picture */
    WebView view;
    WindowScene scene;
    float *hills;
} web;

/* The soil of web_soil, which stays where another robot comes. */
static struct {
    char text[WEB_TEXT];
    MildMaterial material;
    int known; /* bool */
} soil;

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
    const int feet = estimates - policy->feet_velocity;
    const float *frame = history + web.file->shape.history - observation;
    float head[HEADS_MAX], theta[HEADS_MAX], input[TASK_OBSERVATION_MAX + HEADS_MAX];
    const float *weight = apply(&policy->encoder, web.weight, history, head);
    memcpy(input, head + policy->feet_velocity, (size_t)feet * sizeof *input);
    memcpy(input + feet, frame + observation - CLOCK, CLOCK * sizeof *input);
    weight = apply(&policy->modulation, weight, input, theta);
    memcpy(input, frame, (size_t)observation * sizeof *input);
    memcpy(input + observation, head, (size_t)estimates * sizeof *input);
    memcpy(web.estimate, head, (size_t)estimates * sizeof *head);
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
    view->load[f] = env_reading(web.robot)->foot[f].force[2];
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

/* ---- physics ---- */

static void widen(const float *from, int count, double *to) {
    for (int i = 0; i < count; i++) {
        to[i] = (double)from[i];
    }
}

/* A number of the feet's A, of which env_export gives the lower triangle. */
static Real feet_inertia(int row, int column) {
    const int low = row > column ? column : row;
    return web.all.contact.inverse_inertia[contact_triangle(row + column - low, low)];
}

/* From the engine's feet to the ground. */
static void give_feet(void) {
    const EnvsContact *contact = &web.all.contact;
    const int feet = web.feet;
    MildContactInput *input = &web.input;
    widen(contact->position, 3 * feet, input->position[0]);
    widen(contact->rotation, 9 * feet, input->rotation[0]);
    widen(contact->velocity, 6 * feet, input->velocity[0]);
    for (int n = 0; n < 36 * feet * feet; n++) {
        input->inverse_inertia[n] = (double)feet_inertia(n / (6 * feet), n % (6 * feet));
    }
    widen(contact->free_velocity, 6 * feet, input->free_velocity);
}

/* Where the bodies with shells are, and their numbers, if they may touch the ground: choose_rows of
 * robot/sim.c. */
static void find_shells(void) {
    const EngineModel *model = &web.file->model;
    const EngineWork *work = &web.env_scratch->work;
    const EngineLinks links = engine_links_of(work);
    MildContactInput *input = &web.input;
    web.shells.count = 0;
    input->rows = (1u << web.feet) - 1;
    if (web.standing == web.feet) {
        return;
    }
    for (int b = 0; b < web.standing - web.feet; b++) {
        const int at = web.feet + b;
        Real position[3], rotation[9], twist[6];
        engine_body_pose(model, &links, b, position, rotation);
        engine_body_twist(&model->tree, &links, work->rate, b, position, twist);
        for (int k = 0; k < 3; k++) {
            position[k] += work->base[k];
        }
        widen(position, 3, input->position[at]);
        widen(rotation, 9, input->rotation[at]);
        widen(twist, 6, input->velocity[at]);
        widen(twist, 6, input->free_velocity + 6 * at);
    }
    const uint32_t near = mild_ground_near(&web.terrain, input, web.scratch);
    for (int b = 0; b < web.standing - web.feet; b++) {
        if (near >> (web.feet + b) & 1) {
            input->rows |= 1u << (web.feet + b);
            web.shells.body[web.shells.count++] = b;
        }
    }
}

/* From the engine's bodies in web.shells to the ground, which then has the feet. */
static void give_shells(void) {
    const EngineModel *model = &web.file->model;
    const int feet = 6 * web.feet, rows = feet + 6 * web.shells.count;
    Real position[ENGINE_BODIES_MAX][3], rotation[ENGINE_BODIES_MAX][9];
    Real velocity[ENGINE_BODIES_MAX][6], free_velocity[6 * ENGINE_BODIES_MAX];
    Real inertia[36 * STANDING_MAX * STANDING_MAX];
    const EngineShellsGround ground = {position, rotation, velocity, free_velocity, inertia};
    for (int n = 0; n < feet * feet; n++) {
        inertia[n / feet * rows + n % feet] = feet_inertia(n / feet, n % feet);
    }
    engine_save_links(&model->tree, &web.env_scratch->work, &web.links);
    engine_shells_begin(model, &web.robot->saved, &web.links, &web.shells, &ground);
    widen(inertia, rows * rows, web.input.inverse_inertia);
    for (int i = 0; i < web.shells.count; i++) {
        const int at = web.feet + web.shells.body[i];
        widen(free_velocity + 6 * i, 6, web.input.free_velocity + 6 * at);
    }
}

static void solve_ground(void) {
    mild_ground_solve(web.ground, &web.terrain, &web.input, web.scratch, &web.result);
    mild_ground_advance(web.ground, &web.terrain, &web.input, web.scratch, &web.result);
}

static void take_wrench(const MildFootResult *from, Real *wrench) {
    for (int k = 0; k < 3; k++) {
        wrench[k] = (Real)from->force[k];
        wrench[3 + k] = (Real)from->torque[k];
    }
}

/* And back, as mild_batch_step and env_shells_results. */
static void take_wrenches(void) {
    const EnvsContact *contact = &web.all.contact;
    Real wrench[6 * ENGINE_BODIES_MAX];
    for (int f = 0; f < web.feet; f++) {
        take_wrench(&web.result.foot[f], contact->velocity + 6 * f);
        contact->foot[f].depth_mean = (float)web.result.foot[f].depth_mean;
    }
    web.view.shell_load = 0;
    for (int i = 0; i < web.shells.count; i++) {
        take_wrench(&web.result.foot[web.feet + web.shells.body[i]], wrench + 6 * i);
        web.view.shell_load += wrench[6 * i + 2];
    }
    if (web.shells.count > 0) {
        engine_shells_end(&web.file->model.tree, &web.shells, wrench, &web.robot->saved);
    }
}

/* The ground's part of a physics step. */
static void stand_on_ground(void) {
    give_feet();
    find_shells();
    if (web.shells.count > 0) {
        give_shells();
    }
    solve_ground();
    take_wrenches();
}

/* The same on rigid ground, of shells alone: env_part does the feet. */
static void stand_on_floor(int k) {
    if (env_shells_wait(&web.all, 0) && env_shells_follow(&web.all, 0, k)) {
        env_floor_step(&web.all, 0, &web.floor);
    }
    web.view.shell_load = (float)web.down.load;
}

/* Lets the ground forget feet and shells, but not their prints. */
static void lift_feet(void) {
    static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    MildContactInput *input = &web.input;
    memset(input, 0, sizeof *input);
    input->feet = web.standing;
    input->rows = (1u << web.feet) - 1;
    input->inverse_inertia = web.inverse_inertia;
    input->dt = web.task.task.physics_dt;
    input->tolerance = web.task.task.contact_tolerance;
    input->max_iterations = web.task.task.contact_iterations;
    for (int f = 0; f < web.standing; f++) {
        input->position[f][2] = FOOT_FAR;
        memcpy(input->rotation[f], level, sizeof level);
    }
    web.shells.count = 0;
    web.view.shell_load = 0;
    web.near = 0;
    solve_ground();
}

int web_move(const float *action, const float command[TASK_COMMANDS]) {
    TaskEnv *env = web_env();
    const int steps = env_physics_steps(&web.task);
    const EnvsView view = {.history = web.history};
    const int floor = web.trial.rigid && web.standing > web.feet;
    memcpy(env->command, command, sizeof env->command);
    web.call.action = action;
    for (int k = 0; k <= steps; k++) {
        if (k > 0 && !web.trial.rigid) {
            stand_on_ground();
        } else if (k > 0 && floor) {
            stand_on_floor(k - 1);
        }
        env_part(&web.all, &web.call, 0, k, 0, floor, web.env_scratch);
    }
    const TaskStep step = task_end_step(env, &web.task.task, &web.task.robot,
                                        env_reading(web.robot), env->torque, web.robot->diverged);
    task_observe(env, &web.task.task, &web.task.robot, env_reading(web.robot), NULL,
                 &web.robot->sensors, 0, &view);
    return step.done ? step.cause : TASK_END_time;
}

void web_show(void) {
    const Real *base = web.env_scratch->work.base;
    show_links();
    for (int f = 0; f < web.feet; f++) {
        show_foot(f);
    }
    web.scene.ground = web.ground;
    window_show(&web.scene, (double)base[0], (double)base[1], web.trial.rigid, &web.view);
}

/* The newest frame of the history; and what it says about the ground. */
static const float *look_at_ground(void) {
    const WebModel *file = web.file;
    const float *frame = web.history + file->shape.history - file->shape.observation;
    WebView *view = &web.view;
    if (!file->knows || !(belief_step(&web.belief, &file->belief, frame) & BELIEF_FOOTSTEP)) {
        return frame;
    }
    view->footsteps = (float)web.belief.footsteps;
    view->alarms = (float)web.belief.alarms;
    for (int i = 0; i < 3 * BELIEF_PARAMETERS; i++) {
        const double share[3] = {0.05, 0.5, 0.95};
        view->known[i] = (float)(belief_names[i / 3].scale *
                                 belief_quantile(&web.belief, &file->belief,
                                                 (BeliefParameter)(i / 3), share[i % 3]));
    }
    return frame;
}

int web_step(float vx, float vy, float wz, float rise) {
    const float *frame = look_at_ground();
    double held[] = {(double)vx, (double)vy, (double)wz};
    float action[ROBOT_JOINTS_MAX];
    web_act(web.history, action);
    speed_hold(&web.hold, &web.file->hold, frame, web.estimate, held);
    const float command[TASK_COMMANDS] = {(float)held[0], (float)held[1], (float)held[2], rise};
    const int end = web_move(action, command);
    web_show();
    return end;
}

/* ---- where it walks ---- */

void web_change(double stiffness, double friction) {
    const MildTerrain before = web.terrain;
    web.stiffness = stiffness;
    web.friction = friction;
    for (int m = 0; m < web.terrain.material_count; m++) {
        MildMaterial *material = &web.terrain.materials[m];
        *material = web.plain[m];
        material->k_pen *= stiffness;
        material->sigma_cone *= stiffness;
        material->k_c *= stiffness;
        material->k_phi *= stiffness;
        material->zeta *= stiffness;
        material->mu *= friction;
    }
    mild_ground_change(web.ground, &before, &web.terrain, web.scratch);
    web_env()->variation.rigid_friction = REAL(TASK_RIGID_FRICTION * friction);
}

static const MildMaterial *material_at(double x, double y) {
    return &web.terrain.materials[mild_terrain_material_at(&web.terrain, x, y)];
}

/* Stands the robot up at a place [m, m, rad]. Its sensors' noise goes on. */
static void stand_up(double x, double y, double yaw) {
    TaskEnv *env = web_env();
    belief_reset(&web.belief);
    web.view.footsteps = web.view.alarms = 0;
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
    web_show();
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
        def.patch_count = WEB_PRESETS;
    }
    return def;
}

/* Gives the terrain its materials and its map. */
static const char *lay(int ground, int relief) {
    static MildError error;
    const MildMapDef def = map_of(ground, relief);
    MildMap *map = mild_map_create(&def, &error);
    const int all = ground == WEB_STRIPES;
    if (!map) {
        return error.text;
    }
    mild_map_destroy(web.map);
    web.map = map;
    web.terrain = (MildTerrain){.material_count = all ? WEB_PRESETS : 1};
    for (int m = 0; m < web.terrain.material_count; m++) {
        const int preset = all ? m : ground < WEB_PRESETS ? ground : 0;
        mild_material_preset(mild_material_preset_name(preset), &web.plain[m]);
        if (ground == WEB_OWN) {
            web.plain[m] = soil.material;
        }
        web.terrain.materials[m] = web.plain[m];
    }
    mild_terrain_set_map(&web.terrain, map, NULL);
    web.task.has_map = web.task.uneven = !mild_map_is_level(map);
    web.task.map = map_view(map);
    web.trial.rigid = ground == WEB_RIGID;
    web.setup.steepest = (Real)terrain_steepest(&web.terrain);
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

char *web_text(void) {
    return soil.text;
}

const char *web_soil(void) {
    static MildError error;
    MildMaterial material;
    soil.text[WEB_TEXT - 1] = '\0';
    if (soil_parse(soil.text, "soil.ini", &material, &error) != MILD_OK) {
        return error.text;
    }
    if (mild_model_is_concentric((MildModel)material.model)) {
        return "soil.ini: this page has soles of many elements; a model of one element has no "
               "place in it";
    }
    soil.material = material;
    soil.known = 1;
    return NULL;
}

const char *web_start(int ground, int relief, int prints) {
    if (!web.file) {
        return "web_open comes first";
    }
    if (ground == WEB_OWN && !soil.known) {
        return "web_soil comes first";
    }
    if (ground < 0 || ground > WEB_OWN || relief < 0 || relief >= WEB_RELIEFS) {
        return "no such ground";
    }
    const MildSole *const *soles = (const MildSole *const *)web.sole;
    const int tiles = prints ? WEB_TILES : 0;
    void *block = aligned_alloc(64, mild_ground_bytes_imprints(soles, web.standing, tiles));
    if (!block) {
        return "out of memory";
    }
    const char *wrong = lay(ground, relief);
    if (wrong) {
        free(block);
        return wrong;
    }
    free(web.ground);
    web.ground = mild_ground_init_imprints(block, soles, web.standing, tiles);
    show_hills();
    stand_up(ground == WEB_STRIPES ? WEB_STRIPE / 2 : 0, 0, 0);
    window_clear(&web.view);
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
           policy->feet_velocity <= estimates &&
           (policy->modulation.width[0] <= estimates - policy->feet_velocity ||
            policy->modulation.width[0] == estimates - policy->feet_velocity + CLOCK) &&
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

/* The sole that the shells of a body make. */
static MildSole *open_shell(const WebModel *file, int body) {
    MildShape shapes[ROBOT_SHELLS_MAX];
    MildSurfaceDef def = {shapes, 0, file->sole[0].pitch, file->shell_spacing};
    for (int s = 0; s < file->shells; s++) {
        const WebShell *shell = &file->shell[s];
        MildShape *shape = &shapes[def.count];
        if (shell->body == body) {
            *shape = (MildShape){.type = shell->type};
            memcpy(shape->size, shell->size, sizeof shape->size);
            memcpy(shape->pos, shell->pos, sizeof shape->pos);
            memcpy(shape->quat, shell->quat, sizeof shape->quat);
            def.count++;
        }
    }
    return mild_sole_surface(&def, NULL);
}

static int open_soles(const WebModel *file) {
    WebView *view = &web.view;
    web.feet = file->model.tree.feet;
    web.standing = web.feet + file->model.tree.bodies;
    for (int f = 0; f < web.feet; f++) {
        const WebSole *sole = &file->sole[f];
        const MildSoleDef def = {sole->outline, sole->points, sole->pitch, sole->z, sole->elements};
        web.sole[f] = mild_sole_create(&def, NULL);
        if (!web.sole[f]) {
            return 0;
        }
        view->elements = mild_sole_elements(web.sole[f]);
        if (view->elements > WEB_ELEMENTS_MAX ||
            view->elements != mild_sole_elements(web.sole[0])) {
            return 0;
        }
        for (int e = 0; e < view->elements; e++) {
            view->x[f][e] = (float)mild_sole_x(web.sole[f])[e];
            view->y[f][e] = (float)mild_sole_y(web.sole[f])[e];
        }
    }
    for (int b = web.feet; b < web.standing; b++) {
        web.sole[b] = open_shell(file, b - web.feet);
        if (!web.sole[b]) {
            return 0;
        }
    }
    view->bytes = (int32_t)sizeof *view;
    view->feet = web.feet;
    view->knows = file->knows;
    view->pitch = (float)mild_sole_pitch(web.sole[0]);
    web.scratch = mild_scratch_create((const MildSole *const *)web.sole, web.standing, NULL);
    return web.scratch != NULL;
}

static int open_window(const WebModel *file) {
    web.scene = (WindowScene){.feet = web.feet,
                              .standing = web.standing,
                              .outline = file->sole,
                              .sole = web.sole,
                              .terrain = &web.terrain,
                              .input = &web.input,
                              .scratch = web.scratch,
                              .cell = 0.5 * mild_sole_pitch(web.sole[0])}; /* as imprints have */
    web.view.cell = (float)web.scene.cell;
    return window_open(&web.scene);
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
    const size_t triangle = (size_t)contact_triangle(6 * (int)feet, 0); /* A */
    float *block = contact->position = calloc((3 + 9 + 6 + 6) * feet + triangle + 1, sizeof *block);
    contact->foot = calloc(feet, sizeof *contact->foot);
    web.hills = calloc((size_t)WEB_HILLS * WEB_HILLS, sizeof *web.hills);
    if (!all->env || !web.robot || !web.env_scratch || !all->material || !all->map_origin ||
        !all->reset || !contact->position || !contact->foot || !web.hills) {
        return 0;
    }
    memset(web.env_scratch, 0, sizeof *web.env_scratch);
    contact->rotation = block + 3 * feet;
    contact->velocity = contact->rotation + 9 * feet;
    contact->free_velocity = contact->velocity + 6 * feet;
    contact->inverse_inertia = contact->free_velocity + 6 * feet;
    contact->height = contact->inverse_inertia + triangle;
    all->shells.setup = &web.setup;
    all->shells.near = &web.near;
    all->shells.held = &web.held;
    all->shells.robot = (char *)&web.down;
    return 1;
}

static void close_all(void) {
    for (int b = 0; b < STANDING_MAX; b++) {
        mild_sole_destroy(web.sole[b]);
    }
    window_close();
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
    if (!open_policy(file) || !open_soles(file) || !open_window(file) || !open_arrays()) {
        return "out of memory, or soles without elements, or with too many";
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
    return window_depths();
}

const float *web_hills(void) {
    return web.hills;
}
