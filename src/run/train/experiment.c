#include "run/train/experiment.h"

#include <stdio.h>
#include <string.h>

#include "env/task/policy_keys.h"
#include "env/task/task.h"
#include "ground/batch/batch.h"

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

ExperimentDef experiment_def_default(void) {
    ExperimentDef def = {
        .train = train_def_default(),
        .ppo = ppo_def_default(),
        .policy = policy_def_default(),
        .task = task_def_default(),
        .terrain = terrain_def_default(),
    };
    return def;
}

void experiment_fit_robot(ExperimentDef *def, const Robot *robot) {
    TaskShape shape = task_shape(&def->task, robot);
    snprintf(def->policy.robot, sizeof def->policy.robot, "%s", robot_name(robot));
    task_policy_keys_print(&def->task, def->policy.task, sizeof def->policy.task);
    def->policy.observation = shape.observation;
    def->policy.frames = TASK_FRAMES;
    def->policy.scan = shape.scan;
    def->policy.critic_input = shape.critic;
    def->policy.actions = shape.actions;
    def->policy.estimates = shape.estimates;
    def->policy.feet_velocity_offset = 3; /* behind the base's velocity */
    def->policy.feet_velocity_count = 3 * shape.feet;
    ppo_set_decoder(&def->ppo, task_critic_ground(&shape), TASK_GROUND_NUMBERS + 1, &def->policy);
}

MildStatus experiment_check(const ExperimentDef *def, MildError *error) {
    MildStatus status =
        mild_fields_check(train_fields, train_field_count, &def->train, "train", error);
    if (status == MILD_OK) {
        status = mild_fields_check(ppo_fields, ppo_field_count, &def->ppo, "ppo", error);
    }
    if (status == MILD_OK) {
        status =
            mild_fields_check(policy_fields, policy_field_count, &def->policy, "policy", error);
    }
    if (status == MILD_OK) {
        status = task_def_check(&def->task, error);
    }
    if (status == MILD_OK) {
        int count;
        const MildField *fields = terrain_fields(&count);
        status = mild_fields_check(fields, count, &def->terrain, "terrain", error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (def->ppo.learning_rate_min > def->ppo.learning_rate_max) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.learning_rate_min %g is above ppo.learning_rate_max %g",
                         def->ppo.learning_rate_min, def->ppo.learning_rate_max);
    }
    if (def->policy.modulation_input == POLICY_INPUT_FEET_PHASE && !def->task.clock) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "policy.modulation_input = feet_phase reads the gait clock of the "
                         "observation; give task.clock = true");
    }
    if (train_device(&def->train) < -1) {
        return mild_fail(error, MILD_ERROR_RANGE, "train.device = %s: neither cpu, cuda nor cuda:N",
                         def->train.device);
    }
    if ((int64_t)def->train.envs * def->ppo.steps < def->ppo.minibatches) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.minibatches %d: train.envs %d x ppo.steps %d gives fewer samples",
                         def->ppo.minibatches, def->train.envs, def->ppo.steps);
    }
    return MILD_OK;
}

enum { TRAIN_MATERIALS = 3 }; /* drawn for the pattern of a terrain, as for stripes */

/* The batch engine has patches as stripes of the map: *striped, see EnvsDef. */
static MildStatus make_map(const ExperimentDef *def, MildMap **map, int *striped,
                           MildError *error) {
    *striped = train_is_batch(&def->train) && def->task.randomize.patch_share > 0 &&
               def->terrain.map.patches == MILD_PATTERN_NONE;
    return *striped
               ? terrain_make_striped(&def->terrain, TRAIN_MATERIALS,
                                      def->task.randomize.patch_length, def->train.seed, map, error)
               : terrain_make(&def->terrain, TRAIN_MATERIALS, map, error);
}

MildStatus train_envs_open(TrainEnvs *envs, ExperimentDef *def, const Robot *robot, Pool *pool,
                           int count, int first, MildError *error) {
    const int device = train_device(&def->train);
    int striped = 0;
    *envs = (TrainEnvs){.envs = NULL};
    if (make_map(def, &envs->map, &striped, error) != MILD_OK) {
        return error->status;
    }
    def->task.map = envs->map;
    def->task.imprint_tiles = terrain_imprint_tiles(&def->terrain);
    if (task_soils_open(&def->task, robot, &envs->soils, error) != MILD_OK) {
        return error->status;
    }
    if (actuator_open(&def->task, robot, &envs->actuator, error) != MILD_OK) {
        return error->status;
    }
    const EnvsDef of = {.task = &def->task,
                        .robot = robot,
                        .pool = pool,
                        .count = count,
                        .first = (uint32_t)first,
                        .seed = def->train.seed,
                        .batch = train_is_batch(&def->train),
                        .device = device < 0 ? MILD_BATCH_HOST : device,
                        .grounds = def->train.grounds,
                        .striped = striped};
    envs->envs = envs_create(&of, error);
    return envs->envs ? MILD_OK : error->status;
}

void train_envs_close(TrainEnvs *envs) {
    envs_destroy(envs->envs);
    mild_map_destroy(envs->map);
    actuator_destroy(envs->actuator);
}
