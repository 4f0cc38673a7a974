/* The crowd beside the robot of `mild play`: each of its robots stands on that part of the course
 * on which it is drawn. */
#include "app/crowd.h"
#include "kit.h"
#include "sa01.h"

enum { OTHERS = 24, STEPS = 60 };

static void hold(void *self, int rows, TaskEnv *const *envs, float *actions) {
    assert_true(rows == OTHERS && envs[rows - 1]);
    memset(actions, 0, sizeof *actions * (size_t)rows * (size_t) * (const int *)self);
}

/* The default pose falls when it is held for a second; until then feet sink. On rubber up to 2 mm
 * each, in loose sand ten times as deep. */
static void test_ground_of_places(void **state) {
    MildError error = {0};
    TaskDef task = task_def_default();
    Scene scene;
    int joints = SA01_JOINTS, sand = 0, rubber = 0;
    double deepest[OTHERS] = {0};
    (void)state;
    task_def_make_nominal(&task);
    Robot *robot = robot_create(SA01, &error);
    Pool *pool = pool_create(2);
    Controller controller = {.self = &joints, .name = "hold", .act = hold};
    assert_int_equal(scene_make(&scene, "rubber+sand_loose", -3, &error), MILD_OK);
    const CrowdDef def = {.count = OTHERS,
                          .task = &task,
                          .robot = robot,
                          .scene = &scene,
                          .controller = &controller,
                          .pool = pool,
                          .seconds = 1,
                          .seed = 1};
    Crowd *crowd = crowd_create(&def, &error);
    assert_non_null(crowd);
    const ViewOther *others = crowd_others(crowd);
    for (int t = 0; t < STEPS; t++) {
        crowd_step(crowd);
        for (int i = 0; i < OTHERS; i++) {
            for (int f = 0; f < SA01_FEET; f++) {
                deepest[i] = fmin(deepest[i], others[i].position[f][2] - 0.055);
            }
        }
    }
    for (int i = 0; i < OTHERS; i++) {
        const double *place = others[i].place;
        const int material = mild_terrain_material_at(&scene.terrain, place[0], place[1]);
        if (fabs(place[0] + 3) > 0.5) { /* both feet on the same ground */
            assert_true(material == 1 ? deepest[i] < -0.02 : deepest[i] > -0.01);
            sand += material == 1;
            rubber += material == 0;
        }
        for (int k = 0; k < i; k++) {
            const double *other = others[k].place;
            assert_true(hypot(place[0] - other[0], place[1] - other[1]) > 0.6);
            assert_true(hypot(place[0], place[1]) >= hypot(other[0], other[1]));
        }
        assert_true(hypot(place[0], place[1]) > 0.6); /* from the robot itself */
        assert_true(place[0] < 0.5 && place[0] > -crowd_side(OTHERS) - 0.5);
        assert_true(place[1] > -0.5 && place[1] < crowd_side(OTHERS) + 0.5);
    }
    printf("  %d in sand, %d on rubber, %d of %d upright\n", sand, rubber, crowd_upright(crowd),
           crowd_count(crowd));
    assert_true(sand > 4 && rubber > 4);
    crowd_destroy(crowd);
    pool_destroy(pool);
    robot_destroy(robot);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ground_of_places)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
