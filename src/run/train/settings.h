/* The keys and values of a config.ini as texts, whatever version wrote it. */
#ifndef TRAIN_SETTINGS_H
#define TRAIN_SETTINGS_H

#include "mild/error.h"

typedef struct {
    char *key; /* "section.key" */
    char *value;
} Setting;

typedef struct {
    Setting *list; /* [count] in the order of the text */
    int count;
} Settings;

/* Fails when memory runs out or a line is neither a section nor a key, with "NAME:LINE: reason";
 * there is then nothing to free. */
MildStatus settings_read(const char *text, const char *name, Settings *settings, MildError *error);
void settings_free(Settings *settings);

#endif
