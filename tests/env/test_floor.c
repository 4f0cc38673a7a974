/* Environments of the batch engine whose robots fall on rigid ground with shells that stand,
 * against those of the CPU, which MuJoCo steps: the same robots, the same load on the shells, the
 * same ends. With MILD_CUDA on the device too. */
#include "follow.h"

enum { PHYSICS_STEPS = 2 };

static EnvsSample sample[2][ENVS][PHYSICS_STEPS];

static TaskDef floor_def(void) {
    TaskDef def = some_def();
    def.shells_stand = 1;
    def.tilt_limit = 3.1;
    def.randomize.rigid_share = 1;
    def.randomize.preset_share = 0;
    return def;
}

/* The same in all steps of an environment, so that it falls. */
static void draw_falls(int t) {
    draw_actions(t);
    for (int e = 0; e < ENVS; e++) {
        Random r = random_at(4, (uint32_t)e, 0);
        for (int i = 0; i < pair.shape.actions; i++) {
            pair.a.action[e * pair.shape.actions + i] += (float)(4 * random_unit(&r) - 2);
        }
    }
}

/* [-] Largest difference of the load on the shells, of the weight; the least load in *load. */
static double loads_apart(int e, double *load) {
    const double weight = 9.81 * robot_total_mass(pair.robot);
    double most = 0;
    *load = INFINITY;
    for (int k = 0; k < PHYSICS_STEPS; k++) {
        const EnvsSample *a = &sample[0][e][k], *b = &sample[1][e][k];
        most = fmax(most, fabs(a->shell_load - b->shell_load) / weight);
        *load = fmin(*load, a->shell_load / weight);
    }
    return most;
}

/* Bool: MuJoCo's shells carry nothing and the batch engine's something. */
static int load_stayed(int e) {
    double load[2] = {0, 0};
    for (int k = 0; k < PHYSICS_STEPS; k++) {
        for (int n = 0; n < 2; n++) {
            load[n] = fmax(load[n], fabs(sample[n][e][k].shell_load));
        }
    }
    return load[0] == 0 && load[1] > 0;
}

typedef struct {
    int steps, together, loaded, loaded_together;
    int stayed; /* steps in which no shell is down and one carries */
    int ends[TASK_END_COUNT];
    double load; /* mean where it is more than 0 */
} Falls;

/* Largest difference of the newest frames without noise: joints, speeds, base. */
static double frames_apart(int e) {
    const int width = pair.shape.observation;
    double most = 0;
    for (int i = 0; i < width; i++) {
        const int at = e * pair.shape.critic + i;
        const double gap = fabs((double)pair.a.critic[at] - (double)pair.b.critic[at]);
        most = gap > most || gap != gap ? gap : most;
    }
    return most;
}

/* A fall doubles a difference within a few steps: an environment is left alone once it differs,
 * until its next episode. */
static Falls fall(const char *robot, int device, const MildMapDef *on) {
    MildMap *map = on ? mild_map_create(on, NULL) : NULL;
    TaskDef def = floor_def();
    Falls falls = {0};
    int apart[ENVS] = {0};
    def.map = map;
    pair_open(robot, &def, device);
    envs_set_samples(pair.mujoco, sample[0][0]);
    envs_set_samples(pair.batch, sample[1][0]);
    assert_int_equal(envs_physics_steps(pair.batch), PHYSICS_STEPS);
    pair_reset();
    for (int t = 0; t < STEPS; t++) {
        draw_falls(t);
        pair_step();
        for (int e = 0; e < ENVS; e++) {
            const int done = pair.a.done[e] != 0, same = done == (pair.b.done[e] != 0);
            double load, gap = loads_apart(e, &load);
            apart[e] |= !same || !(frames_apart(e) < 1e-2);
            falls.steps++;
            falls.together += !apart[e];
            falls.loaded += load > 0;
            falls.loaded_together += load > 0 && !apart[e] && gap < 0.05;
            falls.load += load > 0 ? load : 0;
            falls.stayed += !apart[e] && load_stayed(e);
            if (!apart[e]) {
                assert_int_equal(pair.a.cause[e], pair.b.cause[e]);
                falls.ends[pair.b.cause[e]] += done;
            }
            apart[e] = done && same ? 0 : apart[e];
        }
    }
    falls.load /= falls.loaded;
    printf("%s, device %d%s: %d of %d steps together, shells with load (%.2f of the weight) %d of "
           "%d, in %d steps without MuJoCo's;",
           robot_name(pair.robot), device, on ? ", on a map" : "", falls.together, falls.steps,
           falls.load, falls.loaded_together, falls.loaded, falls.stayed);
    for (int end = 0; end < TASK_END_COUNT; end++) {
        printf(" %s %d%s", task_end_names[end], falls.ends[end],
               end < TASK_END_COUNT - 1 ? "," : "\n");
    }
    pair_close();
    mild_map_destroy(map);
    return falls;
}

/* No shell ends an episode. */
static void check(Falls falls) {
    assert_true(falls.loaded > 200 && falls.loaded_together > 0.9 * falls.loaded);
    assert_true(falls.together > 0.95 * falls.steps && falls.load > 0.1 && falls.load < 3);
    assert_true(falls.ends[TASK_END_shell] == 0);
    assert_true(falls.stayed <= 3); /* touchdowns within a rounding */
}

TEST(falls_are_those_of_mujoco) {
    const MildMapDef map = some_map();
    check(fall(SA01, MILD_BATCH_HOST, NULL));
    check(fall(GO1, MILD_BATCH_HOST, NULL));
    check(fall(GO1, MILD_BATCH_HOST, &map));
}

/* Robots that stagger, whose shells may come down. */
TEST(standing_robots_follow_mujoco) {
    follow(SA01, floor_def(), MILD_BATCH_HOST, NULL, 0.85);
}

/* Robots that fall: shells that stand change no bit before one is down. */
TEST(in_the_air_they_change_no_bit) {
    static Rows without[STEPS];
    int far = 0, same = 0, down[ENVS] = {0};
    for (int stand = 0; stand < 2; stand++) {
        TaskDef def = floor_def();
        def.shells_stand = stand;
        pair_open(GO1, &def, MILD_BATCH_HOST);
        envs_set_samples(pair.batch, sample[1][0]);
        pair_reset();
        for (int t = 0; t < some_steps(); t++) {
            draw_falls(t);
            pair_step();
            if (!stand) {
                without[t] = pair.b;
            }
            for (int e = 0; stand && e < ENVS; e++) {
                const size_t width = (size_t)pair.shape.critic, at = (size_t)e * width;
                down[e] |= sample[1][e][0].shell_load > 0 || sample[1][e][1].shell_load > 0 ||
                           (without[t].done[e] && without[t].cause[e] == TASK_END_shell);
                far += !down[e];
                same +=
                    !down[e] && pair.b.reward[e] == without[t].reward[e] &&
                    memcmp(pair.b.critic + at, without[t].critic + at, width * sizeof(float)) == 0;
            }
        }
        pair_close();
    }
    print_message("%d of %d steps before a shell is down, %d with the same bits\n", far,
                  ENVS * some_steps(), same);
    assert_true(far > ENVS * some_steps() / 4 && far < ENVS * some_steps() && same == far);
}

TEST(device_falls_are_those_of_mujoco) {
    MildError error;
    if (device_open(0, &error) != MILD_OK) {
        skip();
    }
    check(fall(SA01, 0, NULL));
    check(fall(GO1, 0, NULL));
}

TEST_MAIN(NULL, NULL)
