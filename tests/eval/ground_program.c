/* COMMAND of `mild eval --program` that answers with libmild's own ground, so that a walk on it is
 * one that `mild eval` makes by itself: src/run/eval/other_ground.h has what is said.
 *
 * ground_program ROBOT GROUND [turned]    turned: every moment about y has the other sign */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "env/task/task.h"
#include "robot/robot.h"
#include "run/eval/scene.h"

/* Bool: there is one more question. */
static int ask(MildContactInput *input, double *inverse_inertia) {
    double head[4];
    if (fread(head, sizeof *head, 4, stdin) != 4) {
        return 0;
    }
    const size_t rows = 6 * (size_t)input->feet;
    size_t bad = (int)head[0] != input->feet;
    input->dt = head[2];
    for (int f = 0; f < input->feet; f++) {
        bad += fread(input->position[f], sizeof(double), 3, stdin) != 3;
        bad += fread(input->rotation[f], sizeof(double), 9, stdin) != 9;
        bad += fread(input->velocity[f], sizeof(double), 6, stdin) != 6;
    }
    bad += fread(input->free_velocity, sizeof(double), rows, stdin) != rows;
    bad += fread(inverse_inertia, sizeof(double), rows * rows, stdin) != rows * rows;
    return !bad;
}

static void answer(const MildContactResult *result, int feet, int turned) {
    for (int f = 0; f < feet; f++) {
        const MildFootResult *foot = &result->foot[f];
        const double numbers[] = {foot->force[0],  foot->force[1],  foot->force[2],
                                  foot->torque[0], foot->torque[1], foot->torque[2],
                                  foot->depth_max, foot->depth_mean};
        double out[8];
        memcpy(out, numbers, sizeof out);
        out[4] = turned ? -out[4] : out[4];
        fwrite(out, sizeof *out, 8, stdout);
    }
    fflush(stdout);
}

int main(int count, char **word) {
    MildError error = {0};
    Scene scene;
    Robot *robot = count > 2 ? robot_open(word[1], &error) : NULL;
    if (!robot || scene_make(&scene, word[2], 2, &error) != MILD_OK) {
        fprintf(stderr, "ground_program: %s\n", robot || count > 2 ? error.text : "no ground");
        robot_destroy(robot);
        return 1;
    }
    static double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX];
    static MildContactResult result;
    const TaskDef def = task_def_default();
    const int feet = robot_feet(robot);
    const MildSole *const *soles = robot_soles(robot);
    MildContactInput input = {.feet = feet,
                              .inverse_inertia = inverse_inertia,
                              .solver = MILD_SOLVER_NEWTON,
                              .tolerance = def.contact_tolerance,
                              .max_iterations = def.contact_iterations};
    MildGround *ground = mild_ground_init(malloc(mild_ground_bytes(soles, feet)), soles, feet);
    MildScratch *scratch = mild_scratch_create(soles, feet, &error);
    while (ground && scratch && ask(&input, inverse_inertia)) {
        mild_ground_solve(ground, &scene.terrain, &input, scratch, &result);
        mild_ground_advance(ground, &scene.terrain, &input, scratch, &result);
        answer(&result, feet, count > 3);
    }
    mild_scratch_destroy(scratch);
    free(ground);
    robot_destroy(robot);
    return 0;
}
