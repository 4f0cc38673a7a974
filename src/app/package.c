#include "app/package.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "app/cli.h"
#include "base/paths.h"

static const char *const commands[] = {"trial", "judge"};
enum { COMMANDS = sizeof commands / sizeof *commands };

/* Like `python -m mild`, but the working directory is no place of packages: its files could be
 * anybody's. For this `trial` is not started, whose policies may be modules there. Arguments: what
 * is said without the package, its folder, those of the command. */
static const char code[] = "import sys\n"
                           "said, folder, *words = sys.argv[1:]\n"
                           "sys.path[:] = [folder] * bool(folder) + [p for p in sys.path if p]\n"
                           "try:\n"
                           "    from mild.__main__ import main\n"
                           "except ImportError:\n"
                           "    print(said, file=sys.stderr)\n"
                           "    sys.exit(2)\n"
                           "sys.exit(main(words))\n";

int package_has(const char *command) {
    for (int i = 0; i < COMMANDS; i++) {
        if (strcmp(command, commands[i]) == 0) {
            return 1;
        }
    }
    return 0;
}

void package_python(char python[PATH_SIZE]) {
    const char *named = getenv("MILD_PYTHON");
    if (named && *named) {
        snprintf(python, PATH_SIZE, "%s", named);
    } else if (access(path_data(".venv/bin/python", python), X_OK) != 0) {
        snprintf(python, PATH_SIZE, "python3");
    }
}

/* Replaces this process; returns where that cannot be. */
static void become_python(char *said, char **arguments) {
    char python[PATH_SIZE], folder[PATH_SIZE], program[sizeof code];
    int count = 0;
    while (arguments[count]) {
        count++;
    }
    char **words = calloc((size_t)count + 6, sizeof *words);
    if (!words) {
        return;
    }
    setenv("MILD", path_program(folder), 1);
    package_python(python);
    if (access(path_beside_program("python/mild/__main__.py", folder), R_OK) == 0) {
        path_beside_program("python", folder);
    } else {
        *folder = '\0';
    }
    memcpy(program, code, sizeof code);
    char *const head[] = {python, "-c", program, said, folder};
    memcpy(words, head, sizeof head);
    memcpy(words + 5, arguments, (size_t)count * sizeof *words);
    execvp(python, words);
    free(words);
}

int package_run(char **arguments) {
    const char *name = strcmp(arguments[0], "bench") == 0 ? "bench record" : arguments[0];
    char said[128];
    snprintf(said, sizeof said, "mild: %s is a command of the Python package: python -m mild %s",
             name, name);
    if (strcmp(name, "trial") != 0) {
        become_python(said, arguments);
    }
    fprintf(stderr, "%s\n", said);
    return CLI_EXIT_BAD_INPUT;
}
