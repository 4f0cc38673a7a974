/* One function per command, one file per function: cmd_NAME.c. argv[0] is the command's name;
 * returns the exit code. A command has one row, in COMMAND_LIST; those of
 * lab/lists.h come after them where the lab is built. */
#ifndef MILD_COMMANDS_H
#define MILD_COMMANDS_H

#include "app/cli.h"

/* Name and help; a file cmd_NAME.c defines cmd_NAME. */
#define COMMAND_LIST(X)                                                                            \
    X(train, "train a walking policy on soft ground")                                              \
    X(eval, "measure how a policy walks on several grounds and at several speeds")                 \
    X(play, "watch a policy walk, in a window or as a video")                                      \
    X(press, "press a plate or a sole into a ground and record the force")                         \
    X(fit, "find the parameters of a ground from recorded presses")                                \
    X(actuator, "fit a network to logs of a robot's motors")                                       \
    X(export, "write a policy as an ONNX graph or as C, to run it elsewhere")                      \
    X(report, "draw the curves of training runs on one page")                                      \
    X(info, "list grounds, models, config keys, versions and devices")                             \
    X(web, "serve the walk in a browser that `make web` builds")

#define COMMAND_DECLARE(name, help) int cmd_##name(int argc, char **argv);
COMMAND_LIST(COMMAND_DECLARE)
#undef COMMAND_DECLARE

#endif
