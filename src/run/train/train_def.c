#include "run/train/train_def.h"

#include <stdio.h>
#include <string.h>

int train_device(const TrainDef *def) {
    int number = 0, end = 0;
    if (strcmp(def->device, "cpu") == 0) {
        return -1;
    }
    if (strcmp(def->device, "cuda") == 0) {
        return 0;
    }
    int good = sscanf(def->device, "cuda:%3d%n", &number, &end) == 1 && !def->device[end];
    return good && number >= 0 ? number : -2;
}

int train_is_batch(const TrainDef *def) {
    return def->robots == TRAIN_ROBOTS_BATCH ||
           (def->robots == TRAIN_ROBOTS_AUTO && train_device(def) >= 0);
}

TrainDef train_def_default(void) {
    return (TrainDef){.robot = "sa01",
                      .envs = 1024,
                      .iterations = 0,
                      .minutes = 60,
                      .checkpoint_every = 50,
                      .keep_checkpoints = 3,
                      .seed = 1,
                      .threads = 0,
                      .device = "cpu",
                      .grounds = 4096};
}

#define FIELD(member, type, min, max, help) MILD_FIELD(TrainDef, member, type, 1, min, max, help)
static const char *const robots_names[TRAIN_ROBOTS] = {"auto", "mujoco", "batch"};
#define MACHINE_FIELDS                                                                             \
    MILD_FIELD(TrainDef, device, MILD_FIELD_TEXT, sizeof((TrainDef *)0)->device, 0, 0,             \
               "[-] where the networks run: cpu, cuda or cuda:N (docs/gpu.md)"),                   \
        MILD_FIELD_CHOICE(TrainDef, robots, robots_names, TRAIN_ROBOTS,                            \
                          "[-] what steps the robots: mujoco on the cpu; batch, the batch engine " \
                          "(docs/engine.md), on train.device; auto: batch on a GPU, else mujoco")
const MildField train_machine_fields[] = {MACHINE_FIELDS};
const int train_machine_field_count = sizeof train_machine_fields / sizeof *train_machine_fields;
const MildField train_fields[] = {
    MILD_FIELD(TrainDef, robot, MILD_FIELD_TEXT, sizeof((TrainDef *)0)->robot, 0, 0,
               "[-] name of a folder under robots/, or a folder of your own, with a slash"),
    FIELD(envs, MILD_FIELD_INT, 1, 524288, "[-] robots that are simulated at the same time"),
    FIELD(iterations, MILD_FIELD_INT, 0, 1e9, "[-] iterations of PPO; 0: no limit"),
    FIELD(minutes, MILD_FIELD_DOUBLE, 0, 1e6, "[min] wall time of the run; 0: no limit"),
    FIELD(checkpoint_every, MILD_FIELD_INT, 1, 1e9, "[-] iterations between checkpoints"),
    FIELD(keep_checkpoints, MILD_FIELD_INT, 1, 1000,
          "[-] number of checkpoints to keep, the newest ones"),
    FIELD(seed, MILD_FIELD_UINT64, 0, 18446744073709551616.0,
          "[-] the same seed and config give the same numbers"),
    FIELD(threads, MILD_FIELD_INT, 0, 1024,
          "[-] threads; 0: one per core; the results do not depend on it"),
    MACHINE_FIELDS,
    FIELD(grounds, MILD_FIELD_INT, 1, 1000000,
          "[-] grounds drawn at the start, from which the episodes of the batch engine choose"),
    MILD_FIELD(
        TrainDef, start, MILD_FIELD_TEXT, sizeof((TrainDef *)0)->start, 0, 0,
        "[-] policy whose networks a new run begins with, but for a decoder of another shape "
        "(ppo.decoder_target) or without the scan that the run has; empty: random ones"),
};
const int train_field_count = sizeof train_fields / sizeof *train_fields;
