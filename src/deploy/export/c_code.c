/* The policy as C: files of c/ as they are, the numbers in the header, the weights as arrays. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/paths.h"
#include "c_text.h" /* text_policy_h, text_policy_c, text_example_c: files of c/ */
#include "deploy/export/export.h"

enum { C_LANES = 16 }; /* as in c/policy.c */

#define NUMBERS "/* NUMBERS */\n" /* in c/policy.h */

/* ---- policy_weights.h ---- */

static int blocks(int width) {
    return (width + C_LANES - 1) / C_LANES;
}

static void print_float(FILE *file, int index, float number) {
    fprintf(file, "%s%.8ef,", index % 6 == 0 ? "\n    " : " ", (double)number);
}

/* For each block of C_LANES outputs [in][C_LANES], zero beyond the last. */
static void print_weight(FILE *file, const float *weight, const MlpLayer *layer) {
    int index = 0;
    for (int first = 0; first < layer->out; first += C_LANES) {
        for (int i = 0; i < layer->in; i++) {
            for (int j = first; j < first + C_LANES; j++) {
                print_float(file, index++,
                            j < layer->out ? weight[(size_t)j * (size_t)layer->in + (size_t)i] : 0);
            }
        }
    }
}

static void print_bias(FILE *file, const float *bias, int width) {
    for (int j = 0; j < blocks(width) * C_LANES; j++) {
        print_float(file, j, j < width ? bias[j] : 0);
    }
}

static void print_mlp(FILE *file, const Export *export, const Mlp *mlp, const char *name) {
    for (int l = 0; l < mlp->layers; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        fprintf(file, "static const float %s_weight%d[] = {", name, l);
        print_weight(file, export->parameters + layer->weight, layer);
        fprintf(file, "\n};\nstatic const float %s_bias%d[] = {", name, l);
        print_bias(file, export->parameters + layer->bias, layer->out);
        fprintf(file, "\n};\n");
    }
    fprintf(file, "static const Layer %s[] = {\n", name);
    for (int l = 0; l < mlp->layers; l++) {
        fprintf(file, "    {%s_weight%d, %s_bias%d, %d, %d},\n", name, l, name, l, mlp->layer[l].in,
                blocks(mlp->layer[l].out));
    }
    fprintf(file, "};\n\n");
}

static int widest(const Export *export) {
    const Network *n = export->network;
    const int widths[] = {mlp_widest(&n->encoder), mlp_widest(&n->modulation),
                          mlp_widest(&n->actor)};
    int most = 0;
    for (int i = 0; i < 3; i++) {
        most = widths[i] > most ? widths[i] : most;
    }
    return blocks(most) * C_LANES;
}

static void print_joints(FILE *file, const char *name, const double *numbers, int count) {
    fprintf(file, "const float policy_%s[POLICY_JOINTS] = {", name);
    for (int i = 0; i < count; i++) {
        fprintf(file, "%s%.8ef", i ? ", " : "", numbers[i]);
    }
    fprintf(file, "};\n");
}

static MildStatus print_weights(FILE *file, const Export *export, MildError *error) {
    const Robot *robot = export->robot;
    const int joints = robot_joints(robot);
    TaskGains gains;
    MildStatus status = task_gains(export->task, robot, &gains, error);
    if (status != MILD_OK) {
        return status;
    }
    fprintf(file, "/* Weights and joints of policy.c, which includes this. */\n\n"
                  "const char *const policy_joint_names[POLICY_JOINTS] = {\n");
    for (int i = 0; i < joints; i++) {
        fprintf(file, "    \"%s\",\n", robot_joint_name(robot, i));
    }
    fprintf(file, "};\n");
    print_joints(file, "pose", robot_default_pose(robot), joints);
    print_joints(file, "kp", gains.kp, joints);
    print_joints(file, "kd", gains.kd, joints);
    print_joints(file, "limit", gains.limit, joints);
    print_joints(file, "low", robot_joint_low(robot), joints);
    print_joints(file, "high", robot_joint_high(robot), joints);
    fprintf(file, "\n#define WIDEST %d /* of the layers' outputs, in whole blocks */\n\n",
            widest(export));
    print_mlp(file, export, &export->network->encoder, "encoder");
    print_mlp(file, export, &export->network->modulation, "modulation");
    print_mlp(file, export, &export->network->actor, "actor");
    return MILD_OK;
}

/* ---- policy.h ---- */

static void print_int(FILE *file, const char *name, int number, const char *what) {
    fprintf(file, "#define POLICY_%s %d /* %s */\n", name, number, what);
}

static void print_number(FILE *file, const char *name, double number, const char *suffix,
                         const char *what) {
    fprintf(file, "#define POLICY_%s %.9e%s /* %s */\n", name, number, suffix, what);
}

/* A text inside of a comment. */
static void print_quoted(FILE *file, const char *text) {
    for (; *text; text++) {
        fputc(*text == '*' || *text == '\\' || (unsigned char)*text < 32 ? ' ' : *text, file);
    }
}

static void print_numbers(FILE *file, const Export *export) {
    const TaskDef *task = export->task;
    const PolicyDef *def = &export->network->def;
    const int means = TASK_FRAMES - 1, stride = task->history_stride;
    fprintf(file, "/* Robot %s; mild %s; ", robot_name(export->robot), export->version);
    print_quoted(file, export->note);
    fprintf(file, " */\n");
    print_int(file, "JOINTS", def->actions, "[-] of the robot, and numbers of an action");
    print_int(file, "OBSERVATION", def->observation, "[-] numbers of a frame");
    print_int(file, "MEANS", means, "[-] of older frames in the history");
    print_int(file, "STRIDE", stride, "[-] frames of each mean");
    print_int(file, "HELD", means * stride, "[-] older frames that are kept");
    print_int(file, "ESTIMATES", def->estimates, "[-] of velocities and heights");
    print_int(file, "FEET_VELOCITIES", def->feet_velocity_offset, "[-] their first estimate");
    print_int(file, "FEET_INPUT", export->network->feet, "[-] estimates in the modulation's input");
    print_int(file, "CLOCK_INPUT", export->network->clock, "[-] numbers of the clock behind them");
    print_int(file, "LATENT", def->latent, "[-] width of z");
    print_int(file, "THETA", export->network->theta, "[-] width of the modulation");
    print_int(file, "CLOCK", task->clock, "bool: the frame has the gait clock, else 0, 0");
    print_number(file, "PERIOD", TASK_PERIOD, "", "[s] of a step");
    print_number(file, "GAIT_PERIOD", task->gait_period, "", "[s] of the gait clock");
    print_number(file, "GAIT_SLOWING", task->gait_slowing, "", "[-] of a command of no speed");
    print_number(file, "GAIT_SLOW_BELOW", task->gait_slow_below, "",
                 "[m/s] speed from which the clock is not slowed");
    print_number(file, "STANDING_BELOW", task->standing_below, "f",
                 "a command whose parts are all below this is to stand");
    print_number(file, "ACTION_SCALE", task_action_scale(task, robot_table(export->robot)), "f",
                 "[rad] per unit of action");
    print_number(file, "ACTION_CLIP", task->action_clip, "f", "[-] largest action");
}

static MildStatus print_header(FILE *file, const Export *export, MildError *error) {
    (void)error;
    const size_t before = (size_t)(strstr(text_policy_h, NUMBERS) - text_policy_h),
                 after = before + strlen(NUMBERS);
    fwrite(text_policy_h, 1, before, file);
    print_numbers(file, export);
    fwrite(text_policy_h + after, 1, sizeof text_policy_h - 1 - after, file);
    return MILD_OK;
}

static MildStatus print_source(FILE *file, const Export *export, MildError *error) {
    (void)export;
    (void)error;
    fputs(text_policy_c, file);
    return MILD_OK;
}

static MildStatus print_example(FILE *file, const Export *export, MildError *error) {
    (void)export;
    (void)error;
    fputs(text_example_c, file);
    return MILD_OK;
}

/* ---- the folder ---- */

static const struct {
    const char *name;
    MildStatus (*print)(FILE *file, const Export *export, MildError *error);
} files[] = {{"policy.h", print_header},
             {"policy.c", print_source},
             {"policy_weights.h", print_weights},
             {"example.c", print_example}};
enum { FILES = sizeof files / sizeof *files };

static MildStatus write_one(const Export *export, const char *folder, int index, MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = path_join(folder, files[index].name, path, error);
    FILE *file = status == MILD_OK ? fopen(path, "w") : NULL;
    if (status == MILD_OK && !file) {
        return mild_fail(error, MILD_ERROR_IO, "%s: cannot be written: %s", path, strerror(errno));
    }
    if (status == MILD_OK) {
        status = files[index].print(file, export, error);
        const int lost = ferror(file);
        if ((fclose(file) != 0 || lost) && status == MILD_OK) {
            status = mild_fail(error, MILD_ERROR_IO, "%s: cannot be written: %s", path,
                               errno ? strerror(errno) : "part of it is lost");
        }
    }
    return status;
}

static void remove_folder(const char *folder) {
    char path[PATH_SIZE];
    for (int i = 0; i < FILES; i++) {
        if (path_join(folder, files[i].name, path, NULL) == MILD_OK) {
            unlink(path);
        }
    }
    rmdir(folder);
}

/* policy_observe of c/policy.c writes a frame of TASK_FRAME_LIST with the clock alone. */
static MildStatus check_frame(const Export *export, MildError *error) {
    const PolicyDef *def = &export->network->def;
    const int most = 9 + 3 * def->actions + 2;
    return def->observation == most
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "the C code writes frames of %d numbers, and this policy's have %d; "
                           "give --onnx in the place of --c",
                           most, def->observation);
}

MildStatus export_c(const Export *export, const char *folder, MildError *error) {
    if (check_frame(export, error) != MILD_OK) {
        return error->status;
    }
    if (access(folder, F_OK) == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s exists already; name a new folder, or remove it", folder);
    }
    MildStatus status = path_make_folder(folder, error);
    for (int i = 0; status == MILD_OK && i < FILES; i++) {
        status = write_one(export, folder, i, error);
    }
    if (status != MILD_OK) {
        remove_folder(folder);
    }
    return status;
}
