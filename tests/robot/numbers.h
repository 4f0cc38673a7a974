/* A robot's published numbers, robots/NAME/NAME.json, read here independently of MuJoCo. */
#ifndef NUMBERS_H
#define NUMBERS_H

#include <cjson/cJSON.h>

#include "files.h"

static cJSON *numbers;

static inline void numbers_open(const char *path) {
    char *text = kit_read(path, NULL);
    numbers = cJSON_Parse(text);
    free(text);
    assert_non_null(numbers);
}

static inline void numbers_close(void) {
    cJSON_Delete(numbers);
}

static inline const cJSON *item(const cJSON *object, const char *name) {
    const cJSON *found = cJSON_GetObjectItem(object, name);
    if (!found) {
        fail_msg("no %s", name);
    }
    return found;
}

static inline double number(const cJSON *object, const char *name) {
    const cJSON *found = item(object, name);
    assert_true(cJSON_IsNumber(found));
    return found->valuedouble;
}

static inline const char *word(const cJSON *object, const char *name) {
    const cJSON *found = item(object, name);
    assert_true(cJSON_IsString(found));
    return found->valuestring;
}

static inline void vector(const cJSON *object, const char *name, int count, double *out) {
    const cJSON *found = item(object, name);
    assert_int_equal(cJSON_GetArraySize(found), count);
    for (int k = 0; k < count; k++) {
        const cJSON *entry = cJSON_GetArrayItem(found, k);
        assert_true(cJSON_IsNumber(entry));
        out[k] = entry->valuedouble;
    }
}

#endif
