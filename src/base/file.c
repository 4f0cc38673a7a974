#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/text.h"

enum {
    TEMPORARY_TRIES = 1000,
    TEMPORARY_END = 16 + 4, /* characters of the sum and of ".tmp" */
    CLAIMS_MAX = 32,
    LOCK_PATIENCE = 100 /* [10 ms] for another process to write its lock's text */
};

static const char *base_of(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static const char *folder_of(const char *path, char folder[PATH_SIZE]) {
    const char *slash = strrchr(path, '/');
    int length = !slash ? 1 : slash == path ? 1 : (int)(slash - path);
    snprintf(folder, PATH_SIZE, "%.*s", length, slash ? path : ".");
    return folder;
}

static int same_inode(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/* ---- outputs ---- */

static struct {
    char path[PATH_SIZE];
    char what[80];
} claims[CLAIMS_MAX];
static int claim_count;

/* Whether two paths name the same file. If both exist, they must be the same file on disk (links
 * are followed). If neither exists, they must have the same name in the same folder. Never true for
 * devices and pipes. */
static int same_file(const char *a, const char *b) {
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

MildStatus file_claim(const char *path, const char *what, MildError *error) {
    for (int i = 0; i < claim_count; i++) {
        if (same_file(path, claims[i].path)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "%s and %s name the same file, %.200s",
                             claims[i].what, what, path);
        }
    }
    if (claim_count == CLAIMS_MAX || strlen(path) >= PATH_SIZE) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: too many outputs, or path too long: %.200s", what, path);
    }
    strcpy(claims[claim_count].path, path);
    snprintf(claims[claim_count++].what, sizeof claims->what, "%s", what);
    return MILD_OK;
}

void file_claims_drop(void) {
    claim_count = 0;
}

/* Fails when the file that `info` describes is an output of the program. */
static MildStatus check_claims(const char *path, const struct stat *info, MildError *error) {
    for (int i = 0; i < claim_count; i++) {
        struct stat output = {0};
        if (stat(claims[i].path, &output) == 0 && same_inode(&output, info)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "%s: %.150s is also an input (%.150s) and would be overwritten; name "
                             "another file",
                             claims[i].what, claims[i].path, path);
        }
    }
    return MILD_OK;
}

/* ---- reading ---- */

static MildStatus cannot_read(const char *path, const char *reason, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "%.200s: cannot read: %s", path, reason);
}

static const char *not_regular(const struct stat *info) {
    return S_ISREG(info->st_mode)   ? NULL
           : S_ISDIR(info->st_mode) ? "it is a folder"
                                    : "it is a pipe or a device, not a regular file";
}

MildStatus file_check_own(const char *path, MildError *error) {
    struct stat info = {0};
    const char *reason = lstat(path, &info) != 0 ? NULL
                         : S_ISLNK(info.st_mode) ? "it is a link, which is not followed here"
                                                 : not_regular(&info);
    return reason ? mild_fail(error, MILD_ERROR_IO, "%.200s: %s; put a regular file in its place",
                              path, reason)
                  : MILD_OK;
}

/* Returns a descriptor, or -1. Without O_NONBLOCK, opening a pipe that has no writer would wait. */
static int open_regular(const char *path, struct stat *info, MildError *error) {
    int file = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    const char *reason = file < 0 || fstat(file, info) != 0 ? strerror(errno) : not_regular(info);
    MildStatus status = reason ? cannot_read(path, reason, error) : check_claims(path, info, error);
    if (status == MILD_OK) {
        return file;
    }
    if (file >= 0) {
        close(file);
    }
    return -1;
}

FILE *file_open(const char *path, MildError *error) {
    struct stat info = {0};
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
    struct stat info = {0};
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
    struct stat info = {0};
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode);
}

/* A name that nobody but this program chooses: PATH.PID-N-SUM.tmp, where SUM is the FNV-1a hash of
 * what stands before it, without the folder. */
static int temporary_name(const char *path, long process, int n, char temporary[PATH_SIZE]) {
    uint64_t sum = UINT64_C(14695981039346656037);
    const int size = snprintf(temporary, PATH_SIZE, "%s.%ld-%d-", path, process, n);
    if (size + TEMPORARY_END >= PATH_SIZE) {
        return 0;
    }
    for (const char *c = base_of(temporary); *c; c++) {
        sum = (sum ^ (unsigned char)*c) * UINT64_C(1099511628211);
    }
    snprintf(temporary + size, TEMPORARY_END + 1, "%016" PRIx64 ".tmp", sum);
    return 1;
}

/* Creates the temporary file with the first free N. Returns a descriptor, or -1. */
static int open_temporary(const char *path, char temporary[PATH_SIZE], MildError *error) {
    if (!*path) {
        mild_fail(error, MILD_ERROR_ARGUMENT, "the name of the file is empty");
        return -1;
    }
    for (int n = 0; n < TEMPORARY_TRIES; n++) {
        if (!temporary_name(path, (long)getpid(), n, temporary)) {
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
    char path[PATH_SIZE], made[PATH_SIZE];
    long process;
    int n;
    const size_t length = strlen(name);
    const char *number =
        length < PATH_SIZE && length > TEMPORARY_END ? name + length - TEMPORARY_END : name;
    while (number > name && *number != '.') {
        number--;
    }
    snprintf(path, sizeof path, "%.*s", (int)(number - name), name);
    return sscanf(number, ".%ld-%d-", &process, &n) == 2 &&
           temporary_name(path, process, n, made) && strcmp(name, made) == 0;
}

MildStatus file_check_write(const char *path, MildError *error) {
    struct stat info = {0};
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

/* What a lock's file holds. A file of this name with another text is somebody else's. */
static const char lock_text[] = "A lock of mild. It is free when no process has locked it.\n";

/* Returns a descriptor, or -1. *again: its holder has removed the file meanwhile. */
static int open_lock(const char *path, int *again) {
    const int flags = O_RDWR | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC;
    int file = open(path, flags | O_CREAT | O_EXCL, 0666);
    if (file < 0 && errno == EEXIST) {
        file = open(path, flags);
        *again = file < 0 && errno == ENOENT;
        return file;
    }
    if (file < 0) {
        return -1;
    }
    if (write(file, lock_text, strlen(lock_text)) != (ssize_t)strlen(lock_text) ||
        fsync(file) != 0) {
        int failed = errno;
        unlink(path);
        close(file);
        errno = failed;
        return -1;
    }
    return file;
}

/* What the file is: 1 a lock of ours, 0 somebody else's, -1 empty as before its text is written. */
static int is_lock(int file) {
    char text[sizeof lock_text];
    ssize_t size = pread(file, text, sizeof text, 0);
    return size == 0
               ? -1
               : size == (ssize_t)strlen(lock_text) && memcmp(text, lock_text, (size_t)size) == 0;
}

/* Takes the lock of an open file. *again: the file was removed, or has no text yet. */
static MildStatus take_lock(int file, const char *path, int patience, int *again,
                            MildError *error) {
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    struct stat locked = {0}, named = {0};
    const int is = is_lock(file);
    if (is == 0 || (is < 0 && patience <= 0)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: somebody else's file; a lock of this name is needed here, so "
                         "move it away",
                         path);
    }
    if (is > 0 && fcntl(file, F_SETLK, &whole) != 0) {
        return lock_refused(file, path, error);
    }
    *again = is < 0 || fstat(file, &locked) != 0 || stat(path, &named) != 0 ||
             !same_inode(&locked, &named);
    return MILD_OK;
}

/* The holder removes the file before it releases the lock. So a lock is valid only if the locked
 * file still has its name. */
MildStatus file_lock(FileLock *lock, const char *path, MildError *error) {
    lock->file = -1;
    if (snprintf(lock->path, sizeof lock->path, "%s", path) >= (int)sizeof lock->path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", path);
    }
    for (int patience = LOCK_PATIENCE;; patience--) {
        int again = 0;
        int file = open_lock(path, &again);
        MildStatus status = file >= 0 ? take_lock(file, path, patience, &again, error)
                            : !again  ? cannot_write(path, errno, error)
                                      : MILD_OK;
        if (status == MILD_OK && !again) {
            lock->file = file;
            return MILD_OK;
        }
        if (file >= 0) {
            close(file);
        }
        if (status != MILD_OK) {
            return status;
        }
        nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
    }
}

long file_lock_holder(const char *path) {
    struct flock holder = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
    const int held = file >= 0 && fcntl(file, F_GETLK, &holder) == 0 && holder.l_type != F_UNLCK;
    if (file >= 0) {
        close(file);
    }
    return held ? (long)holder.l_pid : 0;
}

void file_unlock(FileLock *lock) {
    if (lock->file >= 0) {
        unlink(lock->path);
        close(lock->file);
        lock->file = -1;
    }
}
