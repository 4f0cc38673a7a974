/* Files: read when they are regular, written whole or not at all, told apart, locked. */
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

/* Whether file_write could begin. It is asked before long work, so that a wrong path does not cost
 * the result. Leaves nothing behind. */
MildStatus file_check_write(const char *path, MildError *error);

/* Writes a temporary file beside `path`, syncs it, renames it and syncs the folder. After a crash
 * or on a full disk the old file is still whole. Devices and pipes are written to directly. */
MildStatus file_write(const char *path, const void *data, size_t size, MildError *error);

/* Creates an empty file PATH.PID-N.tmp with a name that nothing had before, for a writer that
 * cannot use file_write; the caller renames or removes it. */
MildStatus file_temporary(const char *path, char temporary[PATH_SIZE], MildError *error);
/* Whether `name` is PREFIX.PID-N.tmp with any prefix: a temporary file that a killed process left
 * behind has such a name. */
int file_is_temporary(const char *name);

/* Whether two paths name the same file: one file on disk (symbolic and hard links followed), or,
 * where none exists yet, one name in one folder. Never true of devices and pipes. */
int file_same(const char *a, const char *b);

/* A lock that a process holds on a file made for the purpose. The kernel drops it when the process
 * ends, however it ends; another process then gets it although the file is still there. */
typedef struct {
    int file;             /* descriptor; -1: not held */
    char path[PATH_SIZE]; /* of the file */
} FileLock;

/* Fails with MILD_ERROR_ARGUMENT when another process holds the lock; says which. */
MildStatus file_lock(FileLock *lock, const char *path, MildError *error);
/* Removes the file and drops the lock; nothing happens when it is not held. */
void file_unlock(FileLock *lock);

#endif
