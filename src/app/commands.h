/* One function per command, one file per function: cmd_NAME.c. argv[0] is the command's name;
 * returns the exit code. A command has one row, in COMMAND_LIST. */
#ifndef MILD_COMMANDS_H
#define MILD_COMMANDS_H

#include "app/cli.h"

/* Name, help, and first words with a help of their own (commands.c) or NULL; a file cmd_NAME.c
 * defines cmd_NAME. */
#define COMMAND_LIST(X)                                                                            \
    X(train, "train a walking policy on soft ground", NULL)                                        \
    X(eval, "measure how a policy walks on several grounds and at several speeds", NULL)           \
    X(play, "watch a policy walk, in a window or as a video", NULL)                                \
    X(press, "press a plate or a sole into a ground and record the force", NULL)                   \
    X(fit, "find the parameters of a ground from recorded presses", NULL)                          \
    X(know, "judge what a robot knows of its ground from its own sensors", NULL)                   \
    X(actuator, "fit a network to logs of a robot's motors", actuator_parts)                       \
    X(export, "write a policy as an ONNX graph or as C, to run it elsewhere", NULL)                \
    X(drive, "run a policy for a robot over UDP, or be that robot, simulated", NULL)               \
    X(report, "draw the curves of training runs on one page", NULL)                                \
    X(bench, "measure speed and memory on this machine", NULL)                                     \
    X(info, "list grounds, models, config keys, versions and devices", NULL)                       \
    X(web, "serve the walk in a browser that `make web` builds", NULL)

#define COMMAND_DECLARE(name, help, parts) int cmd_##name(int argc, char **argv);
COMMAND_LIST(COMMAND_DECLARE)
#undef COMMAND_DECLARE

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

#endif
