#include "app/crowd.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "env/envs.h"
#include "run/eval/eval.h"

#define CROWD_SPACING 1.3 /* [m] of the square */
#define CROWD_SPREAD 0.3  /* [m] a place is off its corner by as much */
#define CROWD_RANDOM 0x43524f57u

struct Crowd {
    CrowdDef def;
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

double crowd_side(int count) {
    return CROWD_SPACING * (edge_of(count) - 1);
}

/* Behind the robot and to its left. */
static void find_places(Crowd *crowd) {
    const int side = edge_of(crowd->def.count);
    for (int i = 0; i < crowd->def.count; i++) {
        const int corner = i + 1; /* the first one is the robot's */
        Random r = random_at(crowd->def.seed ^ CROWD_RANDOM, (uint32_t)i, 0);
        double *place = crowd->other[i].place;
        place[0] = -CROWD_SPACING * (corner % side) + CROWD_SPREAD * (2 * random_unit(&r) - 1);
        place[1] = CROWD_SPACING * (corner / side) + CROWD_SPREAD * (2 * random_unit(&r) - 1);
    }
    qsort(crowd->other, (size_t)crowd->def.count, sizeof *crowd->other, compare_distance);
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

static void command_all(Crowd *crowd) {
    for (int i = 0; i < crowd->def.count; i++) {
        eval_command(crowd->env[i], crowd->def.speed, 0);
    }
}

/* Where a robot and its feet are. */
static void see(Crowd *crowd, int i) {
    const EnvsSample *last = &crowd->sample[(size_t)(i + 1) * (size_t)crowd->samples - 1];
    ViewOther *other = &crowd->other[i];
    if (!last->valid) {
        return;
    }
    memcpy(other->qpos, crowd->env[i]->robot.qpos, sizeof other->qpos);
    for (int f = 0; f < last->feet; f++) {
        memcpy(other->position[f], last->foot[f].position, sizeof other->position[f]);
        memcpy(other->rotation[f], last->foot[f].rotation, sizeof other->rotation[f]);
    }
}

int crowd_count(const Crowd *crowd) {
    return crowd->def.count;
}

void crowd_step(Crowd *crowd) {
    const size_t count = (size_t)crowd->def.count;
    const EnvsStep step = {.action = crowd->action,
                           .reward = crowd->reward,
                           .done = crowd->flag,
                           .timeout = crowd->flag + count,
                           .valid = crowd->flag + 2 * count};
    Controller *controller = crowd->def.controller;
    controller->act(controller->self, crowd->def.count, crowd->env, crowd->action);
    envs_step(crowd->envs, &step, NULL, NULL); /* by MuJoCo, which cannot fail */
    for (int i = 0; i < crowd->def.count; i++) {
        see(crowd, i);
        crowd->fallen[i] |= step.done[i] && !step.timeout[i];
    }
    command_all(crowd);
}

const ViewOther *crowd_others(const Crowd *crowd) {
    return crowd->other;
}

int crowd_upright(const Crowd *crowd) {
    int upright = 0;
    for (int i = 0; i < crowd->def.count; i++) {
        upright += !crowd->fallen[i];
    }
    return upright;
}

CrowdRow crowd_on(const Crowd *crowd, int material) {
    const MildTerrain *course = &crowd->def.scene->terrain;
    CrowdRow row = {0};
    for (int i = 0; i < crowd->def.count; i++) {
        const EnvsSample *last = &crowd->sample[(size_t)(i + 1) * (size_t)crowd->samples - 1];
        const ViewOther *other = &crowd->other[i];
        const double x = other->place[0] + other->qpos[0], y = other->place[1] + other->qpos[1];
        double deepest = 0;
        if (mild_terrain_material_at(course, x, y) != material) {
            continue;
        }
        for (int f = 0; f < last->feet; f++) {
            deepest = fmax(deepest, last->foot[f].depth);
        }
        row.robots++;
        row.upright += !crowd->fallen[i];
        row.sinkage += deepest;
    }
    row.sinkage /= row.robots > 0 ? row.robots : 1;
    return row;
}

/* ---- creation ---- */

void crowd_destroy(Crowd *crowd) {
    if (!crowd) {
        return;
    }
    envs_destroy(crowd->envs);
    free(crowd->trial);
    free(crowd->terrain);
    free(crowd->other);
    free(crowd->env);
    free(crowd->sample);
    free(crowd->action);
    free(crowd->reward);
    free(crowd->flag);
    free(crowd->fallen);
    free(crowd);
}

static int open_arrays(Crowd *crowd) {
    const size_t count = (size_t)crowd->def.count;
    crowd->trial = calloc(count, sizeof *crowd->trial);
    crowd->terrain = calloc(count, sizeof *crowd->terrain);
    crowd->other = calloc(count, sizeof *crowd->other);
    crowd->env = calloc(count, sizeof *crowd->env);
    crowd->action = calloc(count * (size_t)robot_joints(crowd->def.robot), sizeof *crowd->action);
    crowd->reward = calloc(count, sizeof *crowd->reward);
    crowd->flag = calloc(count, 3);
    crowd->fallen = calloc(count, 1);
    return crowd->trial && crowd->terrain && crowd->other && crowd->env && crowd->action &&
           crowd->reward && crowd->flag && crowd->fallen;
}

static MildStatus open_envs(Crowd *crowd, MildError *error) {
    const CrowdDef *def = &crowd->def;
    const size_t count = (size_t)def->count;
    for (int i = 0; i < def->count; i++) {
        crowd->terrain[i] = terrain_at(&def->scene->terrain, crowd->other[i].place);
        crowd->trial[i] = (EnvsTrial){(uint32_t)i + 1, i, def->scene->rigid};
    }
    const EnvsDef envs = {.task = &crowd->task,
                          .robot = def->robot,
                          .pool = def->pool,
                          .count = def->count,
                          .seed = def->seed,
                          .trial = crowd->trial,
                          .terrain = crowd->terrain,
                          .terrains = def->count};
    crowd->envs = envs_create(&envs, error);
    if (!crowd->envs) {
        return error->status;
    }
    crowd->samples = envs_physics_steps(crowd->envs);
    crowd->sample = calloc(count * (size_t)crowd->samples, sizeof *crowd->sample);
    if (!crowd->sample) {
        return mild_fail(error, MILD_ERROR_MEMORY, "crowd: out of memory for %d robots",
                         def->count);
    }
    for (int i = 0; i < def->count; i++) {
        crowd->env[i] = envs_env(crowd->envs, i);
    }
    command_all(crowd);
    envs_set_samples(crowd->envs, crowd->sample);
    return envs_reset(crowd->envs, &(EnvsView){0}, NULL, error);
}

Crowd *crowd_create(const CrowdDef *def, MildError *error) {
    Crowd *crowd = calloc(1, sizeof *crowd);
    if (!crowd) {
        mild_fail(error, MILD_ERROR_MEMORY, "crowd: out of memory");
        return NULL;
    }
    crowd->def = *def;
    crowd->task = *def->task;
    crowd->task.episode = def->seconds + 1;
    if (!open_arrays(crowd)) {
        mild_fail(error, MILD_ERROR_MEMORY, "crowd: out of memory for %d robots", def->count);
        crowd_destroy(crowd);
        return NULL;
    }
    find_places(crowd);
    if (open_envs(crowd, error) != MILD_OK) {
        crowd_destroy(crowd);
        return NULL;
    }
    for (int i = 0; i < def->count; i++) {
        memcpy(crowd->other[i].qpos, crowd->env[i]->robot.qpos, sizeof crowd->other[i].qpos);
        for (int f = 0; f < ROBOT_FEET_MAX; f++) {
            crowd->other[i].position[f][2] = VIEW_NOWHERE;
        }
    }
    return crowd;
}
