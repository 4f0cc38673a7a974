/* Four round feet as the two of test_batch.c, by functions that are compiled for the Go1 alone
 * (tests/CMakeLists.txt). */
#include "follow.h"

TEST(go1_follows_mujoco) {
    follow(GO1, some_def(), MILD_BATCH_HOST, NULL, 0.85);
}

TEST(go1_follows_mujoco_on_a_map) {
    const MildMapDef map = some_map();
    follow(GO1, some_def(), MILD_BATCH_HOST, &map, 0.85);
}

TEST_MAIN(NULL, NULL)
