/* The table of commands. */
#include "app/commands.h"

#ifdef MILD_LAB
#include "lab/commands.h"
#else
#define LAB_COMMANDS(X)
#endif

#ifndef MILD_VIEW
int cmd_play(int argc, char **argv) {
    (void)argc;
    (void)argv;
    return cli_fail_text("play", "built without drawing; configure with -DMILD_VIEW=ON");
}
#endif

#define ROW(name, help) {#name, cmd_##name, help},
const AppCommand commands[] = {COMMAND_LIST(ROW) LAB_COMMANDS(ROW)};
#undef ROW
const int command_count = sizeof commands / sizeof *commands;
_Static_assert(sizeof commands / sizeof *commands <= COMMANDS_MAX, "main has room for their names");
