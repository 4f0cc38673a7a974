#include "train/train_def.h"

TrainDef train_def_default(void) {
    return (TrainDef){.robot = "sa01",
                      .envs = 1024,
                      .iterations = 0,
                      .minutes = 60,
                      .checkpoint_every = 50,
                      .keep_checkpoints = 3,
                      .seed = 1,
                      .threads = 0,
                      .device = "cpu"};
}

#define FIELD(member, type, min, max, help) MILD_FIELD(TrainDef, member, type, 1, min, max, help)
const MildField train_fields[] = {
    MILD_FIELD(TrainDef, robot, MILD_FIELD_TEXT, sizeof((TrainDef *)0)->robot, 0, 0,
               "[-] name of a folder under robots/, or a folder of your own, with a slash"),
    FIELD(envs, MILD_FIELD_INT, 1, 65536, "[-] robots that are simulated at the same time"),
    FIELD(iterations, MILD_FIELD_INT, 0, 1e9, "[-] iterations of PPO; 0: no limit"),
    FIELD(minutes, MILD_FIELD_DOUBLE, 0, 1e6, "[min] wall time of the run; 0: no limit"),
    FIELD(checkpoint_every, MILD_FIELD_INT, 1, 1e9, "[-] iterations between checkpoints"),
    FIELD(keep_checkpoints, MILD_FIELD_INT, 1, 1000,
          "[-] number of checkpoints to keep, the newest ones"),
    FIELD(seed, MILD_FIELD_UINT64, 0, 18446744073709551616.0,
          "[-] the same seed and config give the same numbers"),
    FIELD(threads, MILD_FIELD_INT, 0, 1024,
          "[-] threads; 0: one per core; the results do not depend on it"),
    MILD_FIELD(
        TrainDef, device, MILD_FIELD_TEXT, sizeof((TrainDef *)0)->device, 0, 0,
        "[-] where the networks run: cpu or cuda (docs/gpu.md); robots and ground always run on "
        "the cpu"),
};
const int train_field_count = sizeof train_fields / sizeof *train_fields;
