/* The networks as they lie on the device: every width is rounded up to a multiple of 8, because
 * cuBLAS needs rows aligned to 16 bytes to use the tensor cores, of numbers with 16 bits too.
 * Weights, biases and inputs are zero in the columns and rows that were added. So are their
 * gradients, and they stay zero. */
#ifndef MILD_GPU_NETWORK_H
#define MILD_GPU_NETWORK_H

#include "learn/network.h"

static inline int gpu_pitch(int width) {
    return (width + 7) / 8 * 8;
}

/* The same networks with rounded widths and the offsets that follow from them. */
Network gpu_network(const Network *network);
/* Between the parameters [network->count] and their padded form [padded->count]. gpu_network_pad
 * also writes the zeros. */
void gpu_network_pad(const Network *network, const Network *padded, const float *from, float *to);
void gpu_network_strip(const Network *network, const Network *padded, const float *from, float *to);

#endif
