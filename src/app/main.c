/* The program `mild`: a table of commands. Only this layer turns text into structs and errors into
 * exit codes. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "base/text.h"
#include "robot/engine.h"

#ifndef MILD_VIEW
int cmd_play(int argc, char **argv) {
    (void)argc;
    (void)argv;
    return cli_fail_text("play", "built without drawing; configure with -DMILD_VIEW=ON");
}
#endif

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
} commands[] = {
    {"train", cmd_train, "train a walking policy on soft ground"},
    {"eval", cmd_eval, "measure how a policy walks on several grounds and at several speeds"},
    {"play", cmd_play, "watch a policy walk, in a window or as a video"},
    {"press", cmd_press, "press a plate or a sole into a ground and record the force"},
    {"fit", cmd_fit, "find the parameters of a ground from recorded presses"},
    {"export", cmd_export, "write a policy as an ONNX graph or as C, to run it elsewhere"},
    {"drive", cmd_drive, "run a policy for a robot over UDP, or be that robot, simulated"},
    {"bench", cmd_bench, "measure speed and memory on this machine"},
    {"info", cmd_info, "list grounds, models, config keys, versions and devices"},
};
enum { COMMANDS = sizeof commands / sizeof *commands };

static void print_help(FILE *file) {
    fprintf(
        file,
        "mild %s: soft ground for legged robots\n\nusage: mild COMMAND [options]\n\ncommands:\n",
        build_version());
    for (int i = 0; i < COMMANDS; i++) {
        fprintf(file, "  %-8s%s\n", commands[i].name, commands[i].help);
    }
    fprintf(
        file,
        "\nRun `mild COMMAND --help` for the options of a command. The exit code is 0 on success "
        "and 2 after\nan error, which is one line on standard error.\n\n"
        "try first:\n"
        "  mild play --policy policies/mild.safetensors --ground sand_loose --video walk.mp4\n"
        "  mild press --ground foam45 --depth 0.03\n");
}

/* Only the last flush shows whether standard output took everything, for example on a full disk. */
static int finish(int code) {
    int failed = ferror(stdout);
    errno = 0;
    if (fflush(stdout) != 0 || failed) {
        failed = 1;
    }
    if (!failed || code != 0) { /* a failed command has printed its error already */
        return code;
    }
    fprintf(stderr, "mild: cannot write to standard output: %s\n",
            errno ? strerror(errno) : "part of it is lost");
    return CLI_EXIT_BAD_INPUT;
}

/* MuJoCo calls this when it cannot go on. */
static void end_for_engine(const char *text) {
    fprintf(stderr, "mild: MuJoCo failed: %s\n", text);
    _exit(CLI_EXIT_BAD_INPUT);
}

int main(int argc, char **argv) {
    engine_on_error(end_for_engine);
    if (argc < 2) {
        print_help(stderr);
        return CLI_EXIT_BAD_INPUT;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 ||
        strcmp(argv[1], "help") == 0) {
        print_help(stdout);
        return finish(0);
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("mild %s\n", build_version());
        return finish(0);
    }
    const char *names[COMMANDS];
    for (int i = 0; i < COMMANDS; i++) {
        if (strcmp(argv[1], commands[i].name) == 0) {
            return finish(commands[i].run(argc - 1, argv + 1));
        }
        names[i] = commands[i].name;
    }
    fprintf(stderr, "mild: unknown command '%s'; nearest is '%s' (mild --help lists all)\n",
            argv[1], text_nearest(argv[1], names, COMMANDS));
    return CLI_EXIT_BAD_INPUT;
}
