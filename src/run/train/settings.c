#include "run/train/settings.h"

#include <ini.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* inih's handler. Returns 0 when memory runs out. */
static int take(void *self, const char *section, const char *key, const char *value) {
    Settings *settings = self;
    Setting *list = realloc(settings->list, ((size_t)settings->count + 1) * sizeof *list);
    if (!list) {
        return 0;
    }
    settings->list = list;
    size_t size = strlen(section) + strlen(key) + 2;
    Setting setting = {malloc(size), strdup(value)};
    if (!setting.key || !setting.value) {
        free(setting.key);
        free(setting.value);
        return 0;
    }
    snprintf(setting.key, size, "%s.%s", section, key);
    list[settings->count++] = setting;
    return 1;
}

MildStatus settings_read(const char *text, const char *name, Settings *settings, MildError *error) {
    *settings = (Settings){0};
    int line = ini_parse_string(text, take, settings);
    if (line == 0) {
        return MILD_OK;
    }
    settings_free(settings);
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%s:%d: neither `key = value` nor `[section]`, or out of memory", name,
                     line > 0 ? line : 0);
}

void settings_free(Settings *settings) {
    for (int i = 0; i < settings->count; i++) {
        free(settings->list[i].key);
        free(settings->list[i].value);
    }
    free(settings->list);
    *settings = (Settings){0};
}
