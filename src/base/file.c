#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/text.h"

enum { TEMPORARY_TRIES = 1000 };

/* ---- reading ---- */

static MildStatus cannot_read(const char *path, const char *reason, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "%.200s: cannot read: %s", path, reason);
}

static const char *not_regular(const struct stat *info) {
    return S_ISREG(info->st_mode)   ? NULL
           : S_ISDIR(info->st_mode) ? "it is a folder"
                                    : "it is a pipe or a device, not a regular file";
}

MildStatus file_check_regular(const char *path, MildError *error) {
    struct stat info;
    const char *reason = stat(path, &info) == 0 ? not_regular(&info) : NULL;
    return reason ? cannot_read(path, reason, error) : MILD_OK;
}

/* Returns a descriptor, or -1. Without O_NONBLOCK, opening a pipe that has no writer would wait. */
static int open_regular(const char *path, struct stat *info, MildError *error) {
    int file = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    const char *reason = file < 0 || fstat(file, info) != 0 ? strerror(errno) : not_regular(info);
    if (!reason) {
        return file;
    }
    cannot_read(path, reason, error);
    if (file >= 0) {
        close(file);
    }
    return -1;
}

FILE *file_open(const char *path, MildError *error) {
    struct stat info;
    int file = open_regular(path, &info, error);
    FILE *stream = file >= 0 ? fdopen(file, "rb") : NULL;
    if (file >= 0 && !stream) {
        mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", path);
        close(file);
    }
    return stream;
}

/* Reads `size` bytes. Returns 0 or an error number, which is EIO when the file is shorter. */
static int read_whole(int file, char *bytes, size_t size) {
    while (size > 0) {
        ssize_t count = read(file, bytes, size);
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count <= 0) {
            return count < 0 ? errno : EIO;
        }
        bytes += count;
        size -= (size_t)count;
    }
    return 0;
}

char *file_read(const char *path, size_t limit, size_t *size, MildError *error) {
    struct stat info;
    char most[32];
    int file = open_regular(path, &info, error);
    if (file < 0) {
        return NULL;
    }
    *size = (size_t)info.st_size;
    char *bytes = *size <= limit ? malloc(*size + 1) : NULL;
    int failed = bytes ? read_whole(file, bytes, *size) : 0;
    close(file);
    if (bytes && !failed) {
        bytes[*size] = '\0';
        return bytes;
    }
    if (failed) {
        cannot_read(path, strerror(failed), error);
    } else if (*size > limit) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%.200s: larger than %s, the limit for files of this kind", path,
                  text_bytes((double)limit, most, sizeof most));
    } else {
        mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", path);
    }
    free(bytes);
    return NULL;
}

/* ---- writing ---- */

static MildStatus cannot_write(const char *path, int failure, MildError *error) {
    const char *slash = strrchr(path, '/');
    if (failure == ENOENT && slash) {
        return mild_fail(error, MILD_ERROR_IO, "%.200s: there is no folder %.*s; make it first",
                         path, slash - path < 200 ? (int)(slash - path) : 200, path);
    }
    return mild_fail(error, MILD_ERROR_IO, "%.200s: cannot be written: %s", path,
                     strerror(failure));
}

/* Bool: the path is a device or a pipe, which is written to instead of replaced. */
static int is_device(const char *path) {
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode);
}

/* Creates the file PATH.PID-N.tmp with the first free N. Returns a descriptor, or -1. */
static int open_temporary(const char *path, char temporary[PATH_SIZE], MildError *error) {
    if (!*path) {
        mild_fail(error, MILD_ERROR_ARGUMENT, "the name of the file is empty");
        return -1;
    }
    for (int n = 0; n < TEMPORARY_TRIES; n++) {
        if (snprintf(temporary, PATH_SIZE, "%s.%ld-%d.tmp", path, (long)getpid(), n) >= PATH_SIZE) {
            mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", path);
            return -1;
        }
        int file = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file >= 0) {
            return file;
        }
        if (errno != EEXIST) {
            break;
        }
    }
    cannot_write(path, errno, error);
    return -1;
}

MildStatus file_temporary(const char *path, char temporary[PATH_SIZE], MildError *error) {
    int file = open_temporary(path, temporary, error);
    if (file < 0) {
        return error ? error->status : MILD_ERROR_IO;
    }
    close(file);
    return MILD_OK;
}

int file_is_temporary(const char *name) {
    long process;
    int n, end = 0;
    const char *dash = strrchr(name, '-'), *number = dash;
    while (number && number > name && *number != '.') {
        number--;
    }
    return number && sscanf(number, ".%ld-%d.tmp%n", &process, &n, &end) == 2 && end > 0 &&
           !number[end];
}

MildStatus file_check_write(const char *path, MildError *error) {
    struct stat info;
    if (is_device(path)) { /* opening and closing a pipe would end it for its reader */
        int failed = stat(path, &info) == 0 && S_ISDIR(info.st_mode) ? EISDIR
                     : access(path, W_OK) != 0                       ? errno
                                                                     : 0;
        return failed ? cannot_write(path, failed, error) : MILD_OK;
    }
    char temporary[PATH_SIZE];
    MildStatus status = file_temporary(path, temporary, error);
    if (status == MILD_OK) {
        unlink(temporary);
    }
    return status;
}

/* Writes, syncs and closes; returns 0 or the error number. */
static int write_and_close(int file, const char *data, size_t size, int sync) {
    int failed = 0;
    while (size > 0 && !failed) {
        ssize_t written = write(file, data, size);
        failed = written >= 0 || errno == EINTR ? 0 : errno;
        data += written > 0 ? written : 0;
        size -= written > 0 ? (size_t)written : 0;
    }
    if (!failed && sync && fsync(file) != 0) {
        failed = errno;
    }
    if (close(file) != 0 && !failed) {
        failed = errno;
    }
    return failed;
}

static const char *folder_of(const char *path, char folder[PATH_SIZE]) {
    const char *slash = strrchr(path, '/');
    int length = !slash ? 1 : slash == path ? 1 : (int)(slash - path);
    snprintf(folder, PATH_SIZE, "%.*s", length, slash ? path : ".");
    return folder;
}

/* A rename is safe on disk only after its folder has been synced. Errors are ignored, because some
 * file systems cannot sync folders. */
static void sync_folder(const char *path) {
    char name[PATH_SIZE];
    int folder = open(folder_of(path, name), O_RDONLY | O_CLOEXEC);
    if (folder >= 0) {
        fsync(folder);
        close(folder);
    }
}

static MildStatus write_device(const char *path, const void *data, size_t size, MildError *error) {
    int file = open(path, O_WRONLY | O_CLOEXEC);
    int failed = file < 0 ? errno : write_and_close(file, data, size, 0);
    return failed ? cannot_write(path, failed, error) : MILD_OK;
}

MildStatus file_write(const char *path, const void *data, size_t size, MildError *error) {
    if (is_device(path)) {
        return write_device(path, data, size, error);
    }
    char temporary[PATH_SIZE];
    MildError cause = {0};
    int file = open_temporary(path, temporary, &cause);
    if (file < 0) {
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    int failed = write_and_close(file, data, size, 1);
    if (!failed && rename(temporary, path) != 0) {
        failed = errno;
    }
    if (failed) {
        unlink(temporary);
        return cannot_write(path, failed, error);
    }
    sync_folder(path);
    return MILD_OK;
}

/* ---- telling files apart ---- */

static int same_inode(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static const char *base_of(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int file_same(const char *a, const char *b) {
    struct stat about_a, about_b;
    int has_a = stat(a, &about_a) == 0, has_b = stat(b, &about_b) == 0;
    if (has_a && has_b) {
        return S_ISREG(about_a.st_mode) && same_inode(&about_a, &about_b);
    }
    char folder[PATH_SIZE];
    return !has_a && !has_b && strcmp(base_of(a), base_of(b)) == 0 &&
           stat(folder_of(a, folder), &about_a) == 0 && stat(folder_of(b, folder), &about_b) == 0 &&
           same_inode(&about_a, &about_b);
}

/* ---- locks ---- */

static MildStatus lock_refused(int file, const char *path, MildError *error) {
    struct flock holder = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    int failed = errno;
    if (failed != EACCES && failed != EAGAIN) {
        return mild_fail(error, MILD_ERROR_IO, "%.200s: cannot be locked: %s", path,
                         strerror(failed));
    }
    if (fcntl(file, F_GETLK, &holder) == 0 && holder.l_type != F_UNLCK) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "%.200s: in use by process %ld", path,
                         (long)holder.l_pid);
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "%.200s: in use by another process", path);
}

/* The holder removes the file before it releases the lock. So a lock is valid only if the locked
 * file still has its name. */
MildStatus file_lock(FileLock *lock, const char *path, MildError *error) {
    lock->file = -1;
    if (snprintf(lock->path, sizeof lock->path, "%s", path) >= (int)sizeof lock->path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", path);
    }
    for (;;) {
        struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
        struct stat locked, named;
        int file = open(path, O_RDWR | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0666);
        if (file < 0) {
            return cannot_write(path, errno, error);
        }
        if (fcntl(file, F_SETLK, &whole) != 0) {
            MildStatus status = lock_refused(file, path, error);
            close(file);
            return status;
        }
        if (fstat(file, &locked) == 0 && stat(path, &named) == 0 && same_inode(&locked, &named)) {
            lock->file = file;
            return MILD_OK;
        }
        close(file);
    }
}

void file_unlock(FileLock *lock) {
    if (lock->file >= 0) {
        unlink(lock->path);
        close(lock->file);
        lock->file = -1;
    }
}
