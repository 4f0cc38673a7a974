/* The networks of the paper (fig. 3): encoder (multi-head VAE), decoder, modulation (FiLM), actor,
 * critic. Knows no robot. One allocation per family (parameters, gradients, moments), so optimiser
 * and checkpoint are flat loops. */
#ifndef MILD_POLICY_H
#define MILD_POLICY_H

#include <stdint.h>

#include "base/pool.h"
#include "mild/error.h"
#include "mild/field.h"

#define POLICY_LAYERS_MAX 4

typedef struct {
    /* shape of the problem: set by the task, not by the config */
    char robot[64];   /* name of the robot that it was trained for; empty: not known */
    int observation;  /* width of one frame, 47 */
    int frames;       /* frames in the history, newest last: H + 1 = 6 */
    int critic_input; /* width of the critic's input */
    int actions;      /* 12 */
    int estimates;    /* 11: base velocity 3, feet velocities 6, feet heights 2 */
    int feet_velocity_offset,
        feet_velocity_count; /* the estimates that drive the modulation: 3, 6 */
    /* config, section [policy] */
    int latent;                            /* 16 */
    int encoder_hidden[POLICY_LAYERS_MAX]; /* zero-terminated or full: 256 128 */
    int decoder_hidden[POLICY_LAYERS_MAX]; /* 64 128 */
    int modulation_hidden;                 /* 32 */
    int modulation_per_dimension; /* bool: theta1, theta2 per latent dimension instead of scalars */
    int actor_hidden[POLICY_LAYERS_MAX];  /* 512 256 128 */
    int critic_hidden[POLICY_LAYERS_MAX]; /* 768 256 128 */
    double init_std;                      /* initial standard deviation of the action noise */
} PolicyDef;
PolicyDef policy_def_default(void);
extern const MildField policy_fields[];
extern const int policy_field_count;

typedef struct Policy Policy;
Policy *policy_create(const PolicyDef *def, uint64_t seed, MildError *error);
void policy_destroy(Policy *policy);
const PolicyDef *policy_def(const Policy *policy);
int64_t policy_parameter_count(const Policy *policy);
float *policy_parameters(Policy *policy); /* flat, policy_parameter_count() */

/* Deterministic action and estimates for `rows` histories (z = mu). history
 * [rows][frames*observation], actions [rows][actions] (mean), estimates [rows][estimates] (may be
 * NULL), latent [rows][latent] modulated z~ (may be NULL). Rows are processed in fixed chunks over
 * the pool (NULL: caller's thread). One caller at a time per policy. */
void policy_act(Policy *policy, Pool *pool, int rows, const float *history, float *actions,
                float *estimates, float *latent);
/* Critic values [rows] for critic inputs [rows][critic_input]. */
void policy_value(Policy *policy, Pool *pool, int rows, const float *critic, float *values);
const float *policy_std(const Policy *policy); /* [actions] current standard deviation */

/* Safetensors with metadata: the def, a version line, a free text `note`, CRC32 of the data.
 * Temporary name, fsync, rename. load builds a policy from the file alone (missing, truncated,
 * bit-flipped: one clear line). */
MildStatus policy_save(const Policy *policy, const char *path, const char *note, MildError *error);
Policy *policy_load(const char *path, char *note, int note_size, MildError *error);

#endif
