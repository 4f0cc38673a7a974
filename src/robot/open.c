/* Robots by name: the folders under robots/ that ship with the program. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/paths.h"
#include "base/text.h"
#include "robot/robot.h"

static int compare_names(const void *a, const void *b) {
    return strcmp(a, b);
}

static int has_ini(const char *name) {
    char relative[ROBOT_LISTED_SIZE + 32], path[PATH_SIZE];
    snprintf(relative, sizeof relative, "robots/%s/robot.ini", name);
    return access(path_data(relative, path), R_OK) == 0;
}

int robot_list(char names[][ROBOT_LISTED_SIZE], int most) {
    char path[PATH_SIZE];
    int count = 0;
    DIR *folder = opendir(path_data("robots", path));
    for (struct dirent *entry = folder ? readdir(folder) : NULL; entry; entry = readdir(folder)) {
        size_t length = strlen(entry->d_name);
        if (entry->d_name[0] != '.' && length < ROBOT_LISTED_SIZE && count < most &&
            has_ini(entry->d_name)) {
            memcpy(names[count++], entry->d_name, length + 1);
        }
    }
    if (folder) {
        closedir(folder);
    }
    qsort(names, (size_t)count, sizeof *names, compare_names);
    return count;
}

const char *robot_policy(const char *name, char *path) {
    char relative[ROBOT_LISTED_SIZE + 32];
    if (name && !strchr(name, '/') && strlen(name) < ROBOT_LISTED_SIZE) {
        snprintf(relative, sizeof relative, "policies/%s.safetensors", name);
        if (access(path_data(relative, path), R_OK) == 0) {
            return path;
        }
    }
    return path_data("policies/mild.safetensors", path);
}

Robot *robot_open(const char *name, MildError *error) {
    char path[PATH_SIZE], names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    if (strchr(name, '/') || strcmp(name, ".") == 0) {
        return robot_create(name, error);
    }
    const char *known[ROBOT_LISTED_MAX];
    int count = robot_list(names, ROBOT_LISTED_MAX);
    for (int i = 0; i < count; i++) {
        known[i] = names[i];
        if (strcmp(names[i], name) == 0) {
            char relative[ROBOT_LISTED_SIZE + 8];
            snprintf(relative, sizeof relative, "robots/%s", name);
            return robot_create(path_data(relative, path), error);
        }
    }
    mild_fail(
        error, MILD_ERROR_ARGUMENT,
        "unknown robot '%.60s'; nearest is '%s' (mild info robots lists all; write a folder of "
        "your own with a slash, as ./%.60s)",
        name, count ? text_nearest(name, known, count) : "none", name);
    return NULL;
}
