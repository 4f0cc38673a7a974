#include "learn/cuda/network.h"

#include <string.h>

static int64_t pad_mlp(const Mlp *from, Mlp *to, int64_t at) {
    to->layers = from->layers;
    for (int l = 0; l < from->layers; l++) {
        MlpLayer *layer = &to->layer[l];
        layer->in = gpu_pitch(from->layer[l].in);
        layer->out = gpu_pitch(from->layer[l].out);
        layer->weight = at;
        layer->bias = at + (int64_t)layer->in * layer->out;
        at = layer->bias + layer->out;
    }
    return at;
}

Network gpu_network(const Network *network) {
    Network padded = *network;
    int64_t at = pad_mlp(&network->encoder, &padded.encoder, 0);
    at = pad_mlp(&network->decoder, &padded.decoder, at);
    at = pad_mlp(&network->modulation, &padded.modulation, at);
    at = pad_mlp(&network->actor, &padded.actor, at);
    padded.critic_first = at;
    padded.log_std = pad_mlp(&network->critic, &padded.critic, at);
    padded.count = padded.log_std + gpu_pitch(network->def.actions);
    padded.history = gpu_pitch(network->history);
    padded.heads = gpu_pitch(network->heads);
    padded.theta = gpu_pitch(network->theta);
    padded.actor_input = gpu_pitch(network->actor_input);
    padded.decoder_input = gpu_pitch(network->decoder_input);
    return padded;
}

static void copy(float *to, const float *from, int count) {
    memcpy(to, from, (size_t)count * sizeof *to);
}

/* Copies all parameters, from the padded array or to it. */
static void copy_all(const Network *network, const Network *padded, const float *from, float *to,
                     int pad) {
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(network, i, &name), *wide = network_mlp(padded, i, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *a = &mlp->layer[l], *b = &wide->layer[l];
            for (int row = 0; row < a->out; row++) {
                const int64_t tight = a->weight + (int64_t)row * a->in,
                              loose = b->weight + (int64_t)row * b->in;
                copy(to + (pad ? loose : tight), from + (pad ? tight : loose), a->in);
            }
            copy(to + (pad ? b->bias : a->bias), from + (pad ? a->bias : b->bias), a->out);
        }
    }
    copy(to + (pad ? padded : network)->log_std, from + (pad ? network : padded)->log_std,
         network->def.actions);
}

void gpu_network_pad(const Network *network, const Network *padded, const float *from, float *to) {
    memset(to, 0, (size_t)padded->count * sizeof *to);
    copy_all(network, padded, from, to, 1);
}

void gpu_network_strip(const Network *network, const Network *padded, const float *from,
                       float *to) {
    copy_all(network, padded, from, to, 0);
}
