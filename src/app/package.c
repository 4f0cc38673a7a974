#include "app/package.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "app/cli.h"
#include "base/paths.h"
#include "base/text.h"

const char *const package_commands[PACKAGE_COMMANDS] = {"trial", "judge"};

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
    return text_find(command, package_commands, PACKAGE_COMMANDS) >= 0;
}

void package_python(char python[PATH_SIZE]) {
    const char *named = getenv("MILD_PYTHON");
    if (named && *named) {
        snprintf(python, PATH_SIZE, "%s", named);
    } else if (access(path_data(".venv/bin/python", python), X_OK) != 0) {
        snprintf(python, PATH_SIZE, "python3");
    }
}

/* Becomes the words of `head`, then `arguments`. Returns where that cannot be. */
static void become(char *const *head, int words, char **arguments) {
    int count = 0;
    while (arguments[count]) {
        count++;
    }
    char **all = calloc((size_t)(words + count) + 1, sizeof *all);
    if (!all) {
        return;
    }
    memcpy(all, head, (size_t)words * sizeof *all);
    memcpy(all + words, arguments, (size_t)count * sizeof *all);
    execvp(all[0], all);
    free(all);
}

static void become_package(char *said, char **arguments) {
    char python[PATH_SIZE], folder[PATH_SIZE], program[sizeof code];
    setenv("MILD", path_program(folder), 1);
    package_python(python);
    if (access(path_beside_program("python/mild/__main__.py", folder), R_OK) == 0) {
        path_beside_program("python", folder);
    } else {
        *folder = '\0';
    }
    memcpy(program, code, sizeof code);
    char *const head[] = {python, "-c", program, said, folder};
    become(head, sizeof head / sizeof *head, arguments);
}

int package_run(char **arguments) {
    const char *name = strcmp(arguments[0], "bench") == 0 ? "bench record" : arguments[0];
    char said[128];
    snprintf(said, sizeof said, "mild: %s is a command of the Python package: python -m mild %s",
             name, name);
    if (strcmp(name, "trial") != 0) {
        become_package(said, arguments);
    }
    fprintf(stderr, "%s\n", said);
    return CLI_EXIT_BAD_INPUT;
}

void package_other(char **arguments) {
    char name[64], beside[PATH_SIZE], program[PATH_SIZE];
    const int length = snprintf(name, sizeof name, "mild-%s", arguments[0]);
    if (length >= (int)sizeof name || *arguments[0] == '-' || strchr(name, '/')) {
        return;
    }
    setenv("MILD", path_program(program), 1);
    if (*path_beside_program(name, beside)) {
        become((char *[]){beside}, 1, arguments + 1);
    }
    become((char *[]){name}, 1, arguments + 1);
}

int package_script(const char *script, char **arguments) {
    char python[PATH_SIZE], path[PATH_SIZE], isolated[] = "-I";
    package_python(python);
    if (access(path_data(script, path), R_OK) != 0) {
        return cli_fail_text(arguments[0], "%.300s: %s; python -m mild %s is the same", path,
                             strerror(errno), arguments[0]);
    }
    char *const head[] = {python, isolated, path};
    become(head, sizeof head / sizeof *head, arguments + 1);
    return cli_fail_text(arguments[0],
                         "%.200s: %s; this command is in Python: install python3, or name one by "
                         "MILD_PYTHON",
                         python, strerror(errno));
}
