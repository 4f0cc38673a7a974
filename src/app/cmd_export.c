/* mild export: a policy for programs that are not ours, as an ONNX graph and as C. */
#include "deploy/export/export.h"

#include <stdio.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/context.h"
#include "control/learned.h"

typedef struct {
    Context context;
    const char *onnx, *c; /* NULL: not given */
    int in_double;
} Exporting;

static MildStatus write_files(const Exporting *e, MildError *error) {
    const Context *c = &e->context;
    char note[1024];
    Network network;
    MildStatus status = MILD_OK;
    Policy *policy = learned_policy(c->policy, &c->task, c->robot, note, sizeof note, error);
    if (!policy) {
        return error->status;
    }
    const Export export = {.robot = c->robot,
                           .task = &c->task,
                           .network = &network,
                           .parameters = policy_parameters(policy),
                           .note = note,
                           .version = build_version(),
                           .in_double = e->in_double};
    status = task_def_check_plain(&c->task, c->policy, error);
    if (status == MILD_OK) {
        status = network_layout(&network, policy_def(policy), error);
    }
    if (status == MILD_OK && e->c) {
        status = export_c(&export, e->c, error);
    }
    if (status == MILD_OK && e->onnx) {
        status = export_onnx(&export, e->onnx, error);
    }
    policy_destroy(policy);
    return status;
}

static MildStatus run_export(Exporting *e, const CliArgs *args, MildError *error) {
    MildStatus status = context_open(&e->context, args, error);
    status = status == MILD_OK ? write_files(e, error) : status;
    context_close(&e->context);
    return status;
}

int cmd_export(int argc, char **argv) {
    static Exporting e;
    e.context = context_default();
    const CliOption options[] = {
        context_policy(&e.context,
                       "policy to export (default policies/mild.safetensors, or that of --robot)"),
        context_robot(&e.context),
        context_config(&e.context),
        {"onnx", CLI_OUTPUT, &e.onnx, 0, 0, "FILE",
         "write one graph with weights, history and metadata"},
        {"double", CLI_FLAG, &e.in_double, 0, 0, NULL,
         "compute the graph in double precision, in more than twice the time; its inputs and "
         "outputs stay 32-bit floats"},
        {"c", CLI_OUTPUT_LATER, &e.c, 0, 0, "FOLDER",
         "make a folder with policy.h, policy.c, policy_weights.h and example.c, in C99 that "
         "needs libm alone and allocates nothing"},
    };
    const CliCommand command = {
        .name = "export",
        .usage = "--onnx FILE | --c FOLDER [options]",
        .summary = "Writes a policy with everything that a program of your own must know to run "
                   "it: joints and their order, default pose, gains, limits, scales, history and "
                   "clock (docs/policy.md).",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of section [task] that the policy was trained with, e.g. "
                     "--task.gait_period=0.7",
        .examples = "  mild export --onnx policy.onnx\n"
                    "  mild export --c deploy && cc -O3 -march=native deploy/*.c -lm -o run\n",
    };
    static CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    if (!e.onnx && !e.c) {
        return cli_fail_text("export", "nothing to write; give --onnx FILE or --c FOLDER");
    }
    if (e.in_double && !e.onnx) {
        return cli_fail_text("export", "--double is for the graph of --onnx FILE");
    }
    const int bad = cli_refuse_dash("export", "onnx", e.onnx);
    if (bad) {
        return bad;
    }
    MildError error = {0};
    return run_export(&e, &args, &error) == MILD_OK ? 0 : cli_fail("export", &error);
}
