#include "app/trained.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/paths.h"
#include "config/experiment_keys.h"
#include "learn/policy.h"

enum { NOTE = 1000, VALUE = 200 }; /* characters */

/* Keys of [task] that decide what the policy sees and what becomes of its actions. */
static const char *const keys[] = {
    "gait_period",    "standing_below", "clock",        "history_stride",
    "velocity_scale", "height_scale",   "action_scale", "action_clip",
    "torque_share",   "torque_hold",    "kp",           "kd"};

/* The word after --config in the command that made the policy. */
static int config_named(const char *note, char *file, size_t size) {
    const char *at = strstr(note, " --config ");
    if (!at) {
        return 0;
    }
    at += strlen(" --config ");
    const size_t length = strcspn(at, " ,");
    if (length == 0 || length >= size) {
        return 0;
    }
    memcpy(file, at, length);
    file[length] = 0;
    return 1;
}

/* Bool: the command that made the policy gave the key a value of its own. */
static int is_overridden(const char *note, const char *key) {
    char option[VALUE];
    snprintf(option, sizeof option, " --task.%s=", key);
    return strstr(note, option) != NULL;
}

static int note_of(const char *policy, char note[NOTE]) {
    MildError unused;
    Policy *file = policy_load(policy, note, NOTE, &unused);
    policy_destroy(file);
    return file != NULL;
}

void trained_tell(const char *command, const char *policy, const char *config,
                  const TaskDef *task) {
    char note[NOTE] = "", name[PATH_SIZE], place[PATH_SIZE], robot[TRAIN_ROBOT_SIZE];
    TaskDef trained;
    MildError unused;
    if (config || !note_of(policy, note) || !config_named(note, name, sizeof name)) {
        return;
    }
    const char *file = access(name, R_OK) == 0 ? name : path_data(name, place);
    if (access(file, R_OK) != 0 || experiment_task(&trained, 0, robot, file, &unused) != MILD_OK) {
        return;
    }
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        const MildField *field = mild_field_find(task_fields, task_field_count, keys[i], NULL);
        char here[VALUE], there[VALUE];
        mild_field_print(field, task, here, sizeof here);
        mild_field_print(field, &trained, there, sizeof there);
        if (strcmp(here, there) != 0 && !is_overridden(note, keys[i])) {
            fprintf(stderr,
                    "mild %s: %s was trained with task.%s = %s, which is %s here; give --config "
                    "%s\n",
                    command, policy, keys[i], there, here, name);
            return;
        }
    }
}
