/* The networks of the paper (fig. 3): encoder (multi-head VAE), decoder, modulation (FiLM), actor,
 * critic. Knows no robot. One allocation per family (parameters, gradients, moments), so optimiser
 * and checkpoint are flat loops. */
#ifndef MILD_POLICY_H
#define MILD_POLICY_H

#include <stdint.h>

#include "base/pool.h"
#include "learn/network.h"
#include "learn/policy_def.h"
#include "mild/error.h"

typedef struct Policy Policy;
Policy *policy_create(const PolicyDef *def, uint64_t seed, MildError *error);
void policy_destroy(Policy *policy);
const PolicyDef *policy_def(const Policy *policy);
int64_t policy_parameter_count(const Policy *policy);
float *policy_parameters(Policy *policy); /* flat, policy_parameter_count() */
/* Takes the networks of another policy. A decoder of another shape stays as it is, since no action
 * depends on it. From a policy without a scan, weights of the scan become 0, the mean actions are
 * those of the other, and the noise stays as it is. Returns 0, and takes nothing, when another
 * network has another shape. */
int policy_take_networks(Policy *policy, const Policy *from);

/* Deterministic action and estimates for `rows` histories (z = mu). history
 * [rows][frames*observation + scan], actions [rows][actions] (mean), estimates [rows][estimates]
 * (may be NULL), latent [rows][latent] modulated z~ (may be NULL). Rows are processed in fixed
 * chunks over the pool (NULL: caller's thread). One caller at a time per policy. */
void policy_act(Policy *policy, Pool *pool, int rows, const float *history, float *actions,
                float *estimates, float *latent);
/* The same actions from an actor that gets other numbers (NULL: its own), and all that passes
 * inside. policy_theta: numbers of theta in a row. */
void policy_act_inside(Policy *policy, Pool *pool, int rows, const float *history,
                       const PolicyInstead *instead, float *actions, const PolicyInside *inside);
int policy_theta(const Policy *policy);
const float *policy_std(const Policy *policy); /* [actions] current standard deviation */

/* A safetensors file with metadata: the def, a version line, a free text `note`, and a CRC-32 of
 * the whole file. policy_save writes it completely or not at all. policy_load builds a policy from
 * the file alone. A missing or damaged file gives one clear line. */
MildStatus policy_save(const Policy *policy, const char *path, const char *note, MildError *error);
Policy *policy_load(const char *path, char *note, int note_size, MildError *error);

#endif
