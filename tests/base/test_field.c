/* Tables of fields: what is parsed, refused and printed, every message, every type. */
#include <limits.h>

#include "kit.h"
#include "mild/field.h"

typedef struct {
    double before;
    double mass;
    int count[3];
    int flag;
    uint64_t seed;
    char note[6];
    int kind;
    double after;
} Def;

enum { MASS, COUNT, FLAG, SEED, NOTE, KIND, FIELDS };
static const char *const kinds[] = {"sand", "foam45", "foam60"};
static const MildField fields[FIELDS] = {
    MILD_FIELD(Def, mass, MILD_FIELD_DOUBLE, 1, -2, 5, "[kg] of the body"),
    MILD_FIELD(Def, count, MILD_FIELD_INT, 3, 0, 9, "[-] of each"),
    MILD_FIELD(Def, flag, MILD_FIELD_BOOL, 1, 0, 1, "[-] on or off"),
    MILD_FIELD(Def, seed, MILD_FIELD_UINT64, 1, 0, 1.8e19, "[-] of the noise"),
    MILD_FIELD(Def, note, MILD_FIELD_TEXT, 6, 0, 0, "[-] a few letters"),
    MILD_FIELD_CHOICE(Def, kind, kinds, 3, "[-] of ground"),
};

static const Def start = {1, 2, {3, 4, 5}, 1, 6, "seven", 2, 8};

/* Parsing `text` into a copy of `start`. */
static MildStatus parse(int field, const char *text, Def *def, MildError *error) {
    memcpy(def, &start, sizeof *def); /* with its padding */
    *error = (MildError){0};
    return mild_field_parse(&fields[field], def, text, "robot", error);
}

static void check_bad_text(int field, const char *text, MildStatus status, const char *names) {
    Def def;
    MildError error;
    assert_refused(parse(field, text, &def, &error), status, &error, names);
    assert_memory_equal(&def, &start, sizeof def); /* nothing was written */
    assert_int_equal(mild_field_parse(&fields[field], &def, text, "robot", NULL), status);
}

/* Parsed, and printed as `printed`; the fields beside it stay. */
static Def taken(int field, const char *text, const char *printed) {
    Def def;
    MildError error;
    char out[64];
    expect_good(parse(field, text, &def, &error) == MILD_OK, &error);
    assert_int_equal(mild_field_print(&fields[field], &def, out, sizeof out), strlen(printed));
    assert_string_equal(out, printed);
    assert_true(def.before == start.before && def.after == start.after);
    return def;
}

TEST(test_numbers) {
    assert_true(taken(MASS, "-1.5e-1", "-0.15").mass == -0.15);
    assert_true(taken(MASS, " 5 ", "5").mass == 5); /* the bounds belong to the range */
    assert_true(taken(MASS, "-2", "-2").mass == -2);
    assert_true(taken(MASS, "0.1", "0.1").mass == 0.1);
    taken(MASS, "0.30000000000000004", "0.30000000000000004"); /* 17 digits, and it needs them */
    taken(MASS, "3.1415926535897931", "3.141592653589793");
    taken(MASS, "1.2345678", "1.2345678");
    check_bad_text(MASS, "5.0000001", MILD_ERROR_RANGE, "robot.mass 5.0000001 -2 5");
    check_bad_text(MASS, "-2.1", MILD_ERROR_RANGE, "robot.mass -2.1 -2 5");
    check_bad_text(MASS, "inf", MILD_ERROR_RANGE, "robot.mass inf -2 5");
    check_bad_text(MASS, "nan", MILD_ERROR_ARGUMENT, "robot.mass nan");
    check_bad_text(MASS, "1x", MILD_ERROR_ARGUMENT, "robot.mass 1x");
    check_bad_text(MASS, "", MILD_ERROR_ARGUMENT, "robot.mass 0 1");
    check_bad_text(MASS, "1 2", MILD_ERROR_ARGUMENT, "robot.mass 1");
    char word[100], names[200];
    memset(word, '1', sizeof word);
    word[63] = '\0'; /* 63 digits are read, 64 are not */
    check_bad_text(MASS, word, MILD_ERROR_RANGE, "robot.mass 1.11111111e+62 -2 5");
    word[63] = '1';
    word[64] = '\0';
    snprintf(names, sizeof names, "robot.mass %s", word);
    check_bad_text(MASS, word, MILD_ERROR_ARGUMENT, names);
}

TEST(test_integers) {
    static const int wanted[3] = {9, 0, 7};
    Def def = taken(COUNT, "9,0 \t7\n", "9 0 7");
    assert_memory_equal(def.count, wanted, sizeof wanted);
    assert_int_equal(def.flag, start.flag);
    check_bad_text(COUNT, "1 2", MILD_ERROR_ARGUMENT, "robot.count 2 3");
    check_bad_text(COUNT, "1 2 3 4", MILD_ERROR_ARGUMENT, "robot.count 3 4");
    check_bad_text(COUNT, "1 2 10", MILD_ERROR_RANGE, "robot.count 10 0 9");
    check_bad_text(COUNT, "1 -1 3", MILD_ERROR_RANGE, "robot.count -1 0 9");
    check_bad_text(COUNT, "1 2.5 3", MILD_ERROR_ARGUMENT, "robot.count 2.5");
    check_bad_text(COUNT, "4294967297 2 3", MILD_ERROR_ARGUMENT, "robot.count 4294967297");
    check_bad_text(COUNT, "99999999999999999999 2 3", MILD_ERROR_ARGUMENT,
                   "robot.count 99999999999999999999");
    Def seeded = taken(SEED, "10000000000000000001", "10000000000000000001");
    assert_true(seeded.seed == 10000000000000000001u);
    assert_true(taken(SEED, "0x10", "16").seed == 16);
    check_bad_text(SEED, "-1", MILD_ERROR_ARGUMENT, "robot.seed -1");
    check_bad_text(SEED, "18446744073709551615", MILD_ERROR_RANGE,
                   "robot.seed 1.84467441e+19 0 1.8e+19");
    check_bad_text(SEED, "18446744073709551616", MILD_ERROR_ARGUMENT,
                   "robot.seed 18446744073709551616");
}

TEST(test_switches) {
    static const char *const yes[] = {"1", "true", "YES", "On"}, *const no[] = {"0", "False", "no",
                                                                                "OFF"};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(taken(FLAG, yes[i], "true").flag, 1);
        assert_int_equal(taken(FLAG, no[i], "false").flag, 0);
    }
    static const char *const neither[] = {"2", "truth", "tru", "o", "offf", "yes!"};
    for (int i = 0; i < 6; i++) {
        char names[100];
        snprintf(names, sizeof names, "robot.flag %s", neither[i]);
        check_bad_text(FLAG, neither[i], MILD_ERROR_ARGUMENT, names);
    }
}

TEST(test_texts) {
    assert_string_equal(taken(NOTE, "a b,c", "a b,c").note, "a b,c");
    assert_string_equal(taken(NOTE, "", "").note, "");
    check_bad_text(NOTE, "abcdef", MILD_ERROR_RANGE, "robot.note 6 5");
}

TEST(test_names) {
    for (int i = 0; i < 3; i++) {
        assert_int_equal(taken(KIND, kinds[i], kinds[i]).kind, i);
    }
    check_bad_text(KIND, "foam54", MILD_ERROR_ARGUMENT, "robot.kind foam54 foam45");
    check_bad_text(KIND, "foam6", MILD_ERROR_ARGUMENT, "robot.kind foam6 foam60");
    check_bad_text(KIND, "send", MILD_ERROR_ARGUMENT, "robot.kind send sand");
    check_bad_text(KIND, "", MILD_ERROR_ARGUMENT, "robot.kind sand");
}

/* What does not fit is cut, and the whole length returned, as snprintf does. */
TEST(test_cut) {
    char text[16];
    for (size_t size = 0; size <= 8; size++) {
        memset(text, '?', sizeof text);
        assert_int_equal(mild_field_print(&fields[COUNT], &start, text, size), 5);
        char wanted[16] = "3 4 5";
        wanted[size > 0 && size <= 5 ? size - 1 : 5] = '\0';
        assert_true(size == 0 ? text[0] == '?' : strcmp(text, wanted) == 0);
        assert_true(text[size] == '?');
    }
}

TEST(test_check) {
    MildError error = {0};
    assert_int_equal(mild_fields_check(fields, FIELDS, &start, "robot", &error), MILD_OK);
    Def def = start;
    def.mass = NAN;
    assert_refused(mild_fields_check(fields, FIELDS, &def, "robot", &error), MILD_ERROR_RANGE,
                   &error, "robot.mass nan -2 5");
    def = start;
    for (int i = 0; i < 3; i++) {
        def = start;
        def.count[i] = 10 + i;
        def.kind = 3; /* the first in the table's order is reported */
        assert_int_equal(mild_fields_check(fields, FIELDS, &def, "x", &error), MILD_ERROR_RANGE);
        char names[100];
        snprintf(names, sizeof names, "x.count %d 0 9", 10 + i);
        assert_error(&error, MILD_ERROR_RANGE, names);
    }
    def = start;
    def.kind = 3;
    assert_refused(mild_fields_check(fields, FIELDS, &def, "x", &error), MILD_ERROR_RANGE, &error,
                   "x.kind 3 0 2");
    def.kind = -1;
    assert_int_equal(mild_fields_check(fields, FIELDS, &def, "x", &error), MILD_ERROR_RANGE);
    assert_int_equal(mild_fields_check(fields, KIND, &def, "x", &error), MILD_OK);
    def = start;
    memset(def.note, 'n', sizeof def.note);
    def.kind = 0;
    assert_refused(mild_fields_check(fields, FIELDS, &def, "x", &error), MILD_ERROR_RANGE, &error,
                   "x.note 6");
}

TEST(test_find) {
    const char *nearest = "?";
    assert_ptr_equal(mild_field_find(fields, FIELDS, "seed", &nearest), &fields[SEED]);
    assert_string_equal(nearest, "seed");
    assert_ptr_equal(mild_field_find(fields, FIELDS, "mass", NULL), &fields[MASS]);
    assert_null(mild_field_find(fields, FIELDS, "sed", &nearest));
    assert_string_equal(nearest, "seed");
    assert_null(mild_field_find(fields, FIELDS, "cuont", &nearest));
    assert_string_equal(nearest, "count");
    assert_null(mild_field_find(fields, FIELDS, "masses", &nearest));
    assert_string_equal(nearest, "mass");
    assert_null(mild_field_find(fields, FIELDS, "kinds", NULL));
    assert_null(mild_field_find(fields, SEED, "seed", &nearest)); /* not among the first ones */
    assert_null(mild_field_find(fields, 0, "seed", &nearest));
    assert_null(nearest);
    char longer[80];
    memset(longer, 'z', sizeof longer);
    longer[79] = '\0'; /* as far from every name as can be: one is named all the same */
    assert_null(mild_field_find(fields, FIELDS, longer, &nearest));
    assert_string_equal(nearest, "mass");
}

TEST_MAIN(NULL, NULL)
