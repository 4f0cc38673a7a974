/* Soils that lie on a disk. A file of its own, because a web page has none. */
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "ground/soil/soil.h"

int soil_is_file(const char *name) {
    const size_t length = strlen(name);
    return length > 4 && strcmp(name + length - 4, ".ini") == 0;
}

/* ---- reading ---- */

static MildStatus soil_read(const char *path, MildMaterial *material, MildError *error) {
    size_t size;
    char *text = file_read(path, SOIL_BYTES_MAX, &size, error);
    if (!text) {
        return error ? error->status : MILD_ERROR_IO;
    }
    MildStatus status =
        strlen(text) == size
            ? soil_parse(text, path, material, error)
            : mild_fail(error, MILD_ERROR_FORMAT,
                        "%.200s: is no soil, because it contains binary data", path);
    free(text);
    return status;
}

MildStatus soil_find(const char *name, MildMaterial *material, MildError *error) {
    MildError unseen;
    if (soil_is_file(name)) {
        return soil_read(name, material, error ? error : &unseen);
    }
    return soil_preset(name, material, error);
}

/* ---- writing ---- */

MildStatus soil_write(const MildMaterial *material, const SoilNotes *notes, const char *path,
                      MildError *error) {
    MildStatus status = mild_material_check(material, error);
    if (status != MILD_OK) {
        return status;
    }
    if (!soil_is_file(path)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%.200s: the name of a soil ends in .ini, by which it is known", path);
    }
    char *text = soil_text(material, notes);
    status = text ? file_write(path, text, strlen(text), error)
                  : mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", path);
    free(text);
    return status;
}
