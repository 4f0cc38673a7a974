#include "learn/policy_def.h"

PolicyDef policy_def_default(void) {
    return (PolicyDef){
        .observation = 47,
        .frames = 6,
        .critic_input = 104,
        .actions = 12,
        .estimates = 11,
        .feet_velocity_offset = 3,
        .feet_velocity_count = 6,
        .decoder_frame = 1,
        .latent = 16,
        .encoder_hidden = {256, 128},
        .decoder_hidden = {64, 128},
        .modulation_hidden = 32,
        .modulation_per_dimension = 0,
        .modulation_input = POLICY_INPUT_FEET,
        .actor_phase = 1,
        .actor_hidden = {512, 256, 128},
        .critic_hidden = {768, 256, 128},
        .init_std = 0.8,
    };
}

static const char *const input_names[] = {"feet", "feet_phase"};

const MildField policy_fields[] = {
    MILD_FIELD(PolicyDef, latent, MILD_FIELD_INT, 1, 1, 1024, "[-] width of the latent vector z"),
    MILD_FIELD(PolicyDef, encoder_hidden, MILD_FIELD_INT, POLICY_LAYERS_MAX, 0, 8192,
               "[-] widths of the encoder's hidden layers; 0 ends the list"),
    MILD_FIELD(PolicyDef, decoder_hidden, MILD_FIELD_INT, POLICY_LAYERS_MAX, 0, 8192,
               "[-] widths of the decoder's hidden layers; 0 ends the list"),
    MILD_FIELD(PolicyDef, modulation_hidden, MILD_FIELD_INT, 1, 1, 8192,
               "[-] width of the modulation's hidden layer"),
    MILD_FIELD(PolicyDef, modulation_per_dimension, MILD_FIELD_BOOL, 1, 0, 1,
               "[bool] one theta1 and theta2 per latent dimension, instead of one for all"),
    MILD_FIELD_CHOICE(
        PolicyDef, modulation_input, input_names, POLICY_INPUTS,
        "[-] what theta depends on: feet, their estimated velocities (paper); feet_phase, all "
        "their estimates, velocities and heights, and the gait clock"),
    MILD_FIELD(
        PolicyDef, actor_phase, MILD_FIELD_BOOL, 1, 0, 1,
        "[bool] the actor sees the gait clock; false: neither it nor the encoder does, whose "
        "weights of the clock stay 0"),
    MILD_FIELD(PolicyDef, actor_hidden, MILD_FIELD_INT, POLICY_LAYERS_MAX, 0, 8192,
               "[-] widths of the actor's hidden layers; 0 ends the list"),
    MILD_FIELD(PolicyDef, critic_hidden, MILD_FIELD_INT, POLICY_LAYERS_MAX, 0, 8192,
               "[-] widths of the critic's hidden layers; 0 ends the list"),
    MILD_FIELD(PolicyDef, init_std, MILD_FIELD_DOUBLE, 1, 1e-3, 10.0,
               "[-] initial standard deviation of the action noise"),
};
const int policy_field_count = (int)(sizeof policy_fields / sizeof *policy_fields);
