#include "app/others.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "env/envs.h"
#include "run/eval/eval.h"

#define SQUARE_SPACING 1.3 /* [m] of the square */
#define SQUARE_SPREAD 0.3  /* [m] a place is off its corner by as much */
#define SQUARE_RANDOM 0x43524f57u

struct Others {
    OthersDef def;
    TaskDef task; /* with an episode as long as the walk */
    Envs *envs;
    EnvsTrial *trial;     /* [count] */
    MildTerrain *terrain; /* [count] the course, as it is around each place */
    ViewOther *other;     /* [count] */
    TaskEnv **env;        /* [count] */
    EnvsSample *sample;   /* [count][samples] */
    int samples;          /* physics steps of a policy step */
    float *action;        /* [count][joints] */
    float *reward;        /* [count] */
    uint8_t *flag;        /* [3][count] done, timeout, valid */
    uint8_t *fallen;      /* [count] bool */
};

/* ---- places ---- */

static int compare_distance(const void *a, const void *b) {
    const double *p = ((const ViewOther *)a)->place, *q = ((const ViewOther *)b)->place;
    const double near = hypot(p[0], p[1]), far = hypot(q[0], q[1]);
    return (near > far) - (near < far);
}

/* Robots along an edge of the square. */
static int edge_of(int count) {
    return (int)ceil(sqrt(count + 1.0));
}

double others_side(int count) {
    return SQUARE_SPACING * (edge_of(count) - 1);
}

/* Behind the robot and to its left. */
static void find_places(Others *others) {
    const int side = edge_of(others->def.count);
    for (int i = 0; i < others->def.count; i++) {
        const int corner = i + 1; /* the first one is the robot's */
        Random r = random_at(others->def.seed ^ SQUARE_RANDOM, (uint32_t)i, 0);
        double *place = others->other[i].place;
        place[0] = -SQUARE_SPACING * (corner % side) + SQUARE_SPREAD * (2 * random_unit(&r) - 1);
        place[1] = SQUARE_SPACING * (corner / side) + SQUARE_SPREAD * (2 * random_unit(&r) - 1);
    }
    qsort(others->other, (size_t)others->def.count, sizeof *others->other, compare_distance);
}

/* The course as one sees it who takes a place for the origin. */
static MildTerrain terrain_at(const MildTerrain *course, const double place[2]) {
    MildTerrain terrain = *course;
    terrain.map_x -= place[0];
    terrain.map_y -= place[1];
    for (int i = 0; i < terrain.patch_count; i++) {
        terrain.patches[i].x_min -= place[0];
        terrain.patches[i].x_max -= place[0];
        terrain.patches[i].y_min -= place[1];
        terrain.patches[i].y_max -= place[1];
    }
    return terrain;
}

/* ---- steps ---- */

static void command_all(Others *others) {
    for (int i = 0; i < others->def.count; i++) {
        eval_command(others->env[i], others->def.speed, 0);
    }
}

/* Where a robot and its feet are. */
static void see(Others *others, int i) {
    const EnvsSample *last = &others->sample[(size_t)(i + 1) * (size_t)others->samples - 1];
    ViewOther *other = &others->other[i];
    if (!last->valid) {
        return;
    }
    memcpy(other->qpos, others->env[i]->robot.qpos, sizeof other->qpos);
    for (int f = 0; f < last->feet; f++) {
        memcpy(other->position[f], last->foot[f].position, sizeof other->position[f]);
        memcpy(other->rotation[f], last->foot[f].rotation, sizeof other->rotation[f]);
    }
}

int others_count(const Others *others) {
    return others->def.count;
}

void others_step(Others *others) {
    const size_t count = (size_t)others->def.count;
    const EnvsStep step = {.action = others->action,
                           .reward = others->reward,
                           .done = others->flag,
                           .timeout = others->flag + count,
                           .valid = others->flag + 2 * count};
    Controller *controller = others->def.controller;
    controller->act(controller->self, others->def.count, others->env, others->action);
    envs_step(others->envs, &step, NULL, NULL); /* by MuJoCo, which cannot fail */
    for (int i = 0; i < others->def.count; i++) {
        see(others, i);
        others->fallen[i] |= step.done[i] && !step.timeout[i];
    }
    command_all(others);
}

const ViewOther *others_shown(const Others *others) {
    return others->other;
}

int others_upright(const Others *others) {
    int upright = 0;
    for (int i = 0; i < others->def.count; i++) {
        upright += !others->fallen[i];
    }
    return upright;
}

OthersRow others_on(const Others *others, int material) {
    const MildTerrain *course = &others->def.scene->terrain;
    OthersRow row = {0};
    for (int i = 0; i < others->def.count; i++) {
        const EnvsSample *last = &others->sample[(size_t)(i + 1) * (size_t)others->samples - 1];
        const ViewOther *other = &others->other[i];
        const double x = other->place[0] + other->qpos[0], y = other->place[1] + other->qpos[1];
        double deepest = 0;
        if (mild_terrain_material_at(course, x, y) != material) {
            continue;
        }
        for (int f = 0; f < last->feet; f++) {
            deepest = fmax(deepest, last->foot[f].depth);
        }
        row.robots++;
        row.upright += !others->fallen[i];
        row.sinkage += deepest;
    }
    row.sinkage /= row.robots > 0 ? row.robots : 1;
    return row;
}

/* ---- creation ---- */

void others_destroy(Others *others) {
    if (!others) {
        return;
    }
    envs_destroy(others->envs);
    free(others->trial);
    free(others->terrain);
    free(others->other);
    free(others->env);
    free(others->sample);
    free(others->action);
    free(others->reward);
    free(others->flag);
    free(others->fallen);
    free(others);
}

static int open_arrays(Others *others) {
    const size_t count = (size_t)others->def.count;
    others->trial = calloc(count, sizeof *others->trial);
    others->terrain = calloc(count, sizeof *others->terrain);
    others->other = calloc(count, sizeof *others->other);
    others->env = calloc(count, sizeof *others->env);
    others->action =
        calloc(count * (size_t)robot_actions(others->def.robot), sizeof *others->action);
    others->reward = calloc(count, sizeof *others->reward);
    others->flag = calloc(count, 3);
    others->fallen = calloc(count, 1);
    return others->trial && others->terrain && others->other && others->env && others->action &&
           others->reward && others->flag && others->fallen;
}

static MildStatus open_envs(Others *others, MildError *error) {
    const OthersDef *def = &others->def;
    const size_t count = (size_t)def->count;
    for (int i = 0; i < def->count; i++) {
        others->terrain[i] = terrain_at(&def->scene->terrain, others->other[i].place);
        others->trial[i] = (EnvsTrial){(uint32_t)i + 1, i, def->scene->rigid};
    }
    const EnvsDef envs = {.task = &others->task,
                          .robot = def->robot,
                          .pool = def->pool,
                          .count = def->count,
                          .seed = def->seed,
                          .trial = others->trial,
                          .terrain = others->terrain,
                          .terrains = def->count};
    others->envs = envs_create(&envs, error);
    if (!others->envs) {
        return error->status;
    }
    others->samples = envs_physics_steps(others->envs);
    others->sample = calloc(count * (size_t)others->samples, sizeof *others->sample);
    if (!others->sample) {
        return mild_fail(error, MILD_ERROR_MEMORY, "--envs: out of memory for %d robots",
                         def->count);
    }
    for (int i = 0; i < def->count; i++) {
        others->env[i] = envs_env(others->envs, i);
    }
    command_all(others);
    envs_set_samples(others->envs, others->sample);
    return envs_reset(others->envs, &(EnvsView){0}, NULL, error);
}

Others *others_create(const OthersDef *def, MildError *error) {
    Others *others = calloc(1, sizeof *others);
    if (!others) {
        mild_fail(error, MILD_ERROR_MEMORY, "--envs: out of memory");
        return NULL;
    }
    others->def = *def;
    others->task = *def->task;
    others->task.episode = def->seconds + 1;
    if (!open_arrays(others)) {
        mild_fail(error, MILD_ERROR_MEMORY, "--envs: out of memory for %d robots", def->count);
        others_destroy(others);
        return NULL;
    }
    find_places(others);
    if (open_envs(others, error) != MILD_OK) {
        others_destroy(others);
        return NULL;
    }
    for (int i = 0; i < def->count; i++) {
        memcpy(others->other[i].qpos, others->env[i]->robot.qpos, sizeof others->other[i].qpos);
        for (int f = 0; f < ROBOT_FEET_MAX; f++) {
            others->other[i].position[f][2] = VIEW_NOWHERE;
        }
    }
    return others;
}
