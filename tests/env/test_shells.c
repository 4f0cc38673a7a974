/* Environments of the batch engine whose robots' shells stand on soft ground, against those of the
 * CPU, which MuJoCo steps; and against themselves without, where no shell is near the ground. */
#include "follow.h"

#define G1 MILD_SOURCE_DIR "/robots/g1"

/* Falls end by the base or by tilt, and shanks touch the ground before. */
static TaskDef shells_def(void) {
    TaskDef def = some_def();
    def.shells_stand = 1;
    def.randomize.rigid_share = 0.1;
    return def;
}

static void follows_mujoco(void **unused) {
    (void)unused;
    const MildMapDef map = some_map();
    follow(SA01, shells_def(), MILD_BATCH_HOST, NULL, 0.8);
    follow(SA01, shells_def(), MILD_BATCH_HOST, &map, 0.8);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(follows_mujoco),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
