#define _XOPEN_SOURCE 700 /* realpath */
#include "app/run_video.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "app/chart.h"
#include "base/file.h"

enum { PART_MAX = 4 << 20 }; /* bytes of a video that becomes part of the page */

/* RFC 4648, section 4. */
static void write_base64(const unsigned char *data, size_t size, FILE *html) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const unsigned word = (unsigned)data[i] << 16 |
                              (left > 1 ? (unsigned)data[i + 1] << 8 : 0) |
                              (left > 2 ? (unsigned)data[i + 2] : 0);
        fputc(digits[word >> 18], html);
        fputc(digits[word >> 12 & 63], html);
        fputc(left > 1 ? digits[word >> 6 & 63] : '=', html);
        fputc(left > 2 ? digits[word & 63] : '=', html);
    }
}

/* The absolute folder of the page. */
static MildStatus page_folder(const char *page, char folder[PATH_SIZE], MildError *error) {
    const char *slash = strrchr(page, '/');
    const int length = slash ? (int)(slash - page) : 0;
    char named[PATH_SIZE];
    snprintf(named, sizeof named, "%.*s", length, page);
    char *real = realpath(length ? named : slash ? "/" : ".", NULL);
    if (!real || strlen(real) >= PATH_SIZE) {
        free(real);
        return mild_fail(error, MILD_ERROR_IO, "%.300s: cannot find its folder: %s", page,
                         strerror(errno));
    }
    strcpy(folder, real);
    free(real);
    return MILD_OK;
}

/* Writes a path as part of a URL. */
static void write_url(const char *path, FILE *html) {
    for (; *path; path++) {
        const unsigned char c = (unsigned char)*path;
        fprintf(html, isalnum(c) || strchr("/._-", c) ? "%c" : "%%%02X", c);
    }
}

/* Writes the way from `folder` to `file`, both absolute. */
static void write_relative(const char *folder, const char *file, FILE *html) {
    size_t common = 0;
    for (size_t i = 0;; i++) { /* up to the last slash at which both are the same folder */
        const int folder_ends = folder[i] == '/' || folder[i] == '\0';
        if (folder_ends && file[i] == '/') {
            common = i;
        }
        if (!folder[i] || folder[i] != file[i]) {
            break;
        }
    }
    const char *rest = folder[1] ? folder + common : "";
    for (; *rest; rest++) {
        fputs(*rest == '/' ? "../" : "", html);
    }
    write_url(file + common + 1, html);
}

static MildStatus write_part(const char *path, FILE *html, MildError *error) {
    size_t size;
    char *data = file_read(path, PART_MAX, &size, error);
    if (!data) {
        return error->status;
    }
    fputs("data:video/mp4;base64,", html);
    write_base64((const unsigned char *)data, size, html);
    free(data);
    return MILD_OK;
}

static MildStatus write_link(const char *path, const char *page, FILE *html, MildError *error) {
    char folder[PATH_SIZE];
    FILE *video = file_open(path, error); /* as an input, it cannot be the page */
    if (!video) {
        return error->status;
    }
    fclose(video);
    MildStatus status = page_folder(page, folder, error);
    char *file = status == MILD_OK ? realpath(path, NULL) : NULL;
    if (file) {
        write_relative(folder, file, html);
    } else if (status == MILD_OK) {
        status = mild_fail(error, MILD_ERROR_IO, "%.300s: cannot read: %s", path, strerror(errno));
    }
    free(file);
    return status;
}

MildStatus run_video_write(const RunFiles *run, const char *page, FILE *html, MildError *error) {
    MildStatus status = MILD_OK;
    for (int i = 0; i < run->videos && status == MILD_OK; i++) {
        char path[PATH_SIZE];
        struct stat info;
        status = path_join(run->folder, run->video[i], path, error);
        status = status == MILD_OK ? file_check_own(path, error) : status;
        if (status != MILD_OK || stat(path, &info) != 0) {
            continue;
        }
        fputs("<h2>", html);
        chart_write_text(path, html);
        fputs("</h2>\n<video controls loop src=\"", html);
        status = info.st_size <= PART_MAX ? write_part(path, html, error)
                                          : write_link(path, page, html, error);
        fputs("\"></video>\n", html);
    }
    return status;
}
