/* Everything that is drawn once per episode (docs/task.md section 11), and the commands (section
 * 10): the code for the CPU and for a device (lanes.h). */
#include <string.h>

#include "base/random.h"
#include "env/task/task.h"

#define RANDOM_USE_EPISODE 0x45504953u
#define RANDOM_USE_RIGID 0x52494749u
#define RANDOM_USE_MAP 0x4d415050u
#define RANDOM_USE_COMMAND 0x434f4d4du

MILD_HD_FN double draw(Random *r, const double range[2]) {
    return random_uniform(r, range[0], range[1]);
}

MILD_HD_FN double spread(Random *r, double half_width) {
    return half_width * (2 * random_unit(r) - 1);
}

MILD_HD_FN int draw_lag(Random *r, const TaskDef *def) {
    return (int)(draw(r, def->randomize.latency) / def->physics_dt + 0.5);
}

TASK_FN void task_randomize(TaskEnv *env, const TaskDef *def, const Robot *robot) {
    const RandomizeDef *z = &def->randomize;
    Random r = random_at(env->seed ^ RANDOM_USE_EPISODE, env->index, env->tick);
    env->variation.rigid = random_unit(&r) < z->rigid_share || z->model == MILD_MODEL_RIGID;
    task_draw_ground(env, def, robot, &r);
    env->variation.rigid_friction = draw(&r, z->mu);
    Random contact = random_at(env->seed ^ RANDOM_USE_RIGID, env->index, env->tick);
    env->variation.rigid_time = draw(&contact, z->rigid_time);
    env->variation.base_mass_add = draw(&r, z->base_mass);
    env->variation.armature_scale = draw(&r, z->armature);
    for (int i = 0; i < 3; i++) {
        env->variation.com_offset[i] = spread(&r, z->com_offset);
    }
    for (int i = task_lane(); i <= TASK_JOINTS; i += TASK_LANES) {
        Random own = random_after(r, i);
        env->variation.link_mass_scale[i] =
            i <= env->shape.joints ? (TaskReal)draw(&own, z->link_mass) : 1;
    }
    r = random_after(r, env->shape.joints + 1);
    double strength = draw(&r, z->strength);
    for (int i = task_lane(); i < env->shape.joints; i += TASK_LANES) {
        Random own = random_after(r, 3 * i);
        env->kp_scale[i] = draw(&own, z->gain);
        env->kd_scale[i] = draw(&own, z->gain);
        env->strength[i] = strength;
        env->motor_offset[i] = spread(&own, z->motor_offset);
    }
    r = random_after(r, 3 * env->shape.joints);
    env->assist_draw = random_uniform(&r, 0.5, 1);
    if (def->map) {
        Random place = random_at(env->seed ^ RANDOM_USE_MAP, env->index, env->tick);
        task_draw_on_map(env, def, robot, &place);
    }
    env->lag_command = draw_lag(&r, def);
    env->lag_motor = draw_lag(&r, def);
    env->lag_imu = draw_lag(&r, def);
    task_lanes_sync();
}

TASK_FN void task_draw_command(TaskEnv *env, const TaskDef *def) {
    Random r = random_at(env->seed ^ RANDOM_USE_COMMAND, env->index, env->tick);
    double kind = random_unit(&r);
    env->command[0] = env->command[1] = env->command[2] = 0;
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
