/* Trains an actuator network on logs of joints, and says how good it is on what it has not seen. */
#ifndef ACTUATOR_FIT_H
#define ACTUATOR_FIT_H

#include "base/pool.h"
#include "env/actuator/actuator.h"
#include "env/actuator/record.h"

typedef struct {
    double spacing; /* [s] of the history */
    int steps;      /* of the optimiser, for each kind of motor */
    uint64_t seed;
    FILE *held_out; /* CSV of measured and predicted torques; NULL: none */
} ActuatorFitDef;

/* One kind of motor: root mean square errors [N m] on the held-out samples. */
typedef struct {
    int joint;         /* the first one of this kind */
    int trained, held; /* samples */
    double deviation;  /* standard deviation of the torque: the error of its mean */
    double ideal;      /* of the PD with the gains of robot.ini, within the effort */
    double linear;     /* of kp error - kd speed with the best kp, kd of the training samples */
    double kp, kd;     /* [N m/rad], [N m s/rad] these */
    double network;
} ActuatorScore;

ActuatorFitDef actuator_fit_default(void);
/* Held out is one second in five of each file, drawn by the seed. The result depends on the def and
 * the record alone. score: [kinds of the robot's motors]. NULL with a message when the record is
 * too short, has too few rows for the history, or misses a kind of motor. */
Actuator *actuator_fit(const ActuatorFitDef *def, const Record *record, Pool *pool,
                       ActuatorScore *score, MildError *error);

#endif
