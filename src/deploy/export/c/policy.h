/* A policy in C99 (and C++) that needs libm alone and allocates nothing. Written by `mild export`;
 * docs/policy.md of mild explains every number. One step each POLICY_PERIOD:
 *
 *     policy_observe(&state, &readings, observation);
 *     policy_step(&state, observation, action);
 *     policy_targets(action, target);
 *     torque[i] = policy_kp[i] (target[i] - angle[i]) - policy_kd[i] speed[i]
 *
 * and no more than policy_limit[i], as often as the drives can.
 *
 * Joints are in the order of policy_joint_names. */
#ifndef POLICY_H
#define POLICY_H

/* NUMBERS */

#ifdef __cplusplus
extern "C" {
#endif

extern const char *const policy_joint_names[POLICY_JOINTS];
extern const float policy_pose[POLICY_JOINTS];  /* [rad] default pose */
extern const float policy_kp[POLICY_JOINTS];    /* [N m/rad] */
extern const float policy_kd[POLICY_JOINTS];    /* [N m s/rad] */
extern const float policy_limit[POLICY_JOINTS]; /* [N m] largest torque */
extern const float policy_low[POLICY_JOINTS];   /* [rad] range of the joint */
extern const float policy_high[POLICY_JOINTS];  /* [rad] */

/* What the robot measures, and its command. Base axes: x forward, y left, z up. */
typedef struct {
    float angular_velocity[3];  /* [rad/s] of the base */
    float gravity[3];           /* [-] unit vector along gravity, (0, 0, -1) when upright */
    float command[3];           /* [m/s, m/s, rad/s] forward, to the left, turning left */
    float angle[POLICY_JOINTS]; /* [rad] */
    float speed[POLICY_JOINTS]; /* [rad/s] */
} PolicyReadings;

/* What lasts from step to step, without pointers. One for each robot; for one thread at a time. */
typedef struct {
    float frames[POLICY_HELD][POLICY_OBSERVATION]; /* a ring of the last ones */
    int oldest;                                    /* place of the oldest frame in the ring */
    int started;                                   /* bool: there was a step */
    double phase;                                  /* [-] gait clock in [0, 1) */
    float action[POLICY_JOINTS];                   /* the last one */
    float estimates[POLICY_ESTIMATES];             /* of the last step: docs/policy.md */
} PolicyState;

/* Before the first step, and whenever the robot begins anew. */
void policy_reset(PolicyState *state);
/* Makes the frame [POLICY_OBSERVATION] of the readings. */
void policy_observe(const PolicyState *state, const PolicyReadings *readings, float *observation);
/* Takes a frame [POLICY_OBSERVATION], writes the action [POLICY_JOINTS], goes on by one step. */
void policy_step(PolicyState *state, const float *observation, float *action);
/* [rad] The angles [POLICY_JOINTS] that the joints' PD is to hold. */
void policy_targets(const float *action, float *target);

#ifdef __cplusplus
}
#endif

#endif
