#include "base/paths.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int exists(const char *path) {
    return access(path, R_OK) == 0;
}

/* Folder above the one that holds the executable; empty when unknown. */
static void executable_home(char home[PATH_SIZE]) {
    ssize_t length = readlink("/proc/self/exe", home, PATH_SIZE - 1);
    home[length > 0 ? length : 0] = '\0';
    for (int level = 0; level < 2; level++) {
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
    char beside[PATH_SIZE];
    executable_home(beside);
    if (*beside && snprintf(path, PATH_SIZE, "%s/%s", beside, relative) < PATH_SIZE &&
        exists(path)) {
        return path;
    }
    snprintf(path, PATH_SIZE, "%s/%s", MILD_SOURCE_DIR, relative);
    return path;
}

MildStatus path_join(const char *folder, const char *name, char path[PATH_SIZE], MildError *error) {
    if (snprintf(path, PATH_SIZE, "%s/%s", folder, name) < PATH_SIZE) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s.../%s", folder, name);
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
        return mild_fail(error, MILD_ERROR_IO, "%s: exists and is not a folder", path);
    }
    return MILD_OK;
}

static int write_all(int file, const char *data, size_t size) {
    while (size > 0) {
        ssize_t written = write(file, data, size);
        if (written < 0 && errno == EINTR) {
            continue;
        }
        if (written < 0) {
            return -1;
        }
        data += written;
        size -= (size_t)written;
    }
    return 0;
}

/* Opens, writes, syncs, closes; returns 0 or the error number. */
static int write_file(const char *path, int flags, const void *data, size_t size) {
    int file = open(path, O_WRONLY | flags, 0666);
    if (file < 0) {
        return errno;
    }
    int failed = write_all(file, data, size) != 0 || (flags && fsync(file) != 0) ? errno : 0;
    if (close(file) != 0 && !failed) {
        failed = errno;
    }
    return failed;
}

/* Devices and pipes are written to, not replaced. */
static int is_device(const char *path) {
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode);
}

/* The file that stands in for `path` until it is whole. */
static MildStatus temporary_path(const char *path, char temporary[PATH_SIZE], MildError *error) {
    if (!*path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "the name of the file is empty");
    }
    if (snprintf(temporary, PATH_SIZE, "%s.tmp", path) < PATH_SIZE) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", path);
}

static MildStatus cannot_write(const char *path, int failure, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "%s: cannot write: %s", path, strerror(failure));
}

MildStatus path_check_write(const char *path, MildError *error) {
    char temporary[PATH_SIZE];
    MildStatus status = temporary_path(path, temporary, error);
    if (status != MILD_OK) {
        return status;
    }
    int failed = 0;
    if (is_device(path)) { /* not opened: the reader of a pipe would see its end */
        struct stat info;
        failed = stat(path, &info) == 0 && S_ISDIR(info.st_mode) ? EISDIR
                 : access(path, W_OK) != 0                       ? errno
                                                                 : 0;
    } else {
        failed = write_file(temporary, O_CREAT | O_TRUNC, "", 0);
        if (!failed) {
            unlink(temporary);
        }
    }
    return failed ? cannot_write(path, failed, error) : MILD_OK;
}

MildStatus path_write(const char *path, const void *data, size_t size, MildError *error) {
    char temporary[PATH_SIZE];
    MildStatus status = temporary_path(path, temporary, error);
    if (status != MILD_OK) {
        return status;
    }
    int failed;
    if (is_device(path)) {
        failed = write_file(path, 0, data, size);
    } else {
        failed = write_file(temporary, O_CREAT | O_TRUNC, data, size);
        if (!failed && rename(temporary, path) != 0) {
            failed = errno;
        }
        if (failed) {
            unlink(temporary);
        }
    }
    return failed ? cannot_write(path, failed, error) : MILD_OK;
}
