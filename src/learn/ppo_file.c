#include "learn/ppo.h"
#include "learn/ppo_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/text.h"
#include "learn/policy_file.h"

enum { COUNTER_ITERATION, COUNTER_ADAM_STEPS, COUNTER_SEED, COUNTERS };

#define TRAIN_TENSORS 10
#define OPTIMIZER_KEY "ppo.optimizer"

static Safetensor tensor_of(const char *name, SafetensorsType type, const void *data,
                            int64_t count) {
    const size_t sizes[] = {4, 8, 8, 1};
    return (Safetensor){.name = name,
                        .type = type,
                        .rank = 1,
                        .shape = {count},
                        .data = data,
                        .bytes = sizes[type] * (size_t)count};
}

/* ---- several processes: the file has the environments of all, each of them those of its part */

static int has_rows(const char *name) {
    static const char *const names[] = {"train.history", "train.critic",       "train.target",
                                        "train.frame",   "train.environments", "train.progress"};
    return text_find(name, names, sizeof names / sizeof *names) >= 0;
}

/* Bytes of all environments from those of the part, and back. Of a process alone any number. */
static size_t whole_bytes(const Ppo *ppo, size_t part) {
    return part * (size_t)ppo->part.envs / (size_t)ppo->part.width;
}

static size_t part_bytes(const Ppo *ppo, size_t whole, int environments) {
    return whole * (size_t)environments / (size_t)ppo->part.envs;
}

/* Replaces the data of the part by those of all environments, in *block, on rank 0. */
static MildStatus gather(const Ppo *ppo, Safetensor *tensors, int count, char **block,
                         MildError *error) {
    const int leads = ranks_number(ppo->ranks) == 0;
    size_t bytes = 0;
    *block = NULL;
    if (ranks_count(ppo->ranks) == 1) {
        return MILD_OK;
    }
    for (int i = 0; i < count; i++) {
        bytes += has_rows(tensors[i].name) ? tensors[i].bytes : 0;
    }
    *block = leads ? malloc(bytes) : NULL;
    MildStatus status =
        leads && !*block
            ? mild_fail(error, MILD_ERROR_MEMORY, "no memory for the checkpoint's %zu bytes", bytes)
            : MILD_OK;
    status = ranks_agree(ppo->ranks, status, error);
    char *to = *block;
    for (int i = 0; i < count && status == MILD_OK; i++) {
        if (has_rows(tensors[i].name)) {
            ranks_gather(ppo->ranks, tensors[i].data,
                         part_bytes(ppo, tensors[i].bytes, ppo->part.width), to);
            tensors[i].data = to;
            if (leads) {
                to += tensors[i].bytes;
            }
        }
    }
    return status;
}

/* Rank 0 reads the file, because other machines need not see it. */
static Safetensors *read_file(Ranks *ranks, const char *path, MildError *error) {
    const int leads = ranks_number(ranks) == 0;
    size_t size = 0;
    char *bytes = leads ? file_read(path, SIZE_MAX - 1, &size, error) : NULL;
    if (ranks_agree(ranks, leads && !bytes ? error->status : MILD_OK, error) != MILD_OK) {
        free(bytes);
        return NULL;
    }
    ranks_broadcast(ranks, &size, sizeof size);
    bytes = leads ? bytes : malloc(size);
    MildStatus status =
        bytes ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "%s: no memory to read it", path);
    if (ranks_agree(ranks, status, error) != MILD_OK) {
        free(bytes);
        return NULL;
    }
    ranks_broadcast(ranks, bytes, size);
    return safetensors_parse((unsigned char *)bytes, size, path, error);
}

/* ---- tensors ---- */

/* The caller's bytes in a checkpoint, and what belongs to them. */
typedef struct {
    const char *name; /* of the tensor */
    const void *bytes;
    size_t size; /* 0: none */
    int rows;    /* bool: the rows of time 0, from which the next rollout starts, are there too */
} Extra;

static Extra whole_extra(const void *bytes, size_t size) {
    return (Extra){"train.environments", bytes, size, 1};
}

static Extra kept_extra(const void *bytes, size_t size) {
    return (Extra){"train.progress", bytes, size, 0};
}

/* What resuming needs besides the policy. The sizes are those of the file; the data are those of
 * the part. */
static int train_tensors(const Ppo *ppo, const int64_t counters[COUNTERS], const Extra *extra,
                         Safetensor tensors[TRAIN_TENSORS]) {
    const Network *n = &ppo->policy->network;
    const PpoBatch *b = &ppo->start;
    const int64_t envs = ppo->part.envs;
    int count = 0;
    tensors[count++] = tensor_of("train.counters", SAFETENSORS_I64, counters, COUNTERS);
    tensors[count++] = tensor_of("train.learning_rate", SAFETENSORS_F64, &ppo->learning_rate, 1);
    tensors[count++] = tensor_of("train.first_moment", SAFETENSORS_F32, ppo->first, n->count);
    tensors[count++] = tensor_of("train.second_moment", SAFETENSORS_F32, ppo->second, n->count);
    if (extra->rows) {
        tensors[count++] =
            tensor_of("train.history", SAFETENSORS_F32, b->history, envs * n->history);
        tensors[count++] =
            tensor_of("train.critic", SAFETENSORS_F32, b->critic, envs * n->def.critic_input);
        tensors[count++] =
            tensor_of("train.target", SAFETENSORS_F32, b->target, envs * n->def.estimates);
        tensors[count++] =
            tensor_of("train.frame", SAFETENSORS_F32, b->frame, envs * n->def.observation);
    }
    if (ppo->average) {
        tensors[count++] =
            tensor_of("train.average", SAFETENSORS_F32, policy_parameters(ppo->average), n->count);
    }
    if (extra->size > 0) {
        tensors[count++] = tensor_of(extra->name, SAFETENSORS_U8, extra->bytes,
                                     (int64_t)whole_bytes(ppo, extra->size));
    }
    return count;
}

static MildStatus save(const Ppo *ppo, const char *path, const Extra *extra, const char *note,
                       MildError *error) {
    const PpoBackend *backend = &ppo->backend;
    MildStatus status = backend->pull ? backend->pull(backend->self, error) : MILD_OK;
    status = ranks_agree(ppo->ranks, status, error);
    if (status) {
        return status;
    }
    PolicyTensors policy;
    PolicyTexts texts;
    Safetensor all[TRAIN_TENSORS + POLICY_TENSORS_MAX];
    const int64_t counters[COUNTERS] = {ppo->iteration, ppo->adam_steps, (int64_t)ppo->seed};
    char *block;
    int count = train_tensors(ppo, counters, extra, all);
    status = gather(ppo, all, count, &block, error);
    if (status != MILD_OK) {
        free(block);
        return status;
    }
    policy_file_tensors(&ppo->policy->network, ppo->policy->parameters, &policy);
    policy_file_texts(&ppo->policy->network, POLICY_CHECKPOINT_KIND, note, &texts);
    if (ppo->def.optimizer != PPO_OPTIMIZER_ADAM) {
        texts.text[texts.count++] =
            (SafetensorsText){OPTIMIZER_KEY, ppo_optimizer_names[ppo->def.optimizer]};
    }
    /* the caller's bytes last, so that every number before them stays aligned */
    const int numbers = extra->size > 0 ? count - 1 : count;
    const Safetensor last = all[count - 1];
    memcpy(all + numbers, policy.tensor, (size_t)policy.count * sizeof *all);
    if (numbers < count) {
        all[numbers + policy.count] = last;
    }
    if (ranks_number(ppo->ranks) == 0) {
        status = safetensors_write(path, all, count + policy.count, texts.text, texts.count, error);
    }
    free(block);
    return ranks_agree(ppo->ranks, status, error);
}

MildStatus ppo_save(const Ppo *ppo, const char *path, const void *extra, size_t extra_size,
                    const char *note, MildError *error) {
    const Extra whole = whole_extra(extra, extra_size);
    return save(ppo, path, &whole, note, error);
}

MildStatus ppo_save_learner(const Ppo *ppo, const char *path, const void *kept, size_t kept_size,
                            const char *note, MildError *error) {
    const Extra some = kept_extra(kept, kept_size);
    return save(ppo, path, &some, note, error);
}

/* Of [policy]; the first action noise may be another. */
static MildStatus check_same_keys(const char *path, const PolicyDef *theirs, const PolicyDef *ours,
                                  MildError *error) {
    for (int f = 0; f < policy_field_count; f++) {
        const MildField *field = &policy_fields[f];
        char text[2][96];
        mild_field_print(field, theirs, text[0], sizeof text[0]);
        mild_field_print(field, ours, text[1], sizeof text[1]);
        if (strcmp(text[0], text[1]) != 0 && strcmp(field->name, "init_std") != 0) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "%s: its policy.%s is '%.60s', this run's is '%.60s'; resume with the "
                             "checkpoint's config",
                             path, field->name, text[0], text[1]);
        }
    }
    return MILD_OK;
}

static MildStatus check_same_network(const Safetensors *file, const char *path,
                                     const Network *network, MildError *error) {
    PolicyDef def;
    MildStatus status = policy_file_def(file, path, &def, error);
    if (status) {
        return status;
    }
    PolicyTexts ours;
    policy_file_texts(network, POLICY_CHECKPOINT_KIND, "", &ours);
    for (int i = 0; i < ours.count; i++) {
        const char *key = ours.text[i].key, *theirs = safetensors_text(file, key);
        if (theirs && strcmp(key, "note") != 0 && strcmp(key, "policy.init_std") != 0 &&
            strcmp(ours.text[i].value, theirs) != 0) {
            return mild_fail(
                error, MILD_ERROR_ARGUMENT,
                "%s: its %s is '%.60s', this run's is '%.60s'; resume with the checkpoint's config",
                path, key, theirs, ours.text[i].value);
        }
    }
    return check_same_keys(path, &def, &network->def, error);
}

/* Momentum means another number to another optimiser, and Adam's second moments are missing after
 * Muon. Files without the text are Adam's. */
static MildStatus check_optimizer(const Safetensors *file, const char *path, const Ppo *ppo,
                                  MildError *error) {
    const char *text = safetensors_text(file, OPTIMIZER_KEY),
               *theirs = text ? text : ppo_optimizer_names[PPO_OPTIMIZER_ADAM],
               *ours = ppo_optimizer_names[ppo->def.optimizer];
    if (strcmp(theirs, ours) != 0) {
        return mild_fail(
            error, MILD_ERROR_ARGUMENT,
            "%s: its %s is '%.60s', this run's is '%s'; resume with the checkpoint's config", path,
            OPTIMIZER_KEY, theirs, ours);
    }
    return MILD_OK;
}

/* Bool: a NaN in this tensor would spoil all weights at the first update. A NaN in an observation
 * costs only its minibatch. */
static int is_weights(const char *name) {
    return strcmp(name, "train.average") == 0 || strcmp(name, "train.first_moment") == 0 ||
           strcmp(name, "train.second_moment") == 0;
}

static int all_finite(const Safetensor *tensor) {
    for (size_t i = 0; i < tensor->bytes; i += sizeof(float)) {
        float value;
        memcpy(&value, (const char *)tensor->data + i, sizeof value);
        if (!isfinite(value)) {
            return 0;
        }
    }
    return 1;
}

static MildStatus check_train(const Safetensors *file, const char *path, const Safetensor *wanted,
                              int count, const Extra *extra, MildError *error) {
    for (int i = 0; i < count; i++) {
        const Safetensor *have = safetensors_find(file, wanted[i].name);
        if (!extra->rows && strcmp(wanted[i].name, extra->name) == 0) {
            continue; /* taken where it fits */
        }
        if (!have && strcmp(wanted[i].name, "train.average") == 0) {
            continue; /* the run had none: it starts from the weights */
        }
        if (!have || have->type != wanted[i].type || have->bytes != wanted[i].bytes) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "%s: %s holds %zu bytes, this run needs %zu; resume with the "
                             "checkpoint's config (train.envs, task)",
                             path, wanted[i].name, have ? have->bytes : (size_t)0, wanted[i].bytes);
        }
        if (is_weights(wanted[i].name) && !all_finite(have)) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: %s holds numbers that are not finite; take an older checkpoint",
                             path, wanted[i].name);
        }
    }
    if (extra->rows && !safetensors_find(file, extra->name) != !extra->size) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: contains an environment state that this run does not expect", path);
    }
    return MILD_OK;
}

static void take_train(Ppo *ppo, const Safetensors *file, const int64_t counters[COUNTERS],
                       double learning_rate, const Extra *extra, void *to) {
    const int rows = extra->rows;
    const struct {
        const char *name;
        void *to;
    } areas[] = {
        {"train.first_moment", ppo->first},
        {"train.second_moment", ppo->second},
        {"train.history", rows ? ppo->start.history : NULL},
        {"train.critic", rows ? ppo->start.critic : NULL},
        {"train.target", rows ? ppo->start.target : NULL},
        {"train.frame", rows ? ppo->start.frame : NULL},
        {"train.average", ppo->average ? policy_parameters(ppo->average) : NULL},
        {extra->name, to},
    };
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        const Safetensor *have = safetensors_find(file, areas[i].name);
        if (have && areas[i].to) {
            const int rows = has_rows(areas[i].name);
            const size_t skip = rows ? part_bytes(ppo, have->bytes, ppo->part.first) : 0,
                         take = rows ? part_bytes(ppo, have->bytes, ppo->part.width) : have->bytes;
            memcpy(areas[i].to, (const char *)have->data + skip, take);
        }
    }
    ppo->iteration = counters[COUNTER_ITERATION];
    ppo->adam_steps = counters[COUNTER_ADAM_STEPS];
    ppo->seed = (uint64_t)counters[COUNTER_SEED];
    ppo->learning_rate = learning_rate;
}

/* Checks everything, and reads the parameters into a spare array, before it changes `ppo`. */
static MildStatus take_file(Ppo *ppo, const Safetensors *file, const char *path, const Extra *extra,
                            void *to, float *spare, MildError *error) {
    const Network *n = &ppo->policy->network;
    Safetensor wanted[TRAIN_TENSORS];
    int64_t counters[COUNTERS] = {0};
    double learning_rate;
    int count = train_tensors(ppo, counters, extra, wanted);
    MildStatus status = check_same_network(file, path, n, error);
    if (!status) {
        status = check_optimizer(file, path, ppo, error);
    }
    if (!status) {
        status = policy_file_parameters(file, path, n, spare, error);
    }
    if (!status) {
        status = check_train(file, path, wanted, count, extra, error);
    }
    if (status) {
        return status;
    }
    memcpy(counters, safetensors_find(file, "train.counters")->data, sizeof counters);
    memcpy(&learning_rate, safetensors_find(file, "train.learning_rate")->data,
           sizeof learning_rate);
    if (counters[COUNTER_ITERATION] < 0 || counters[COUNTER_ADAM_STEPS] < 0 ||
        !(learning_rate >= 0.0 && learning_rate <= 1.0)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: its counters make no sense; take an older checkpoint", path);
    }
    memcpy(ppo->policy->parameters, spare, (size_t)n->count * sizeof *spare);
    if (ppo->average) {
        memcpy(policy_parameters(ppo->average), spare, (size_t)n->count * sizeof *spare);
    }
    take_train(ppo, file, counters, learning_rate, extra, to);
    return ppo->backend.push ? ppo->backend.push(ppo->backend.self, error) : MILD_OK;
}

static MildStatus take(Ppo *ppo, const Safetensors *file, const char *path, const Extra *extra,
                       void *to, MildError *error) {
    float *spare = malloc((size_t)ppo->policy->network.count * sizeof *spare);
    MildStatus status = spare
                            ? take_file(ppo, file, path, extra, to, spare, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "%s: no memory to read it", path);
    free(spare);
    return status;
}

MildStatus ppo_load_file(Ppo *ppo, const Safetensors *file, const char *path, void *extra,
                         size_t extra_size, MildError *error) {
    const Extra whole = whole_extra(extra, extra_size);
    return take(ppo, file, path, &whole, extra, error);
}

/* Takes the caller's bytes only if the file has as many of them. */
static MildStatus load_learner(Ppo *ppo, const Safetensors *file, const char *path, void *kept,
                               size_t kept_size, int *found, MildError *error) {
    const Safetensor *have = safetensors_find(file, "train.progress");
    const Extra some = kept_extra(kept, kept_size);
    *found = have && have->bytes == whole_bytes(ppo, kept_size);
    return take(ppo, file, path, &some, *found ? kept : NULL, error);
}

MildStatus ppo_load_learner(Ppo *ppo, const char *path, void *kept, size_t kept_size, int *found,
                            MildError *error) {
    MildError cause = {0};
    Safetensors *file = read_file(ppo->ranks, path, &cause);
    MildStatus status =
        file ? load_learner(ppo, file, path, kept, kept_size, found, &cause) : cause.status;
    status = ranks_agree(ppo->ranks, status, &cause);
    if (error && status != MILD_OK) {
        *error = cause;
    }
    safetensors_destroy(file);
    return status;
}

MildStatus ppo_file_is_whole(const char *path, int *whole, MildError *error) {
    MildError cause = {0};
    Safetensors *file = safetensors_read(path, &cause);
    if (!file) {
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    *whole = safetensors_find(file, "train.history") != NULL;
    safetensors_destroy(file);
    return MILD_OK;
}

MildStatus ppo_load(Ppo *ppo, const char *path, void *extra, size_t extra_size, MildError *error) {
    MildError cause = {0};
    Safetensors *file = read_file(ppo->ranks, path, &cause);
    MildStatus status =
        file ? ppo_load_file(ppo, file, path, extra, extra_size, &cause) : cause.status;
    status = ranks_agree(ppo->ranks, status, &cause);
    if (error && status != MILD_OK) {
        *error = cause;
    }
    safetensors_destroy(file);
    return status;
}
