/* Commands and controllers of the lab. They follow those of COMMAND_LIST (src/app/commands.h) and
 * of CONTROLLER_LIST (src/control/controller.h). */
#ifndef LAB_LISTS_H
#define LAB_LISTS_H

#include "control/controller.h"

#define LAB_COMMANDS(X)                                                                            \
    X(know, "judge what a robot knows of its ground from its own sensors")                         \
    X(bench, "measure speed and memory on this machine")                                           \
    X(drive, "run a policy for a robot over UDP, or be that robot, simulated")

#define LAB_DECLARE(name, help) int cmd_##name(int argc, char **argv);
LAB_COMMANDS(LAB_DECLARE)
#undef LAB_DECLARE

#define LAB_CONTROLLERS(X)                                                                         \
    X(clock, CONTROLLER_FOLLOWS,                                                                   \
      "a network that sees one frame, at 40 Hz (Singh et al. 2024), of --policy")                  \
    X(ht2, CONTROLLER_FOLLOWS, "a transformer (Radosavovic et al. 2024), of --policy")             \
    X(passivity, CONTROLLER_FOLLOWS | CONTROLLER_OWN_GAINS,                                        \
      "a biped that knows its true state: a DCM plan and whole-body impedances command torques")

LAB_CONTROLLERS(CONTROLLER_MAKE)

#endif
