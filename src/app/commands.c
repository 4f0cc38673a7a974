/* The table of commands. */
#include "app/commands.h"

#include <stdio.h>

#ifndef MILD_VIEW
int cmd_play(int argc, char **argv) {
    (void)argc;
    (void)argv;
    return cli_fail_text("play", "built without drawing; configure with -DMILD_VIEW=ON");
}
#endif

const char commands_about[] = "soft ground for legged robots";
const char commands_exit[] =
    "The exit code is 0 on success and 2 after\nan error, which is one line "
    "on standard error.";
const char commands_examples[] =
    "  mild play --policy policies/mild.safetensors --ground sand_loose --video walk.mp4\n"
    "  mild press --ground foam45 --depth 0.03\n";

static const char *const actuator_parts[] = {"fit", "log", NULL};

#define ROW(name, help, parts) {#name, cmd_##name, help, parts},
const AppCommand commands[] = {COMMAND_LIST(ROW)};
#undef ROW
const int command_count = sizeof commands / sizeof *commands;
_Static_assert(sizeof commands / sizeof *commands <= COMMANDS_MAX, "main has room for their names");

/* part: a first word, or NULL for the command itself. */
static void describe(const AppCommand *command, const char *part) {
    char name[16], word[16], help[] = "--help";
    char *whole[] = {name, help, NULL}, *one[] = {name, word, help, NULL};
    snprintf(name, sizeof name, "%s", command->name);
    snprintf(word, sizeof word, "%s", part ? part : "");
    command->run(part ? 3 : 2, part ? one : whole);
}

void commands_describe(void (*print)(const CliCommand *command)) {
    cli_set_help(print);
    for (int i = 0; i < command_count; i++) {
        const char *const *part = commands[i].parts;
        describe(&commands[i], NULL);
        for (; part && *part; part++) {
            describe(&commands[i], *part);
        }
    }
    cli_set_help(NULL);
}
