/* As test_batch.c, by functions that are compiled for the Go1 alone (tests/CMakeLists.txt). */
#include "follow.h"

static void go1_follows_mujoco(void **unused) {
    (void)unused;
    follow(GO1, some_def(), MILD_BATCH_HOST, NULL, 0.85);
}

static void go1_follows_mujoco_on_a_map(void **unused) {
    (void)unused;
    const MildMapDef map = some_map();
    follow(GO1, some_def(), MILD_BATCH_HOST, &map, 0.85);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(go1_follows_mujoco),
        cmocka_unit_test(go1_follows_mujoco_on_a_map),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
