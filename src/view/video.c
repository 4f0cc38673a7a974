#include "view/video.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"

extern char **environ;

struct Video {
    char path[PATH_SIZE];
    char temporary[PATH_SIZE]; /* what ffmpeg writes; renamed when it is whole */
    int width, height, frames;
    int pipe;   /* our end; -1 when closed */
    int errors; /* file that receives ffmpeg's messages */
    pid_t child;
    MildStatus status; /* first failure, repeated by close */
    char text[300];
};

/* Last non-empty line that ffmpeg wrote: the one that says why. */
static void last_error_line(int file, char *line, size_t size) {
    char text[2048];
    line[0] = '\0';
    off_t length = lseek(file, 0, SEEK_END);
    off_t start = length > (off_t)sizeof text - 1 ? length - (off_t)sizeof text + 1 : 0;
    if (length <= 0 || lseek(file, start, SEEK_SET) < 0) {
        return;
    }
    ssize_t got = read(file, text, sizeof text - 1);
    if (got <= 0) {
        return;
    }
    text[got] = '\0';
    while (got > 0 && (text[got - 1] == '\n' || text[got - 1] == '\r')) {
        text[--got] = '\0';
    }
    const char *last = strrchr(text, '\n');
    last = last ? last + 1 : text;
    size_t keep = strlen(last) < size ? strlen(last) : size - 1;
    memcpy(line, last, keep);
    line[keep] = '\0';
}

static int error_file(void) {
    FILE *file = tmpfile();
    if (!file) {
        return -1;
    }
    int descriptor = fcntl(fileno(file), F_DUPFD_CLOEXEC, 3);
    fclose(file);
    return descriptor;
}

/* Frames travel over a socket pair: unlike a pipe it can be written without a SIGPIPE when ffmpeg
 * dies. */
static MildStatus spawn_ffmpeg(Video *video, double fps, MildError *error) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        return mild_fail(error, MILD_ERROR_IO, "video %s: no pipe: %s", video->path,
                         strerror(errno));
    }
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    char size[32], rate[32], ffmpeg[PATH_SIZE];
    const char *other = getenv("MILD_FFMPEG"); /* that of a Python package */
    snprintf(ffmpeg, sizeof ffmpeg, "%s", other && *other ? other : "ffmpeg");
    snprintf(size, sizeof size, "%dx%d", video->width, video->height);
    snprintf(rate, sizeof rate, "%g", fps);
    char *arguments[] = {ffmpeg,
                         "-nostdin",
                         "-loglevel",
                         "error",
                         "-y",
                         "-f",
                         "rawvideo",
                         "-pix_fmt",
                         "rgb24",
                         "-s",
                         size,
                         "-r",
                         rate,
                         "-i",
                         "pipe:0",
                         "-an",
                         "-c:v",
                         "libx264",
                         "-preset",
                         "veryfast",
                         "-crf",
                         "20",
                         "-pix_fmt",
                         "yuv420p",
                         "-movflags",
                         "+faststart",
                         "-f",
                         "mp4",
                         video->temporary,
                         NULL};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, video->errors, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions, video->errors, STDOUT_FILENO);
    if (ends[1] != STDIN_FILENO) {
        posix_spawn_file_actions_addclose(&actions, ends[1]);
    }
    /* A process group of its own: Ctrl-C ends our loop, and ffmpeg then gets to finish the file. */
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    int failure = posix_spawnp(&video->child, ffmpeg, &actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (failure) {
        close(ends[0]);
        return mild_fail(
            error, MILD_ERROR_IO,
            "video %s: cannot start ffmpeg (%s); install it: apt-get install ffmpeg, or "
            "pip install imageio-ffmpeg",
            video->path, strerror(failure));
    }
    video->pipe = ends[0];
    return MILD_OK;
}

Video *video_open(const char *path, int width, int height, double fps, MildError *error) {
    if (width <= 0 || height <= 0 || width % 2 || height % 2 || !(fps > 0)) {
        mild_fail(error, MILD_ERROR_ARGUMENT,
                  "video %s: size %d x %d must be positive and even, fps %g positive", path, width,
                  height, fps);
        return NULL;
    }
    Video *video = calloc(1, sizeof *video);
    if (!video) {
        mild_fail(error, MILD_ERROR_MEMORY, "video %s: out of memory", path);
        return NULL;
    }
    video->width = width, video->height = height, video->pipe = -1;
    if (snprintf(video->path, sizeof video->path, "%s", path) >= (int)sizeof video->path) {
        mild_fail(error, MILD_ERROR_ARGUMENT, "video: the path is longer than %d characters",
                  PATH_SIZE - 1);
        free(video);
        return NULL;
    }
    if (file_temporary(path, video->temporary, error) != MILD_OK) {
        free(video);
        return NULL;
    }
    video->errors = error_file();
    if (video->errors < 0) {
        mild_fail(error, MILD_ERROR_IO, "video %s: no temporary file: %s", path, strerror(errno));
        unlink(video->temporary);
        free(video);
        return NULL;
    }
    if (spawn_ffmpeg(video, fps, error) != MILD_OK) {
        close(video->errors);
        unlink(video->temporary);
        free(video);
        return NULL;
    }
    return video;
}

/* Closes our end, waits, and returns whether ffmpeg ended well; keeps its message otherwise. */
static int finish_ffmpeg(Video *video) {
    close(video->pipe);
    video->pipe = -1;
    int code = 0;
    while (waitpid(video->child, &code, 0) < 0 && errno == EINTR) {
        continue;
    }
    if (WIFEXITED(code) && WEXITSTATUS(code) == 0) {
        return 1;
    }
    char line[200];
    last_error_line(video->errors, line, sizeof line);
    video->status = MILD_ERROR_IO;
    snprintf(video->text, sizeof video->text, "ffmpeg failed: %s", line[0] ? line : "no message");
    return 0;
}

MildStatus video_frame(Video *video, const unsigned char *rgb, MildError *error) {
    if (video->status != MILD_OK) {
        return mild_fail(error, video->status, "video %s: %s", video->path, video->text);
    }
    size_t left = (size_t)video->width * (size_t)video->height * 3;
    while (left > 0) {
        ssize_t sent = send(video->pipe, rgb, left, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) {
            continue;
        }
        if (sent <= 0) {
            if (finish_ffmpeg(video)) { /* ffmpeg exited early with success */
                video->status = MILD_ERROR_IO;
                snprintf(video->text, sizeof video->text, "ffmpeg stopped reading after %d frames",
                         video->frames);
            }
            return mild_fail(error, video->status, "video %s: %s", video->path, video->text);
        }
        rgb += sent;
        left -= (size_t)sent;
    }
    video->frames++;
    return MILD_OK;
}

MildStatus video_close(Video *video, MildError *error) {
    if (!video) {
        return MILD_OK;
    }
    if (video->pipe >= 0) {
        finish_ffmpeg(video);
    }
    MildStatus status = video->status;
    if (status != MILD_OK) {
        mild_fail(error, status, "video %s: %s", video->path, video->text);
    } else if (rename(video->temporary, video->path) != 0) {
        status = mild_fail(error, MILD_ERROR_IO, "video %s: cannot rename: %s", video->path,
                           strerror(errno));
    }
    if (status != MILD_OK) {
        unlink(video->temporary);
    }
    close(video->errors);
    free(video);
    return status;
}
