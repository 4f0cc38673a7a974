/* Everything that is drawn once per episode (docs/task.md section 11), and the commands (section
 * 10). */
#include <assert.h>
#include <string.h>

#include "base/random.h"
#include "task/task.h"

#define DRAW_TRIES 100 /* of a material that the model can match */
#define RANDOM_USE_EPISODE 0x45504953u
#define RANDOM_USE_MAP 0x4d415050u
#define RANDOM_USE_COMMAND 0x434f4d4du

static double draw(Random *r, const double range[2]) {
    return random_uniform(r, range[0], range[1]);
}

static double spread(Random *r, double half_width) {
    return half_width * (2 * random_unit(r) - 1);
}

/* A preset with each of its numbers changed a little. */
static MildMaterial draw_preset(Random *r, const RandomizeDef *def) {
    MildMaterial m = mild_material_default();
    mild_material_preset(
        mild_material_preset_name((int)random_index(r, (uint32_t)mild_material_preset_count())),
        &m);
    double *const jittered[] = {&m.k_pen, &m.sigma_cone, &m.mu,     &m.c_d,
                                &m.c_g,   &m.k_drift,    &m.b_drift};
    for (size_t i = 0; i < sizeof jittered / sizeof *jittered; i++) {
        *jittered[i] *= 1 + spread(r, def->preset_jitter);
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
    m.k_pen = draw(r, def->k_pen);
    m.sigma_cone = draw(r, def->sigma_cone);
    m.alpha = draw(r, def->alpha);
    m.nu = draw(r, def->nu);
    m.c_g = draw(r, def->c_g);
    m.c_d = draw(r, def->c_d);
    m.phi = draw(r, def->phi);
    m.mu = draw(r, def->mu);
    m.rho = draw(r, def->rho);
    m.recovery = draw(r, def->recovery);
    m.bed_depth = draw(r, def->bed_depth);
    limit_sinkage(&m, robot, def->sinkage_max);
    return m;
}

/* Draws a material for the model. If its match would be out of range (mild_model_match), another
 * one is drawn. */
static MildMaterial draw_material(Random *r, const RandomizeDef *def, const Robot *robot) {
    double preset = def->rigid_share < 1 ? def->preset_share / (1 - def->rigid_share) : 0;
    MildMaterial m, rival;
    for (int tries = 0; tries < DRAW_TRIES; tries++) {
        m = random_unit(r) < preset ? draw_preset(r, def) : draw_ranges(r, def, robot);
        if (def->model == MILD_MODEL_RIGID) {
            return m; /* the engine's contact does not use it */
        }
        if (robot_match_model(robot, (MildModel)def->model, &m, &rival, NULL) == MILD_OK) {
            return rival;
        }
    }
    m = mild_material_default();
    MildStatus status = robot_match_model(robot, (MildModel)def->model, &m, &rival, NULL);
    assert(status == MILD_OK);
    (void)status;
    return rival;
}

/* Stripes across x around the start, three materials in random order. */
static void draw_stripes(Random *r, const RandomizeDef *def, const Robot *robot,
                         MildTerrain *terrain) {
    while (terrain->material_count < 3) {
        terrain->materials[terrain->material_count++] = draw_material(r, def, robot);
    }
    double x = -0.5 * MILD_PATCHES_MAX * 0.5 * (def->patch_length[0] + def->patch_length[1]);
    for (int i = 0; i < MILD_PATCHES_MAX; i++) {
        double length = draw(r, def->patch_length);
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
static void draw_on_map(Random *r, const TaskDef *def, const Robot *robot, MildTerrain *terrain) {
    double x, y;
    mild_map_extent(def->map, &x, &y);
    terrain->map_x = spread(r, 0.5 * x);
    terrain->map_y = spread(r, 0.5 * y);
    while (terrain->material_count < mild_map_label_count(def->map)) {
        terrain->materials[terrain->material_count++] = draw_material(r, &def->randomize, robot);
    }
}

static int draw_lag(Random *r, const TaskDef *def) {
    return (int)(draw(r, def->randomize.latency) / def->physics_dt + 0.5);
}

void task_randomize(TaskEnv *env, const TaskDef *def, const Robot *robot) {
    const RandomizeDef *z = &def->randomize;
    Random r = random_at(env->seed ^ RANDOM_USE_EPISODE, env->index, env->tick);
    env->variation = robot_variation_nominal();
    env->variation.rigid = random_unit(&r) < z->rigid_share || z->model == MILD_MODEL_RIGID;
    MildMaterial material = draw_material(&r, z, robot);
    env->terrain = mild_terrain_uniform(&material);
    int striped = random_unit(&r) < z->patch_share;
    if (striped && !(def->map && mild_map_label_count(def->map) > 1)) {
        draw_stripes(&r, z, robot, &env->terrain);
    }
    env->variation.rigid_friction = draw(&r, z->mu);
    env->variation.base_mass_add = draw(&r, z->base_mass);
    env->variation.armature_scale = draw(&r, z->armature);
    for (int i = 0; i < 3; i++) {
        env->variation.com_offset[i] = spread(&r, z->com_offset);
    }
    for (int i = 0; i <= env->shape.joints; i++) {
        env->variation.link_mass_scale[i] = draw(&r, z->link_mass);
    }
    double strength = draw(&r, z->strength);
    for (int i = 0; i < env->shape.joints; i++) {
        env->kp_scale[i] = draw(&r, z->gain);
        env->kd_scale[i] = draw(&r, z->gain);
        env->strength[i] = strength;
        env->motor_offset[i] = spread(&r, z->motor_offset);
    }
    env->assist_draw = random_uniform(&r, 0.5, 1);
    if (def->map) {
        Random place = random_at(env->seed ^ RANDOM_USE_MAP, env->index, env->tick);
        draw_on_map(&place, def, robot, &env->terrain);
    }
    env->lag_command = draw_lag(&r, def);
    env->lag_motor = draw_lag(&r, def);
    env->lag_imu = draw_lag(&r, def);
}

void task_draw_command(TaskEnv *env, const TaskDef *def) {
    Random r = random_at(env->seed ^ RANDOM_USE_COMMAND, env->index, env->tick);
    double kind = random_unit(&r);
    memset(env->command, 0, sizeof env->command);
    if (kind < def->standing_share) {
        return;
    }
    kind -= def->standing_share;
    env->command[0] = draw(&r, kind < def->backward_share ? def->backward_vx : def->vx);
    if (random_unit(&r) >= def->straight_share) {
        env->command[1] = draw(&r, def->vy);
        env->command[2] = draw(&r, def->wz);
    }
}
