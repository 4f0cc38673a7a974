#include "app/report.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

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
    MildStatus status = MILD_OK;
    if (strcmp(path, "-") != 0) {
        status = file_write(path, line, length + 1, error);
    } else if (fputs(line, stdout) < 0) {
        status = mild_fail(error, MILD_ERROR_IO, "cannot write to standard output");
    }
    free(line);
    return status;
}
