#include "run/eval/inside.h"

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

static void print_numbers(FILE *csv, const float *numbers, int count, double scale) {
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
    print_numbers(log->csv, rows->latent + trial * (size_t)in->latent, in->latent, 1);
    print_numbers(log->csv, rows->modulated + trial * (size_t)in->latent, in->latent, 1);
    print_numbers(log->csv, rows->theta + trial * (size_t)in->theta, in->theta, 1);
    print_numbers(log->csv, estimates, 3, decision->task->velocity_scale);
    print_numbers(log->csv, estimates + 3, 3 * log->feet, 1);
    print_numbers(log->csv, estimates + 3 + 3 * log->feet, log->feet, decision->task->height_scale);
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
