#include "run/config/config.h"

#include <ctype.h>
#include <ini.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/paths.h"
#include "base/text.h"

enum { SECTIONS_MAX = 16, FILE_MAX = 1 << 20, VALUE_MAX = 512, WHERE_MAX = 160, TEXT_MAX = 150 };

static const ConfigSection *section_find(const ConfigSection *sections, int count, const char *name,
                                         const char **nearest) {
    const char *names[SECTIONS_MAX];
    int known = count < SECTIONS_MAX ? count : SECTIONS_MAX;
    for (int i = 0; i < known; i++) {
        if (strcmp(sections[i].name, name) == 0) {
            return &sections[i];
        }
        names[i] = sections[i].name;
    }
    *nearest = text_nearest(name, names, known);
    return NULL;
}

static MildStatus section_fail(const char *where, const char *name, const char *nearest,
                               MildError *error) {
    return mild_fail(error, MILD_ERROR_FORMAT, "%s: unknown section '%.60s'; nearest is '%s'",
                     where, name, nearest ? nearest : "none");
}

/* If the key exists in another section, that is a better hint than a similar name in this one. */
static MildStatus key_fail(const ConfigSection *sections, int count, const ConfigSection *section,
                           const char *key, const char *nearest, const char *where,
                           MildError *error) {
    const char *home = section->name;
    for (int i = 0; i < count; i++) {
        if (mild_field_find(sections[i].fields, sections[i].count, key, NULL)) {
            home = sections[i].name;
            nearest = key;
        }
    }
    return mild_fail(error, MILD_ERROR_FORMAT, "%s: unknown key '%s.%.60s'; nearest is '%s.%s'",
                     where, section->name, key, home, nearest ? nearest : "");
}

/* Whether a line of a config file can hold the text. A resumed run reads the text back from such a
 * line. */
static int text_fits_line(const char *text) {
    const char *rest = text, *line;
    const size_t length = strlen(text);
    const int blanks =
        length > 0 && (isspace((unsigned char)text[0]) || isspace((unsigned char)text[length - 1]));
    return length <= TEXT_MAX && text_line(&rest, &line) == length && !blanks;
}

/* A key that the last version read with this value (VERSIONING.md), and what stands for it now. */
typedef struct {
    const char *section, *key, *value, *key_now, *value_now;
} ConfigRename;
static const ConfigRename renames[] = {
    {"task", "newton", "true", "solver", "newton"},
    {"task", "newton", "1", "solver", "newton"},
    {"task", "newton", "false", "solver", "gauss_seidel"},
    {"task", "newton", "0", "solver", "gauss_seidel"},
};

/* A key that has no effect any more (VERSIONING.md), and what holds instead. */
typedef struct {
    const char *section, *key, *instead;
} ConfigGone;
static const ConfigGone gone[] = {
    {"task", "shell_depth", "a shank in soft ground ends no episode, a base that touches it does"},
};

/* Bool: the key is one of these; a line says so. */
static int key_is_gone(const char *section, const char *key, const char *where) {
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++) {
        if (strcmp(section, gone[i].section) == 0 && strcmp(key, gone[i].key) == 0) {
            fprintf(stderr, "%s: %s.%s has no effect: %s\n", where, section, key, gone[i].instead);
            return 1;
        }
    }
    return 0;
}

/* Puts the new names in the place of old ones, with a line that says so. */
static void key_rename(const char *section, const char **key, const char **value,
                       const char *where) {
    for (size_t i = 0; i < sizeof renames / sizeof *renames; i++) {
        const ConfigRename *old = &renames[i];
        if (strcmp(section, old->section) == 0 && strcmp(*key, old->key) == 0 &&
            strcmp(*value, old->value) == 0) {
            fprintf(stderr, "%s: %s.%s = %s is now %s.%s = %s\n", where, section, old->key,
                    old->value, section, old->key_now, old->value_now);
            *key = old->key_now;
            *value = old->value_now;
            return;
        }
    }
}

/* field_set: the key's field; NULL for a key that has no effect any more. */
static MildStatus key_set(const ConfigSection *sections, int count, const char *section_name,
                          const char *key, const char *value, const char *where,
                          const MildField **field_set, MildError *error) {
    const char *nearest = NULL;
    const ConfigSection *section = section_find(sections, count, section_name, &nearest);
    if (!section) {
        return section_fail(where, section_name, nearest, error);
    }
    *field_set = NULL;
    if (key_is_gone(section->name, key, where)) {
        return MILD_OK;
    }
    key_rename(section->name, &key, &value, where);
    const MildField *field = mild_field_find(section->fields, section->count, key, &nearest);
    if (!field) {
        return key_fail(sections, count, section, key, nearest, where, error);
    }
    if (field->type == MILD_FIELD_TEXT && !text_fits_line(value)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: %s.%s: a text may have at most %d characters, no blanks around it, "
                         "and no ; or # after a blank",
                         where, section->name, key, TEXT_MAX);
    }
    MildError cause = {0};
    MildStatus status = mild_field_parse(field, section->def, value, section->name, &cause);
    if (status != MILD_OK) {
        return mild_fail(error, status, "%s: %s", where, cause.text);
    }
    *field_set = field;
    return MILD_OK;
}

/* ---- ini text: this reader counts the lines and gives them to inih, which splits them into
 * section, key and value ---- */
typedef struct {
    const ConfigSection *sections;
    int count;
    const char *name;        /* of the file, for messages */
    const char *rest;        /* text not yet read */
    int line;                /* of the text last handed to inih, from 1 */
    int first[SECTIONS_MAX]; /* index of the section's first flag in seen */
    int *seen;               /* [keys] line on which the key was set, 0: not yet */
    MildStatus status;
    MildError *error;
} ConfigReader;

static const char *reader_where(const ConfigReader *reader, char *where) {
    snprintf(where, WHERE_MAX, "%.140s:%d", reader->name, reader->line);
    return where;
}

/* Checks the line itself, so that the first mistake is reported: inih accepts empty sections and
 * continues after a syntax error. line: without its comment, ends with a newline. */
static void reader_check_line(ConfigReader *reader, const char *line) {
    char name[64], where[WHERE_MAX];
    reader_where(reader, where);
    size_t length = strcspn(line, "]\n");
    if (*line == '[' && line[length] == ']' && line[length + 1] != '\n') {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s: '%.*s' stands behind a [section]; give it its own line",
                                   where, (int)strcspn(line + length + 1, "\n"), line + length + 1);
    } else if (*line == '[' && line[length] == ']') {
        snprintf(name, sizeof name, "%.*s", (int)length - 1, line + 1);
        const char *nearest = NULL;
        if (!section_find(reader->sections, reader->count, name, &nearest)) {
            reader->status = section_fail(where, name, nearest, reader->error);
        }
    } else if (*line == '[' || (*line != '\n' && !strpbrk(line, "=:"))) {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s: neither `key = value` nor `[section]`", where);
    }
}

/* fgets over the text. Drops indentation, because inih would add an indented line to the value
 * before it. */
static char *reader_line(char *buffer, int size, void *stream) {
    ConfigReader *reader = stream;
    if (reader->status != MILD_OK || !*reader->rest) {
        return NULL;
    }
    reader->line++;
    const char *line;
    reader->rest += strspn(reader->rest, " \t");
    const size_t length = text_line(&reader->rest, &line);
    if ((int)length > size - 2) {
        char where[WHERE_MAX];
        reader->status =
            mild_fail(reader->error, MILD_ERROR_FORMAT, "%s: line longer than %d characters",
                      reader_where(reader, where), size - 2);
        return NULL;
    }
    memcpy(buffer, line, length);
    buffer[length] = '\n';
    buffer[length + 1] = '\0';
    reader_check_line(reader, buffer);
    return reader->status == MILD_OK ? buffer : NULL;
}

static int *reader_seen(ConfigReader *reader, const char *section_name, const MildField *field) {
    for (int i = 0; i < reader->count; i++) {
        const ConfigSection *section = &reader->sections[i];
        if (strcmp(section->name, section_name) == 0) {
            return &reader->seen[reader->first[i] + (field - section->fields)];
        }
    }
    return NULL;
}

static int reader_key(void *user, const char *section, const char *key, const char *value) {
    ConfigReader *reader = user;
    if (reader->status != MILD_OK) {
        return 0;
    }
    char where[WHERE_MAX];
    reader_where(reader, where);
    if (!*section) {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s: key '%.60s' comes before the first [section]", where, key);
        return 0;
    }
    const MildField *field = NULL;
    reader->status =
        key_set(reader->sections, reader->count, section, key, value, where, &field, reader->error);
    if (reader->status != MILD_OK || !field) {
        return reader->status == MILD_OK;
    }
    int *seen = reader_seen(reader, section, field);
    if (*seen) {
        reader->status =
            mild_fail(reader->error, MILD_ERROR_FORMAT,
                      "%s: key '%s.%s' was already set on line %d", where, section, key, *seen);
        return 0;
    }
    *seen = reader->line;
    return 1;
}

static MildStatus reader_check_complete(const ConfigReader *reader) {
    for (int i = 0; i < reader->count; i++) {
        for (int j = 0; j < reader->sections[i].count; j++) {
            if (!reader->seen[reader->first[i] + j]) {
                return mild_fail(reader->error, MILD_ERROR_FORMAT,
                                 "%.140s: key '%s.%s' is missing; this file must be complete",
                                 reader->name, reader->sections[i].name,
                                 reader->sections[i].fields[j].name);
            }
        }
    }
    return MILD_OK;
}

MildStatus config_read_text(const ConfigSection *sections, int count, const char *text,
                            const char *name, int complete, MildError *error) {
    ConfigReader reader = {
        .sections = sections, .count = count, .name = name, .rest = text, .error = error};
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) {
        reader.rest += 3; /* byte order mark of some editors */
    }
    if (count > SECTIONS_MAX) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "config: more than %d sections", SECTIONS_MAX);
    }
    int keys = 0;
    for (int i = 0; i < count; i++) {
        reader.first[i] = keys;
        keys += sections[i].count;
    }
    reader.seen = calloc((size_t)keys + 1, sizeof *reader.seen);
    if (!reader.seen) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", name);
    }
    int bad_line = ini_parse_stream(reader_line, &reader, reader_key, &reader);
    if (reader.status == MILD_OK && bad_line) {
        reader.status = mild_fail(error, MILD_ERROR_FORMAT, "%.140s:%d: not a line of a config",
                                  name, bad_line);
    }
    if (reader.status == MILD_OK && complete) {
        reader.status = reader_check_complete(&reader);
    }
    free(reader.seen);
    return reader.status;
}

MildStatus config_read(const ConfigSection *sections, int count, const char *path, int complete,
                       MildError *error) {
    MildError cause = {0};
    size_t size;
    char found[PATH_SIZE];
    char *text = file_read(path_given(path, found), FILE_MAX, &size, &cause);
    if (!text) {
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    if (memchr(text, '\0', size)) {
        free(text);
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: is not a config, because it contains binary data", path);
    }
    MildStatus status = config_read_text(sections, count, text, path, complete, error);
    free(text);
    return status;
}

static MildStatus set_override(const ConfigSection *sections, int count, const char *text,
                               MildError *error) {
    char section[64], key[64], where[WHERE_MAX];
    if (strpbrk(text, "\r\n")) {
        return mild_fail(error, MILD_ERROR_FORMAT, "--%.*s: an override must be a single line",
                         (int)strcspn(text, "\r\n"), text);
    }
    snprintf(where, sizeof where, "--%.120s", text);
    const char *dot = strchr(text, '.'), *equals = strchr(text, '=');
    if (!dot || !equals || dot > equals || dot == text || dot + 1 == equals ||
        dot - text >= (int)sizeof section || equals - dot > (int)sizeof key) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: an override has the form --section.key=value", where);
    }
    snprintf(section, sizeof section, "%.*s", (int)(dot - text), text);
    snprintf(key, sizeof key, "%.*s", (int)(equals - dot - 1), dot + 1);
    const MildField *field = NULL;
    return key_set(sections, count, section, key, equals + 1, where, &field, error);
}

MildStatus config_overrides(const ConfigSection *sections, int count, const char *const *texts,
                            int text_count, MildError *error) {
    for (int i = 0; i < text_count; i++) {
        MildStatus status = set_override(sections, count, texts[i], error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return MILD_OK;
}

static void print_help(const MildField *field, FILE *file) {
    fprintf(file, "# %s", field->help);
    if (field->type == MILD_FIELD_BOOL || field->type == MILD_FIELD_TEXT) {
        fputc('\n', file);
    } else if (field->type == MILD_FIELD_NAME) {
        for (int i = 0; i <= (int)field->max; i++) {
            fprintf(file, "%s%s", i ? ", " : " (", field->names[i]);
        }
        fputs(")\n", file);
    } else if (field->min > -1e15 && field->max < 1e15) {
        fprintf(file, " (%g .. %g)\n", field->min, field->max);
    } else {
        fprintf(file, " (from %g)\n", field->min);
    }
}

void config_print(const ConfigSection *sections, int count, int comments, FILE *file) {
    for (int i = 0; i < count; i++) {
        const ConfigSection *section = &sections[i];
        fprintf(file, "%s[%s]\n", i ? "\n" : "", section->name);
        for (int j = 0; j < section->count; j++) {
            char value[VALUE_MAX];
            mild_field_print(&section->fields[j], section->def, value, sizeof value);
            if (comments) {
                print_help(&section->fields[j], file);
            }
            fprintf(file, "%s = %s\n", section->fields[j].name, value);
        }
    }
}

char *config_text(const ConfigSection *sections, int count, int comments) {
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    if (!file) {
        return NULL;
    }
    config_print(sections, count, comments, file);
    if (fclose(file) != 0) {
        free(text);
        return NULL;
    }
    return text;
}
