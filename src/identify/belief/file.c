#include "identify/belief/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/paths.h"
#include "learn/safetensors.h"

/* Tensor, its numbers, where they go. */
typedef struct {
    const char *name;
    float *to;
    size_t count;
} Part;

#define PART(member)                                                                               \
    { #member, (float *)(void *)&net->member, sizeof net->member / sizeof(float) }

static MildStatus take(const Safetensors *file, const Part *part, const char *path,
                       MildError *error) {
    const Safetensor *tensor = safetensors_find(file, part->name);
    if (!tensor || tensor->type != SAFETENSORS_F32 ||
        tensor->bytes != part->count * sizeof(float)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: no weights of a belief: tensor '%s' of %zu numbers is missing; "
                         "lab/know/know.py makes the file",
                         path, part->name, part->count);
    }
    memcpy(part->to, tensor->data, tensor->bytes);
    for (size_t i = 0; i < part->count; i++) {
        if (!isfinite(part->to[i])) {
            return mild_fail(error, MILD_ERROR_FORMAT, "%s: a number of '%s' is not finite", path,
                             part->name);
        }
    }
    return MILD_OK;
}

/* A prior's values grow with their place. */
static MildStatus check_priors(const BeliefNet *net, const char *path, MildError *error) {
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        for (int k = 1; k < BELIEF_KNOTS; k++) {
            if (!(net->prior[i][k] > net->prior[i][k - 1])) {
                return mild_fail(error, MILD_ERROR_FORMAT, "%s: the prior of %s does not grow",
                                 path, belief_names[i].name);
            }
        }
    }
    return MILD_OK;
}

static MildStatus fill(const Safetensors *file, const char *path, BeliefNet *net,
                       MildError *error) {
    const Part parts[] = {PART(embed),       PART(embed_bias),    PART(hidden),
                          PART(hidden_bias), PART(out),           PART(out_bias),
                          PART(prior),       PART(widen),         PART(odds),
                          PART(odds_bias),   PART(odds_second),   PART(odds_second_bias),
                          PART(odds_out),    PART(odds_out_bias), PART(alarm)};
    MildStatus status = MILD_OK;
    for (size_t i = 0; i < sizeof parts / sizeof *parts && status == MILD_OK; i++) {
        status = take(file, &parts[i], path, error);
    }
    return status == MILD_OK ? check_priors(net, path, error) : status;
}

BeliefNet *belief_read(const char *path, MildError *error) {
    Safetensors *file = safetensors_read(path, error);
    if (!file) {
        return NULL;
    }
    BeliefNet *net = calloc(1, sizeof *net);
    MildStatus status = net ? fill(file, path, net, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    safetensors_destroy(file);
    if (status != MILD_OK) {
        free(net);
        return NULL;
    }
    return net;
}

int belief_has(const char *robot) {
    return strcmp(robot, "sa01") == 0;
}

MildStatus belief_open(const char *robot, BeliefNet **net, MildError *error) {
    char shipped[PATH_SIZE];
    *net = NULL;
    if (belief_has(robot)) {
        *net = belief_read(path_data(BELIEF_SHIPPED, shipped), error);
        return *net ? MILD_OK : error->status;
    }
    return MILD_OK;
}
