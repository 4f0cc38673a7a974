/* A robot and the memory of its ground. */
#ifndef TEST_ROBOTS_H
#define TEST_ROBOTS_H

#include "files.h"
#include "materials.h"
#include "robot/robot.h"

/* A robot of a folder. */
static inline Robot *kit_robot(const char *folder) {
    MildError error = {0};
    Robot *robot = robot_create(folder, &error);
    expect_good(robot != NULL, &error);
    return robot;
}

/* A robot of the repository. */
static inline Robot *kit_robot_named(const char *name) {
    MildError error = {0};
    Robot *robot = robot_open(name, &error);
    expect_good(robot != NULL, &error);
    return robot;
}

/* A robot of a folder of these two files, which is gone when it is made; NULL with an error. */
static inline Robot *kit_robot_of(const char *model, const char *mjcf, const char *ini,
                                  MildError *error) {
    char folder[] = "/tmp/mild_robot_XXXXXX", path[2][64];
    assert_non_null(mkdtemp(folder));
    snprintf(path[0], sizeof path[0], "%s/%s", folder, model);
    snprintf(path[1], sizeof path[1], "%s/robot.ini", folder);
    kit_write_text(path[0], mjcf);
    kit_write_text(path[1], ini);
    Robot *robot = robot_create(folder, error);
    for (int k = 0; k < 2; k++) {
        remove(path[k]);
    }
    rmdir(folder);
    return robot;
}

/* The robot of a folder with `from` written as `to` in one of its two files; NULL with an error. */
static inline Robot *kit_robot_changed(const char *folder, const char *model, const char *file,
                                       const char *from, const char *to, MildError *error) {
    const char *const names[2] = {model, "robot.ini"};
    char path[512], *text[2];
    for (int k = 0; k < 2; k++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[k]);
        text[k] = kit_read(path, NULL);
        if (strcmp(names[k], file) == 0) {
            char *whole = text[k];
            text[k] = kit_replaced(whole, from, to);
            free(whole);
        }
    }
    Robot *robot = kit_robot_of(model, text[0], text[1], error);
    free(text[0]);
    free(text[1]);
    return robot;
}

/* Ground that has met none of the robot's bodies. To be freed by the caller. */
static inline MildGround *kit_ground(const Robot *robot) {
    const int bodies = robot_bodies(robot);
    const size_t bytes = mild_ground_bytes(robot_soles(robot), bodies);
    void *block = aligned_alloc(64, (bytes + 63) / 64 * 64);
    assert_non_null(block);
    return mild_ground_init(block, robot_soles(robot), bodies);
}

#endif
