/* mild drive: runs a policy for a robot on the other end of a UDP socket, or is that robot,
 * simulated. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/context.h"
#include "app/report.h"
#include "drive/drive.h"
#include "identify/belief/file.h"
#include "lab/lists.h"

#define ADDRESS "127.0.0.1:9870"

typedef struct {
    Context context;
    const char *json, *gamepad, *listen, *connect, *bind, *peer, *key, *ground,
        *log; /* NULL: not given */
    CliNumbers command, delay;
    int simulate, no_keys, lockstep;
    RunnerDef runner;
    SimulatedDef simulated;
    Key secret;        /* of --key */
    BeliefNet *belief; /* NULL: the robot has none */
    double seconds;
} Drive;

/* ---- results ---- */

static cJSON *add_times(cJSON *parent, const char *name, const Times *times) {
    cJSON *o = cJSON_AddObjectToObject(parent, name);
    cJSON_AddNumberToObject(o, "count", (double)times->count);
    cJSON_AddNumberToObject(o, "p50_s", times_quantile(times, 0.5));
    cJSON_AddNumberToObject(o, "p99_s", times_quantile(times, 0.99));
    cJSON_AddNumberToObject(o, "p999_s", times_quantile(times, 0.999));
    cJSON_AddNumberToObject(o, "longest_s", times->longest);
    cJSON *bins = cJSON_AddArrayToObject(o, "bins"); /* [from, to, count] where there are any */
    for (int i = 0; i < TIMES_BINS; i++) {
        if (times->bin[i] > 0) {
            const double bin[3] = {times_edge(i), times_edge(i + 1), (double)times->bin[i]};
            cJSON_AddItemToArray(bins, cJSON_CreateDoubleArray(bin, 3));
        }
    }
    return o;
}

static cJSON *runner_json(const Context *c, const DriveReport *report, const RunnerReport *runner) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "policy", c->policy);
    cJSON_AddStringToObject(root, "robot", robot_name(c->robot));
    cJSON_AddStringToObject(root, "version", build_version());
    cJSON_AddStringToObject(root, "end", report->end);
    cJSON_AddStringToObject(root, "why_damped", runner->why);
    const struct {
        const char *name;
        double value;
    } counts[] = {{"seconds", report->seconds},
                  {"ticks", (double)report->ticks},
                  {"missed_ticks", (double)report->missed},
                  {"strangers", (double)runner->refused[PACKET_FAULT_stranger]},
                  {"ends_ignored", (double)runner->ends_ignored},
                  {"received", (double)runner->received},
                  {"lost", (double)runner->lost},
                  {"reordered", (double)runner->reordered},
                  {"late", (double)runner->late},
                  {"steps", (double)runner->steps},
                  {"holds", (double)runner->holds},
                  {"damps", (double)runner->damps},
                  {"targets_limited", (double)runner->targets_limited}};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        cJSON_AddNumberToObject(root, counts[i].name, counts[i].value);
    }
    cJSON *refused = cJSON_AddObjectToObject(root, "refused");
    for (int i = PACKET_FAULT_none + 1; i < PACKET_FAULTS; i++) {
        cJSON_AddNumberToObject(refused, packet_faults[i], (double)runner->refused[i]);
    }
    add_times(root, "wakeup", &report->wakeup);
    add_times(root, "compute", &report->compute);
    add_times(root, "reply", &report->reply);
    add_times(root, "age", &runner->age);
    return root;
}

static void print_times(FILE *file, const char *name, const Times *times) {
    fprintf(file, "%-9s%12.1f%12.1f%12.1f%12.1f\n", name, 1e6 * times_quantile(times, 0.5),
            1e6 * times_quantile(times, 0.99), 1e6 * times_quantile(times, 0.999),
            1e6 * times->longest);
}

/* Bars of the time to compute a tick, 1, 2 and 5 of each decade. */
static void print_histogram(FILE *file, const Times *times) {
    static const double step[3] = {2, 2.5, 2};
    double edge = 1e-6;
    int bin = 0;
    for (int row = 0; bin < TIMES_BINS; row++) {
        long count = 0;
        edge *= step[row % 3];
        for (; bin < TIMES_BINS && times_edge(bin + 1) < edge * 1.05; bin++) {
            count += times->bin[bin];
        }
        if (count > 0) {
            fprintf(file, "  below %8.0f us %8ld ", 1e6 * edge, count);
            for (long i = 0; i < (50 * count + times->count - 1) / times->count; i++) {
                fputc('#', file);
            }
            fputc('\n', file);
        }
    }
}

/* How many packets were refused, and of these how many for each reason. */
static void print_refused(FILE *file, const RunnerReport *runner) {
    long refused = 0;
    for (int i = PACKET_FAULT_none + 1; i < PACKET_FAULTS; i++) {
        refused += runner->refused[i];
    }
    fprintf(file, "refused %ld", refused);
    for (int i = PACKET_FAULT_none + 1; i < PACKET_FAULTS; i++) {
        if (runner->refused[i] > 0) {
            fprintf(file, ", %s %ld", packet_faults[i], runner->refused[i]);
        }
    }
    fprintf(file, "; ends ignored %ld\n", runner->ends_ignored);
}

static void print_runner(FILE *file, const DriveReport *report, const RunnerReport *runner) {
    fprintf(file,
            "%.2f s, %ld ticks, %ld missed; %ld steps, %ld holds, %ld damped; targets limited %ld\n"
            "states %ld, lost %ld, reordered %ld, late %ld, ",
            report->seconds, report->ticks, report->missed, runner->steps, runner->holds,
            runner->damps, runner->targets_limited, runner->received, runner->lost,
            runner->reordered, runner->late);
    print_refused(file, runner);
    fprintf(file, "[us]            median         p99       p99.9     longest\n");
    print_times(file, "wake-up", &report->wakeup);
    print_times(file, "compute", &report->compute);
    print_times(file, "reply", &report->reply);
    print_times(file, "age", &runner->age);
    fprintf(file, "time to compute a tick:\n");
    print_histogram(file, &report->compute);
}

static cJSON *simulated_json(const SimulatedReport *report) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "end", report->end);
    cJSON_AddBoolToObject(root, "fallen", report->fallen);
    const struct {
        const char *name;
        double value;
    } values[] = {{"seconds", report->seconds},
                  {"way_x_m", report->way[0]},
                  {"way_y_m", report->way[1]},
                  {"real_time_factor", report->rate},
                  {"damped_s", report->damped},
                  {"sent", (double)report->sent},
                  {"dropped", (double)report->dropped},
                  {"delayed", (double)report->delayed},
                  {"targets", (double)report->targets},
                  {"refused", (double)report->refused},
                  {"strangers", (double)report->strangers}};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        cJSON_AddNumberToObject(root, values[i].name, values[i].value);
    }
    return root;
}

/* What the robot's own sensors say of the ground at the end; nothing before the first footstep. */
static void print_ground(FILE *file, const BeliefNet *net, const Belief *belief) {
    char text[400];
    if (net && belief->footsteps > 0) {
        belief_text(belief, net, text, sizeof text);
        fprintf(file, "ground, of %d footsteps, with 90 %%: %s; it changed %d times\n",
                belief->footsteps, text, belief->alarms);
    }
}

static void add_ground(cJSON *root, const BeliefNet *net, const Belief *belief) {
    cJSON *o = cJSON_AddObjectToObject(root, "ground");
    cJSON_AddNumberToObject(o, "footsteps", net ? belief->footsteps : 0);
    cJSON_AddNumberToObject(o, "changes", net ? belief->alarms : 0);
    for (int i = 0; net && belief->footsteps > 0 && i < BELIEF_PARAMETERS; i++) {
        cJSON *one = cJSON_AddObjectToObject(o, belief_names[i].name);
        const BeliefParameter p = (BeliefParameter)i;
        cJSON_AddNumberToObject(one, "median", belief_quantile(belief, net, p, 0.5));
        cJSON_AddNumberToObject(one, "low", belief_quantile(belief, net, p, 0.05));
        cJSON_AddNumberToObject(one, "high", belief_quantile(belief, net, p, 0.95));
    }
}

/* ---- the runner ---- */

static double greater(double a, double b) {
    return a > b ? a : b;
}

static void print_refusal(const char *refusal) {
    fprintf(stderr, "mild drive: refused a packet: %s\n", refusal);
}

static MildStatus run_on(Drive *d, Runner *runner, Udp *udp, MildError *error) {
    const Robot *robot = d->context.robot;
    const TaskDef *t = &d->context.task;
    const double range[3] = {t->vx[1], greater(t->vy[1], -t->vy[0]), greater(t->wz[1], -t->wz[0])};
    const int taken = d->json && strcmp(d->json, "-") == 0;
    char text[32];
    Input input;
    DriveReport report;
    drive_catch_signals();
    MildStatus status = input_open(&input, d->command.value, range, !d->no_keys, d->gamepad, error);
    if (status != MILD_OK) {
        return status;
    }
    fprintf(stderr, "mild drive: %s at %s; robot %08x; %s\n", robot_name(robot),
            udp_text(&udp->own, text), (unsigned)packet_robot(robot),
            input.keys ? INPUT_KEYS : "Ctrl-C ends");
    const DriveDef def = {runner, udp, &input, d->seconds, print_refusal};
    drive_run(&def, &report);
    input_close(&input);
    const RunnerReport *counts = runner_report(runner);
    print_runner(taken ? stderr : stdout, &report, counts);
    print_ground(taken ? stderr : stdout, d->belief, &counts->belief);
    if (d->json) {
        cJSON *root = runner_json(&d->context, &report, counts);
        add_ground(root, d->belief, &counts->belief);
        status = report_save(root, d->json, error);
    }
    return status == MILD_OK && counts->why[0]
               ? mild_fail(error, MILD_ERROR_IO, "damped: %s", counts->why)
               : status;
}

/* What the runner looks at the ground with, and its log. */
static MildStatus open_ground(Drive *d, MildError *error) {
    MildStatus status = belief_open(robot_name(d->context.robot), &d->belief, error);
    d->runner.belief = d->belief;
    if (status != MILD_OK || !d->log) {
        return status;
    }
    if (!d->belief) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--log: only sa01 has learned to know its ground (docs/identify.md)");
    }
    d->runner.log = fopen(d->log, "w");
    if (!d->runner.log) {
        return mild_fail(error, MILD_ERROR_IO, "%s: cannot write", d->log);
    }
    belief_log_print_header(d->runner.log);
    return MILD_OK;
}

static MildStatus run_runner(Drive *d, MildError *error) {
    Udp udp = {.file = -1};
    d->runner.policy = d->context.policy;
    d->runner.robot = d->context.robot;
    d->runner.task = &d->context.task;
    MildStatus status = key_draw_session(&d->runner.session, error);
    if (status == MILD_OK) {
        status = open_ground(d, error);
    }
    if (status == MILD_OK && d->peer) {
        status = udp_find_sender("peer", d->peer, &d->runner.peer, error);
    }
    Runner *runner = status == MILD_OK ? runner_create(&d->runner, error) : NULL;
    status = runner ? MILD_OK : error->status;
    if (status == MILD_OK) {
        status = udp_listen(&udp, "listen", d->listen ? d->listen : ADDRESS, error);
    }
    if (status == MILD_OK) {
        status = run_on(d, runner, &udp, error);
    }
    udp_close(&udp);
    runner_destroy(runner);
    free(d->belief);
    if (d->runner.log && fclose(d->runner.log) != 0 && status == MILD_OK) {
        status = mild_fail(error, MILD_ERROR_IO, "%s: cannot write all of it", d->log);
    }
    return status;
}

/* ---- the simulated robot ---- */

static MildStatus walk_on(const Drive *d, const Scene *scene, MildError *error) {
    Udp udp = {.file = -1};
    SimulatedDef def = d->simulated;
    SimulatedReport report;
    def.robot = d->context.robot;
    def.task = &d->context.task;
    def.terrain = &scene->terrain;
    def.rigid = scene->rigid;
    def.udp = &udp;
    def.lockstep = d->lockstep;
    def.seconds = d->seconds > 0 ? d->seconds : 3600;
    def.delay_share = d->delay.value[0];
    def.delay = d->delay.value[1];
    MildStatus status = key_draw_session(&def.session, error);
    if (status == MILD_OK) {
        status = udp_connect(&udp, "connect", d->connect ? d->connect : ADDRESS, d->bind, error);
    }
    if (status == MILD_OK) {
        status = simulated_run(&def, &report, error);
    }
    udp_close(&udp);
    if (status != MILD_OK) {
        return status;
    }
    fprintf(d->json && strcmp(d->json, "-") == 0 ? stderr : stdout,
            "%s on %s: %s after %.2f s and %.2f m, %.2f of real time; states %ld, dropped %ld, "
            "delayed %ld; targets %ld, refused %ld, of strangers %ld; damped %.2f s\n",
            robot_name(def.robot), scene->name, report.end, report.seconds, report.way[0],
            report.rate, report.sent, report.dropped, report.delayed, report.targets,
            report.refused, report.strangers, report.damped);
    return d->json ? report_save(simulated_json(&report), d->json, error) : MILD_OK;
}

static MildStatus run_simulated(Drive *d, MildError *error) {
    Scene scene;
    const char *ground = d->ground ? d->ground : "rigid";
    MildStatus status = context_scene(&d->context, ground, 2.5, &scene, error);
    if (status == MILD_OK) {
        status = task_def_check_robot(&d->context.task, d->context.robot, error);
    }
    return status == MILD_OK ? walk_on(d, &scene, error) : status;
}

/* ---- the command ---- */

/* Fails when an option is there that only the other half of the command reads. */
static int refuse_other_half(const CliCommand *command, const CliArgs *args, int simulate) {
    static const char *const runner[] = {"policy",      "listen",       "command",    "gamepad",
                                         "no-keys",     "late",         "damp-after", "speed-limit",
                                         "angle-limit", "torque-share", "peer",       "turn-limit",
                                         "glitch",      "stall-after",  "log",        NULL},
                             *const robot[] = {"connect",  "bind", "ground", "model", "lockstep",
                                               "patience", "drop", "delay",  "seed",  NULL};
    const char *other = cli_first_given(command, args, simulate ? runner : robot);
    return !other     ? 0
           : simulate ? cli_fail_text("drive", "--%s is for the runner, not for --simulate", other)
                      : cli_fail_text("drive", "--%s needs --simulate", other);
}

static MildStatus check_options(const Drive *d, MildError *error) {
    if (d->command.count && d->command.count != 3) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--command: forward, sideways and turning speed, as 0.5,0,0");
    }
    if (d->delay.count && (d->delay.count != 2 || d->delay.value[0] > 1)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--delay: a share in 0 .. 1 and seconds, as 0.05,0.02");
    }
    return MILD_OK;
}

static MildStatus run_drive(Drive *d, const CliArgs *args, MildError *error) {
    MildStatus status = check_options(d, error);
    if (status == MILD_OK && d->key) {
        status = key_read(d->key, &d->secret, error);
        d->runner.key = d->simulated.key = &d->secret;
    }
    if (status != MILD_OK) {
        return status;
    }
    Context *c = &d->context;
    c->without_policy = c->on_ground = d->simulate;
    status = context_open(c, args, error);
    if (status == MILD_OK) {
        status = (d->simulate ? run_simulated : run_runner)(d, error);
    }
    context_close(c);
    return status;
}

int cmd_drive(int argc, char **argv) {
    static Drive d;
    static CliArgs args;
    d.context = context_default();
    d.runner = (RunnerDef){.late = 0.02,
                           .damp_after = 0.1,
                           .stall_after = 0.05,
                           .glitch = 0.02,
                           .turn_limit = 10,
                           .speed_limit = 30,
                           .angle_limit = 0.5,
                           .torque_share = 1};
    d.simulated = (SimulatedDef){.patience = 30, .seed = 1};
    const CliOption options[] = {
        context_policy(&d.context,
                       "policy to run (default policies/mild.safetensors, or that of --robot)"),
        context_robot(&d.context),
        context_config(&d.context),
        {"listen", CLI_TEXT, &d.listen, 0, 0, "HOST:PORT",
         "where states arrive; targets go to where they come from (default " ADDRESS ")"},
        {"peer", CLI_TEXT, &d.peer, 0, 0, "HOST[:PORT]",
         "the robot; packets of others are not heard (default: whoever first sends five good "
         "states in a row)"},
        {"key", CLI_INPUT, &d.key, 0, 0, "FILE",
         "32 to 64 bytes that the robot has, too: packets that are not sealed with them are "
         "refused"},
        {"command", CLI_NUMBERS, &d.command, -10, 10, "VX,VY,WZ",
         "[m/s, m/s, rad/s] forward, to the left, turning left; brought into the ranges of section "
         "[task] (default 0,0,0)"},
        {"gamepad", CLI_TEXT, &d.gamepad, 0, 0, "FILE",
         "a gamepad of Linux, /dev/input/js0: left stick walks, right stick turns, button 1 damps"},
        {"no-keys", CLI_FLAG, &d.no_keys, 0, 0, NULL, "leave the terminal's keys alone"},
        {"late", CLI_NUMBER, &d.runner.late, 0.001, 10, "T",
         "[s] a state that took so much longer than the fastest one is not used (default 0.02)"},
        {"damp-after", CLI_NUMBER, &d.runner.damp_after, 0.01, 60, "T",
         "[s] without a state until the robot is damped, for good (default 0.1)"},
        {"stall-after", CLI_NUMBER, &d.runner.stall_after, 0.015, 60, "T",
         "[s] between two ticks of the runner until the robot is damped, for good (default 0.05)"},
        {"turn-limit", CLI_NUMBER, &d.runner.turn_limit, 0, 1000, "W",
         "[rad/s] a state whose base is faster, or turned faster since the last one, is not used; "
         "0: none (default 10)"},
        {"speed-limit", CLI_NUMBER, &d.runner.speed_limit, 0, 1000, "W",
         "[rad/s] a state with a joint that is faster, or moved faster since the last one, is not "
         "used; 0: none (default 30)"},
        {"angle-limit", CLI_NUMBER, &d.runner.angle_limit, -1, 10, "A",
         "[rad] a state with a joint so far beyond its range is not used; negative: none (default "
         "0.5)"},
        {"glitch", CLI_NUMBER, &d.runner.glitch, 0, 10, "T",
         "[s] states beyond these limits may come for so long; then the robot is damped, for good "
         "(default 0.02)"},
        {"torque-share", CLI_NUMBER, &d.runner.torque_share, 0.01, 1, "S",
         "[-] of the torque limit of the task that targets may ask for (default 1)"},
        {"seconds", CLI_NUMBER, &d.seconds, 0, 86400, "T",
         "[s] from the first target on; 0: until Ctrl-C (default 0)"},
        {"simulate", CLI_FLAG, &d.simulate, 0, 0, NULL,
         "be the robot, simulated in MuJoCo, and send states to --connect"},
        {"connect", CLI_TEXT, &d.connect, 0, 0, "HOST:PORT",
         "simulated robot: where the runner listens (default " ADDRESS ")"},
        {"bind", CLI_TEXT, &d.bind, 0, 0, "HOST[:PORT]",
         "simulated robot: its own address, needed when --connect names another machine (default "
         "127.0.0.1)"},
        {"ground", CLI_TEXT, &d.ground, 0, 0, "NAME[+NAME]",
         "simulated robot: ground, or a course of them (default rigid)"},
        context_model(&d.context),
        {"lockstep", CLI_FLAG, &d.lockstep, 0, 0, NULL,
         "simulated robot: its time stands still until a state is answered"},
        {"patience", CLI_NUMBER, &d.simulated.patience, 0.1, 3600, "T",
         "[s] simulated robot: wait so long for the first answer, and in lockstep for each "
         "(default 30)"},
        {"drop", CLI_NUMBER, &d.simulated.drop, 0, 1, "P",
         "[-] simulated robot: share of its states that are lost (default 0)"},
        {"delay", CLI_NUMBERS, &d.delay, 0, 10, "P,T",
         "[-, s] simulated robot: share of its states that are sent so late (default 0,0)"},
        {"seed", CLI_UINT64, &d.simulated.seed, 0, 0, "S",
         "simulated robot: its start, and what is lost (default 1)"},
        {"log", CLI_OUTPUT, &d.log, 0, 0, "FILE.csv",
         "also write the frames that the policy sees, for mild fit FILE.csv"},
        {"json", CLI_OUTPUT, &d.json, 0, 0, "FILE",
         "also write counts and times as JSON to FILE; - for standard output"},
    };
    const CliCommand command = {
        .name = "drive",
        .usage = "[--listen HOST:PORT] [options] | --simulate [options]",
        .summary =
            "Runs a policy at 100 Hz for a robot that sends its state and takes joint "
            "targets by UDP (lab/drive/README.md), and prints how long everything took. Without "
            "a new state it holds the last targets, then damps the robot. With --simulate "
            "it is the robot.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of section [task]; with --simulate also of [ground] and [terrain]",
        .examples =
            "  mild drive --command 0.5,0,0\n"
            "  mild drive --simulate --ground sand_loose    # in another terminal\n"
            "  mild drive --listen 0.0.0.0:9870 --gamepad /dev/input/js0 --json drive.json\n",
    };
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    int bad = refuse_other_half(&command, &args, d.simulate);
    bad = bad ? bad : cli_refuse_dash("drive", "log", d.log);
    if (bad) {
        return bad;
    }
    MildError error = {0};
    return run_drive(&d, &args, &error) == MILD_OK ? 0 : cli_fail("drive", &error);
}
