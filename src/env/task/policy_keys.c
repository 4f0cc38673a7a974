#include "env/task/policy_keys.h"

#include <stdio.h>
#include <string.h>

#include "base/text.h"

static const char *const keys[] = {"gait_period",
                                   "gait_slowing",
                                   "gait_slow_below",
                                   "standing_below",
                                   "clock",
                                   "history_stride",
                                   "jump",
                                   "jump_stance",
                                   "scan",
                                   "scan_ahead",
                                   "scan_pitch",
                                   "scan_hold",
                                   "velocity_scale",
                                   "height_scale",
                                   "action_scale",
                                   "action_clip",
                                   "torque_share",
                                   "torque_hold",
                                   "speed_hold",
                                   "speed_hold_most",
                                   "kp",
                                   "kd"};

enum { KEYS = sizeof keys / sizeof *keys };

/* A key of older files, which has no effect: a shell in soft ground ends no episode. */
static const char gone[] = "shell_depth";

/* Bool: of a height scan or a speed hold, where the policy has none. Such keys are left out, so
 * that files stay what they were before there were these keys. */
static int is_off(const TaskDef *def, const char *name) {
    return (def->scan == 0 && strncmp(name, "scan", strlen("scan")) == 0) ||
           (def->speed_hold == 0 && strcmp(name, "speed_hold") == 0) ||
           (def->speed_hold_most == 0 && strcmp(name, "speed_hold_most") == 0);
}

void task_policy_keys_print(const TaskDef *def, char *text, size_t size) {
    size_t used = 0;
    for (int i = 0; i < KEYS && used < size; i++) {
        if (is_off(def, keys[i])) {
            continue;
        }
        const MildField *field = mild_field_find(task_fields, task_field_count, keys[i], NULL);
        used += (size_t)snprintf(text + used, size - used, "%s%s = ", i > 0 ? "; " : "", keys[i]);
        if (used < size) {
            used += (size_t)mild_field_print(field, def, text + used, size - used);
        }
    }
    if (used >= size) {
        text[0] = '\0';
    }
}

/* One "key = value" of `length` characters. */
static MildStatus take_key(TaskDef *def, const char *text, size_t length, MildError *error) {
    char line[32 + TASK_GAINS_SIZE];
    char *equals = NULL;
    if (length < sizeof line) {
        memcpy(line, text, length);
        line[length] = '\0';
        equals = strstr(line, " = ");
    }
    if (equals) {
        *equals = '\0';
    }
    if (equals && strcmp(line, gone) == 0) {
        return MILD_OK;
    }
    if (!equals || text_find(line, keys, KEYS) < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "'%.*s' is no key that a policy of this program has",
                         (int)(length < 40 ? length : 40), text);
    }
    const MildField *field = mild_field_find(task_fields, task_field_count, line, NULL);
    return mild_field_parse(field, def, equals + strlen(" = "), "task", error);
}

MildStatus task_policy_keys_read(TaskDef *def, const char *text, MildError *error) {
    MildStatus status = MILD_OK;
    while (status == MILD_OK && *text) {
        const char *end = strstr(text, "; ");
        const size_t length = end ? (size_t)(end - text) : strlen(text);
        status = take_key(def, text, length, error);
        text += length + (end ? strlen("; ") : 0);
    }
    return status == MILD_OK ? task_def_check(def, error) : status;
}
