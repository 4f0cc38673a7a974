#include "run/train/envs.h"

#include "ground/batch/batch.h"

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
