/* The tensors and texts of a policy in a safetensors file. Names are those of a PyTorch module
 * whose members encoder, decoder, modulation, actor and critic are nn.Sequential(Linear, ELU,
 * Linear, ...): encoder.0.weight, encoder.2.weight, and a parameter log_std. */
#ifndef MILD_POLICY_FILE_H
#define MILD_POLICY_FILE_H

#include "learn/network.h"
#include "learn/policy.h"
#include "learn/safetensors.h"

#define POLICY_TENSORS_MAX (NETWORK_MLPS * MLP_LAYERS_MAX * 2 + 1)
#define POLICY_TEXTS_MAX 32

typedef struct {
    int count;
    Safetensor tensor[POLICY_TENSORS_MAX]; /* `data` points into the given parameters */
    char name[POLICY_TENSORS_MAX][32];
} PolicyTensors;

typedef struct {
    int count;
    SafetensorsText text[POLICY_TEXTS_MAX];
    char key[POLICY_TEXTS_MAX][48], value[POLICY_TEXTS_MAX][96];
} PolicyTexts;

#define POLICY_KIND "mild policy"
#define POLICY_CHECKPOINT_KIND "mild checkpoint" /* a policy and additional tensors "train.*" */
#define POLICY_FILE_VERSION "1"

void policy_file_tensors(const Network *network, const float *parameters, PolicyTensors *tensors);
void policy_file_texts(const Network *network, const char *kind, const char *note,
                       PolicyTexts *texts);

/* Reads the def from a file. Fails unless it is complete and valid. */
MildStatus policy_file_def(const Safetensors *file, const char *path, PolicyDef *def,
                           MildError *error);
/* The parameters of a network from the file: every tensor there, with its shape, finite. */
MildStatus policy_file_parameters(const Safetensors *file, const char *path, const Network *network,
                                  float *parameters, MildError *error);
/* A policy from an open file, as policy_load. */
Policy *policy_file_policy(const Safetensors *file, const char *path, MildError *error);

#endif
