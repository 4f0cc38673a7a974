/* What a policy is made of: the widths that the task sets, and section [policy] of a config
 * file. */
#ifndef MILD_POLICY_DEF_H
#define MILD_POLICY_DEF_H

#include "mild/field.h"

#define POLICY_LAYERS_MAX 4

/* What theta depends on: the estimated velocities of the feet (paper), or all estimates of the
 * feet, velocities and heights, and the gait clock of the newest frame. */
typedef enum { POLICY_INPUT_FEET, POLICY_INPUT_FEET_PHASE, POLICY_INPUTS } PolicyInput;

typedef struct {
    /* shape of the problem: set by the task, not by the config */
    char robot[64];           /* name of the robot that it was trained for; empty: not known */
    char task[1024];          /* how it walks, see task/policy_keys.h; empty: not known */
    int observation;          /* width of one frame, 47; it ends with the gait clock: sin, cos */
    int frames;               /* frames in the history, newest last: H + 1 = 6 */
    int scan;                 /* numbers behind the newest frame: a height scan; 0: none */
    int critic_input;         /* width of the critic's input, which begins with a noiseless frame */
    int actions;              /* 12 */
    int estimates;            /* 11: base velocity 3, feet velocities 6, feet heights 2 */
    int feet_velocity_offset; /* 3: first of the estimated velocities of the feet */
    int feet_velocity_count;  /* 6: how many there are; the feet's heights follow them */
    /* what the decoder rebuilds: a frame, then numbers of the critic's input */
    int decoder_frame; /* bool */
    int ground_offset; /* first of the ground's parameters in the critic's input */
    int ground_count;  /* how many the decoder rebuilds; 0: none */
    /* config, section [policy] */
    int latent;                            /* 16 */
    int encoder_hidden[POLICY_LAYERS_MAX]; /* zero-terminated or full: 256 128 */
    int decoder_hidden[POLICY_LAYERS_MAX]; /* 64 128 */
    int modulation_hidden;                 /* 32 */
    int modulation_per_dimension;          /* bool: theta1, theta2 for each latent dimension */
    int modulation_input;                  /* a PolicyInput */
    int actor_phase;                       /* bool: actor and encoder see the gait clock */
    int actor_hidden[POLICY_LAYERS_MAX];   /* 512 256 128 */
    int critic_hidden[POLICY_LAYERS_MAX];  /* 768 256 128 */
    double init_std;                       /* initial standard deviation of the action noise */
} PolicyDef;
PolicyDef policy_def_default(void);
/* Width of the history [frames | scan], and of what the actor has of it, [newest frame | scan]. */
static inline int policy_history(const PolicyDef *def) {
    return def->frames * def->observation + def->scan;
}
static inline int policy_newest(const PolicyDef *def) {
    return def->observation + def->scan;
}
extern const MildField policy_fields[];
extern const int policy_field_count;

#endif
