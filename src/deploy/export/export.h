/* A policy for programs that are not ours (docs/policy.md): as an ONNX graph, as C. */
#ifndef MILD_EXPORT_H
#define MILD_EXPORT_H

#include "env/task/task.h"
#include "learn/network.h"
#include "robot/def.h"

/* A policy and what goes around it. Everything is borrowed. */
typedef struct {
    const Robot *robot;
    const TaskDef *task; /* that the policy was trained with */
    const Network *network;
    const float *parameters;
    const char *note;    /* of the policy's file */
    const char *version; /* of this program */
    int in_double;       /* bool: the ONNX graph computes in double precision, between floats */
} Export;

/* One graph with weights and metadata, written whole or not at all. Fails in a program without
 * protobuf-c. */
MildStatus export_onnx(const Export *export, const char *path, MildError *error);
/* A new folder with policy.h, policy.c, policy_weights.h and example.c, made whole or not at all.
 * Fails when the folder exists. */
MildStatus export_c(const Export *export, const char *folder, MildError *error);

/* ---- what a program must know beside the networks' weights, as texts ---- */

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
