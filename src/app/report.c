#include "app/report.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

MildStatus report_text(const char *text, size_t size, const char *path, MildError *error) {
    if (strcmp(path, "-") != 0) {
        return file_write(path, text, size, error);
    }
    return fwrite(text, 1, size, stdout) != size || fflush(stdout) != 0
               ? mild_fail(error, MILD_ERROR_IO, "cannot write to standard output")
               : MILD_OK;
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
