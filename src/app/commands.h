/* One function per command, one file per function: cmd_NAME.c. argv[0] is the command's name;
 * returns the exit code. */
#ifndef MILD_COMMANDS_H
#define MILD_COMMANDS_H

#include "app/cli.h"

typedef struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
    const char *const *parts; /* first words with a help of their own, then NULL; NULL: none */
} AppCommand;
enum { COMMANDS_MAX = 32 };
extern const AppCommand commands[];
extern const int command_count;

/* What the program says of itself, for its help and its man page: whole lines each. */
extern const char commands_about[], commands_exit[], commands_examples[];

/* Gives the description of every command and of its parts to `print`, in order. */
void commands_describe(void (*print)(const CliCommand *command));

/* Standard output gets the man page, in roff; or the completion, for bash and zsh. Return the exit
 * code. */
int manual_print(void);
int completion_print(void);

int cmd_train(int argc, char **argv);
int cmd_eval(int argc, char **argv);
int cmd_play(int argc, char **argv);
int cmd_press(int argc, char **argv);
int cmd_fit(int argc, char **argv);
int cmd_report(int argc, char **argv);
int cmd_actuator(int argc, char **argv);
int cmd_export(int argc, char **argv);
int cmd_drive(int argc, char **argv);
int cmd_bench(int argc, char **argv);
int cmd_info(int argc, char **argv);
int cmd_web(int argc, char **argv);

#endif
