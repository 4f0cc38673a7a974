/* The ground of an episode on the CPU, and a collection of grounds to draw from. */
#include "env/task/ground.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "env/task/task.h"
#include "ground/law/models.h"
#include "ground/law/width.h"
#include "ground/soil/soil.h"

#define DRAW_TRIES 100 /* of a material that the model can match */
#define RANDOM_USE_GROUNDS 0x47524e44u
#define RANDOM_USE_DRIFT 0x44524654u
#define RANDOM_USE_SLIP 0x534c4950u
#define SLIP_RECOVERY 0.2 /* [-] ground that springs back by more has no grains that flow */

static double spread_of(Random *r, const RandomizeDef *def) {
    return 1 + task_spread(r, def->preset_jitter);
}

/* A preset, or a ground of randomize.presets, with its numbers changed a little. */
static MildMaterial draw_preset(Random *r, const TaskDef *task) {
    const RandomizeDef *def = &task->randomize;
    const TaskSoils *soils = task->soils;
    MildMaterial m = mild_material_default();
    if (soils) {
        m = soils->soil[random_index(r, (uint32_t)soils->count)];
    } else {
        mild_material_preset(
            mild_material_preset_name((int)random_index(r, (uint32_t)mild_material_preset_count())),
            &m);
    }
    const MildMaterial own = m;
    double *const jittered[] = {&m.k_pen, &m.sigma_cone, &m.mu,     &m.c_d,
                                &m.c_g,   &m.k_drift,    &m.b_drift};
    for (size_t i = 0; i < sizeof jittered / sizeof *jittered; i++) {
        *jittered[i] *= spread_of(r, def);
    }
    double *const others[] = {&m.k_c, &m.k_phi, &m.cohesion, &m.zeta};
    for (size_t i = 0; !model_is_cones(m.model) && i < sizeof others / sizeof *others; i++) {
        *others[i] *= spread_of(r, def);
    }
    if (own.k_c < 0) { /* one factor for both, or their sum might be below 0 under a sole */
        m.k_c = own.k_c * m.k_phi / own.k_phi;
    }
    return m;
}

/* Makes a ground that is too soft stiffer, so that half of the robot's feet carry it at
 * sinkage_max. One factor suffices, because the quasistatic force is linear in (k_pen, sigma_cone).
 * Without this, a fifth of the paper's draws would swallow the foot (docs/task.md section 11). */
static void limit_sinkage(MildMaterial *m, const Robot *robot, double sinkage) {
    const MildSole *sole = robot_rasters(robot)[0];
    MildMaterial bottomless = *m;
    bottomless.bed_depth = 1e3;
    double feet = 0.5 * robot_feet(robot); /* half of them are in stance */
    double wanted = robot_total_mass(robot) * 9.81 / feet / mild_sole_elements(sole);
    double force = mild_element_law(&bottomless, mild_sole_pitch(sole), sinkage).force;
    if (force < wanted && force > 0) {
        m->k_pen *= wanted / force;
        m->sigma_cone *= wanted / force;
    }
}

static MildMaterial draw_ranges(Random *r, const RandomizeDef *def, const Robot *robot) {
    MildMaterial m = mild_material_default();
    Random drift = *r; /* apart, so that it moves no other draw */
    drift.seed ^= RANDOM_USE_DRIFT;
    m.k_pen = task_draw(r, def->k_pen);
    m.sigma_cone = task_draw(r, def->sigma_cone);
    m.alpha = task_draw(r, def->alpha);
    m.nu = task_draw(r, def->nu);
    m.c_g = task_draw(r, def->c_g);
    m.c_d = task_draw(r, def->c_d);
    m.phi = task_draw(r, def->phi);
    m.mu = task_draw(r, def->mu);
    m.rho = task_draw(r, def->rho);
    m.k_drift = task_draw(&drift, def->k_drift);
    m.b_drift = task_draw(&drift, def->b_drift);
    m.recovery = task_draw(r, def->recovery);
    m.bed_depth = task_draw(r, def->bed_depth);
    limit_sinkage(&m, robot, def->sinkage_max);
    return m;
}

/* The law of a ground that was drawn. */
static int model_wanted(const RandomizeDef *def, const MildMaterial *m, int is_preset) {
    if (def->model != TASK_MODEL_OWN) {
        return def->model;
    }
    return is_preset || m->recovery > SLIP_RECOVERY ? m->model : MILD_MODEL_MILD_MERGED;
}

/* Slip costs support on a share of the grounds that stay dented. start: the draw before any of the
 * material's own, which this moves none of. */
static void draw_slip(const Random *start, const RandomizeDef *def, MildMaterial *m) {
    Random r = *start;
    r.seed ^= RANDOM_USE_SLIP;
    int slips = random_unit(&r) < def->slip_share;
    double length = task_draw(&r, def->slip_length);
    double grip = task_draw(&r, def->grip);
    if (slips && m->recovery <= SLIP_RECOVERY) {
        m->slip_length = length;
        m->slip_growth = 0;
        m->grip = grip;
    }
}

/* Draws a material for the model. If its match would be out of range (mild_model_match), another
 * one is drawn. */
static MildMaterial draw_new(Random *r, const TaskDef *task, const Robot *robot) {
    const RandomizeDef *def = &task->randomize;
    double preset = def->rigid_share < 1 ? def->preset_share / (1 - def->rigid_share) : 0;
    MildMaterial m, rival;
    const Random start = *r;
    for (int tries = 0; tries < DRAW_TRIES; tries++) {
        const int is_preset = random_unit(r) < preset;
        m = is_preset ? draw_preset(r, task) : draw_ranges(r, def, robot);
        m.passive = def->passive;
        if (def->model == MILD_MODEL_RIGID) {
            return m; /* the engine's contact does not use it */
        }
        if (!model_is_cones(m.model)) {
            return m; /* which has no match */
        }
        const int model = model_wanted(def, &m, is_preset);
        if (robot_match_model(robot, (MildModel)model, &m, &rival, NULL) == MILD_OK) {
            draw_slip(&start, def, &rival);
            return rival;
        }
    }
    m = mild_material_default();
    const int model = model_wanted(def, &m, 1);
    MildStatus status = robot_match_model(robot, (MildModel)model, &m, &rival, NULL);
    assert(status == MILD_OK);
    (void)status;
    return rival;
}

/* index: among the grounds that were drawn beforehand, or NULL. */
static MildMaterial draw_material(Random *r, const TaskDef *def, const Robot *robot, int *index) {
    const TaskGrounds *from = def->grounds;
    if (!from) {
        return draw_new(r, def, robot);
    }
    int at = (int)random_index(r, (uint32_t)from->count);
    if (index) {
        *index = at;
    }
    return from->ground[at].material;
}

/* Stripes across x around the start, three materials in random order. */
static void draw_stripes(Random *r, const TaskDef *task, const Robot *robot, MildTerrain *terrain) {
    const RandomizeDef *def = &task->randomize;
    while (terrain->material_count < 3) {
        terrain->materials[terrain->material_count++] = draw_material(r, task, robot, NULL);
    }
    double x = -0.5 * MILD_PATCHES_MAX * 0.5 * (def->patch_length[0] + def->patch_length[1]);
    for (int i = 0; i < MILD_PATCHES_MAX; i++) {
        double length = task_draw(r, def->patch_length);
        MildPatch patch;
        /* Clears the padding too, because environments are saved and compared byte by byte. */
        memset(&patch, 0, sizeof patch);
        patch.x_min = x;
        patch.x_max = x + length;
        patch.y_min = -1e3;
        patch.y_max = 1e3;
        patch.material = (int)random_index(r, 3);
        mild_terrain_add_patch(terrain, &patch, NULL);
        x += length;
    }
}

/* Starts somewhere on the map and draws a material for each of its labels. */
void task_draw_on_map(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r) {
    MildTerrain *terrain = &task_env_rest(env)->terrain;
    double x, y;
    mild_map_extent(def->map, &x, &y);
    terrain->map_x = task_spread(r, 0.5 * x);
    terrain->map_y = task_spread(r, 0.5 * y);
    while (terrain->material_count < mild_map_label_count(def->map)) {
        terrain->materials[terrain->material_count++] = draw_material(r, def, robot, NULL);
    }
}

void task_draw_ground(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r) {
    MildMaterial material = draw_material(r, def, robot, &env->ground[0]);
    MildTerrain *terrain = &task_env_rest(env)->terrain;
    *terrain = mild_terrain_uniform(&material);
    int striped = random_unit(r) < def->randomize.patch_share;
    if (striped && !(def->map && mild_map_label_count(def->map) > 1)) {
        draw_stripes(r, def, robot, terrain);
    }
}

/* Parameters of an element that represents a whole sole are converted to those of one of its
 * cells. */
void task_ground_numbers(const Robot *robot, const MildMaterial *m, float *numbers) {
    double cells = mild_model_is_concentric((MildModel)m->model)
                       ? mild_sole_elements(robot_rasters(robot)[0])
                       : 1;
    /* A floor is a hundred times as stiff as foam: beyond 4 all are firm. */
    const double values[TASK_GROUND_NUMBERS] = {fmin(m->k_pen / 500 / cells, 4),
                                                fmin(m->sigma_cone / 1e5, 4),
                                                m->alpha,
                                                m->nu,
                                                m->c_g / 4,
                                                m->c_d / 20,
                                                m->phi,
                                                m->mu,
                                                m->k_drift / 500 / cells,
                                                m->b_drift * 10 / cells,
                                                m->recovery,
                                                m->bed_depth * 10};
    for (int i = 0; i < TASK_GROUND_NUMBERS; i++) {
        numbers[i] = (float)values[i];
    }
}

double task_standing_depth(const Robot *robot, const MildMaterial *material) {
    return mild_sole_sinkage(robot_soles(robot)[0], material, robot_foot_load(robot));
}

static MildStatus soil_open(const TaskDef *def, const char *name, MildMaterial *soil,
                            MildError *error) {
    MildError cause = {0};
    const int model = def->randomize.model;
    MildStatus status = soil_find(name, soil, &cause);
    if (status != MILD_OK) {
        return mild_fail(error, status, "randomize.presets: %s", cause.text);
    }
    const int own = model == TASK_MODEL_OWN && !mild_model_is_concentric((MildModel)soil->model);
    if (own || model_is_cones(soil->model) || soil->model == model || model == MILD_MODEL_RIGID) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "randomize.presets: %.150s is a ground of %s; set randomize.model = %s", name,
                     mild_model_names[soil->model], mild_model_names[soil->model]);
}

/* A ground meets the feet of the robot. */
static MildStatus soil_meet(const char *name, const MildMaterial *soil, const Robot *robot,
                            MildError *error) {
    MildStatus status = MILD_OK;
    for (int f = 0; f < robot_feet(robot) && status == MILD_OK; f++) {
        MildError cause = {0};
        status = width_check(soil, mild_sole_width(robot_rasters(robot)[f]), &cause);
        if (status != MILD_OK) {
            mild_fail(error, status, "randomize.presets: %.150s: %s", name, cause.text);
        }
    }
    return status;
}

MildStatus task_soils_open(TaskDef *def, const Robot *robot, TaskSoils *soils, MildError *error) {
    char name[TASK_TEXT_SIZE];
    const char *rest = def->randomize.presets;
    MildStatus status = MILD_OK;
    soils->count = 0;
    def->soils = *rest ? soils : NULL;
    while (*rest && status == MILD_OK) {
        const size_t length = strcspn(rest, ",");
        snprintf(name, sizeof name, "%.*s", (int)length, rest);
        if (soils->count == TASK_SOILS_MAX) {
            return mild_fail(error, MILD_ERROR_RANGE, "randomize.presets: more than %d grounds",
                             (int)TASK_SOILS_MAX);
        }
        const char *own = name + strspn(name, " ");
        MildMaterial *soil = &soils->soil[soils->count++];
        status = soil_open(def, own, soil, error);
        status = status == MILD_OK ? soil_meet(own, soil, robot, error) : status;
        rest += length + (rest[length] == ',');
    }
    return status;
}

typedef struct {
    const TaskDef *def;
    const Robot *robot;
    uint64_t seed;
    TaskGrounds *grounds;
} GroundJob;

static void make_ground(void *context, int piece, int thread) {
    (void)thread;
    const GroundJob *job = context;
    Random r = random_at(job->seed ^ RANDOM_USE_GROUNDS, (uint32_t)piece, 0);
    TaskGround *ground = &job->grounds->ground[piece];
    ground->material = draw_new(&r, job->def, job->robot);
    ground->depth = task_standing_depth(job->robot, &ground->material);
}

TaskGrounds *task_grounds_create(const TaskDef *def, const Robot *robot, int count, uint64_t seed,
                                 Pool *pool, MildError *error) {
    TaskGrounds *grounds = malloc(sizeof *grounds);
    TaskGround *ground = calloc((size_t)count, sizeof *ground);
    if (!grounds || !ground) {
        free(grounds);
        free(ground);
        mild_fail(error, MILD_ERROR_MEMORY, "no memory for %d grounds", count);
        return NULL;
    }
    *grounds = (TaskGrounds){count, ground};
    pool_run(pool, count, make_ground, &(GroundJob){def, robot, seed, grounds});
    return grounds;
}

void task_grounds_destroy(TaskGrounds *grounds) {
    if (grounds) {
        free(grounds->ground);
        free(grounds);
    }
}
