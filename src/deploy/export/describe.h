/* What a program must know beside the networks' weights, as texts. */
#ifndef EXPORT_DESCRIBE_H
#define EXPORT_DESCRIBE_H

#include "deploy/export/export.h"
#include "robot/def.h"

enum {
    DESCRIBE_MAX = 40,
    DESCRIBE_KEY = 32,
    DESCRIBE_VALUE = ROBOT_JOINTS_MAX * ROBOT_NAME_SIZE /* the names of all joints */
};

/* Lists are separated by commas, joints in the order of every vector. Names are those that other
 * exporters of walking policies use, where they have one. */
typedef struct {
    int count;
    char key[DESCRIBE_MAX][DESCRIBE_KEY];
    char value[DESCRIBE_MAX][DESCRIBE_VALUE];
} Description;

MildStatus describe(const Export *export, Description *description, MildError *error);

#endif
