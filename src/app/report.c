#include "app/report.h"

#include <errno.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "app/package.h"
#include "base/file.h"
#include "base/paths.h"

MildStatus report_text(const char *text, size_t size, const char *path, MildError *error) {
    if (strcmp(path, "-") != 0) {
        return file_write(path, text, size, error);
    }
    return fwrite(text, 1, size, stdout) != size || fflush(stdout) != 0
               ? mild_fail(error, MILD_ERROR_IO, "cannot write to standard output")
               : MILD_OK;
}

MildStatus sheet_open(Sheet *sheet, MildError *error) {
    sheet->file = open_memstream(&sheet->text, &sheet->size);
    return sheet->file ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
}

MildStatus sheet_close(Sheet *sheet, const char *path, MildStatus status, MildError *error) {
    if (sheet->file && fclose(sheet->file) && status == MILD_OK) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    if (sheet->file && status == MILD_OK) {
        status = report_text(sheet->text, sheet->size, path, error);
    }
    free(sheet->text);
    return status;
}

MildStatus report_save(cJSON *root, const char *path, MildError *error) {
    char *text = root ? cJSON_Print(root) : NULL;
    cJSON_Delete(root);
    size_t length = text ? strlen(text) : 0;
    char *line = text ? realloc(text, length + 2) : NULL;
    if (!line) {
        free(text);
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    strcpy(line + length, "\n");
    MildStatus status = report_text(line, length + 1, path, error);
    free(line);
    return status;
}

extern char **environ;

MildStatus figure_draw(const char *kind, const char *data, const char *picture, const char *title,
                       MildError *error) {
    char python[PATH_SIZE], code_path[PATH_SIZE], from[PATH_SIZE], to[PATH_SIZE], above[256],
        what[32];
    package_python(python);
    path_data("scripts/draw.py", code_path);
    FILE *text = file_open(code_path, error); /* as an input, it cannot be the output, too */
    if (!text) {
        return error->status;
    }
    fclose(text);
    snprintf(what, sizeof what, "%s", kind);
    snprintf(from, sizeof from, "%s", data);
    snprintf(to, sizeof to, "%s", picture);
    snprintf(above, sizeof above, "%s", title ? title : "");
    char *arguments[] = {python, code_path, what, from, to, title ? above : NULL, NULL};
    pid_t child;
    int code = 0, failure = posix_spawnp(&child, python, NULL, NULL, arguments, environ);
    while (failure == 0 && waitpid(child, &code, 0) < 0 && errno == EINTR) {
        continue;
    }
    if (failure == 0 && WIFEXITED(code) && WEXITSTATUS(code) == 0) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_IO,
                     "%.150s: not drawn, Python with matplotlib is needed (make setup, or pip "
                     "install matplotlib); the numbers are in %.150s",
                     picture, data);
}
