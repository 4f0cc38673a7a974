/* Writes the sizes of a robot, for code that is compiled for it (model.h), as a header. Usage:
 * engine_sizes FOLDER HEADER */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "robot/engine/read.h"

#define SIZES_DT 0.005 /* [s] any physics step; no size depends on it */

static MildStatus write_sizes(const char *folder, const char *path, MildError *error) {
    char text[200];
    EngineTree tree;
    Robot *robot = robot_create(folder, error);
    double *number = robot ? calloc(ENGINE_NUMBERS, sizeof *number) : NULL;
    MildStatus status = robot ? MILD_ERROR_MEMORY : error->status;
    if (number) {
        robot_set_shells(robot, 1);
        status = engine_model_read(robot, SIZES_DT, &tree, number, error);
    } else if (robot) {
        mild_fail(error, status, "out of memory");
    }
    if (status == MILD_OK) {
        engine_model_sizes(&tree, text, sizeof text);
        status = file_write(path, text, strlen(text), error);
    }
    free(number);
    robot_destroy(robot);
    return status;
}

int main(int argc, char **argv) {
    MildError error = {0};
    if (argc != 3) {
        fprintf(stderr, "usage: engine_sizes FOLDER HEADER\n");
        return 2;
    }
    if (write_sizes(argv[1], argv[2], &error) != MILD_OK) {
        fprintf(stderr, "engine_sizes: %s\n", error.text);
        return 2;
    }
    return 0;
}
