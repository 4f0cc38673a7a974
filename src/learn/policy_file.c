#include "learn/policy_file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "learn/policy_private.h"

/* Shape fields of the def. The task sets them, so they are no config keys, but a file must have
 * them. */
static const MildField shape_fields[] = {
    MILD_FIELD(PolicyDef, observation, MILD_FIELD_INT, 1, 1, 16384, "[-] width of one frame"),
    MILD_FIELD(PolicyDef, frames, MILD_FIELD_INT, 1, 1, 16384, "[-] frames in the history"),
    MILD_FIELD(PolicyDef, critic_input, MILD_FIELD_INT, 1, 1, 16384,
               "[-] width of the critic's input"),
    MILD_FIELD(PolicyDef, actions, MILD_FIELD_INT, 1, 1, NETWORK_ACTIONS_MAX, "[-] actions"),
    MILD_FIELD(PolicyDef, estimates, MILD_FIELD_INT, 1, 1, 16384, "[-] estimates"),
    MILD_FIELD(PolicyDef, feet_velocity_offset, MILD_FIELD_INT, 1, 0, 16384,
               "[-] first estimate of the feet velocities"),
    MILD_FIELD(PolicyDef, feet_velocity_count, MILD_FIELD_INT, 1, 1, 16384,
               "[-] estimates of feet velocities"),
    MILD_FIELD(PolicyDef, scan, MILD_FIELD_INT, 1, 0, 16384, "[-] numbers of the height scan"),
};
#define SHAPE_FIELDS ((int)(sizeof shape_fields / sizeof *shape_fields))

/* What the decoder rebuilds. A file without them has the decoder of a frame alone, and is written
 * without them. */
static const MildField decoder_fields[] = {
    MILD_FIELD(PolicyDef, decoder_frame, MILD_FIELD_BOOL, 1, 0, 1, "[bool] it rebuilds a frame"),
    MILD_FIELD(PolicyDef, ground_offset, MILD_FIELD_INT, 1, 0, 16384,
               "[-] first of the ground's parameters in the critic's input"),
    MILD_FIELD(PolicyDef, ground_count, MILD_FIELD_INT, 1, 1, 16384,
               "[-] parameters of the ground that it rebuilds"),
};
#define DECODER_FIELDS ((int)(sizeof decoder_fields / sizeof *decoder_fields))

static const MildField *file_field(int index) {
    return index < SHAPE_FIELDS ? &shape_fields[index] : &policy_fields[index - SHAPE_FIELDS];
}

/* Keys that came after the first files. A file without them has their defaults, which are not
 * written. */
static int is_later(const MildField *field) {
    return strcmp(field->name, "modulation_input") == 0 ||
           strcmp(field->name, "actor_phase") == 0 || strcmp(field->name, "scan") == 0;
}

static int is_written(const MildField *field, const PolicyDef *def) {
    const PolicyDef usual = policy_def_default();
    char text[2][48];
    mild_field_print(field, def, text[0], sizeof text[0]);
    mild_field_print(field, &usual, text[1], sizeof text[1]);
    return !is_later(field) || strcmp(text[0], text[1]) != 0;
}

static void add_tensor(PolicyTensors *tensors, const char *net, int index, const char *what,
                       const float *data, int rows, int columns) {
    char *name = tensors->name[tensors->count];
    snprintf(name, sizeof tensors->name[0], "%s.%d.%s", net, index, what);
    tensors->tensor[tensors->count++] =
        (Safetensor){.name = name,
                     .type = SAFETENSORS_F32,
                     .rank = columns > 0 ? 2 : 1,
                     .shape = {rows, columns},
                     .data = data,
                     .bytes = sizeof(float) * (size_t)rows * (size_t)(columns > 0 ? columns : 1)};
}

void policy_file_tensors(const Network *network, const float *parameters, PolicyTensors *tensors) {
    tensors->count = 0;
    for (int n = 0; n < NETWORK_MLPS; n++) {
        const char *name;
        const Mlp *mlp = network_mlp(network, n, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *layer = &mlp->layer[l];
            add_tensor(tensors, name, 2 * l, "weight", parameters + layer->weight, layer->out,
                       layer->in);
            add_tensor(tensors, name, 2 * l, "bias", parameters + layer->bias, layer->out, 0);
        }
    }
    add_tensor(tensors, "", 0, "", parameters + network->log_std, network->def.actions, 0);
    strcpy(tensors->name[tensors->count - 1], "log_std");
}

/* Optional: files from before they were written have none. */
static const MildField text_fields[] = {
    MILD_FIELD(PolicyDef, robot, MILD_FIELD_TEXT, (int)sizeof((PolicyDef *)NULL)->robot, 0, 0,
               "[text] robot that the policy was trained for"),
    MILD_FIELD(PolicyDef, task, MILD_FIELD_TEXT, (int)sizeof((PolicyDef *)NULL)->task, 0, 0,
               "[text] how it walks"),
};

static void add_text(PolicyTexts *texts, const char *key, const char *value) {
    texts->text[texts->count++] = (SafetensorsText){key, value};
}

static void add_field(PolicyTexts *texts, const MildField *field, const PolicyDef *def) {
    const int at = texts->count;
    snprintf(texts->key[at], sizeof texts->key[at], "policy.%s", field->name);
    mild_field_print(field, def, texts->value[at], sizeof texts->value[at]);
    add_text(texts, texts->key[at], texts->value[at]);
}

void policy_file_texts(const Network *network, const char *kind, const char *note,
                       PolicyTexts *texts) {
    texts->count = 0;
    add_text(texts, "kind", kind);
    add_text(texts, "version", POLICY_FILE_VERSION);
    add_text(texts, "note", note ? note : "");
    if (network->def.robot[0]) {
        add_text(texts, "robot", network->def.robot);
    }
    if (network->def.task[0]) {
        add_text(texts, "task", network->def.task);
    }
    for (int f = 0; f < SHAPE_FIELDS + policy_field_count; f++) {
        if (is_written(file_field(f), &network->def)) {
            add_field(texts, file_field(f), &network->def);
        }
    }
    for (int f = 0; network->def.ground_count > 0 && f < DECODER_FIELDS; f++) {
        add_field(texts, &decoder_fields[f], &network->def);
    }
}

static MildStatus missing_key(const char *path, const char *key, MildError *error) {
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%s: its metadata key '%s' is missing; give a policy or checkpoint that "
                     "`mild train` wrote",
                     path, key);
}

static MildStatus take_field(const Safetensors *file, const char *path, const MildField *field,
                             int needed, PolicyDef *def, MildError *error) {
    char key[48];
    snprintf(key, sizeof key, "policy.%s", field->name);
    const char *text = safetensors_text(file, key);
    MildError inner = {0};
    if (!text) {
        return needed ? missing_key(path, key, error) : MILD_OK;
    }
    if (mild_field_parse(field, def, text, "policy", &inner)) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%s: %.200s; this program cannot use the file",
                         path, inner.text);
    }
    return MILD_OK;
}

MildStatus policy_file_def(const Safetensors *file, const char *path, PolicyDef *def,
                           MildError *error) {
    const char *kind = safetensors_text(file, "kind"), *version = safetensors_text(file, "version");
    if (!kind) {
        return missing_key(path, "kind", error);
    }
    if (!version) {
        return missing_key(path, "version", error);
    }
    if (strcmp(kind, POLICY_KIND) != 0 && strcmp(kind, POLICY_CHECKPOINT_KIND) != 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: holds no policy of mild; give a file that `mild train` wrote", path);
    }
    if (strcmp(version, POLICY_FILE_VERSION) != 0) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%s: has file version %.20s, this program reads version " POLICY_FILE_VERSION, path,
            version);
    }
    *def = policy_def_default();
    for (size_t f = 0; f < sizeof text_fields / sizeof *text_fields; f++) {
        const char *name = text_fields[f].name, *text = safetensors_text(file, name);
        if (text && mild_field_parse(&text_fields[f], def, text, "policy", error) != MILD_OK) {
            return mild_fail(error, MILD_ERROR_FORMAT, "%s: its metadata key '%s' is too long",
                             path, name);
        }
    }
    MildStatus status = MILD_OK;
    for (int f = 0; !status && f < SHAPE_FIELDS + policy_field_count; f++) {
        const MildField *field = file_field(f);
        status = take_field(file, path, field, !is_later(field), def, error);
    }
    for (int f = 0; !status && f < DECODER_FIELDS; f++) {
        status = take_field(file, path, &decoder_fields[f], 0, def, error);
    }
    return status;
}

static MildStatus wrong_tensor(const char *path, const char *name, const char *what,
                               MildError *error) {
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%s: tensor %.64s %s; the file does not fit the network it states", path, name,
                     what);
}

/* Refuses tensors that belong neither to a policy nor to a checkpoint. */
static MildStatus check_strangers(const Safetensors *file, const char *path,
                                  const PolicyTensors *wanted, MildError *error) {
    for (int i = 0; i < safetensors_count(file); i++) {
        const char *name = safetensors_at(file, i)->name;
        int known = strncmp(name, "train.", 6) == 0;
        for (int k = 0; k < wanted->count && !known; k++) {
            known = strcmp(name, wanted->name[k]) == 0;
        }
        if (!known) {
            return wrong_tensor(path, name, "is not part of a policy", error);
        }
    }
    return MILD_OK;
}

MildStatus policy_file_parameters(const Safetensors *file, const char *path, const Network *network,
                                  float *parameters, MildError *error) {
    PolicyTensors wanted;
    policy_file_tensors(network, parameters, &wanted);
    for (int k = 0; k < wanted.count; k++) {
        const Safetensor *want = &wanted.tensor[k], *have = safetensors_find(file, want->name);
        if (!have) {
            return wrong_tensor(path, want->name, "is missing", error);
        }
        if (have->type != want->type || have->rank != want->rank ||
            memcmp(have->shape, want->shape, sizeof have->shape) != 0) {
            return wrong_tensor(path, want->name, "has another type or shape", error);
        }
        memcpy(parameters + ((const float *)want->data - parameters), have->data, have->bytes);
    }
    for (int64_t i = 0; i < network->count; i++) {
        if (!isfinite(parameters[i])) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: holds weights that are not finite; take an older checkpoint",
                             path);
        }
    }
    if (network_sees_clock(network, parameters)) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%s: says policy.actor_phase = false, but its actor or encoder has weights "
            "of the gait clock; give a file that `mild train` wrote",
            path);
    }
    return check_strangers(file, path, &wanted, error);
}

MildStatus policy_save(const Policy *policy, const char *path, const char *note, MildError *error) {
    PolicyTensors tensors;
    PolicyTexts texts;
    policy_file_tensors(&policy->network, policy->parameters, &tensors);
    policy_file_texts(&policy->network, POLICY_KIND, note, &texts);
    return safetensors_write(path, tensors.tensor, tensors.count, texts.text, texts.count, error);
}

/* Compares the size that the def asks for with the file before it allocates that much. */
Policy *policy_file_policy(const Safetensors *file, const char *path, MildError *error) {
    PolicyDef def;
    Network network;
    MildError inner = {0};
    if (policy_file_def(file, path, &def, error)) {
        return NULL;
    }
    if (network_layout(&network, &def, &inner)) {
        mild_fail(error, MILD_ERROR_FORMAT, "%s: %.200s; this program cannot use the file", path,
                  inner.text);
        return NULL;
    }
    size_t bytes = 0;
    for (int i = 0; i < safetensors_count(file); i++) {
        bytes += safetensors_at(file, i)->bytes;
    }
    if ((uint64_t)network.count > bytes / sizeof(float)) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%s: states a network larger than the file; take an older checkpoint", path);
        return NULL;
    }
    Policy *policy = policy_create(&def, 0, error);
    if (policy && policy_file_parameters(file, path, &policy->network, policy->parameters, error)) {
        policy_destroy(policy);
        return NULL;
    }
    return policy;
}

/* For a file that is none of ours, by its name: another program's network or checkpoint. */
static void say_where_to_go(const char *path, MildError *error) {
    const char *end = strrchr(path, '.');
    if (end && strcmp(end, ".onnx") == 0) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%s: no policy of mild; `mild trial ROBOT.xml %s --describe LAYOUT` judges it, "
                  "--video shows it (docs/public-policies.md)",
                  path, path);
    } else if (end && strcmp(end, ".pt") == 0) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%s: no policy of mild; `python -m mild.rsl_rl %s --out FILE` makes one of a "
                  "checkpoint of mild.rsl_rl (docs/python.md); `mild trial ROBOT.xml FILE "
                  "--describe LAYOUT` judges TorchScript, or the .onnx that mjlab writes beside a "
                  "checkpoint (docs/public-policies.md)",
                  path, path);
    }
}

Policy *policy_load(const char *path, char *note, int note_size, MildError *error) {
    Safetensors *file = safetensors_read(path, error);
    if (!file) {
        char inside[512];
        snprintf(inside, sizeof inside, "%.480s/policy.safetensors", path);
        if (error && error->status == MILD_ERROR_FORMAT) {
            say_where_to_go(path, error);
        } else if (access(inside, R_OK) == 0) { /* a run folder */
            mild_fail(error, MILD_ERROR_ARGUMENT, "%s: it is a folder; give %s", path, inside);
        }
        return NULL;
    }
    Policy *policy = policy_file_policy(file, path, error);
    if (policy && note && note_size > 0) {
        const char *text = safetensors_text(file, "note");
        snprintf(note, (size_t)note_size, "%s", text ? text : "");
    }
    safetensors_destroy(file);
    return policy;
}
