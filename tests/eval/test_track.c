/* The track of a trial: the centre of mass from the engine's bodies, angles of a turned base, and
 * the CSV. */
#include <mujoco/mujoco.h>

#include "env/envs.h"
#include "env/task/task.h"
#include "robots.h"
#include "run/eval/track.h"
#include "sa01.h"

/* Turned by 0.7 rad about z, then pitched by 0.3 and rolled by -0.2 rad, knees bent. */
TEST(a_point_of_a_turned_robot) {
    MildError error = {0};
    Robot *robot = kit_robot(SA01);
    RobotSim *sim = robot_sim_create(robot, 0.005, &error);
    assert_non_null(sim);
    const RobotVariation nominal = robot_variation_nominal();
    RobotState body = {.qpos = {1, -2, 0.9}};
    const double half[3] = {-0.1, 0.15, 0.35}; /* roll, pitch, yaw */
    double q[3][4], turned[4];
    for (int i = 0; i < 3; i++) {
        memset(q[i], 0, sizeof q[i]);
        q[i][0] = cos(half[i]);
        q[i][1 + i] = sin(half[i]);
    }
    mju_mulQuat(turned, q[2], q[1]);
    mju_mulQuat(body.qpos + 3, turned, q[0]);
    for (int i = 0; i < SA01_JOINTS; i++) {
        body.qpos[7 + i] = 0.1 * i - 0.5;
    }
    robot_sim_load(sim, &body, &nominal);

    Track track;
    assert_int_equal(track_make(&track, 2, 3, &error), MILD_OK);
    const double none[SA01_JOINTS] = {0};
    const MildMaterial any = mild_material_default();
    const TaskDef def = task_def_default();
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    EnvsSample sample;
    assert_non_null(env);
    task_env_init(env, &def, robot, 1, 0);
    task_env_rest(env)->terrain = mild_terrain_uniform(&any);
    envs_read_sample(env, sim, none, &sample);
    track_take(&track, 1, &sample);
    assert_true(track.count[0] == 0 && track.count[1] == 1);
    const TrackPoint *point = &track.point[3];
    const mjModel *m = robot_sim_model(sim);
    const mjData *d = robot_sim_data(sim);
    for (int k = 0; k < 3; k++) {
        double sum = 0, mass = 0;
        for (int b = 1; b < m->nbody; b++) {
            sum += m->body_mass[b] * d->xipos[3 * b + k];
            mass += m->body_mass[b];
        }
        assert_true(fabs(point->mass_center[k] - sum / mass) < 1e-12);
        assert_true(point->base[k] == body.qpos[k]);
    }
    assert_true(fabs(point->roll + 0.2) < 1e-12 && fabs(point->pitch - 0.3) < 1e-12);

    track.point[3] = (TrackPoint){{1, 2, 3}, {4, 5, 6}, 0.25, -0.5};
    char *text = NULL;
    size_t size = 0;
    FILE *csv = open_memstream(&text, &size);
    track_print(&track, "foam45", 0.6, 0.01, csv);
    fclose(csv);
    assert_string_equal(text, "foam45,0.6,1,0.01,1.00000,2.00000,3.00000,4.00000,5.00000,6.00000,"
                              "0.25000,-0.50000\n");
    free(text);
    track_free(&track);
    free(env);
    robot_sim_destroy(sim);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
