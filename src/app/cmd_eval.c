/* mild eval: measures a policy on grounds and at speeds; prints a table, writes JSON. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/context.h"
#include "app/report.h"
#include "base/text.h"
#include "mild/batch.h"
#include "run/eval/actions.h"
#include "run/eval/other_ground.h"
#include "run/eval/track.h"

enum { ROWS_MAX = CLI_LIST_MAX * CLI_LIST_MAX };

typedef struct {
    Context context;
    /* NULL: not given */
    const char *json, *latent, *ablate, *stances, *actions, *track, *feet, *program, *start;
    CliNames grounds;
    CliNumbers speeds;
    int speed_given; /* bool */
    double patch;
    Ablation ablation;
    int threads;
    EvalDef eval;
    Scene scenes[CLI_LIST_MAX]; /* of the batch engine */
    EvalRow rows[ROWS_MAX];
    int row_count;
    EvalTrial *each; /* [rows][trials] */
} Eval;

static void add_ends(cJSON *o, const EvalRow *row) {
    cJSON *ends = cJSON_AddObjectToObject(o, "ends");
    for (int end = 0; end < TASK_END_COUNT; end++) {
        cJSON_AddNumberToObject(ends, task_end_names[end], row->ends[end]);
    }
}

static void add_each(cJSON *o, const EvalTrial *each, int trials) {
    cJSON *list = cJSON_AddArrayToObject(o, "each");
    for (int i = 0; i < trials; i++) {
        cJSON *trial = cJSON_CreateObject();
        cJSON_AddStringToObject(trial, "end", task_end_names[each[i].end]);
        cJSON_AddNumberToObject(trial, "up", each[i].up);
        cJSON_AddNumberToObject(trial, "seconds", each[i].seconds);
        cJSON_AddNumberToObject(trial, "legs", each[i].legs);
        cJSON_AddNumberToObject(trial, "shells", each[i].shells);
        cJSON_AddNumberToObject(trial, "torque_max", each[i].torque);
        cJSON_AddNumberToObject(trial, "x", each[i].x);
        cJSON_AddItemToArray(list, trial);
    }
}

/* The trials of a row. */
static EvalTrial *each_of(const Eval *e, int row) {
    return e->each + (size_t)row * (size_t)e->eval.trials;
}

/* each: [trials] */
static cJSON *row_json(const EvalRow *row, const EvalTrial *each) {
    cJSON *o = cJSON_CreateObject();
    cJSON_AddStringToObject(o, "ground", row->ground);
    const struct {
        const char *name;
        double value;
    } values[] = {{"speed", row->speed},
                  {"trials", row->trials},
                  {"success", row->success},
                  {"velocity", row->velocity},
                  {"cot", row->cot},
                  {"torque_max", row->torque_max},
                  {"clearance", row->clearance},
                  {"penetration", row->penetration},
                  {"drift", row->drift},
                  {"energy", row->energy},
                  {"velocity_low", row->velocity_low},
                  {"velocity_high", row->velocity_high},
                  {"sideways", row->sideways},
                  {"velocity_sideways", row->velocity_sideways},
                  {"base_oscillation", row->base_oscillation},
                  {"seconds", row->seconds},
                  {"turn", row->turn},
                  {"velocity_turn", row->velocity_turn},
                  {"push", row->push},
                  {"drift_forward", row->drift_forward},
                  {"drift_left", row->drift_left},
                  {"velocity_deviation", row->velocity_deviation},
                  {"cot_deviation", row->cot_deviation},
                  {"torque_deviation", row->torque_deviation},
                  {"measured", row->measured},
                  {"legs", row->legs},
                  {"target_jump", row->smooth.target_jump},
                  {"action_jerk", row->smooth.action_jerk},
                  {"tilt_rate", row->smooth.tilt_rate},
                  {"yaw_rate", row->smooth.yaw_rate},
                  {"joint_speed", row->smooth.joint_speed},
                  {"shells", row->shells},
                  {"drift_path", row->drift_path},
                  {"stride", row->stride},
                  {"cadence", row->cadence},
                  {"flight", row->flight},
                  {"jump", row->jump},
                  {"rise", row->rise},
                  {"duty", row->duty},
                  {"load_peak", row->load_peak},
                  {"load_rate", row->load_rate},
                  {"joint_speed_max", row->joint_speed_max},
                  {"torque_rms", row->torque_rms},
                  {"at_limit", row->at_limit},
                  {"righted", row->righted},
                  {"up", row->up}};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        cJSON_AddNumberToObject(o, values[i].name, values[i].value);
    }
    cJSON_AddStringToObject(o, "start", task_start_names[row->start]);
    add_ends(o, row);
    add_each(o, each, row->trials);
    return o;
}

/* Writes the JSON. It names the file of the policy, or a controller that needs none. */
static MildStatus write_json(const Eval *e, MildError *error) {
    const Context *c = &e->context;
    cJSON *root = cJSON_CreateObject();
    const int policy = context_has_policy(c);
    cJSON_AddStringToObject(root, policy ? "policy" : "controller",
                            policy ? c->policy : c->controller);
    if (e->ablate) {
        cJSON_AddStringToObject(root, "ablate", e->ablate);
    }
    cJSON_AddStringToObject(root, "robot", robot_name(c->robot));
    cJSON_AddStringToObject(root, "model", grounds_model_name(c->grounds.model));
    cJSON_AddStringToObject(root, "version", build_version());
    cJSON *rows = cJSON_AddArrayToObject(root, "rows");
    for (int i = 0; i < e->row_count; i++) {
        cJSON_AddItemToArray(rows, row_json(&e->rows[i], each_of(e, i)));
    }
    return report_save(root, e->json, error);
}

/* speed: of the walk; a course lies where it leads. */
static MildStatus make_scene(Eval *e, const char *name, double speed, Scene *scene,
                             MildError *error) {
    return context_scene(&e->context, name, speed < 0 ? -e->patch : e->patch, scene, error);
}

/* sheet_close; says the size, because a row for each physics step is many. */
static MildStatus close_csv(Sheet *sheet, const char *path, MildStatus status, MildError *error) {
    char size[32];
    status = sheet_close(sheet, path, status, error);
    if (sheet->file && status == MILD_OK && strcmp(path, "-") != 0) {
        fprintf(stderr, "%s: %s\n", path, text_bytes((double)sheet->size, size, sizeof size));
    }
    return status;
}

/* Prints a row and counts it. */
static void take_row(Eval *e, FILE *table) {
    char line[SCENE_NAME_SIZE + 256];
    eval_print_row(&e->rows[e->row_count++], line, sizeof line);
    fprintf(table, "%s\n", line);
    fflush(table);
}

static EvalRun eval_of(Eval *e, const Scene *scenes, int scene_count, const double *speeds,
                       int speed_count) {
    Context *c = &e->context;
    const int device = train_device(&c->train);
    return (EvalRun){.task = &c->task,
                     .robot = c->robot,
                     .pool = c->pool,
                     .controller = &c->mover,
                     .batch = train_is_batch(&c->train),
                     .device = device < 0 ? MILD_BATCH_HOST : device,
                     .scenes = scenes,
                     .scene_count = scene_count,
                     .speeds = speeds,
                     .speed_count = speed_count,
                     .eval = e->eval,
                     .each = e->each};
}

/* One row, on the ground of --program if there is one. */
static MildStatus evaluate_row(Eval *e, EvalRun *run, MildError *error) {
    EvalRow *row = &e->rows[e->row_count];
    if (!e->program) {
        return eval_run(run, row, error);
    }
    if (run->scenes->rigid) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--program computes soft ground; --ground %s is not", run->scenes->name);
    }
    OtherGround *other = other_ground_start(e->program, run->robot, e->eval.trials, error);
    if (!other) {
        return error->status;
    }
    run->ground = other_ground_of(other);
    MildStatus status = eval_run(run, row, error);
    return other_ground_stop(other, status, error);
}

/* Ground after ground, speed after speed, by MuJoCo. table: NULL: rows are not kept. */
static MildStatus evaluate_rows(Eval *e, FILE *table, MildError *error) {
    MildStatus status = MILD_OK;
    for (int i = 0; status == MILD_OK && i < e->grounds.count * e->speeds.count; i++) {
        Scene scene;
        const char *ground = e->grounds.name[i / e->speeds.count];
        const double speed = e->speeds.value[i % e->speeds.count];
        status = make_scene(e, ground, speed, &scene, error);
        if (status == MILD_OK) {
            EvalRun run = eval_of(e, &scene, 1, &speed, 1);
            run.each = each_of(e, e->row_count);
            status = evaluate_row(e, &run, error);
        }
        if (status == MILD_OK && table) {
            take_row(e, table);
        }
    }
    return status;
}

/* The means of all trials with the whole controller take the place of a part of it. */
static MildStatus ablate(Eval *e, InsideLog *log, MildError *error) {
    const LearnedInside *in = log->inside;
    const size_t width = (size_t)in->latent + (size_t)in->estimates + (size_t)in->theta;
    double *sum = calloc(width, sizeof *sum);
    float *means = calloc(width, sizeof *means);
    MildStatus status = MILD_OK;
    if (!sum || !means) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    } else if (ablation_has_means(e->ablation)) {
        const EvalDef whole = e->eval;
        log->sum = sum;
        e->eval.stances = e->eval.actions = e->eval.track = e->eval.feet = NULL;
        status = evaluate_rows(e, NULL, error);
        e->eval = whole;
        inside_means(log, means);
        log->sum = NULL;
    }
    if (status == MILD_OK) {
        learned_ablate(&e->context.mover, e->ablation, means);
    }
    free(sum);
    free(means);
    return status;
}

/* With --latent or --ablate: rows whose controller is looked into. */
static MildStatus evaluate_inside(Eval *e, FILE *table, MildError *error) {
    InsideLog log = {.feet = robot_feet(e->context.robot)};
    const EvalCallback callback = inside_callback(&log);
    Sheet sheet = {0};
    MildStatus status = learned_watch(&e->context.mover, &log.inside, error);
    if (status != MILD_OK) {
        return status;
    }
    e->eval.callback = &callback;
    status = e->ablate ? ablate(e, &log, error) : MILD_OK;
    if (status == MILD_OK && e->latent) {
        status = sheet_open(&sheet, error);
    }
    if (status == MILD_OK && sheet.file) {
        log.csv = sheet.file;
        inside_print_header(&log);
    }
    if (status == MILD_OK) {
        status = evaluate_rows(e, table, error);
    }
    e->eval.callback = NULL;
    return close_csv(&sheet, e->latent, status, error);
}

/* All at once, by the batch engine: its rows have one map, because each has one material. */
static MildStatus evaluate_batch(Eval *e, MildError *error) {
    MildStatus status = MILD_OK;
    for (int g = 0; status == MILD_OK && g < e->grounds.count; g++) {
        status = make_scene(e, e->grounds.name[g], 0, &e->scenes[g], error);
    }
    if (status == MILD_OK) {
        const EvalRun run =
            eval_of(e, e->scenes, e->grounds.count, e->speeds.value, e->speeds.count);
        status = eval_run(&run, e->rows, error);
    }
    return status;
}

static void print_header(const Eval *e, FILE *table) {
    char line[256];
    if (e->context.grounds.model != TASK_MODEL_OWN) {
        fprintf(table, "ground model %s\n", mild_model_names[e->context.grounds.model]);
    }
    eval_print_header(line, sizeof line);
    fprintf(table, "%s\n", line);
}

static MildStatus evaluate_table(Eval *e, MildError *error) {
    const char *outputs[] = {e->json, e->latent, e->stances, e->actions, e->track, e->feet};
    int taken = e->eval.led; /* how many want standard output */
    for (int i = 0; i < (int)(sizeof outputs / sizeof *outputs); i++) {
        taken += outputs[i] && strcmp(outputs[i], "-") == 0;
    }
    if (e->eval.led && taken > 1) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--led talks on standard output: give the other output a file's name");
    }
    FILE *table = taken ? stderr : stdout;
    const int batch = train_is_batch(&e->context.train);
    MildStatus status = batch ? evaluate_batch(e, error) : MILD_OK;
    if (status != MILD_OK) {
        return status;
    }
    print_header(e, table);
    if (!batch) {
        status = (e->latent || e->ablate ? evaluate_inside : evaluate_rows)(e, table, error);
    }
    while (batch && e->row_count < e->grounds.count * e->speeds.count) {
        take_row(e, table);
    }
    return status == MILD_OK && e->json ? write_json(e, error) : status;
}

static MildStatus evaluate(Eval *e, MildError *error) {
    Sheet stances = {0}, actions = {0}, track = {0}, feet = {0};
    MildStatus status = e->stances ? sheet_open(&stances, error) : MILD_OK;
    if (status == MILD_OK && e->actions) {
        status = sheet_open(&actions, error);
    }
    if (status == MILD_OK && e->track) {
        status = sheet_open(&track, error);
    }
    if (status == MILD_OK && e->feet) {
        status = sheet_open(&feet, error);
    }
    if (stances.file) {
        eval_print_stances_header(stances.file);
    }
    if (actions.file) {
        actions_print_header(actions.file, &e->context.task, e->context.robot);
    }
    if (track.file) {
        track_print_header(track.file);
    }
    if (feet.file) {
        feet_print_header(feet.file);
    }
    e->eval.stances = stances.file;
    e->eval.actions = actions.file;
    e->eval.track = track.file;
    e->eval.feet = feet.file;
    if (status == MILD_OK) {
        status = evaluate_table(e, error);
    }
    e->eval.stances = e->eval.actions = e->eval.track = e->eval.feet = NULL;
    status = close_csv(&stances, e->stances, status, error);
    status = close_csv(&actions, e->actions, status, error);
    status = close_csv(&track, e->track, status, error);
    return close_csv(&feet, e->feet, status, error);
}

/* Checks all grounds before the first trial: a typing error in the last one should not cost an
 * hour. */
static MildStatus check_grounds(Eval *e, MildError *error) {
    MildStatus status = MILD_OK;
    Scene scene;
    for (int g = 0; status == MILD_OK && g < e->grounds.count; g++) {
        status = make_scene(e, e->grounds.name[g], 0, &scene, error);
    }
    return status;
}

static MildStatus check_place(const Eval *e, MildError *error) {
    const TrainDef *train = &e->context.train;
    const int device = train_device(train);
    const char *missing = e->latent           ? "--latent"
                          : e->ablate         ? "--ablate"
                          : e->actions        ? "--actions"
                          : e->track          ? "--track"
                          : e->feet           ? "--feet"
                          : e->program        ? "--program"
                          : e->eval.led       ? "--led"
                          : e->eval.push != 0 ? "--push"
                                              : NULL;
    if (device < -1) {
        return mild_fail(error, MILD_ERROR_RANGE, "train.device = %s: neither cpu, cuda nor cuda:N",
                         train->device);
    }
    if (device >= 0 && !train_is_batch(train)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "train.device = %s: MuJoCo runs on the processor; leave it out, or give "
                         "--train.robots=batch",
                         train->device);
    }
    return missing && train_is_batch(train)
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "%s is not there in the batch engine; leave it out, or give "
                           "--train.robots=mujoco",
                           missing)
               : MILD_OK;
}

/* A controller that follows no command has to stand, so that no speed is shown as asked. */
static MildStatus check_command(Eval *e, MildError *error) {
    const char *controller = e->context.controller;
    if (!e->speed_given && !controller_has(controller, CONTROLLER_FOLLOWS)) {
        e->speeds.value[0] = 0;
    }
    MildStatus status = robots_check_command(controller, "sideways", e->eval.sideways, error);
    if (status == MILD_OK) {
        status = robots_check_jump(&e->context.task, e->eval.jump, error);
    }
    if (status == MILD_OK) {
        status = robots_check_command(controller, "turn", e->eval.turn, error);
    }
    for (int i = 0; i < e->speeds.count && status == MILD_OK; i++) {
        status = robots_check_command(controller, "speed", e->speeds.value[i], error);
    }
    return status;
}

/* How trials begin. Where a robot begins lying, it may lie, and the command is to stand. */
static MildStatus take_start(Eval *e, MildError *error) {
    const MildField *field = mild_field_find(task_fields, task_field_count, "start", NULL);
    TaskDef *task = &e->context.task;
    MildStatus status = mild_field_parse(field, task, e->start, "task", error);
    if (status == MILD_OK && task->start != TASK_START_STAND) {
        task->start_share = task->may_lie = 1;
        e->speeds.value[0] = e->speed_given ? e->speeds.value[0] : 0;
    }
    return status;
}

/* What is asked for together must go together. */
static MildStatus check(Eval *e, MildError *error) {
    MildStatus status = e->start ? take_start(e, error) : MILD_OK;
    if (status == MILD_OK) {
        status = check_command(e, error);
    }
    if (status == MILD_OK && e->ablate) {
        status = ablation_find(e->ablate, &e->ablation, error);
    }
    if (status == MILD_OK) {
        status = check_grounds(e, error);
    }
    return status == MILD_OK ? check_place(e, error) : status;
}

static MildStatus allocate(Eval *e, MildError *error) {
    const size_t rows = (size_t)e->grounds.count * (size_t)e->speeds.count;
    e->each = calloc(rows * (size_t)e->eval.trials, sizeof *e->each);
    return e->each
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d trials", e->eval.trials);
}

static MildStatus run_eval(Eval *e, const CliArgs *args, MildError *error) {
    Context *c = &e->context;
    c->pool = pool_create(e->threads);
    MildStatus status = c->pool ? context_open(c, args, error)
                                : mild_fail(error, MILD_ERROR_MEMORY, "cannot start threads");
    if (status == MILD_OK) {
        status = check(e, error);
    }
    if (status == MILD_OK) {
        status = allocate(e, error);
    }
    if (status == MILD_OK) {
        const int rows = train_is_batch(&c->train) ? e->grounds.count * e->speeds.count : 1;
        status = context_move(c, rows * e->eval.trials, error);
    }
    if (status == MILD_OK) {
        robots_warn_slow("eval", &c->train, c->robot_name ? c->robot_name : c->named);
        status = evaluate(e, error);
    }
    context_close(c);
    return status;
}

/* Defaults of all options but for those of the context. */
static void set_defaults(Eval *e) {
    e->context = context_default();
    e->context.controller = "learned";
    e->context.on_ground = e->context.machine = 1;
    e->eval = (EvalDef){.trials = 10, .seconds = 20, .seed = 1};
    e->patch = 2.5;
    e->speeds = (CliNumbers){1, {0.6}};
    e->grounds.count = 3;
    strcpy(e->grounds.name[0], "rigid");
    strcpy(e->grounds.name[1], "foam45");
    strcpy(e->grounds.name[2], "sand_loose");
}

int cmd_eval(int argc, char **argv) {
    Eval *e = calloc(1, sizeof *e);
    CliArgs *args = calloc(1, sizeof *args);
    if (!e || !args) {
        free(e);
        free(args);
        return cli_fail_text("eval", "out of memory");
    }
    Context *c = &e->context;
    set_defaults(e);
    const CliOption options[] = {
        context_policy(c,
                       "policy to measure (default policies/mild.safetensors, or that of --robot)"),
        context_robot(c),
        context_controller(c),
        context_config(c),
        {"ground", CLI_NAMES, &e->grounds, 0, 0, "NAME[,NAME]",
         "grounds that `mild info grounds` lists, one row each; rubber+foam45 is a course of both, "
         "in which rigid is a very hard material (default rigid,foam45,sand_loose)"},
        context_model(c),
        {"speed", CLI_NUMBERS, &e->speeds, -4, 4, "V[,V]",
         "[m/s] commanded forward speeds, one row each (default 0.6; 0 for a controller that "
         "stands)"},
        {"sideways", CLI_NUMBER, &e->eval.sideways, -1.5, 1.5, "V",
         "[m/s] commanded speed to the left (default 0)"},
        {"turn", CLI_NUMBER, &e->eval.turn, -1.5, 1.5, "W",
         "[rad/s] commanded turning speed to the left; speeds are then along the robot's heading "
         "(default 0: the heading is held along x)"},
        {"jump", CLI_NUMBER, &e->eval.jump, 0, 1, "H",
         "[m] commanded rise of jumps, one after the other from 1 s on, of a policy trained with "
         "task.jump; --speed is their mean speed (default 0)"},
        {"push", CLI_NUMBER, &e->eval.push, 0, 5, "V",
         "[m/s] added to the speed of the base every 4 s, in a random direction (default 0)"},
        {"start", CLI_TEXT, &e->start, 0, 0, "HOW",
         "how trials begin: stand; or back, side, any: dropped so, with any angles of the joints "
         "and motors that only damp for task.settle; then --speed is 0, and a row says how many "
         "were up at the end, for 2 s, and when they came up (default stand)"},
        {"randomize", CLI_FLAG, &c->randomized, 0, 0, NULL,
         "draw robots as in training, and push them so: section [randomize] of --config, but for "
         "its grounds"},
        {"stop", CLI_NUMBER, &e->eval.stop, 0, 3600, "T",
         "[s] time at which the command becomes 0; 0: never (default 0)"},
        {"trials", CLI_INT, &e->eval.trials, 1, 10000, "N",
         "trials per row, each with its own start and noise (default 10)"},
        {"seconds", CLI_NUMBER, &e->eval.seconds, 0.1, 3600, "T",
         "[s] length of a trial (default 20)"},
        {"patch", CLI_NUMBER, &e->patch, 0.1, 1000, "L",
         "[m] length of each ground of a course, which lies where the walk leads (default 2.5)"},
        {"seed", CLI_UINT64, &e->eval.seed, 0, 0, "S",
         "the same seed gives the same trials (default 1)"},
        {"threads", CLI_INT, &e->threads, 0, 1024, "N",
         "threads; 0: one per core; the results do not depend on it (default 0)"},
        {"latent", CLI_OUTPUT, &e->latent, 0, 0, "FILE",
         "also write what passes between the networks at every decision, as CSV: trial, ground, "
         "speed, time, phase of the gait, z, z modulated, theta1, theta2, estimates"},
        {"ablate", CLI_TEXT, &e->ablate, 0, 0, "PART",
         "take a part out of the policy: z (its mean instead), modulation (the means of "
         "theta1 and theta2), estimates (their means for the actor), history (the newest frame in "
         "each place); means are those of the whole policy in the same trials of all rows, which "
         "run once more for them"},
        {"stances", CLI_OUTPUT, &e->stances, 0, 0, "FILE",
         "also write each stance of each foot as CSV: ground, speed, trial, foot, start, duration, "
         "depth, slip along the heading and to the left, apex of the swing before, place of the "
         "touchdown, largest torque"},
        {"actions", CLI_OUTPUT, &e->actions, 0, 0, "FILE",
         "also write what the controller saw and did at every decision, as CSV: trial, ground, "
         "speed, time, the true state, the observation, the action (docs/policy.md)"},
        {"track", CLI_OUTPUT, &e->track, 0, 0, "FILE",
         "also write where the robot went, after every policy step, as CSV: ground, speed, trial, "
         "time, centre of mass, base, roll and pitch of the base"},
        {"feet", CLI_OUTPUT, &e->feet, 0, 0, "FILE",
         "also write what the ground does to each foot, in every physics step, as CSV (8 s of a "
         "trial: 2.6 MB): ground, speed, trial, foot, time, ankle, its rotation, force and moment, "
         "pressure centre, depth"},
        {"program", CLI_TEXT, &e->program, 0, 0, "COMMAND",
         "a program that computes the soft ground in the place of the model, asked in every "
         "physics step; one runs for each trial (lab/grains/README.md)"},
        {"led", CLI_FLAG, &e->eval.led, 0, 0, NULL,
         "after every policy step tell each trial's feet on standard output, and hear the speed to "
         "command on standard input (src/run/eval/eval.c)"},
        {"json", CLI_OUTPUT, &e->json, 0, 0, "FILE",
         "also write the table as JSON to FILE; - for standard output"},
    };
    const CliCommand command = {
        .name = "eval",
        .usage = "[--policy FILE] [--ground NAME[,NAME]] [--speed V[,V]] [options]",
        .summary =
            "Lets a policy walk on every ground at every speed and prints one row for "
            "each: trials without a fall, measured speed with its 95 % interval, cost of "
            "transport (COT), largest torque of a joint, clearance of the swinging foot "
            "above the undisturbed ground, deepest element (sink) and way of the sole "
            "(drift) in a stance, power of the joints, and what ended the trials that fell. A - is "
            "what cannot be measured, such as the speed of trials that fell within 2.5 s; the "
            "JSON has null there. The sensors have the noise "
            "and delay of training. The robot has its nominal parameters, and nobody pushes "
            "it, without --randomize or --push.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of sections [task], [ground] and [terrain], e.g. --ground.mu=0.4 "
                     "--terrain.kind=waves --terrain.memory=true; --train.robots=batch runs all "
                     "rows at once in the batch engine, on --train.device=cpu or cuda:N",
        .examples =
            "  mild eval --ground rigid,foam45,sand_loose --speed 0.3,0.6\n"
            "  mild eval --ground sand_loose --terrain.kind=rough --terrain.amplitude=0.02\n"
            "  mild eval --robot go1\n"
            "  mild eval --robot go1 --controller stand --speed 0\n"
            "  mild eval --robot go1 --start back\n"
            "  mild eval --train.device=cuda --trials 1000\n",
    };
    int code = cli_parse(&command, argc, argv, args);
    if (code == CLI_RUN) {
        MildError error = {0};
        e->speed_given =
            cli_first_given(&command, args, (const char *const[]){"speed", NULL}) != NULL;
        code = run_eval(e, args, &error) == MILD_OK ? 0 : cli_fail("eval", &error);
    }
    free(e->each);
    free(e);
    free(args);
    return code;
}
