/* Everything that is drawn once per episode (docs/task.md section 11), and the commands (section
 * 10). The ground is drawn by who steps the robot:
 *
 *     Random r = task_draw_contact(env, def);       rigid or soft
 *     ...                                           which soft ground, from r
 *     task_draw_robot(env, def, r);                 robot and sensors
 *     task_map_random(env)                          random numbers for a place on the map */
#ifndef TASK_RANDOMIZE_H
#define TASK_RANDOMIZE_H

#include "base/random.h"
#include "env/task/state.h"

#define TASK_RANDOM_EPISODE 0x45504953u
#define TASK_RANDOM_RIGID 0x52494749u
#define TASK_RANDOM_SHELLS 0x5348454cu
#define TASK_RANDOM_MAP 0x4d415050u
#define TASK_RANDOM_SIGHT 0x53494748u
#define TASK_RANDOM_COMMAND 0x434f4d4du

/* Uniform in the range. */
MILD_HD_FN double task_draw(Random *r, const double range[2]) {
    return random_uniform(r, range[0], range[1]);
}

/* Uniform in +- half_width. */
MILD_HD_FN double task_spread(Random *r, double half_width) {
    return half_width * (2 * random_unit(r) - 1);
}

/* [physics steps] A latency. */
MILD_HD_FN int task_draw_lag(Random *r, const TaskDef *def) {
    return (int)(task_draw(r, def->randomize.latency) / def->physics_dt + 0.5);
}

/* Draws whether the ground is rigid. Returns the random numbers for what follows. */
MILD_HD_FN Random task_draw_contact(TaskEnv *env, const TaskDef *def) {
    const RandomizeDef *z = &def->randomize;
    Random r = random_at(env->seed ^ TASK_RANDOM_EPISODE, env->index, env->tick);
    env->variation.rigid = random_unit(&r) < z->rigid_share || z->model == MILD_MODEL_RIGID;
    return r;
}

/* Of the episode, for where on the map it begins. */
MILD_HD_FN Random task_map_random(const TaskEnv *env) {
    return random_at(env->seed ^ TASK_RANDOM_MAP, env->index, env->tick);
}

/* Draws the robot, its motors and sensors. */
MILD_HD_FN void task_draw_robot(TaskEnv *env, const TaskDef *def, Random r) {
    const RandomizeDef *z = &def->randomize;
    env->variation.rigid_friction = task_draw(&r, z->mu);
    Random contact = random_at(env->seed ^ TASK_RANDOM_RIGID, env->index, env->tick);
    env->variation.rigid_time = task_draw(&contact, z->rigid_time);
    Random shells = random_at(env->seed ^ TASK_RANDOM_SHELLS, env->index, env->tick);
    env->variation.shells_stand = random_unit(&shells) < z->shells_share;
    env->variation.base_mass_add = task_draw(&r, z->base_mass);
    env->variation.armature_scale = task_draw(&r, z->armature);
    for (int i = 0; i < 3; i++) {
        env->variation.com_offset[i] = task_spread(&r, z->com_offset);
    }
    for (int i = tile_lane(); i <= TASK_JOINTS; i += TILE) {
        Random own = random_after(r, i);
        env->variation.link_mass_scale[i] =
            i <= env->shape.joints ? (Real)task_draw(&own, z->link_mass) : 1;
    }
    r = random_after(r, env->shape.joints + 1);
    env->strength = task_draw(&r, z->strength);
    for (int i = tile_lane(); i < env->shape.joints; i += TILE) {
        Random own = random_after(r, 3 * i);
        env->kp_scale[i] = task_draw(&own, z->gain);
        env->kd_scale[i] = task_draw(&own, z->gain);
        env->motor_offset[i] = task_spread(&own, z->motor_offset);
    }
    r = random_after(r, 3 * env->shape.joints);
    env->assist_draw = random_uniform(&r, 0.5, 1);
    env->lag_command = task_draw_lag(&r, def);
    env->lag_motor = task_draw_lag(&r, def);
    env->lag_imu = task_draw_lag(&r, def);
    Random sight = random_at(env->seed ^ TASK_RANDOM_SIGHT, env->index, env->tick);
    env->lag_scan = (int)(task_draw(&sight, z->scan_delay) / TASK_PERIOD + 0.5);
    env->scan_offset = (Real)task_spread(&sight, z->scan_offset);
    tile_sync();
}

#define COMMAND_NEAR 0.7     /* [-] of the highest: a command near it */
#define COMMAND_FOLLOWED 0.8 /* [-] of the command: a speed that follows it */
#define COMMAND_GROWTH 0.25  /* [m/s] */
#define JUMP_GROWTH 0.025    /* [m] */

/* A robot's highest command, forward or, where it jumps, of the rise, grows where it follows one
 * near it when the next of an episode is drawn (command curriculum of Rudin et al. 2021), and falls
 * where it has less than half of it. */
MILD_HD_FN void task_command_adapt(TaskEnv *env, const TaskDef *def) {
    const int jumps = def->jump[1] > 0;
    const double asked = env->command[jumps ? TASK_RISE : TASK_FORWARD];
    const double has = jumps ? env->risen[1] : env->smooth_velocity[0];
    const double most = env->command_most, top = jumps ? def->jump[1] : def->vx[1];
    const double growth = jumps ? JUMP_GROWTH : COMMAND_GROWTH;
    if (!(asked > COMMAND_NEAR * fmin(most, top))) {
        return;
    }
    if (has > COMMAND_FOLLOWED * asked) {
        env->command_most = fmax(most, fmin(most + growth, top));
    } else if (has < 0.5 * asked) {
        env->command_most =
            fmax(most - growth, fmin(most, jumps ? def->jump_start : def->vx_start));
    }
}

/* Uniform in the range up to the highest command of the robot. */
MILD_HD_FN double task_draw_below(Random *r, const double range[2], double most) {
    const double below[2] = {range[0], fmax(range[0], fmin(range[1], most))};
    return task_draw(r, below);
}

/* Draws the command that the policy is to follow. */
MILD_HD_FN void task_draw_command(TaskEnv *env, const TaskDef *def) {
    Random r = random_at(env->seed ^ TASK_RANDOM_COMMAND, env->index, env->tick);
    double kind = random_unit(&r);
    for (int i = 0; i < TASK_COMMANDS; i++) {
        env->command[i] = 0;
    }
    if (kind < def->standing_share) {
        return;
    }
    kind -= def->standing_share;
    const int jumps = def->jump[1] > 0;
    const double most = env->command_most;
    env->command[0] =
        kind < def->backward_share
            ? task_draw(&r, def->backward_vx)
            : task_draw_below(&r, def->vx, jumps ? def->vx[1] * most / def->jump[1] : most);
    if (random_unit(&r) >= def->straight_share) {
        env->command[1] = task_draw(&r, def->vy);
        env->command[2] = task_draw(&r, def->wz);
    }
    if (jumps) {
        env->command[TASK_RISE] = task_draw_below(&r, def->jump, most);
    }
}

#endif
