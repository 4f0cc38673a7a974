#define _XOPEN_SOURCE 700 /* realpath */
#include "robot/files.h"

#include <dirent.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"

enum { FILE_LIMIT = 1 << 30 }; /* bytes */

typedef struct {
    char *bytes;
    size_t size;
} Contents;

/* ---- what MuJoCo calls, for textures and meshes on threads of its own ---- */

static pthread_mutex_t refusing = PTHREAD_MUTEX_INITIALIZER;

static void keep_reason(RobotFiles *files, const MildError *error) {
    pthread_mutex_lock(&refusing);
    if (files->refused.status == MILD_OK) {
        files->refused = *error;
    }
    pthread_mutex_unlock(&refusing);
}

/* MuJoCo tries several folders for a name, so a file that is missing is no reason. */
static int open_file(mjResource *resource) {
    RobotFiles *files = resource->provider->data;
    MildError error = {0};
    if (access(resource->name, F_OK) != 0) {
        return 0;
    }
    Contents *contents = malloc(sizeof *contents);
    if (contents) {
        contents->bytes = file_read(resource->name, FILE_LIMIT, &contents->size, &error);
    } else {
        mild_fail(&error, MILD_ERROR_MEMORY, "%.200s: out of memory", resource->name);
    }
    if (error.status != MILD_OK) {
        keep_reason(files, &error);
        free(contents);
        return 0;
    }
    resource->data = contents;
    return 1;
}

static int read_file(mjResource *resource, const void **buffer) {
    const Contents *contents = resource->data;
    *buffer = contents->bytes;
    return (int)contents->size;
}

static void close_file(mjResource *resource) {
    Contents *contents = resource->data;
    if (contents) {
        free(contents->bytes);
        free(contents);
    }
    resource->data = NULL;
}

static int mount_nothing(mjResource *resource) {
    (void)resource;
    return 1;
}

/* ---- reading a model ---- */

/* A mount covers what is below a folder of a name, but not the root. */
static void mount_root(RobotFiles *files) {
    DIR *root = opendir("/");
    for (struct dirent *entry; root && (entry = readdir(root));) {
        char path[2 + sizeof entry->d_name];
        snprintf(path, sizeof path, "/%s", entry->d_name);
        if (entry->d_name[0] != '.') {
            mj_mountVFS(&files->vfs, path, &files->provider);
        }
    }
    if (root) {
        closedir(root);
    }
}

static void begin(RobotFiles *files) {
    files->refused = (MildError){0};
    mj_defaultVFS(&files->vfs);
    mjp_defaultProvider(&files->provider);
    files->provider.prefix = "mild";
    files->provider.open = open_file;
    files->provider.read = read_file;
    files->provider.close = close_file;
    files->provider.mount = mount_nothing;
    files->provider.unmount = mount_nothing;
    files->provider.data = files;
    mount_root(files);
}

/* The path from the root, as mounts need it. Links of the last name are kept, because MuJoCo looks
 * for other files beside it. */
static MildStatus find_path(const char *path, char whole[PATH_SIZE], MildError *error) {
    char folder[PATH_SIZE];
    const char *slash = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1,
             slash ? path : ".");
    char *real = realpath(folder, NULL);
    if (!real) {
        return mild_fail(error, MILD_ERROR_IO, "%.300s: cannot find its folder", path);
    }
    MildStatus status = path_join(real, slash ? slash + 1 : path, whole, error);
    free(real);
    return status;
}

/* MuJoCo's messages have several lines; ours have one. */
static void fail(const RobotFiles *files, const char *path, const char *text, MildError *error) {
    char line[300];
    snprintf(line, sizeof line, "%s", text);
    for (char *c = line; *c; c++) {
        if (*c == '\n' || *c == '\r') {
            *c = ' ';
        }
    }
    if (files->refused.status != MILD_OK) {
        mild_fail(error, files->refused.status, "%s", files->refused.text);
    } else {
        mild_fail(error, MILD_ERROR_FORMAT, "%.300s: %s", path, line);
    }
}

mjSpec *robot_files_parse(RobotFiles *files, const char *path, MildError *error) {
    char whole[PATH_SIZE], text[300] = "";
    begin(files);
    if (find_path(path, whole, error) != MILD_OK) {
        return NULL;
    }
    mjSpec *spec = mj_parseXML(whole, &files->vfs, text, (int)sizeof text);
    if (!spec) {
        fail(files, path, text, error);
    }
    return spec;
}

mjModel *robot_files_compile(RobotFiles *files, mjSpec *spec, const char *path, MildError *error) {
    mjModel *model = mj_compile(spec, &files->vfs);
    if (!model) {
        fail(files, path, mjs_getError(spec), error);
    }
    return model;
}

void robot_files_end(RobotFiles *files) {
    mj_deleteVFS(&files->vfs);
}
