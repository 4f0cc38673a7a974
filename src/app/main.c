/* The program `mild`. Only this layer turns text into structs and errors into
 * exit codes. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/package.h"
#include "app/plain.h"
#include "base/text.h"
#include "learn/product.h"
#include "robot/engine.h"

static void print_help(FILE *file) {
    fprintf(file, "mild %s: soft ground for legged robots\n\n", build_version());
    fprintf(file, "usage: mild COMMAND [options]\n\ncommands:\n");
    for (int i = 0; i < command_count; i++) {
        fprintf(file, "  %-10s%s\n", commands[i].name, commands[i].help);
    }
    fputs("\nRun `mild COMMAND --help` for the options of a command. The exit code is 0 on "
          "success and 2 after\nan error, which is one line on standard error.\n\ntry first:\n"
          "  mild play --policy policies/mild.safetensors --ground sand_loose --video walk.mp4\n"
          "  mild press --ground foam45 --depth 0.03\n",
          file);
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

/* oneDNN is C++ inside, and throws when memory runs out. */
static void end_for_exception(void) {
    static const char text[] = "mild: out of memory\n";
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    _exit(CLI_EXIT_BAD_INPUT);
}

int main(int argc, char **argv) {
    plain_streams();
    engine_on_error(end_for_engine);
    product_on_exception(end_for_exception);
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
    const char *names[COMMANDS_MAX];
    for (int i = 0; i < command_count; i++) {
        if (strcmp(argv[1], commands[i].name) == 0) {
            return finish(commands[i].run(argc - 1, argv + 1));
        }
        names[i] = commands[i].name;
    }
    if (package_has(argv[1])) {
        return package_run(argv + 1);
    }
    package_other(argv + 1);
    fprintf(stderr, "mild: unknown command '%s'; nearest is '%s' (mild --help lists all)\n",
            argv[1], text_nearest(argv[1], names, command_count));
    return CLI_EXIT_BAD_INPUT;
}
