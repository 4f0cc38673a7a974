/* Commands of the lab, as COMMAND_LIST of src/app/commands.h has the others. */
#ifndef LAB_COMMANDS_H
#define LAB_COMMANDS_H

#define LAB_COMMANDS(X)                                                                            \
    X(know, "judge what a robot knows of its ground from its own sensors")                         \
    X(bench, "measure speed and memory on this machine")                                           \
    X(drive, "run a policy for a robot over UDP, or be that robot, simulated")

#define LAB_DECLARE(name, help) int cmd_##name(int argc, char **argv);
LAB_COMMANDS(LAB_DECLARE)
#undef LAB_DECLARE

#endif
