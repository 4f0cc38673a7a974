/* Commands that are other programs: those of the Python package, `trial`, `judge`, `bench record`,
 * and `report`; and any program mild-NAME. */
#ifndef MILD_PACKAGE_H
#define MILD_PACKAGE_H

#include "base/paths.h"

enum { PACKAGE_COMMANDS = 2 };
/* Names of those of them that are one word. */
extern const char *const package_commands[PACKAGE_COMMANDS];

/* Bool: it is one of them, of a word. */
int package_has(const char *command);

/* Says in a line how a command of the package is run; all but `trial` become that run where they
 * can, by package_python, with the package beside the program (build/python) or an installed one.
 * The variable MILD is this program there. arguments: the command, its own, NULL. Returns an exit
 * code. */
int package_run(char **arguments);

/* As git has it: becomes the program mild-NAME of the folder of this one, or else of PATH, with the
 * variable MILD as above. Returns where there is none. arguments: NAME, its own, NULL. */
void package_other(char **arguments);

/* Becomes a shipped file of the package, "python/mild/report.py", which needs nothing but Python:
 * not the package, and no module of the working directory. Returns an exit code where that cannot
 * be. arguments: the command, its own, NULL. */
int package_script(const char *script, char **arguments);

/* The Python that MILD_PYTHON names, that of .venv, or "python3". */
void package_python(char python[PATH_SIZE]);

#endif
