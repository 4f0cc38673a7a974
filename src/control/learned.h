/* The policy behind a learned controller. Looking into one: what passes between its networks, and
 * how it acts without one of its parts. */
#ifndef CONTROL_LEARNED_H
#define CONTROL_LEARNED_H

#include "control/controller.h"
#include "learn/network.h"
#include "learn/policy.h"

/* The policy of a file, if it is one for this task and robot. note: as of policy_load. */
Policy *learned_policy(const char *path, const TaskDef *task, const Robot *robot, char *note,
                       int note_size, MildError *error);

/* Parts that may be taken out, and what the actor gets in their place. */
#define ABLATION_LIST(X)                                                                           \
    X(none, "")                                                                                    \
    X(z, "z is its mean")                                                                          \
    X(modulation, "theta1 and theta2 are their means")                                             \
    X(estimates, "the actor's estimates are their means")                                          \
    X(history, "the older frames are the newest one")
#define ABLATION_ENUM(name, what) ABLATION_##name,
typedef enum { ABLATION_LIST(ABLATION_ENUM) ABLATIONS } Ablation;
#undef ABLATION_ENUM

/* The ablation of this name, but for `none`. The message contains the nearest name. */
MildStatus ablation_find(const char *name, Ablation *ablation, MildError *error);

/* Bool: means take the place of the part. */
int ablation_has_means(Ablation ablation);

/* What passed inside in the last call of `act`, with the widths of its rows. */
typedef struct {
    int latent, theta, estimates;
    PolicyInside rows;
} LearnedInside;

/* From now on each call of `act` is seen. Fails for a controller that is not learned. The result
 * lasts as long as the controller. */
MildStatus learned_watch(Controller *controller, const LearnedInside **inside, MildError *error);
/* Takes a part out, from the next call of `act` on. means: [latent] of z, then [estimates], then
 * [theta], for these three; copied. The controller is watched. */
void learned_ablate(Controller *controller, Ablation ablation, const float *means);

#endif
