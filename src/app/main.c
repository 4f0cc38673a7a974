/* The program `mild`: a table of commands. Only in this layer text becomes structs and errors
 * become exits. */
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
    {"eval", cmd_eval, "walk a policy over grounds and speeds, and print what came out"},
    {"play", cmd_play, "watch a policy: video, window, picture of sole pressure"},
    {"press", cmd_press, "press a plate or a sole into a ground and record the force"},
    {"fit", cmd_fit, "find a ground's parameters from recorded presses"},
    {"bench", cmd_bench, "measure speed and memory on this machine"},
    {"info", cmd_info, "grounds, models, config keys, build, devices"},
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
    fprintf(file,
            "\n`mild COMMAND --help` tells the rest. Exit code: 0 fine, 2 bad input.\n\n"
            "a first look:\n"
            "  mild play --policy policies/mild.safetensors --ground sand_loose --video walk.mp4\n"
            "  mild press --ground foam45 --depth 0.03\n");
}

/* What was printed must have arrived: a full disk is found out at the last flush. */
static int finish(int code) {
    int failed = ferror(stdout);
    errno = 0;
    if (fflush(stdout) != 0 || failed) {
        failed = 1;
    }
    if (!failed || code != 0) { /* a command that failed has said its line */
        return code;
    }
    fprintf(stderr, "mild: cannot write to standard output: %s\n",
            errno ? strerror(errno) : "part of it is lost");
    return CLI_EXIT_BAD_INPUT;
}

/* MuJoCo cannot go on. */
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
