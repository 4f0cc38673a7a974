/* The five networks in one flat parameter array, and the forward pass of rollout, play and loss.
 *
 *   heads   = encoder(history), [estimates | mu | logvar]; the history is [frames | scan]
 *   theta   = modulation(estimated feet velocities), [theta1 | theta2]; with
 *             policy.modulation_input = feet_phase of [velocities | heights | clock]
 *   z~      = theta1 * z + theta2 (FiLM), z = mu; with ppo.sample_latent a draw, in training
 *   mean    = actor([newest frame | scan | estimates | z~])
 *   decoded = decoder([z | estimates]) = [frame | ground], in the loss only, with a sampled z
 *   value   = critic(critic input)
 *
 * With policy.actor_phase = false the weights of the clock in the first layers of encoder and actor
 * are 0 and stay 0, so that z, estimates and actor know nothing of it. */
#ifndef MILD_NETWORK_H
#define MILD_NETWORK_H

#include <stddef.h>
#include <stdint.h>

#include "learn/mlp.h"
#include "learn/policy_def.h"
#include "mild/error.h"

/* ---- what passes between the networks, to look at and to replace ---- */

/* Outputs, for each row; NULL: not wanted. */
typedef struct {
    float *latent;    /* [rows][latent] z = mu */
    float *theta;     /* [rows][policy_theta] theta1, then theta2 */
    float *modulated; /* [rows][latent] z~, as the actor gets it */
    float *estimates; /* [rows][estimates] of the encoder */
} PolicyInside;

/* What the actor gets in the place of the networks' own numbers. */
typedef struct {
    const float *latent;    /* [latent] z; NULL: mu */
    const float *estimates; /* [estimates], for the actor alone; NULL: the encoder's */
    const float *theta;     /* [policy_theta]; NULL: that of the modulation */
} PolicyInstead;

#define NETWORK_ACTIONS_MAX 64
#define NETWORK_MLPS 5
#define NETWORK_CLOCK 2 /* last numbers of a frame: sin and cos of the gait's phase */

typedef struct {
    PolicyDef def;
    Mlp encoder, decoder, modulation, actor, critic;
    int64_t critic_first; /* the critic's parameters are the range [critic_first, log_std) */
    int64_t log_std;      /* offset of the log standard deviations [actions] */
    int64_t count;        /* of parameters */
    int history;          /* width: frames * observation + scan */
    int newest;           /* width of its end that the actor has: observation + scan */
    int heads;            /* width: estimates + 2 latent */
    int theta;            /* width: 2, or 2 latent */
    int feet;             /* estimates that the modulation reads, from feet_velocity_offset on */
    int clock;            /* numbers of the clock that it reads behind them: 0, NETWORK_CLOCK */
    int actor_input;      /* width: newest + estimates + latent */
    int decoder_input;    /* width: latent + estimates */
    int decoded_frame;    /* width of the frame in the decoder's output: observation, or 0 */
    int decoded;          /* width of that output: decoded_frame + ground_count */
} Network;

/* Checks the def and sets the offsets of the parameters. */
MildStatus network_layout(Network *network, const PolicyDef *def, MildError *error);
void network_initialise(const Network *network, float *parameters, uint64_t seed);
/* Of a network with actor_phase = false: sets the weights of the clock to 0 in an array laid out as
 * the parameters; bool, one of them is not 0. */
void network_hide_clock(const Network *network, float *parameters);
int network_sees_clock(const Network *network, const float *parameters);
/* index < NETWORK_MLPS. */
const Mlp *network_mlp(const Network *network, int index, const char **name);

typedef struct {
    MlpOutputs encoder, modulation, actor;
    float *modulation_input; /* [rows][feet + clock] */
    float *actor_input;      /* [rows][actor_input] */
    const float *noise;      /* [rows][latent] input: z = mu + e^(logvar/2) noise; NULL: z = mu */
} NetworkOutputs;

void network_carve(const Network *network, int rows, float *block, size_t *used,
                   NetworkOutputs *outputs);
float *network_heads(const Network *network, const NetworkOutputs *outputs); /* [rows][heads] */
float *network_theta(const Network *network, const NetworkOutputs *outputs); /* [rows][theta] */
/* history [rows][history] -> all outputs. Returns the mean actions [rows][actions]. */
float *network_forward(const Network *network, const float *parameters, int rows,
                       const float *history, const NetworkOutputs *outputs);
/* The same with an actor that gets other numbers; NULL: its own. */
float *network_forward_instead(const Network *network, const float *parameters, int rows,
                               const float *history, const PolicyInstead *instead,
                               const NetworkOutputs *outputs);

#endif
