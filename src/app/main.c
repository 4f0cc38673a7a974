/* The program `mild`. Only this layer turns text into structs and errors into
 * exit codes. */
#define _GNU_SOURCE /* fopencookie */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/package.h"
#include "base/text.h"
#include "learn/product.h"
#include "robot/engine.h"

#ifdef MILD_LAB
#include "lab/lists.h"
#else
#define LAB_COMMANDS(X)
#endif

/* ---- the table of commands ---- */

#ifndef MILD_VIEW
int cmd_play(int argc, char **argv) {
    (void)argc;
    (void)argv;
    return cli_fail_text("play", "built without drawing; configure with -DMILD_VIEW=ON");
}
#endif

typedef struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
} AppCommand;

#define ROW(name, help) {#name, cmd_##name, help},
static const AppCommand commands[] = {COMMAND_LIST(ROW) LAB_COMMANDS(ROW)};
#undef ROW
enum { COMMANDS = sizeof commands / sizeof *commands };

/* ---- plain text, whatever the names in a file hold ---- */

typedef struct {
    int file;
    const char *keep;
    char torn[4]; /* begin of a character whose rest has not been printed yet */
    size_t count; /* of its bytes */
} Plain;

static int write_all(int file, const char *bytes, size_t size) {
    while (size > 0) {
        const ssize_t written = write(file, bytes, size);
        if (written < 0 && errno != EINTR) {
            return 0;
        }
        bytes += written > 0 ? written : 0;
        size -= written > 0 ? (size_t)written : 0;
    }
    return 1;
}

static ssize_t write_plain(void *cookie, const char *bytes, size_t size) {
    Plain *plain = cookie;
    for (size_t done = 0; done < size;) {
        char block[4096];
        const size_t before = plain->count;
        const size_t room = sizeof block - before;
        const size_t taken = size - done < room ? size - done : room;
        memcpy(block, plain->torn, before);
        memcpy(block + before, bytes + done, taken);
        plain->count = text_plain(block, before + taken, plain->keep);
        const size_t whole = before + taken - plain->count;
        memcpy(plain->torn, block + whole, plain->count);
        if (!write_all(plain->file, block, whole)) {
            return 0;
        }
        done += taken;
    }
    return (ssize_t)size;
}

/* The stream itself when memory runs out. */
static FILE *guard(FILE *stream, Plain *plain, int buffered) {
    const cookie_io_functions_t calls = {.write = write_plain};
    FILE *guarded = fopencookie(plain, "w", calls);
    if (!guarded) {
        return stream;
    }
    setvbuf(guarded, NULL, buffered, BUFSIZ);
    return guarded;
}

/* From now on standard output and standard error replace control characters but line ends and tabs
 * by '?' (text_plain). A name in a file cannot move the cursor, change colours, or answer in the
 * user's name. */
static void plain_streams(void) {
    /* the progress line returns to its begin; so do lines of files from other systems */
    static Plain out = {.file = STDOUT_FILENO, .keep = "\n\t"},
                 err = {.file = STDERR_FILENO, .keep = "\n\t\r"};
    const int terminal = isatty(STDOUT_FILENO);
    out.keep = terminal ? "\n\t" : "\n\t\r";
    stdout = guard(stdout, &out, terminal ? _IOLBF : _IOFBF);
    stderr = guard(stderr, &err, _IONBF);
}

/* ---- program ---- */

static void print_help(FILE *file) {
    fprintf(file, "mild %s: soft ground for legged robots\n\n", build_version());
    fprintf(file, "usage: mild COMMAND [options]\n\ncommands:\n");
    for (int i = 0; i < COMMANDS; i++) {
        fprintf(file, "  %-10s%s\n", commands[i].name, commands[i].help);
    }
    fputs("\nOf the Python package: `mild trial` lets any policy walk on soft ground, `mild judge` "
          "judges ground\nmodels by grains.\n",
          file);
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
    const char *names[COMMANDS + PACKAGE_COMMANDS];
    for (int i = 0; i < COMMANDS; i++) {
        if (strcmp(argv[1], commands[i].name) == 0) {
            return finish(commands[i].run(argc - 1, argv + 1));
        }
        names[i] = commands[i].name;
    }
    if (package_has(argv[1])) {
        return package_run(argv + 1);
    }
    package_other(argv + 1);
    memcpy(names + COMMANDS, package_commands, sizeof package_commands);
    fprintf(stderr, "mild: unknown command '%s'; nearest is '%s' (mild --help lists all)\n",
            argv[1], text_nearest(argv[1], names, COMMANDS + PACKAGE_COMMANDS));
    return CLI_EXIT_BAD_INPUT;
}
