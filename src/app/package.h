/* Commands of the Python package, which the program has not: `trial`, `judge`, `bench record`. */
#ifndef MILD_PACKAGE_H
#define MILD_PACKAGE_H

#include "base/paths.h"

/* Bool: it is one of them, of a word. */
int package_has(const char *command);

/* Says in a line how a command of the package is run; all but `trial` become that run where they
 * can, by package_python, with the package beside the program (build/python) or an installed one.
 * The variable MILD is this program there. arguments: the command, its own, NULL. Returns an exit
 * code. */
int package_run(char **arguments);

/* The Python that MILD_PYTHON names, that of .venv, or "python3". */
void package_python(char python[PATH_SIZE]);

#endif
