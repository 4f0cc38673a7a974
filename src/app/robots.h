/* Robots named on the command line. */
#ifndef APP_ROBOTS_H
#define APP_ROBOTS_H

#include <stddef.h>

#include "app/cli.h"
#include "robot/robot.h"
#include "run/train/experiment.h"

/* `option` of --robot, or `otherwise` where it is NULL. */
Robot *robots_open(const char *option, const char *otherwise, MildError *error);
/* Sets train.robot from --robot. Refuses names that a config file cannot hold, like an override. */
MildStatus robots_set(ExperimentDef *def, const char *option, MildError *error);
/* Says on standard error, in one line, that a GPU steps the robot by kernels for any robot. */
void robots_warn_slow(const char *command, const TrainDef *def, const char *robot);
/* Help on --controller in `text` [ROBOTS_CONTROLLER_HELP], which is returned. */
#define ROBOTS_CONTROLLER_HELP 800
const char *robots_controller_help(char *text, size_t size);
/* The robots that ship: joints, feet, mass, height, source. Returns the exit code. */
int robots_print(void);

#define ROBOTS_HELP "robot: a name listed by `mild info robots`, or a folder, written with a slash"

/* Fails when a controller that follows no command gets one to move. option: of the command. */
MildStatus robots_check_command(const char *controller, const char *option, double value,
                                MildError *error);
/* Fails when a jump [m] is asked of a policy whose task has none. */
MildStatus robots_check_jump(const TaskDef *task, double jump, MildError *error);

#endif
