#include "app/robots.h"

#include <stdio.h>
#include <string.h>

#include "control/controller.h"
#include "env/envs.h"
#include "run/config/experiment_keys.h"

enum { LINE = 100 }; /* characters */

Robot *robots_open(const char *option, const char *otherwise, MildError *error) {
    return robot_open(option ? option : otherwise, error);
}

MildStatus robots_set(ExperimentDef *def, const char *option, MildError *error) {
    char text[512];
    const char *override = text;
    ConfigSection sections[EXPERIMENT_SECTIONS];
    if (snprintf(text, sizeof text, "train.robot=%s", option) >= (int)sizeof text) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--robot: '%.40s...' is too long", option);
    }
    experiment_sections(def, sections);
    return config_overrides(sections, EXPERIMENT_SECTIONS, &override, 1, error);
}

void robots_warn_slow(const char *command, const TrainDef *def, const char *robot) {
    MildError unused;
    Robot *is = train_is_batch(def) && train_device(def) >= 0 ? robot_open(robot, &unused) : NULL;
    if (is && envs_are_slow(is)) {
        fprintf(stderr,
                "mild %s: this build has no CUDA kernels of %s's size, and those for any robot are "
                "several times slower; build with -DMILD_CUDA_ROBOTS=FOLDER (docs/gpu.md)\n",
                command, robot_name(is));
    }
    robot_destroy(is);
}

const char *robots_controller_help(char *text, size_t size) {
    size_t used = (size_t)snprintf(text, size, "who moves the robot:");
    for (int i = 0; i < controller_count() && used < size; i++) {
        used += (size_t)snprintf(text + used, size - used, " %s: %s;", controller_name(i),
                                 controller_summary(i));
    }
    if (used < size) {
        snprintf(text + used - 1, size - used + 1, " (default learned)");
    }
    return text;
}

static void print_names(const char *what, const Robot *robot, int count,
                        const char *(*name)(const Robot *robot, int index)) {
    int column = printf("  %-7s", what);
    for (int i = 0; i < count; i++) {
        const char *text = name(robot, i);
        if (column > 10 && column + 1 + (int)strlen(text) > LINE) {
            column = printf("\n  %-7s", "") - 1;
        }
        column += printf(" %s", text);
    }
    printf("\n");
}

static void print_robot(const Robot *robot) {
    printf("%s: %d joints, %d feet, %.1f kg, base %.2f m high\n", robot_name(robot),
           robot_joints(robot), robot_feet(robot), robot_total_mass(robot),
           robot_nominal_height(robot));
    print_names("feet", robot, robot_feet(robot), robot_foot_name);
    print_names("joints", robot, robot_joints(robot), robot_joint_name);
    printf("  %-7s %s\n", "model", robot_model_path(robot));
    printf("  %-7s %s\n", "source", *robot_source(robot) ? robot_source(robot) : "-");
}

int robots_print(void) {
    char names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    int count = robot_list(names, ROBOT_LISTED_MAX);
    if (count == 0) {
        return cli_fail_text("info", "no robots: the folder robots/ is missing or empty");
    }
    printf("robots (--robot NAME); write a folder of your own with a slash, as ./walker "
           "(docs/robots.md)\n\n");
    for (int i = 0; i < count; i++) {
        MildError error = {0};
        Robot *robot = robot_open(names[i], &error);
        if (!robot) {
            return cli_fail("info", &error);
        }
        print_robot(robot);
        robot_destroy(robot);
    }
    return 0;
}

MildStatus robots_check_command(const char *controller, const char *option, double value,
                                MildError *error) {
    return value == 0 || controller_has(controller, CONTROLLER_FOLLOWS)
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--%s %g: controller %s follows no command; leave it out", option, value,
                           controller);
}

MildStatus robots_check_jump(const TaskDef *task, double jump, MildError *error) {
    return jump == 0 || task->jump[1] > 0
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--jump %g: the policy was not trained to jump (task.jump); leave it "
                           "out, or name one that was with --policy",
                           jump);
}
