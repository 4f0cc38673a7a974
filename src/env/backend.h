/* What steps the robots of a set of environments: MuJoCo (mujoco.c) or the batch engine
 * (batch.c). */
#ifndef ENVS_BACKEND_H
#define ENVS_BACKEND_H

#include "env/envs.h"

/* See the functions of envs.h of these names. */
typedef struct {
    void (*destroy)(Envs *envs);
    MildStatus (*reset)(Envs *envs, const EnvsView *first, MildStream stream, MildError *error);
    MildStatus (*step)(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error);
    MildStatus (*wait)(Envs *envs, MildError *error);
    MildStatus (*sums)(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error);
    MildStatus (*save_progress)(Envs *envs, TaskProgress *progress, MildError *error);
    MildStatus (*load_progress)(Envs *envs, const TaskProgress *progress, MildError *error);
    EnvsMemory (*memory)(const Envs *envs);
    MildStatus (*set_commands)(Envs *envs, const double *command, MildError *error);
    void (*set_samples)(Envs *envs, EnvsSample *sample);
    /* of the batch engine, else NULL */
    size_t (*block_bytes)(const Envs *envs, int own_ground);
    MildStatus (*save)(Envs *envs, int first, int count, void *blocks, MildStream stream,
                       MildError *error);
    MildStatus (*fork)(Envs *envs, const void *blocks, int count, size_t bytes, int own_ground,
                       MildStream stream, MildError *error);
    MildStatus (*read)(Envs *envs, const EnvsMotion *motion, MildStream stream, MildError *error);
    /* of MuJoCo, else NULL */
    void (*times)(Envs *envs, double *physics, double *ground);
    char *(*state)(Envs *envs, size_t *bytes);
    TaskEnv *(*env)(Envs *envs, int i);
} EnvsBackend;

/* The first member of each backend's own struct. */
struct Envs {
    const EnvsBackend *backend;
    int count;         /* environments */
    int physics_steps; /* of a policy step */
};

/* NULL with one line in *error. */
Envs *envs_create_mujoco(const EnvsDef *def, MildError *error);
Envs *envs_create_batch(const EnvsDef *def, MildError *error);

#endif
