/* Files: reads regular files, writes a file completely or not at all, compares and locks files. */
#ifndef BASE_FILE_H
#define BASE_FILE_H

#include <stddef.h>
#include <stdio.h>

#include "base/paths.h"

/* Opens a regular file for reading. Refuses folders, pipes and devices, because reading one may
 * block or never end. Returns NULL on failure, with "PATH: cannot read: reason" in *error. */
FILE *file_open(const char *path, MildError *error);

/* Reads a whole regular file of at most `limit` bytes. Returns its bytes from malloc, followed by a
 * '\0', and their number in *size. Returns NULL on failure, with the reason in *error. */
char *file_read(const char *path, size_t limit, size_t *size, MildError *error);

/* Fails when `path` exists and is a link or no regular file: for a file in a folder that the
 * program writes or publishes by itself, where nobody named the file that a link leads to. */
MildStatus file_check_own(const char *path, MildError *error);

/* Announces that the program will write `path`, before it reads anything. From then on a file that
 * is the same on disk cannot be opened for reading by file_open or file_read: an output never
 * replaces what it was made from, whoever named that. what: the output in messages, "--json".
 * Fails when another output has the file. For one thread, at the start of a program. */
MildStatus file_claim(const char *path, const char *what, MildError *error);
void file_claims_drop(void); /* for tests */

/* Fails if file_write could not start. Call it before long work, so that a wrong path does not cost
 * the result. Leaves nothing behind. */
MildStatus file_check_write(const char *path, MildError *error);

/* Writes a temporary file beside `path`, syncs it, renames it and syncs the folder. After a crash
 * or on a full disk the old file is still whole. Devices and pipes are written to directly. */
MildStatus file_write(const char *path, const void *data, size_t size, MildError *error);

/* Creates an empty file PATH.PID-N-SUM.tmp with a name that is not in use, for a writer that cannot
 * use file_write. The caller renames or removes it. */
MildStatus file_temporary(const char *path, char temporary[PATH_SIZE], MildError *error);
/* Whether `name` (without a folder) is that of a temporary file, which a killed process left
 * behind. SUM is a checksum of the rest, so that no file of a user has such a name by chance. */
int file_is_temporary(const char *name);

/* A process's lock on a file made for this purpose. The system releases it when the process ends,
 * for whatever reason. Another process can then take it although the file still exists. */
typedef struct {
    int file;             /* descriptor; -1: not held */
    char path[PATH_SIZE]; /* of the file */
} FileLock;

/* Takes the lock. Fails with MILD_ERROR_ARGUMENT when another process holds it, which the message
 * names, and with MILD_ERROR_FORMAT when the file is there and was not made for this purpose: it
 * would be removed with the lock. */
MildStatus file_lock(FileLock *lock, const char *path, MildError *error);
/* The process that holds the lock, or 0. Not for a process that may hold it: asking ends its
 * lock. */
long file_lock_holder(const char *path);
/* Removes the file and releases the lock. Does nothing when it is not held. */
void file_unlock(FileLock *lock);

#endif
