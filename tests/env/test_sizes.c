/* Memory of a robot: what SA01 takes of a device under the default task, by functions
 * compiled for it, and not more than it may. */
#define MILD_REAL_FLOAT
#include "env/backend.h"
#include "kit.h"
#include "mild/batch.h"
#include "robot/engine/data.h"
#include "sa01.h"

enum { ENVS = 2048, GROUNDS = 2 };

static size_t measure(const MildMapDef *on) {
    MildError error = {0};
    TaskDef def = task_def_default();
    MildMap *map = on ? mild_map_create(on, &error) : NULL;
    def.map = map;
    def.physics_dt = 0.005;
    def.randomize.patch_share = 0;
    Robot *robot = robot_create(SA01, &error);
    Pool *pool = pool_create(2);
    const EnvsDef of = {.task = &def,
                        .robot = robot,
                        .pool = pool,
                        .batch = 1,
                        .device = MILD_BATCH_HOST,
                        .count = ENVS,
                        .grounds = GROUNDS,
                        .seed = 7};
    Envs *envs = envs_create(&of, &error);
    expect_good(envs != NULL, &error);
    const EnvsMemory memory = envs_memory(envs);
    const size_t bytes = envs_robot_bytes(envs);
    printf("%s: %zu B: task %zu, engine %zu, ground %zu, rest %zu\n", on ? "map" : "level", bytes,
           memory.task, memory.engine, memory.ground, memory.rest);
    envs_destroy(envs);
    pool_destroy(pool);
    robot_destroy(robot);
    mild_map_destroy(map);
    return bytes;
}

/* With a share of 16 B of what all these robots have in common. */
TEST(sizes) {
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    const size_t level = measure(NULL), map = measure(&waves);
    assert_true(level <= 12288 && map <= 14900);
    assert_int_equal(map - level, (4 * 160 + 32) * sizeof(float)); /* the ground's */
}

/* A warp's, in shared memory. */
TEST(working_data) {
    printf("working data: %zu B\n", sizeof(EngineWork));
    assert_true(sizeof(EngineWork) <= 6 * 1024);
}

TEST_MAIN(NULL, NULL)
