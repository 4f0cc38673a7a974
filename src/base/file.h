/* Files: reads regular files, writes a file completely or not at all, compares and locks files. */
#ifndef BASE_FILE_H
#define BASE_FILE_H

#include <stddef.h>
#include <stdio.h>

#include "base/paths.h"

/* Opens a regular file for reading. A folder, a pipe or a device is refused: reading one may wait
 * for ever or never end. NULL, with "PATH: cannot read: reason" in *error. */
FILE *file_open(const char *path, MildError *error);

/* The whole of a regular file of at most `limit` bytes (from malloc, with a '\0' behind the last),
 * its size in *size; NULL, with the reason in *error. */
char *file_read(const char *path, size_t limit, size_t *size, MildError *error);

/* Fails when `path` exists and is not a regular file. */
MildStatus file_check_regular(const char *path, MildError *error);

/* Fails when file_write could not begin. Called before long work, so that a wrong path does not
 * cost the result. Leaves nothing behind. */
MildStatus file_check_write(const char *path, MildError *error);

/* Writes a temporary file beside `path`, syncs it, renames it and syncs the folder. After a crash
 * or on a full disk the old file is still whole. Devices and pipes are written to directly. */
MildStatus file_write(const char *path, const void *data, size_t size, MildError *error);

/* Creates an empty file PATH.PID-N.tmp with a name that is not in use, for a writer that cannot use
 * file_write. The caller renames or removes it. */
MildStatus file_temporary(const char *path, char temporary[PATH_SIZE], MildError *error);
/* Whether `name` is PREFIX.PID-N.tmp with any prefix, as a temporary file that a killed process
 * left behind. */
int file_is_temporary(const char *name);

/* Whether two paths name the same file: the same file on disk (links are followed), or, where none
 * exists yet, the same name in the same folder. Never true for devices and pipes. */
int file_same(const char *a, const char *b);

/* A lock of a process, on a file made for it. The system releases it when the process ends, however
 * it ends. Another process can then take it although the file still exists. */
typedef struct {
    int file;             /* descriptor; -1: not held */
    char path[PATH_SIZE]; /* of the file */
} FileLock;

/* Fails with MILD_ERROR_ARGUMENT when another process holds the lock; says which. */
MildStatus file_lock(FileLock *lock, const char *path, MildError *error);
/* Removes the file and releases the lock. Does nothing when it is not held. */
void file_unlock(FileLock *lock);

#endif
