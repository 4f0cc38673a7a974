#include "run/eval/actions.h"

#include <math.h>

static void print_joints(FILE *csv, const Robot *robot, int count, const char *what,
                         const char *unit) {
    for (int i = 0; i < count; i++) {
        fprintf(csv, ",%s_%s%s", what, robot_joint_name(robot, i), unit);
    }
}

void actions_print_header(FILE *csv, const TaskDef *task, const Robot *robot) {
    const TaskShape shape = task_shape(task, robot);
    fprintf(csv, "trial,ground,speed_m_s,time_s,command_x_m_s,command_y_m_s,command_turn_rad_s,"
                 "phase,quaternion_w,quaternion_x,quaternion_y,quaternion_z,omega_x_rad_s,"
                 "omega_y_rad_s,omega_z_rad_s");
    print_joints(csv, robot, shape.joints, "angle", "_rad");
    print_joints(csv, robot, shape.joints, "speed", "_rad_s");
    for (int i = 0; i < shape.observation; i++) {
        fprintf(csv, ",observation%d", i);
    }
    print_joints(csv, robot, shape.actions, "action", "");
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

void inside_print_header(const InsideLog *log) {
    static const char axes[] = "xyz";
    const LearnedInside *in = log->inside;
    fprintf(log->csv, "trial,ground,speed_m_s,time_s,phase");
    for (int j = 0; j < in->latent; j++) {
        fprintf(log->csv, ",z%d", j);
    }
    for (int j = 0; j < in->latent; j++) {
        fprintf(log->csv, ",modulated%d", j);
    }
    for (int n = 1; n <= 2; n++) {
        for (int j = 0; j < in->theta / 2; j++) {
            fprintf(log->csv, in->theta == 2 ? ",theta%d" : ",theta%d_%d", n, j);
        }
    }
    for (int i = 0; i < 3; i++) {
        fprintf(log->csv, ",velocity_%c_m_s", axes[i]);
    }
    for (int f = 0; f < log->feet; f++) {
        for (int i = 0; i < 3; i++) {
            fprintf(log->csv, ",foot%d_velocity_%c_m_s", f, axes[i]);
        }
    }
    for (int f = 0; f < log->feet; f++) {
        fprintf(log->csv, ",foot%d_height_m", f);
    }
    fprintf(log->csv, "\n");
}

static void print_scaled(FILE *csv, const float *numbers, int count, double scale) {
    for (int i = 0; i < count; i++) {
        fprintf(csv, ",%.6g", (double)numbers[i] / scale);
    }
}

static void print_row(const InsideLog *log, const EvalDecision *decision) {
    const LearnedInside *in = log->inside;
    const PolicyInside *rows = &in->rows;
    const size_t trial = (size_t)decision->trial;
    const float *estimates = rows->estimates + trial * (size_t)in->estimates;
    const double *at = decision->env->robot.qpos;
    char ground[sizeof decision->scene->name];
    scene_ground_at(decision->scene, at[0], at[1], ground, sizeof ground);
    fprintf(log->csv, "%d,%s,%g,%.2f,%.6g", decision->trial, ground, decision->speed,
            decision->time, decision->env->phase);
    print_scaled(log->csv, rows->latent + trial * (size_t)in->latent, in->latent, 1);
    print_scaled(log->csv, rows->modulated + trial * (size_t)in->latent, in->latent, 1);
    print_scaled(log->csv, rows->theta + trial * (size_t)in->theta, in->theta, 1);
    print_scaled(log->csv, estimates, 3, decision->task->velocity_scale);
    print_scaled(log->csv, estimates + 3, 3 * log->feet, 1);
    print_scaled(log->csv, estimates + 3 + 3 * log->feet, log->feet, decision->task->height_scale);
    fprintf(log->csv, "\n");
}

static void add_numbers(double *sum, const float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        sum[i] += (double)numbers[i];
    }
}

static void decided(void *context, const EvalDecision *decision) {
    InsideLog *log = context;
    const LearnedInside *in = log->inside;
    const size_t trial = (size_t)decision->trial;
    const float *latent = in->rows.latent + trial * (size_t)in->latent;
    const float *estimates = in->rows.estimates + trial * (size_t)in->estimates;
    const float *theta = in->rows.theta + trial * (size_t)in->theta;
    log->decisions++;
    if (log->sum) {
        add_numbers(log->sum, latent, in->latent);
        add_numbers(log->sum + in->latent, estimates, in->estimates);
        add_numbers(log->sum + in->latent + in->estimates, theta, in->theta);
    }
    if (log->csv) {
        print_row(log, decision);
    }
}

EvalCallback inside_callback(InsideLog *log) {
    return (EvalCallback){decided, log};
}

void inside_means(const InsideLog *log, float *means) {
    const LearnedInside *in = log->inside;
    for (int i = 0; i < in->latent + in->estimates + in->theta; i++) {
        means[i] = (float)(log->sum[i] / (double)log->decisions);
    }
}
