#include "run/eval/actions.h"

#include <math.h>

static void print_joints(FILE *csv, const Robot *robot, const char *what, const char *unit) {
    for (int i = 0; i < robot_joints(robot); i++) {
        fprintf(csv, ",%s_%s%s", what, robot_joint_name(robot, i), unit);
    }
}

void actions_print_header(FILE *csv, const TaskDef *task, const Robot *robot) {
    const TaskShape shape = task_shape(task, robot);
    fprintf(csv, "trial,ground,speed_m_s,time_s,command_x_m_s,command_y_m_s,command_turn_rad_s,"
                 "phase,quaternion_w,quaternion_x,quaternion_y,quaternion_z,omega_x_rad_s,"
                 "omega_y_rad_s,omega_z_rad_s");
    print_joints(csv, robot, "angle", "_rad");
    print_joints(csv, robot, "speed", "_rad_s");
    for (int i = 0; i < shape.observation; i++) {
        fprintf(csv, ",observation%d", i);
    }
    print_joints(csv, robot, "action", "");
    fprintf(csv, "\n");
}

static void print_numbers(FILE *csv, const double *numbers, int count) {
    for (int i = 0; i < count; i++) {
        fprintf(csv, ",%.9g", numbers[i]);
    }
}

void actions_print_row(FILE *csv, const EvalDecision *decision) {
    TaskEnv *env = decision->env;
    const TaskShape *shape = &env->shape;
    const double *qpos = env->robot.qpos, *qvel = env->robot.qvel;
    const double clip = decision->task->action_clip;
    const float *frame = task_env_frame(env);
    char ground[sizeof decision->scene->name];
    scene_ground_at(decision->scene, qpos[0], qpos[1], ground, sizeof ground);
    fprintf(csv, "%d,%s,%g,%.2f", decision->trial, ground, decision->speed, decision->time);
    print_numbers(csv, env->command_seen, 3);
    print_numbers(csv, &env->phase, 1);
    print_numbers(csv, qpos + 3, 4);
    print_numbers(csv, qvel + 3, 3);
    print_numbers(csv, qpos + 7, shape->joints);
    print_numbers(csv, qvel + 6, shape->joints);
    for (int i = 0; i < shape->observation; i++) {
        fprintf(csv, ",%.9g", (double)frame[i]);
    }
    for (int i = 0; i < shape->actions; i++) {
        fprintf(csv, ",%.9g", fmin(fmax((double)decision->action[i], -clip), clip));
    }
    fprintf(csv, "\n");
}
