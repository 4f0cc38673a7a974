/* Assistance early in training, after the curriculum of Yu, Turk and Liu 2018 ("Learning symmetric
 * and low-energy locomotion"). With the paper's soft ankles balance is so hard that an untrained
 * policy learns to stand stiffly and never discovers that stepping pays. With assistance, an
 * external force holds the trunk upright and pulls it along, and the legs follow the reference
 * gait. So the robot steps, and is rewarded for it, from the start. The level of assistance of each
 * robot decays while it stays on its feet and rises when it falls. It settles where episodes last
 * about four seconds, and goes to 0 as they last longer. There is no assistance in evaluation
 * (task_def_make_nominal), where actions are deviations from the constant default pose. */
#ifndef TASK_ASSIST_H
#define TASK_ASSIST_H

#include <math.h>

#include "env/task/gait.h"

/* Key assist of robot.ini: stiffness and damping against tilt, gain towards the commanded velocity,
 * and the limit of that force. With a larger force a robot would learn to lean on it. */
enum { ASSIST_HAND_TILT, ASSIST_HAND_DAMPING, ASSIST_HAND_DRAW, ASSIST_HAND_LIMIT };
#define ASSIST_WEIGHT 0.5 /* [-] share of the weight that full assistance carries */
#define ASSIST_LEAD                                                                                \
    1.3 /* [-] scale of the reference gait, because the joints lag behind their targets */
#define ASSIST_GRACE 2.0  /* [s] time on its feet before the level decays */
#define ASSIST_RISE 1.3   /* [-] at a fall */
#define ASSIST_LEAST 0.01 /* [-] added at a fall */
#define ASSIST_GRAVITY 9.81

/* [-] Share of full assistance that the environment has. */
MILD_HD_FN double task_assist_share(const TaskEnv *env, const TaskDef *def) {
    return def->assist ? env->assist_level * env->assist_draw : 0;
}

/* Updates the level after a policy step. The level is steady when the robot falls every
 * ASSIST_GRACE + def->assist_decay ln(ASSIST_RISE) seconds. */
MILD_HD_FN void task_assist_adapt(TaskEnv *env, const TaskDef *def, int fallen) {
    if (fallen) {
        env->assist_level = fmin(1.0, ASSIST_RISE * env->assist_level + ASSIST_LEAST);
    } else if ((env->step - env->step_first) * TASK_PERIOD > ASSIST_GRACE) {
        env->assist_level *= 1 - TASK_PERIOD / def->assist_decay;
    }
}

/* [rad] What the action of joint i is added to: the angle of the default pose, moved along the
 * reference gait while there is assistance. */
MILD_HD_FN double task_assist_pose(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                   int i) {
    double share = task_assist_share(env, def), rest = robot->default_pose[i];
    if (share == 0) {
        return rest;
    }
    double reference = task_gait_reference(def, robot, env->phase, env->command, i);
    return rest + share * ASSIST_LEAD * (reference - rest);
}

/* Writes force and torque on the base, world, and returns 0 when there is none. rotation: [9] of
 * the base; qvel: [6] its twist. */
MILD_HD_FN int task_assist(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                           const Real *rotation, const Real *qvel, Real wrench[6]) {
    double share = task_assist_share(env, def);
    if (share == 0) {
        return 0;
    }
    const Real *turn = rotation, *v = qvel;
    double length = task_sqrt(turn[0] * turn[0] + turn[3] * turn[3]);
    double c = length > 0 ? turn[0] / length : 1, s = length > 0 ? turn[3] / length : 0;
    const double *hand = robot->assist;
    double wanted[2] = {c * env->command[0] - s * env->command[1],
                        s * env->command[0] + c * env->command[1]};
    for (int i = 0; i < 2; i++) {
        double pull = hand[ASSIST_HAND_DRAW] * (wanted[i] - v[i]);
        wrench[i] = share * fmin(fmax(pull, -hand[ASSIST_HAND_LIMIT]), hand[ASSIST_HAND_LIMIT]);
    }
    wrench[2] = share * ASSIST_WEIGHT * ASSIST_GRAVITY * robot->total_mass;
    /* The base's z axis in the world is u = (turn[2], turn[5], turn[8]); u x e_z turns it upright.
     */
    double omega[3];
    for (int i = 0; i < 3; i++) {
        omega[i] = turn[3 * i] * v[3] + turn[3 * i + 1] * v[4] + turn[3 * i + 2] * v[5];
    }
    wrench[3] = share * (hand[ASSIST_HAND_TILT] * turn[5] - hand[ASSIST_HAND_DAMPING] * omega[0]);
    wrench[4] = share * (-hand[ASSIST_HAND_TILT] * turn[2] - hand[ASSIST_HAND_DAMPING] * omega[1]);
    wrench[5] = 0;
    return 1;
}

#endif
