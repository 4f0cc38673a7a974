#include "base/paths.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int exists(const char *path) {
    return access(path, R_OK) == 0;
}

/* The folder that many levels above the executable; empty when unknown. */
static void executable_home(int levels, char home[PATH_SIZE]) {
    ssize_t length = readlink("/proc/self/exe", home, PATH_SIZE - 1);
    home[length > 0 ? length : 0] = '\0';
    for (int level = 0; level < levels; level++) {
        char *slash = strrchr(home, '/');
        if (slash) {
            *slash = '\0';
        }
    }
}

const char *path_data(const char *relative, char path[PATH_SIZE]) {
    const char *home = getenv("MILD_HOME");
    if (home && *home) {
        snprintf(path, PATH_SIZE, "%s/%s", home, relative);
        return path;
    }
    static const char *const below[] = {"", "/share/mild"};
    char beside[PATH_SIZE];
    executable_home(2, beside);
    for (int i = 0; i < 2 && *beside; i++) {
        if (snprintf(path, PATH_SIZE, "%s%s/%s", beside, below[i], relative) < PATH_SIZE &&
            exists(path)) {
            return path;
        }
    }
    snprintf(path, PATH_SIZE, "%s/%s", MILD_DATA_DIR, relative);
    return path;
}

const char *path_given(const char *name, char path[PATH_SIZE]) {
    return *name && *name != '/' && !exists(name) && exists(path_data(name, path)) ? path : name;
}

const char *path_program(char path[PATH_SIZE]) {
    executable_home(0, path);
    return path;
}

const char *path_beside_program(const char *name, char path[PATH_SIZE]) {
    char folder[PATH_SIZE];
    executable_home(1, folder);
    if (!*folder || snprintf(path, PATH_SIZE, "%s/%s", folder, name) >= PATH_SIZE) {
        *path = '\0';
    }
    return path;
}

MildStatus path_join(const char *folder, const char *name, char path[PATH_SIZE], MildError *error) {
    if (snprintf(path, PATH_SIZE, "%s/%s", folder, name) < PATH_SIZE) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s.../%s", folder, name);
}

MildStatus path_beside(const char *file, const char *ending, char path[PATH_SIZE],
                       MildError *error) {
    const char *dot = strrchr(file, '.'), *slash = strrchr(file, '/');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - file) : (int)strlen(file);
    if (snprintf(path, PATH_SIZE, "%.*s%s", stem, file, ending) < PATH_SIZE) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", file);
}

MildStatus path_make_folder(const char *folder, MildError *error) {
    char path[PATH_SIZE];
    if (!*folder) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "the name of the folder is empty");
    }
    if (snprintf(path, sizeof path, "%s", folder) >= (int)sizeof path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", folder);
    }
    for (char *slash = strchr(path + 1, '/');; slash = strchr(slash + 1, '/')) {
        if (slash) {
            *slash = '\0';
        }
        if (mkdir(path, 0777) != 0 && errno != EEXIST) {
            return mild_fail(error, MILD_ERROR_IO, "%s: cannot make folder: %s", path,
                             strerror(errno));
        }
        if (!slash) {
            break;
        }
        *slash = '/';
    }
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode)) {
        return mild_fail(error, MILD_ERROR_IO, "%s: exists but is not a folder", path);
    }
    return MILD_OK;
}
