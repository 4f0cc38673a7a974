#include "robot/def.h"

#include <ini.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/text.h"

enum { FILE_SIZE_MAX = 1 << 20, LIST_SIZE = 4096 };
enum { SECTION_MAX = 49 }; /* characters of a section's name; inih drops the rest */

/* Lists are kept as text until all sections have been read, because most need the number of
 * joints. */
typedef struct {
    char names[LIST_SIZE];
    char mirror[LIST_SIZE];
    char mirror_sign[LIST_SIZE];
    char pose[LIST_SIZE];
    char kp[LIST_SIZE];
    char kd[LIST_SIZE];
    char stand_kp[LIST_SIZE];
    char stand_kd[LIST_SIZE];
    char effort[LIST_SIZE];
    char speed[LIST_SIZE];
    char full_speed[LIST_SIZE];
    char swing[LIST_SIZE];
    char still[LIST_SIZE];
    char driven[LIST_SIZE];
} JointsText;

typedef struct {
    RobotFootDef def;
    char outline[LIST_SIZE];
    char corners[LIST_SIZE];
} FootText;

typedef struct {
    RobotDef def; /* only the scalars of [robot] */
    char shells[LIST_SIZE];
    char legs[LIST_SIZE];
} RobotText;

#define TEXT(Struct, member, help)                                                                 \
    MILD_FIELD(Struct, member, MILD_FIELD_TEXT, (int)sizeof(((Struct *)NULL)->member), 0, 0, help)
#define NAMED(Struct, key, member, type, count, min, max, help)                                    \
    { key, type, offsetof(Struct, member), count, min, max, help, NULL }

#define R(key, count, min, max, help)                                                              \
    NAMED(RobotText, #key, def.key, MILD_FIELD_DOUBLE, count, min, max, help)
#define RT(key, help)                                                                              \
    NAMED(RobotText, #key, def.key, MILD_FIELD_TEXT, (int)sizeof(((RobotDef *)NULL)->key), 0, 0,   \
          help)
static const MildField robot_fields[] = {
    RT(name, "[text] name of the robot"),
    RT(model, "[text] MJCF file in the folder"),
    RT(source, "[text] source of the numbers, and their licence"),
    RT(base, "[text] body with the free joint"),
    TEXT(RobotText, shells, "[text] geoms of the MJCF that stand as soles do"),
    R(shell_spacing, 1, 1e-3, 1, "[m] distance of the ground elements of the shells"),
    TEXT(RobotText, legs, "[text] geoms of the MJCF by which the legs touch each other"),
    R(height, 1, 0.01, 5, "[m] wanted height of the base above the stance soles"),
    R(action_scale, 1, 0.01, 2, "[rad] joint offset per unit of action"),
    R(feet_range, 2, 0, 5, "[m] limits of the lateral distance of mirrored feet"),
    R(knee_range, 2, 0, 5, "[m] limits of the lateral distance of mirrored knees"),
    R(feet_least, 1, 0, 5, "[m] lateral distance below which mirrored feet collide"),
    R(knee_least, 1, 0, 5, "[m] lateral distance below which mirrored knees collide"),
    R(foot_force, 1, 0.1, 1e6, "[N] force on a foot above which a landing is hard"),
    R(assist, 4, 0, 1e6,
      "[N m/rad, N m s/rad, N s/m, N] helping hand of a beginner: stiffness and damping against "
      "tilt, pull towards the commanded velocity, its limit"),
};

#define J(member, help) TEXT(JointsText, member, help)
static const MildField joint_fields[] = {
    J(names, "[text] hinges of the MJCF, in the order of observations and actions"),
    J(mirror, "[text] for each joint, the joint on the other side"),
    J(mirror_sign, "[-] 1 or -1: mirrored angle = sign times angle of the other side"),
    J(pose, "[rad] default pose"),
    J(kp, "[N m/rad] position gain"),
    J(kd, "[N m s/rad] velocity gain"),
    J(stand_kp, "[N m/rad] position gain of the controller `stand`; default kp"),
    J(stand_kd, "[N m s/rad] velocity gain of the controller `stand`; default kd"),
    J(effort, "[N m] torque limit; 0, the default: actuatorfrcrange of the MJCF"),
    J(speed, "[rad/s] speed limit of the motor; 0, the default: none"),
    J(full_speed, "[rad/s] up to which it gives its whole torque; 0, the default: up to speed"),
    J(swing, "[-] amplitude in the reference swing motion, times reward.reference_amplitude"),
    J(still, "[-] 1 for joints that reward.default_pose keeps near the pose; default 0"),
    J(driven, "[-] 1 for joints that another program moves, not the policy; the last; default 0"),
};

#define F(key, type, count, min, max, help)                                                        \
    NAMED(FootText, #key, def.key, type, count, min, max, help)
#define FT(key, help) F(key, MILD_FIELD_TEXT, ROBOT_NAME_SIZE, 0, 0, help)
static const char *const shape_names[] = {"outline", "round"};
static const MildField foot_fields[] = {
    FT(body, "[text] body that carries the sole"),
    FT(knee, "[text] body whose origin is the knee"),
    FT(mirror, "[text] foot on the other side"),
    FT(ankle, "[text] joint that pitches a flat sole; none by default"),
    F(offset, MILD_FIELD_DOUBLE, 1, 0, 1, "[-] phase of the gait cycle at which the stance begins"),
    {"shape", MILD_FIELD_NAME, offsetof(FootText, def.shape), 1, 0, 1,
     "[text] outline (a flat sole) or round (a sphere)", shape_names},
    TEXT(FootText, outline, "[m] x y of each point of a flat sole's outline"),
    F(z, MILD_FIELD_DOUBLE, 1, -5, 5, "[m] plane of a flat sole"),
    F(center, MILD_FIELD_DOUBLE, 3, -5, 5, "[m] centre of a round foot"),
    F(radius, MILD_FIELD_DOUBLE, 1, 1e-4, 1, "[m] of a round foot"),
    F(pitch, MILD_FIELD_DOUBLE, 1, 1e-4, 1, "[m] edge of a ground element"),
    F(elements, MILD_FIELD_INT, 1, 0, ROBOT_ELEMENTS_MAX,
      "[-] ground elements of the sole; 0: as many as fit"),
    TEXT(FootText, corners, "[m] x y z of the spheres that carry a flat sole on rigid ground"),
    F(corner_radius, MILD_FIELD_DOUBLE, 1, 1e-5, 1, "[m] of these spheres"),
};

enum {
    ROBOT_KEYS = sizeof robot_fields / sizeof *robot_fields,
    JOINT_KEYS = sizeof joint_fields / sizeof *joint_fields,
    FOOT_KEYS = sizeof foot_fields / sizeof *foot_fields
};

/* A file while it is read. */
typedef struct {
    const char *path; /* for messages */
    const char *rest; /* text that is still to be read */
    int line;         /* number of the line last passed to inih, from 1 */
    int continues;    /* bool: that line is indented, so it continues the value before it */
    RobotText robot;
    JointsText joints;
    FootText foot[ROBOT_FEET_MAX];
    int feet;
    int robot_seen[ROBOT_KEYS], joints_seen[JOINT_KEYS], foot_seen[ROBOT_FEET_MAX][FOOT_KEYS];
    RobotDef *def;
    MildError *error;
    MildStatus status;
} DefReader;

static MildStatus fail_line(DefReader *reader, const char *text) {
    return reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT, "%s:%d: %s", reader->path,
                                      reader->line, text);
}

/* Where a section's keys are kept. */
typedef struct {
    const MildField *fields;
    int count;
    void *values;
    int *seen; /* [count] line of the key; 0: not yet */
} Section;

static int find_section(DefReader *reader, const char *name, Section *section) {
    if (strcmp(name, "robot") == 0) {
        *section = (Section){robot_fields, ROBOT_KEYS, &reader->robot, reader->robot_seen};
        return 1;
    }
    if (strcmp(name, "joints") == 0) {
        *section = (Section){joint_fields, JOINT_KEYS, &reader->joints, reader->joints_seen};
        return 1;
    }
    if (strncmp(name, "foot.", 5) != 0 || !name[5] || strlen(name + 5) >= ROBOT_NAME_SIZE) {
        reader->status =
            mild_fail(reader->error, MILD_ERROR_FORMAT,
                      "%s:%d: unknown section [%.40s]; known: [robot], [joints], [foot.NAME]",
                      reader->path, reader->line, name);
        return 0;
    }
    int f = 0;
    while (f < reader->feet && strcmp(reader->foot[f].def.name, name + 5) != 0) {
        f++;
    }
    if (f == ROBOT_FEET_MAX) {
        reader->status =
            mild_fail(reader->error, MILD_ERROR_FORMAT, "%s:%d: [%.40s]: more than %d feet",
                      reader->path, reader->line, name, ROBOT_FEET_MAX);
        return 0;
    }
    if (f == reader->feet) {
        strcpy(reader->foot[f].def.name, name + 5);
        reader->foot[f].def.pitch = 0.0195;
        reader->foot[f].def.corner_radius = 0.005;
        reader->feet++;
    }
    *section = (Section){foot_fields, FOOT_KEYS, &reader->foot[f], reader->foot_seen[f]};
    return 1;
}

/* Checks the header itself, because inih ignores sections without keys. */
static int check_header(DefReader *reader, const char *line, size_t length) {
    char name[SECTION_MAX + 1];
    Section section;
    if (length < 2 || line[length - 1] != ']') {
        fail_line(reader, "neither `key = value` nor `[section]`");
        return 0;
    }
    if (length - 2 > SECTION_MAX) {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s:%d: [%.20s...] has %zu characters; a section's name has at "
                                   "most %d, and so the NAME of [foot.NAME] %d",
                                   reader->path, reader->line, line + 1, length - 2, SECTION_MAX,
                                   SECTION_MAX - (int)strlen("foot."));
        return 0;
    }
    snprintf(name, sizeof name, "%.*s", (int)length - 2, line + 1);
    return find_section(reader, name, &section);
}

/* Like fgets over the text. */
static char *next_line(char *buffer, int size, void *stream) {
    DefReader *reader = stream;
    if (reader->status != MILD_OK || !*reader->rest) {
        return NULL;
    }
    reader->line++;
    const char *line;
    const size_t length = text_line(&reader->rest, &line);
    if ((int)length > size - 2) {
        fail_line(reader, "the line is too long; continue the value on an indented line");
        return NULL;
    }
    if (*line == '[' && !check_header(reader, line, length)) {
        return NULL;
    }
    reader->continues = length > 0 && (*line == ' ' || *line == '\t');
    memcpy(buffer, line, length);
    buffer[length] = '\n';
    buffer[length + 1] = '\0';
    return buffer;
}

/* Adds an indented line to the list that it belongs to. */
static MildStatus continue_value(DefReader *reader, const Section *section, const MildField *field,
                                 const char *value) {
    char *text = (char *)section->values + field->offset;
    if (field->type != MILD_FIELD_TEXT) {
        return fail_line(
            reader, "an indented line continues the list above it, but this value is not a list");
    }
    size_t used = strlen(text);
    if (used + strlen(value) + 2 > (size_t)field->count) {
        return fail_line(reader, "the list is too long");
    }
    text[used] = ' ';
    strcpy(text + used + 1, value);
    return MILD_OK;
}

static int take_key(void *user, const char *name, const char *key, const char *value) {
    DefReader *reader = user;
    Section section;
    if (reader->status != MILD_OK) {
        return 0;
    }
    if (!find_section(reader, name, &section)) {
        return 0;
    }
    const char *nearest = NULL;
    const MildField *field = mild_field_find(section.fields, section.count, key, &nearest);
    if (!field) {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s:%d: [%.40s] has no key '%.40s'; nearest is '%s'",
                                   reader->path, reader->line, name, key, nearest);
        return 0;
    }
    int *seen = &section.seen[field - section.fields];
    if (reader->continues) {
        return continue_value(reader, &section, field, value) == MILD_OK;
    }
    if (*seen) {
        reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                   "%s:%d: [%.40s] %s was already set on line %d", reader->path,
                                   reader->line, name, key, *seen);
        return 0;
    }
    *seen = reader->line;
    MildError cause = {0};
    reader->status = mild_field_parse(field, section.values, value, name, &cause);
    if (reader->status != MILD_OK) {
        mild_fail(reader->error, reader->status, "%s:%d: %s", reader->path, reader->line,
                  cause.text);
    }
    return reader->status == MILD_OK;
}

/* ---- lists ---- */

static MildStatus fail_key(DefReader *reader, const char *section, const char *key,
                           const char *what) {
    return reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT, "%s: [%s] %s: %s",
                                      reader->path, section, key, what);
}

/* Next word of a list, with its length in *length; NULL at the end. */
static const char *next_word(const char *text, size_t *length) {
    static const char separators[] = " \t\r\n,";
    text += strspn(text, separators);
    *length = strcspn(text, separators);
    return *length ? text : NULL;
}

/* Reads names into `names`. Returns their number, or -1 after an error. */
static int take_names(DefReader *reader, const char *section, const char *key, const char *text,
                      RobotName *names, int most) {
    char what[160];
    size_t length = 0;
    int count = 0;
    for (const char *at = text; (at = next_word(at, &length)) != NULL; at += length) {
        if (length >= ROBOT_NAME_SIZE || count == most) {
            snprintf(what, sizeof what, "at most %d names of %d characters fit", most,
                     ROBOT_NAME_SIZE - 1);
            fail_key(reader, section, key, what);
            return -1;
        }
        snprintf(names[count++], ROBOT_NAME_SIZE, "%.*s", (int)length, at);
    }
    return count;
}

/* Reads finite numbers into `numbers`. Returns their number, or -1 after an error. */
static int take_numbers(DefReader *reader, const char *section, const char *key, const char *text,
                        double *numbers, int most) {
    char what[160], word[64];
    size_t length = 0;
    int count = 0;
    for (const char *at = text; (at = next_word(at, &length)) != NULL; at += length) {
        char *end = word;
        snprintf(word, sizeof word, "%.*s", (int)length, at);
        double number = strtod(word, &end);
        if (length >= sizeof word || *end || !(fabs(number) <= 1e6)) {
            snprintf(what, sizeof what, "'%.40s' is not a number", word);
            fail_key(reader, section, key, what);
            return -1;
        }
        if (count == most) {
            snprintf(what, sizeof what, "more than %d numbers", most);
            fail_key(reader, section, key, what);
            return -1;
        }
        numbers[count++] = number;
    }
    return count;
}

/* Reads a number for each joint, none below `least`. If the list is empty, uses `fallback`, or
 * zeros. */
static MildStatus take_column(DefReader *reader, const char *key, const char *text, double *column,
                              const double *fallback, double least) {
    char what[160];
    int joints = reader->def->joints;
    int count = take_numbers(reader, "joints", key, text, column, ROBOT_JOINTS_MAX);
    if (count < 0) {
        return reader->status;
    }
    if (count == 0 && fallback) {
        memcpy(column, fallback, (size_t)joints * sizeof *column);
        return MILD_OK;
    }
    if (count != joints) {
        snprintf(what, sizeof what, "%d numbers for %d joints", count, joints);
        return fail_key(reader, "joints", key, what);
    }
    for (int i = 0; i < joints; i++) {
        if (column[i] < least) {
            snprintf(what, sizeof what, "%g of '%s' is below %g", column[i], reader->def->joint[i],
                     least);
            return fail_key(reader, "joints", key, what);
        }
    }
    return MILD_OK;
}

static int find_joint(const RobotDef *def, const char *name) {
    int i = def->joints - 1;
    while (i >= 0 && strcmp(def->joint[i], name) != 0) {
        i--;
    }
    return i;
}

static MildStatus check_joint_names(DefReader *reader) {
    const RobotDef *def = reader->def;
    char what[240];
    for (int i = 0; i < def->joints; i++) {
        if (find_joint(def, def->joint[i]) != i) {
            snprintf(what, sizeof what, "'%s' stands there twice", def->joint[i]);
            return fail_key(reader, "joints", "names", what);
        }
    }
    for (int i = 0; i < def->joints; i++) {
        int j = find_joint(def, def->mirror[i]);
        if (j < 0) {
            snprintf(what, sizeof what, "'%s' is not among the names", def->mirror[i]);
            return fail_key(reader, "joints", "mirror", what);
        }
        if (strcmp(def->mirror[j], def->joint[i]) != 0) {
            snprintf(what, sizeof what, "'%s' has '%s' there, but '%s' has '%s'", def->joint[i],
                     def->mirror[i], def->joint[j], def->mirror[j]);
            return fail_key(reader, "joints", "mirror", what);
        }
        if (fabs(def->mirror_sign[i]) != 1.0 || def->mirror_sign[i] != def->mirror_sign[j]) {
            snprintf(what, sizeof what, "must be 1 or -1, and the same for '%s' and '%s'",
                     def->joint[i], def->joint[j]);
            return fail_key(reader, "joints", "mirror_sign", what);
        }
    }
    return MILD_OK;
}

/* Counts the driven joints. They are the last, so that joint i is that of action i. */
static MildStatus take_driven(DefReader *reader, const double *driven) {
    RobotDef *def = reader->def;
    const int joints = def->joints;
    while (def->driven < joints && driven[joints - 1 - def->driven] == 1.0) {
        def->driven++;
    }
    for (int i = 0; i < joints; i++) {
        const int other = find_joint(def, def->mirror[i]);
        if (driven[i] != (i >= joints - def->driven) || driven[i] != driven[other]) {
            return fail_key(reader, "joints", "driven",
                            "must be 0 or 1, the same for mirrored joints, with those of 1 last");
        }
    }
    return def->driven < joints
               ? MILD_OK
               : fail_key(reader, "joints", "driven", "no joint is left to the policy");
}

static MildStatus take_joints(DefReader *reader) {
    RobotDef *def = reader->def;
    const JointsText *text = &reader->joints;
    static const double zeros[ROBOT_JOINTS_MAX];
    double driven[ROBOT_JOINTS_MAX];
    def->joints = take_names(reader, "joints", "names", text->names, def->joint, ROBOT_JOINTS_MAX);
    if (def->joints < 1) {
        return def->joints < 0 ? reader->status
                               : fail_key(reader, "joints", "names", "at least one is needed");
    }
    int mirrors =
        take_names(reader, "joints", "mirror", text->mirror, def->mirror, ROBOT_JOINTS_MAX);
    if (mirrors != def->joints) {
        return mirrors < 0 ? reader->status
                           : fail_key(reader, "joints", "mirror", "not one name for each joint");
    }
    const struct {
        const char *key, *text;
        double *column;
        const double *fallback;
        double least;
    } columns[] = {{"mirror_sign", text->mirror_sign, def->mirror_sign, NULL, -1},
                   {"pose", text->pose, def->pose, NULL, -1e6},
                   {"kp", text->kp, def->kp, NULL, 0},
                   {"kd", text->kd, def->kd, NULL, 0},
                   {"stand_kp", text->stand_kp, def->stand_kp, def->kp, 0},
                   {"stand_kd", text->stand_kd, def->stand_kd, def->kd, 0},
                   {"effort", text->effort, def->effort, zeros, 0},
                   {"speed", text->speed, def->speed, zeros, 0},
                   {"full_speed", text->full_speed, def->full_speed, zeros, 0},
                   {"swing", text->swing, def->swing, zeros, -1e6},
                   {"still", text->still, def->still, zeros, 0},
                   {"driven", text->driven, driven, zeros, 0}};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        if (take_column(reader, columns[i].key, columns[i].text, columns[i].column,
                        columns[i].fallback, columns[i].least) != MILD_OK) {
            return reader->status;
        }
    }
    for (int i = 0; i < def->joints; i++) {
        if (def->full_speed[i] > def->speed[i]) {
            return fail_key(reader, "joints", "full_speed", "is above speed");
        }
    }
    const MildStatus status = check_joint_names(reader);
    return status == MILD_OK ? take_driven(reader, driven) : status;
}

/* ---- feet ---- */

static MildStatus fail_foot(DefReader *reader, const RobotFootDef *foot, const char *key,
                            const char *what) {
    char section[ROBOT_NAME_SIZE + 8];
    snprintf(section, sizeof section, "foot.%s", foot->name);
    return fail_key(reader, section, key, what);
}

/* A round foot on rigid ground is its own sphere. */
static MildStatus take_round(DefReader *reader, RobotFootDef *foot, const int *seen) {
    for (int k = 0; k < FOOT_KEYS; k++) {
        const char *key = foot_fields[k].name;
        int missing = !seen[k] && (strcmp(key, "center") == 0 || strcmp(key, "radius") == 0);
        int other = seen[k] && (strcmp(key, "outline") == 0 || strcmp(key, "z") == 0 ||
                                strcmp(key, "corners") == 0 || strcmp(key, "corner_radius") == 0 ||
                                strcmp(key, "ankle") == 0);
        if (missing || other) {
            return fail_foot(reader, foot, key,
                             missing ? "a round foot needs it" : "only a flat sole has it");
        }
    }
    foot->corner_count = 1;
    foot->corner_radius = foot->radius;
    memcpy(foot->corners, foot->center, sizeof foot->center);
    return MILD_OK;
}

static MildStatus take_flat(DefReader *reader, RobotFootDef *foot, const FootText *text,
                            const int *seen) {
    char section[ROBOT_NAME_SIZE + 8];
    snprintf(section, sizeof section, "foot.%s", foot->name);
    for (int k = 0; k < FOOT_KEYS; k++) {
        const char *key = foot_fields[k].name;
        int missing = !seen[k] && (strcmp(key, "outline") == 0 || strcmp(key, "z") == 0 ||
                                   strcmp(key, "corners") == 0);
        int other = seen[k] && (strcmp(key, "center") == 0 || strcmp(key, "radius") == 0);
        if (missing || other) {
            return fail_foot(reader, foot, key,
                             missing ? "a flat sole needs it" : "only a round foot has it");
        }
    }
    int points = take_numbers(reader, section, "outline", text->outline, foot->outline,
                              2 * ROBOT_OUTLINE_MAX);
    int corners = points < 0 ? -1
                             : take_numbers(reader, section, "corners", text->corners,
                                            foot->corners, 3 * ROBOT_CORNERS_MAX);
    if (corners < 0) {
        return reader->status;
    }
    if (points % 2 != 0 || points < 6) {
        return fail_foot(reader, foot, "outline", "needs x y of at least three points");
    }
    if (corners % 3 != 0 || corners < 3) {
        return fail_foot(reader, foot, "corners", "needs x y z of at least one sphere");
    }
    foot->outline_points = points / 2;
    foot->corner_count = corners / 3;
    return MILD_OK;
}

static MildStatus take_foot(DefReader *reader, int f) {
    RobotDef *def = reader->def;
    RobotFootDef *foot = &def->foot[f];
    const int *seen = reader->foot_seen[f];
    *foot = reader->foot[f].def;
    for (int k = 0; k < FOOT_KEYS; k++) {
        const char *key = foot_fields[k].name;
        int needed = strcmp(key, "body") == 0 || strcmp(key, "knee") == 0 ||
                     strcmp(key, "mirror") == 0 || strcmp(key, "offset") == 0 ||
                     strcmp(key, "shape") == 0;
        if (needed && !seen[k]) {
            return fail_foot(reader, foot, key, "is missing");
        }
    }
    if (!(foot->offset < 1.0)) {
        return fail_foot(reader, foot, "offset", "must be below 1");
    }
    if (foot->ankle[0] && find_joint(def, foot->ankle) < 0) {
        return fail_foot(reader, foot, "ankle", "is not among the names in [joints]");
    }
    return foot->shape == ROBOT_SOLE_ROUND ? take_round(reader, foot, seen)
                                           : take_flat(reader, foot, &reader->foot[f], seen);
}

static int find_foot(const RobotDef *def, const char *name) {
    int f = def->feet - 1;
    while (f >= 0 && strcmp(def->foot[f].name, name) != 0) {
        f--;
    }
    return f;
}

/* The mirror image of a gait is either the same gait half a cycle later or the gait itself. All
 * feet must agree on which. */
static MildStatus check_gait(DefReader *reader) {
    RobotDef *def = reader->def;
    for (int f = 0; f < def->feet; f++) {
        const RobotFootDef *foot = &def->foot[f];
        int g = find_foot(def, foot->mirror);
        if (g < 0 || strcmp(def->foot[g].mirror, foot->name) != 0) {
            return fail_foot(reader, foot, "mirror", "must name a foot whose mirror is this one");
        }
        double shift = fabs(foot->offset - def->foot[g].offset);
        if (f == 0) {
            def->mirror_shift = shift;
        }
        if ((shift != 0.0 && shift != 0.5) || shift != def->mirror_shift) {
            return fail_foot(reader, foot, "offset",
                             "must differ from that of the mirrored foot by 0.5, for all feet, or "
                             "by 0, for all");
        }
    }
    return MILD_OK;
}

/* ---- the whole ---- */

static int optional(const char *key) {
    static const char *const keys[] = {"source", "legs", "shell_spacing"};
    return text_find(key, keys, sizeof keys / sizeof *keys) >= 0;
}

static MildStatus take_robot(DefReader *reader) {
    RobotDef *def = reader->def;
    *def = reader->robot.def;
    for (int k = 0; k < ROBOT_KEYS; k++) {
        const char *key = robot_fields[k].name;
        if (!reader->robot_seen[k] && !optional(key)) {
            return fail_key(reader, "robot", key, "is missing");
        }
    }
    if (def->feet_range[0] > def->feet_range[1] || def->knee_range[0] > def->knee_range[1]) {
        return fail_key(reader, "robot", "feet_range, knee_range", "low is above high");
    }
    def->shells =
        take_names(reader, "robot", "shells", reader->robot.shells, def->shell, ROBOT_SHELLS_MAX);
    def->legs =
        take_names(reader, "robot", "legs", reader->robot.legs, def->leg, ROBOT_CAPSULES_MAX);
    return def->shells < 0 || def->legs < 0 ? reader->status : MILD_OK;
}

static MildStatus take_all(DefReader *reader) {
    if (take_robot(reader) != MILD_OK || take_joints(reader) != MILD_OK) {
        return reader->status;
    }
    if (reader->feet < 1) {
        return reader->status = mild_fail(reader->error, MILD_ERROR_FORMAT,
                                          "%s: no foot; add a section [foot.NAME]", reader->path);
    }
    reader->def->feet = reader->feet;
    for (int f = 0; f < reader->feet; f++) {
        if (take_foot(reader, f) != MILD_OK) {
            return reader->status;
        }
    }
    return check_gait(reader);
}

MildStatus robot_def_parse(const char *text, const char *path, RobotDef *def, MildError *error) {
    DefReader *reader = calloc(1, sizeof *reader);
    if (!reader) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    reader->path = path;
    reader->rest = text;
    reader->def = def;
    reader->error = error;
    reader->robot.def.shell_spacing = 0.03;
    int bad_line = ini_parse_stream(next_line, reader, take_key, reader);
    if (reader->status == MILD_OK && bad_line) {
        reader->line = bad_line;
        fail_line(reader, "neither `key = value` nor `[section]`");
    }
    if (reader->status == MILD_OK) {
        take_all(reader);
    }
    MildStatus status = reader->status;
    free(reader);
    return status;
}

MildStatus robot_def_read(const char *folder, RobotDef *def, MildError *error) {
    char path[PATH_SIZE];
    size_t size = 0;
    MildError cause = {0};
    MildStatus status = path_join(folder, "robot.ini", path, error);
    if (status != MILD_OK) {
        return status;
    }
    char *text = file_read(path, FILE_SIZE_MAX, &size, &cause);
    if (!text) {
        return mild_fail(error, cause.status, "%.350s (a robot is a folder with robot.ini in it)",
                         cause.text);
    }
    status = memchr(text, '\0', size)
                 ? mild_fail(error, MILD_ERROR_FORMAT, "%s: holds binary data", path)
                 : robot_def_parse(text, path, def, error);
    free(text);
    return status;
}
