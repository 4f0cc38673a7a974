/* The policy's step; see policy.h. */
#include "policy.h"

#include <math.h>
#include <string.h>

#define LANES 16 /* outputs of a layer that are computed together */

/* y = W x + b. weight: for each block of LANES outputs [in][LANES], zero beyond the last output;
 * bias alike. */
typedef struct {
    const float *weight, *bias;
    int in, blocks;
} Layer;

#include "policy_weights.h"

/* ---- networks ---- */

static float elu(float x) {
    return x > 0 ? x : expf(x) - 1;
}

/* sum += W x of one block; w: [in][LANES]. Four inputs at a time, because compilers then keep the
 * sums in vectors. */
static void add_products(float *sum, const float *w, const float *x, int in) {
    int i = 0;
    for (; i + 4 <= in; i += 4, w += 4 * LANES) {
        for (int k = 0; k < LANES; k++) {
            sum[k] += (w[k] * x[i] + w[LANES + k] * x[i + 1]) +
                      (w[2 * LANES + k] * x[i + 2] + w[3 * LANES + k] * x[i + 3]);
        }
    }
    for (; i < in; i++, w += LANES) {
        for (int k = 0; k < LANES; k++) {
            sum[k] += w[k] * x[i];
        }
    }
}

/* y has room for whole blocks. */
static void run_layer(const Layer *layer, int is_last, const float *x, float *y) {
    const float *w = layer->weight;
    for (int block = 0; block < layer->blocks; block++, y += LANES) {
        float sum[LANES];
        memcpy(sum, layer->bias + block * LANES, sizeof sum);
        add_products(sum, w, x, layer->in);
        w += layer->in * LANES;
        for (int k = 0; k < LANES; k++) {
            y[k] = is_last ? sum[k] : elu(sum[k]);
        }
    }
}

static void run_network(const Layer *layer, int layers, const float *x, float *y) {
    float between[2][WIDEST];
    for (int l = 0; l < layers; l++) {
        const int is_last = l == layers - 1;
        float *out = is_last ? y : between[l % 2];
        run_layer(&layer[l], is_last, x, out);
        x = out;
    }
}

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))
#define WHOLE(width) (((width) + LANES - 1) / LANES * LANES)

/* [estimates | mu | log variance] = encoder(history), theta of the feet's estimates and, as the
 * policy has it, the clock, z = theta1 mu + theta2, and the action of [frame | estimates | z]. */
static void run_policy(PolicyState *state, const float *history, float *action) {
    const float *frame = history + POLICY_MEANS * POLICY_OBSERVATION;
    float heads[WHOLE(POLICY_ESTIMATES + 2 * POLICY_LATENT)], theta[WHOLE(POLICY_THETA)];
    float feet[POLICY_FEET_INPUT + POLICY_CLOCK_INPUT];
    float input[POLICY_OBSERVATION + POLICY_ESTIMATES + POLICY_LATENT];
    float raw[WHOLE(POLICY_JOINTS)];
    float *z = input + POLICY_OBSERVATION + POLICY_ESTIMATES;
    const float *mu = heads + POLICY_ESTIMATES;
    run_network(encoder, COUNT(encoder), history, heads);
    memcpy(feet, heads + POLICY_FEET_VELOCITIES, POLICY_FEET_INPUT * sizeof *feet);
    memcpy(feet + POLICY_FEET_INPUT, frame + POLICY_OBSERVATION - POLICY_CLOCK_INPUT,
           POLICY_CLOCK_INPUT * sizeof *feet);
    run_network(modulation, COUNT(modulation), feet, theta);
    memcpy(input, frame, POLICY_OBSERVATION * sizeof *input);
    memcpy(input + POLICY_OBSERVATION, heads, POLICY_ESTIMATES * sizeof *input);
    for (int j = 0; j < POLICY_LATENT; j++) {
        const int one = POLICY_THETA == 2 ? 0 : j;
        z[j] = theta[one] * mu[j] + theta[POLICY_THETA / 2 + one];
    }
    run_network(actor, COUNT(actor), input, raw);
    memcpy(state->estimates, heads, sizeof state->estimates);
    memcpy(action, raw, POLICY_JOINTS * sizeof *action);
}

/* ---- around them ---- */

void policy_reset(PolicyState *state) {
    memset(state, 0, sizeof *state);
}

static int is_standing(const float *command) {
    const float below = POLICY_STANDING_BELOW;
    return fabsf(command[0]) < below && fabsf(command[1]) < below && fabsf(command[2]) < below;
}

void policy_observe(const PolicyState *state, const PolicyReadings *readings, float *observation) {
    const int still = !POLICY_CLOCK || is_standing(readings->command);
    const double turn = 6.283185307179586 * state->phase;
    float *q = observation + 9, *qd = q + POLICY_JOINTS, *last = qd + POLICY_JOINTS;
    for (int i = 0; i < 3; i++) {
        observation[i] = readings->angular_velocity[i];
        observation[3 + i] = readings->command[i] * (i < 2 ? 2.0f : 1.0f);
        observation[6 + i] = readings->gravity[i];
    }
    for (int i = 0; i < POLICY_JOINTS; i++) {
        q[i] = readings->angle[i] - policy_pose[i];
        qd[i] = 0.05f * readings->speed[i];
        last[i] = state->action[i];
    }
    last[POLICY_JOINTS] = still ? 0 : (float)sin(turn);
    last[POLICY_JOINTS + 1] = still ? 0 : (float)cos(turn);
}

/* Means of POLICY_STRIDE older frames each, oldest first, then the frame, which takes the place of
 * the oldest in the ring. */
static void write_history(PolicyState *state, const float *observation, float *history) {
    const size_t size = POLICY_OBSERVATION * sizeof *history;
    int place = state->oldest;
    for (int k = 0; !state->started && k < POLICY_HELD; k++) {
        memcpy(state->frames[k], observation, size);
    }
    memset(history, 0, POLICY_MEANS * size);
    for (int m = 0; m < POLICY_MEANS; m++, history += POLICY_OBSERVATION) {
        for (int k = 0; k < POLICY_STRIDE; k++, place = (place + 1) % POLICY_HELD) {
            for (int i = 0; i < POLICY_OBSERVATION; i++) {
                history[i] += state->frames[place][i];
            }
        }
        for (int i = 0; i < POLICY_OBSERVATION; i++) {
            history[i] /= POLICY_STRIDE;
        }
    }
    memcpy(history, observation, size);
    memcpy(state->frames[place], observation, size);
    state->oldest = (place + 1) % POLICY_HELD;
    state->started = 1;
}

/* [s] Period of the gait clock under the command of a frame, in which speeds are doubled. */
static double gait_period(const float *observation) {
    const double v = 0.5 * fabs(observation[3]) + 1.5 * fabs(observation[4]) + fabs(observation[5]);
    const double slow = 1 - v / POLICY_GAIT_SLOW_BELOW;
    return POLICY_GAIT_PERIOD * (1 + POLICY_GAIT_SLOWING * (slow > 0 ? slow : 0));
}

void policy_step(PolicyState *state, const float *observation, float *action) {
    float history[(POLICY_MEANS + 1) * POLICY_OBSERVATION];
    write_history(state, observation, history);
    run_policy(state, history, action);
    for (int i = 0; i < POLICY_JOINTS; i++) {
        const float a = action[i], clip = POLICY_ACTION_CLIP;
        action[i] = !(a > -clip) ? -clip : a > clip ? clip : a; /* not a number: -clip */
        state->action[i] = action[i];
    }
    state->phase += POLICY_PERIOD / gait_period(observation);
    state->phase -= floor(state->phase);
}

void policy_targets(const float *action, float *target) {
    for (int i = 0; i < POLICY_JOINTS; i++) {
        target[i] = policy_pose[i] + POLICY_ACTION_SCALE * action[i];
    }
}
