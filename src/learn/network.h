/* The five networks side by side in one flat parameter array, and the forward pass that rollout,
 * play and loss share.
 *
 *   heads      [estimates | mu | logvar] = encoder(history)
 *   theta      [theta1 | theta2]         = modulation(estimated feet velocities)
 *   z~                                   = theta1 * mu + theta2              (FiLM; z = mu wherever
 * the actor acts) mean                                 = actor([newest frame | estimates | z~])
 *   decoded                              = decoder([z | estimates])          (loss only; z sampled
 * there) value                                = critic(critic input) */
#ifndef MILD_NETWORK_H
#define MILD_NETWORK_H

#include <stddef.h>
#include <stdint.h>

#include "learn/mlp.h"
#include "learn/policy_def.h"
#include "mild/error.h"

#define NETWORK_ACTIONS_MAX 64
#define NETWORK_MLPS 5

typedef struct {
    PolicyDef def;
    Mlp encoder, decoder, modulation, actor, critic;
    int64_t log_std,
        count; /* offset of the log standard deviations [actions]; number of parameters */
    int64_t
        critic_first; /* the critic's parameters are the contiguous range [critic_first, log_std) */
    int history, heads,
        theta; /* widths: frames * observation, estimates + 2 latent, 2 or 2 latent */
    int actor_input, decoder_input;
} Network;

/* Checks the def and lays the parameters out. */
MildStatus network_layout(Network *network, const PolicyDef *def, MildError *error);
void network_initialise(const Network *network, float *parameters, uint64_t seed);
const Mlp *network_mlp(const Network *network, int index,
                       const char **name); /* index < NETWORK_MLPS */

typedef struct {
    MlpOutputs encoder, modulation, actor;
    float *actor_input; /* [rows][actor_input] */
} NetworkOutputs;

void network_carve(const Network *network, int rows, float *block, size_t *used,
                   NetworkOutputs *outputs);
float *network_heads(const Network *network, const NetworkOutputs *outputs); /* [rows][heads] */
float *network_theta(const Network *network, const NetworkOutputs *outputs); /* [rows][theta] */
/* history [rows][history] -> everything up to the mean actions, which it returns: [rows][actions].
 */
float *network_forward(const Network *network, const float *parameters, int rows,
                       const float *history, const NetworkOutputs *outputs);

#endif
