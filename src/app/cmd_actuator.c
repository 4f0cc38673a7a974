/* mild actuator: fits the network of a robot's motors to logs, and makes such a log of a simulated
 * motor. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/context.h"
#include "app/report.h"
#include "base/file.h"
#include "env/actuator/fit.h"
#include "env/actuator/motor.h"
#include "run/config/experiment_keys.h"
#include "run/eval/motor_log.h"

/* actuator.png is drawn from actuator_held.csv, because actuator.csv may be the log. */
#define NUMBERS_END "_held.csv"

/* ---- fit ---- */

typedef struct {
    Context context; /* its robot and threads */
    const char *out, *figure;
    int threads;
    ActuatorFitDef fit;
} FitCommand;

static void print_scores(const Robot *robot, int kinds, const ActuatorScore *score) {
    printf("%-16s %7s %7s %9s %9s %9s %9s   best PD\n", "motor as of", "train", "held", "std", "PD",
           "best PD", "network");
    for (int k = 0; k < kinds; k++) {
        const ActuatorScore *s = &score[k];
        printf("%-16s %7d %7d %9.4g %9.4g %9.4g %9.4g   kp %.4g kd %.4g\n",
               robot_joint_name(robot, s->joint), s->trained, s->held, s->deviation, s->ideal,
               s->linear, s->network, s->kp, s->kd);
    }
    printf("std to network: root mean square errors on held-out seconds [N m], of the mean torque, "
           "the PD of robot.ini,\nthe PD fitted to the log, and the network\n");
}

static MildStatus draw(const char *picture, const char *text, size_t size, MildError *error) {
    char data[PATH_SIZE];
    MildStatus status = path_beside(picture, NUMBERS_END, data, error);
    if (status == MILD_OK) {
        status = report_text(text, size, data, error);
    }
    return status == MILD_OK && strcmp(data, picture) != 0
               ? figure_draw("actuator", data, picture, NULL, error)
               : status;
}

static MildStatus fit_record(FitCommand *command, const Record *record, MildError *error) {
    int kind[ROBOT_JOINTS_MAX];
    ActuatorScore score[ROBOT_JOINTS_MAX];
    char *text = NULL, note[96];
    size_t size = 0;
    FILE *held = command->figure ? open_memstream(&text, &size) : NULL;
    if (command->figure && !held) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    command->fit.held_out = held;
    Actuator *actuator = actuator_fit(&command->fit, record, command->context.pool, score, error);
    const int closed = !held || fclose(held) == 0;
    MildStatus status = !actuator ? error->status
                        : closed  ? MILD_OK
                                  : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    snprintf(note, sizeof note, "%d files, %d rows, %d steps, seed %llu", record->files,
             record->rows, command->fit.steps, (unsigned long long)command->fit.seed);
    if (status == MILD_OK) {
        status = actuator_save(actuator, command->out, note, error);
    }
    if (status == MILD_OK) {
        print_scores(record->robot, actuator_kinds(record->robot, kind), score);
        printf("written: %s\n", command->out);
    }
    if (status == MILD_OK && command->figure) {
        status = draw(command->figure, text, size, error);
    }
    free(text);
    actuator_destroy(actuator);
    return status;
}

static MildStatus fit_logs(FitCommand *command, const CliArgs *args, MildError *error) {
    Record *record = calloc(1, sizeof *record);
    if (!record) {
        return mild_fail(error, MILD_ERROR_MEMORY, "actuator: out of memory");
    }
    record->robot = command->context.robot;
    MildStatus status = MILD_OK;
    for (int i = 0; status == MILD_OK && i < args->positional_count; i++) {
        status = record_read(record, args->positional[i], error);
    }
    if (status == MILD_OK) {
        status = fit_record(command, record, error);
    }
    record_free(record);
    free(record);
    return status;
}

static MildStatus run_fit(FitCommand *command, const CliArgs *args, MildError *error) {
    if (!command->out) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--out FILE.safetensors is missing");
    }
    if (args->positional_count == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "no log is given; `mild actuator log --out LOG.csv` makes one");
    }
    Context *on = &command->context;
    on->pool = pool_create(command->threads);
    MildStatus status = on->pool ? context_open(on, args, error)
                                 : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    status = status == MILD_OK ? fit_logs(command, args, error) : status;
    context_close(on);
    return status;
}

static int cmd_fit_actuator(int argc, char **argv) {
    FitCommand c = {.context = context_default(), .fit = actuator_fit_default()};
    c.context.without_policy = 1;
    const CliOption options[] = {
        {"out", CLI_OUTPUT, &c.out, 0, 0, "FILE.safetensors", "where the network is written"},
        {"robot", CLI_TEXT, &c.context.robot_name, 0, 0, "NAME|DIR", ROBOTS_HELP " (default sa01)"},
        {"spacing", CLI_NUMBER, &c.fit.spacing, ACTUATOR_SPACING_MIN, ACTUATOR_SPACING_MAX, "T",
         "[s] between the three times of the history; a multiple of the log's interval and of "
         "task.physics_dt (default 0.01)"},
        {"steps", CLI_INT, &c.fit.steps, 1, 1e7, "N",
         "steps of the optimiser, of 512 samples each (default 6000)"},
        {"seed", CLI_UINT64, &c.fit.seed, 0, 0, "S",
         "of the held-out seconds, the first weights and the samples' order (default 1)"},
        {"threads", CLI_INT, &c.threads, 0, 1024, "N",
         "threads; 0: one per core; the result does not depend on it (default 0)"},
        {"figure", CLI_OUTPUT, &c.figure, 0, 0, "FILE.png",
         "draw torques of a held-out second; the numbers go to FILE_held.csv beside it"},
    };
    const CliCommand command = {
        .name = "actuator fit",
        .usage = "LOG.csv [LOG2.csv ...] --out FILE.safetensors [options]",
        .summary = "Trains a network that gives the torque of a joint from the errors of its angle "
                   "and its speeds at t, t - 0.01 s and t - 0.02 s. Joints with equal gains, "
                   "effort and speed in robot.ini share one network. A log is a CSV file with the "
                   "columns time_s and, for each logged joint, JOINT.error_rad (target minus "
                   "angle), JOINT.speed_rad_s and JOINT.torque_nm. One second in five is held out. "
                   "Use the file with --task.actuator=FILE.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild actuator log --out motor.csv\n"
                    "  mild actuator fit motor.csv --out motor.safetensors --figure motor.png\n"
                    "  mild eval --task.actuator=motor.safetensors\n",
        .positional_max = CLI_LIST_MAX,
        .picture = "figure",
        .numbers = NUMBERS_END,
    };
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    const int bad = cli_refuse_dash(command.name, "out", c.out);
    if (bad) {
        return bad;
    }
    MildError error = {0};
    return run_fit(&c, &args, &error) == MILD_OK ? 0 : cli_fail("actuator fit", &error);
}

/* ---- log ---- */

typedef struct {
    Context context;
    const char *out;
    MotorDef motor;
    Motor made_up;
    MotorLogDef log;
} LogCommand;

static MildStatus write_log(LogCommand *c, MildError *error) {
    Context *on = &c->context;
    Sheet csv = {0};
    int falls;
    motor_init(&c->made_up, &c->motor, on->robot, on->task.physics_dt);
    c->log.task = &on->task, c->log.robot = on->robot, c->log.controller = &on->mover;
    c->log.motors = &c->made_up.motors;
    MildStatus status = sheet_open(&csv, error);
    c->log.csv = csv.file;
    status = status == MILD_OK ? motor_log(&c->log, &falls, error) : status;
    status = sheet_close(&csv, c->out, status, error);
    if (status == MILD_OK) {
        fprintf(strcmp(c->out, "-") == 0 ? stderr : stdout, "%.0f s, %d falls, written: %s\n",
                c->log.seconds, falls, c->out);
    }
    return status;
}

static MildStatus run_log(LogCommand *c, const CliArgs *args, MildError *error) {
    if (!c->out) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--out LOG.csv is missing");
    }
    Context *on = &c->context;
    MildStatus status = context_open(on, args, error);
    on->task.randomize.push_interval = task_def_default().randomize.push_interval;
    if (status == MILD_OK) {
        status = context_move(on, 1, error);
    }
    if (status == MILD_OK) {
        status = write_log(c, error);
    }
    context_close(on);
    return status;
}

static int cmd_log_actuator(int argc, char **argv) {
    LogCommand c = {.context = context_default(),
                    .motor = motor_def_default(),
                    .log = {.seconds = 60, .shake = 0.1, .seed = 1}};
    c.context.controller = "learned";
    const CliOption options[] = {
        {"out", CLI_OUTPUT, &c.out, 0, 0, "LOG.csv",
         "where the log is written; - for standard "
         "output"},
        {"robot", CLI_TEXT, &c.context.robot_name, 0, 0, "NAME|DIR",
         ROBOTS_HELP " (default: the policy's, or sa01)"},
        context_controller(&c.context),
        context_policy(&c.context,
                       "policy that walks (default policies/mild.safetensors, or that of --robot)"),
        {"seconds", CLI_NUMBER, &c.log.seconds, 0.1, 3600, "T", "[s] of the log (default 60)"},
        {"shake", CLI_NUMBER, &c.log.shake, 0, 1, "A",
         "[rad] greatest amplitude of the sines of 0.5 to 8 Hz that are added to the targets "
         "(default 0.1)"},
        {"delay", CLI_NUMBER, &c.motor.delay, 0, 0.02, "T",
         "[s] of the motor's drive, in whole steps of 2.5 ms (default 0.005)"},
        {"coulomb", CLI_NUMBER, &c.motor.coulomb, 0, 0.2, "X",
         "[-] Coulomb friction as a share of the joint's effort (default 0.02)"},
        {"viscous", CLI_NUMBER, &c.motor.viscous, 0, 1, "X",
         "[-] viscous friction at the speed limit as a share of the effort (default 0.1)"},
        {"peak", CLI_NUMBER, &c.motor.peak, 0.05, 1, "X",
         "[-] largest torque as a share of the effort; above half of the speed limit it falls to "
         "0 (default 0.5)"},
        {"seed", CLI_UINT64, &c.log.seed, 0, 0, "S",
         "the same seed gives the same log (default 1)"},
    };
    const CliCommand command = {
        .name = "actuator log",
        .usage = "--out LOG.csv [options]",
        .summary = "Writes a log of the joints of a simulated robot whose motors have friction, "
                   "saturation and delay, one row per physics step, as `mild actuator fit` reads "
                   "it. The robot walks on soft grounds by changing commands, is pushed, and its "
                   "targets are shaken; when it falls the time jumps by a second.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild actuator log --out motor.csv\n"
                    "  mild actuator log --out other.csv --seed 2 --coulomb 0.05\n",
    };
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    MildError error = {0};
    return run_log(&c, &args, &error) == MILD_OK ? 0 : cli_fail("actuator log", &error);
}

/* ---- the command ---- */

int cmd_actuator(int argc, char **argv) {
    static const CliWord words[] = {
        {"fit", "train the network of a robot's motors on logs of its joints"},
        {"log",
         "log the joints of a simulated robot whose motors have friction, saturation, delay"},
    };
    const CliCommand command = {
        .name = "actuator",
        .usage = "fit LOG.csv [LOG2.csv ...] --out FILE.safetensors | log --out LOG.csv",
        .summary = "Fits a network to the motors of a robot, for task.actuator, and logs simulated "
                   "ones. Each of the two has a --help of its own.",
        .words_title = "first word",
        .words = words,
        .word_count = sizeof words / sizeof *words,
        .examples = "  mild actuator log --out motor.csv\n"
                    "  mild actuator fit motor.csv --out motor.safetensors\n"
                    "  mild eval --task.actuator=motor.safetensors\n",
        .positional_max = 1,
    };
    if (argc > 1 && strcmp(argv[1], "fit") == 0) {
        return cmd_fit_actuator(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "log") == 0) {
        return cmd_log_actuator(argc - 1, argv + 1);
    }
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    return cli_fail_text("actuator", "'%.40s' is neither fit nor log; see mild actuator --help",
                         args.positional_count ? args.positional[0] : "");
}
