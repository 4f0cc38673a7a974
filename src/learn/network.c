#include "learn/network.h"

#include <math.h>
#include <string.h>

#include "learn/loss_sample.h"

/* Widths are bounded so that no product of two of them leaves the range of int. */
#define WIDTH_MAX 16384

static MildStatus check_width(int value, int min, const char *name, MildError *error) {
    if (value < min || value > WIDTH_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "policy.%s = %d is outside %d..%d", name, value,
                         min, WIDTH_MAX);
    }
    return MILD_OK;
}

static MildStatus check_hidden(const int *hidden, const char *name, MildError *error) {
    for (int l = 0; l < POLICY_LAYERS_MAX; l++) {
        if (hidden[l] < 0 || hidden[l] > WIDTH_MAX ||
            (l > 0 && hidden[l] > 0 && hidden[l - 1] == 0)) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "policy.%s: width %d of layer %d is not usable (1..%d, then zeros)",
                             name, hidden[l], l + 1, WIDTH_MAX);
        }
    }
    return MILD_OK;
}

static MildStatus check_widths(const PolicyDef *def, MildError *error) {
    const struct {
        const char *name;
        int width;
    } in[] = {{"observation", def->observation},
              {"frames", def->frames},
              {"critic_input", def->critic_input},
              {"estimates", def->estimates}};
    const struct {
        const char *name;
        const int *hidden;
    } net[] = {{"encoder_hidden", def->encoder_hidden},
               {"decoder_hidden", def->decoder_hidden},
               {"actor_hidden", def->actor_hidden},
               {"critic_hidden", def->critic_hidden}};
    MildStatus status = MILD_OK;
    for (size_t i = 0; !status && i < sizeof in / sizeof *in; i++) {
        status = check_width(in[i].width, 1, in[i].name, error);
    }
    for (size_t i = 0; !status && i < sizeof net / sizeof *net; i++) {
        status = check_hidden(net[i].hidden, net[i].name, error);
    }
    return status;
}

static MildStatus check_clock(const PolicyDef *def, MildError *error) {
    const int wanted = def->modulation_input == POLICY_INPUT_FEET_PHASE || !def->actor_phase;
    if (wanted && def->observation < NETWORK_CLOCK) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "policy: a frame of %d numbers has no gait clock for modulation_input = "
                         "feet_phase or actor_phase = false",
                         def->observation);
    }
    return MILD_OK;
}

static MildStatus check_def(const PolicyDef *def, MildError *error) {
    MildStatus status = mild_fields_check(policy_fields, policy_field_count, def, "policy", error);
    status = status ? status : check_widths(def, error);
    status = status ? status : check_clock(def, error);
    if (status) {
        return status;
    }
    if (def->scan < 0 || (int64_t)def->frames * def->observation + def->scan > WIDTH_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "policy: %d frames of %d numbers and a scan of %d are more than %d",
                         def->frames, def->observation, def->scan, WIDTH_MAX);
    }
    if (def->actions < 1 || def->actions > NETWORK_ACTIONS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "policy.actions = %d is outside 1..%d",
                         def->actions, NETWORK_ACTIONS_MAX);
    }
    if (def->feet_velocity_offset < 0 || def->feet_velocity_count < 1 ||
        def->feet_velocity_offset > def->estimates ||
        def->feet_velocity_count > def->estimates - def->feet_velocity_offset) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "policy: feet velocities %d..+%d are not among the %d estimates",
                         def->feet_velocity_offset, def->feet_velocity_count, def->estimates);
    }
    if (def->ground_offset < 0 || def->ground_count < 0 || def->ground_offset > def->critic_input ||
        def->ground_count > def->critic_input - def->ground_offset ||
        (!def->decoder_frame && def->ground_count == 0)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "policy: the decoder rebuilds numbers %d..+%d of the critic's %d%s",
                         def->ground_offset, def->ground_count, def->critic_input,
                         def->decoder_frame ? "" : ", and no frame");
    }
    return MILD_OK;
}

MildStatus network_layout(Network *network, const PolicyDef *def, MildError *error) {
    MildStatus status = check_def(def, error);
    if (status) {
        return status;
    }
    const int modulation_hidden[POLICY_LAYERS_MAX] = {def->modulation_hidden},
              phase = def->modulation_input == POLICY_INPUT_FEET_PHASE;
    memset(network, 0, sizeof *network);
    network->def = *def;
    network->history = policy_history(def);
    network->newest = policy_newest(def);
    network->heads = def->estimates + 2 * def->latent;
    network->theta = def->modulation_per_dimension ? 2 * def->latent : 2;
    network->feet = phase ? def->estimates - def->feet_velocity_offset : def->feet_velocity_count;
    network->clock = phase ? NETWORK_CLOCK : 0;
    network->actor_input = network->newest + def->estimates + def->latent;
    network->decoder_input = def->latent + def->estimates;
    network->decoded_frame = def->decoder_frame ? def->observation : 0;
    network->decoded = network->decoded_frame + def->ground_count;
    int64_t at =
        mlp_layout(&network->encoder, network->history, def->encoder_hidden, network->heads, 0);
    at = mlp_layout(&network->decoder, network->decoder_input, def->decoder_hidden,
                    network->decoded, at);
    at = mlp_layout(&network->modulation, network->feet + network->clock, modulation_hidden,
                    network->theta, at);
    at = mlp_layout(&network->actor, network->actor_input, def->actor_hidden, def->actions, at);
    network->critic_first = at;
    network->log_std = mlp_layout(&network->critic, def->critic_input, def->critic_hidden, 1, at);
    network->count = network->log_std + def->actions;
    return MILD_OK;
}

/* The clock in frame f of the inputs of a layer, whose first `frames` frames it reads. */
static int64_t clock_weights(const Network *network, const MlpLayer *layer, int row, int f) {
    return layer->weight + (int64_t)row * layer->in + (f + 1) * network->def.observation -
           NETWORK_CLOCK;
}

static void hide_in(const Network *network, const MlpLayer *layer, int frames, float *parameters) {
    for (int row = 0; row < layer->out; row++) {
        for (int f = 0; f < frames; f++) {
            memset(parameters + clock_weights(network, layer, row, f), 0,
                   NETWORK_CLOCK * sizeof *parameters);
        }
    }
}

static int sees_in(const Network *network, const MlpLayer *layer, int frames,
                   const float *parameters) {
    int sees = 0;
    for (int row = 0; row < layer->out; row++) {
        for (int f = 0; f < frames; f++) {
            const float *w = parameters + clock_weights(network, layer, row, f);
            sees |= w[0] != 0.0f || w[1] != 0.0f;
        }
    }
    return sees;
}

void network_hide_clock(const Network *network, float *parameters) {
    if (!network->def.actor_phase) {
        hide_in(network, &network->encoder.layer[0], network->def.frames, parameters);
        hide_in(network, &network->actor.layer[0], 1, parameters);
    }
}

int network_sees_clock(const Network *network, const float *parameters) {
    return !network->def.actor_phase &&
           (sees_in(network, &network->encoder.layer[0], network->def.frames, parameters) ||
            sees_in(network, &network->actor.layer[0], 1, parameters));
}

const Mlp *network_mlp(const Network *network, int index, const char **name) {
    static const char *const names[NETWORK_MLPS] = {"encoder", "decoder", "modulation", "actor",
                                                    "critic"};
    const Mlp *const mlps[NETWORK_MLPS] = {&network->encoder, &network->decoder,
                                           &network->modulation, &network->actor, &network->critic};
    *name = names[index];
    return mlps[index];
}

/* The modulation starts at identity: its last layer's weights are zero, its biases theta1 = 1,
 * theta2 = 0. */
void network_initialise(const Network *network, float *parameters, uint64_t seed) {
    const double last_scale[NETWORK_MLPS] = {0.5, 1.0, 0.0, 0.02, 1.0};
    for (int n = 0; n < NETWORK_MLPS; n++) {
        const char *name;
        mlp_initialise(network_mlp(network, n, &name), parameters, seed, (uint32_t)n,
                       last_scale[n]);
    }
    const MlpLayer *last = &network->modulation.layer[network->modulation.layers - 1];
    for (int i = 0; i < network->theta / 2; i++) {
        parameters[last->bias + i] = 1.0f;
    }
    for (int i = 0; i < network->def.actions; i++) {
        parameters[network->log_std + i] = (float)log(network->def.init_std);
    }
    network_hide_clock(network, parameters);
}

void network_carve(const Network *network, int rows, float *block, size_t *used,
                   NetworkOutputs *outputs) {
    mlp_carve_outputs(&network->encoder, rows, block, used, &outputs->encoder);
    mlp_carve_outputs(&network->modulation, rows, block, used, &outputs->modulation);
    mlp_carve_outputs(&network->actor, rows, block, used, &outputs->actor);
    outputs->noise = NULL;
    outputs->modulation_input =
        mlp_carve(block, used, (size_t)rows * (size_t)(network->feet + network->clock));
    outputs->actor_input = mlp_carve(block, used, (size_t)rows * (size_t)network->actor_input);
}

float *network_heads(const Network *network, const NetworkOutputs *outputs) {
    return outputs->encoder.y[network->encoder.layers - 1];
}

float *network_theta(const Network *network, const NetworkOutputs *outputs) {
    return outputs->modulation.y[network->modulation.layers - 1];
}

/* [feet's estimates | clock of the newest frame, before the scan]. */
static void fill_modulation_input(const Network *network, int rows, const float *history,
                                  const float *heads, float *input) {
    const int feet = network->feet, clock = network->clock;
    for (int r = 0; r < rows; r++) {
        memcpy(input, heads + network->def.feet_velocity_offset, (size_t)feet * sizeof *input);
        memcpy(input + feet, history + network->history - network->def.scan - clock,
               (size_t)clock * sizeof *input);
        history += network->history;
        heads += network->heads;
        input += feet + clock;
    }
}

/* z~ = theta1 z + theta2 of one row, z: mu, a draw around it, or what there is instead. */
static void modulate(const Network *network, const float *mu, const float *noise,
                     const float *theta, const PolicyInstead *instead, float *modulated) {
    const int latent = network->def.latent, per_dimension = network->def.modulation_per_dimension;
    const float *logvar = mu + latent;
    theta = instead && instead->theta ? instead->theta : theta;
    for (int j = 0; j < latent; j++) {
        float theta1 = theta[per_dimension ? j : 0], theta2 = theta[per_dimension ? latent + j : 1];
        const float z =
            instead && instead->latent ? instead->latent[j] : loss_latent(mu, logvar, noise, j);
        modulated[j] = theta1 * z + theta2;
    }
}

/* [newest frame | scan | estimates | theta1 mu + theta2]; paper, "Terrain Estimator and Modulation
 * Net". */
static void fill_actor_input(const Network *network, int rows, const float *history,
                             const PolicyInstead *instead, const NetworkOutputs *outputs) {
    const int newest = network->newest, estimates = network->def.estimates;
    const float *heads = network_heads(network, outputs), *theta = network_theta(network, outputs);
    const float *noise = outputs->noise;
    float *input = outputs->actor_input;
    for (int r = 0; r < rows; r++) {
        const float *estimated = instead && instead->estimates ? instead->estimates : heads;
        memcpy(input, history + network->history - newest, (size_t)newest * sizeof *input);
        memcpy(input + newest, estimated, (size_t)estimates * sizeof *input);
        modulate(network, heads + estimates, noise, theta, instead, input + newest + estimates);
        noise = noise ? noise + network->def.latent : NULL;
        history += network->history;
        heads += network->heads;
        theta += network->theta;
        input += network->actor_input;
    }
}

float *network_forward_instead(const Network *network, const float *parameters, int rows,
                               const float *history, const PolicyInstead *instead,
                               const NetworkOutputs *outputs) {
    const float *heads = mlp_forward(&network->encoder, parameters, rows, history, network->history,
                                     &outputs->encoder);
    fill_modulation_input(network, rows, history, heads, outputs->modulation_input);
    mlp_forward(&network->modulation, parameters, rows, outputs->modulation_input,
                network->feet + network->clock, &outputs->modulation);
    fill_actor_input(network, rows, history, instead, outputs);
    return mlp_forward(&network->actor, parameters, rows, outputs->actor_input,
                       network->actor_input, &outputs->actor);
}

float *network_forward(const Network *network, const float *parameters, int rows,
                       const float *history, const NetworkOutputs *outputs) {
    return network_forward_instead(network, parameters, rows, history, NULL, outputs);
}
