/* The comparisons of kit.h themselves: what counts as named, and what is wrong with an error. */
#include "kit.h"

TEST(whole_words_are_named) {
    const struct {
        const char *text, *names;
        int named;
    } rows[] = {
        {"robot.mass = -1.5 is outside 0 .. 5", "robot.mass", 1},
        {"robot.mass = -1.5 is outside 0 .. 5", "robot.mass -1.5 0 5", 1},
        {"robot.mass = -1.5 is outside 0 .. 5", " 5  robot.mass ", 1}, /* in any order */
        {"robot.mass = -1.5 is outside 0 .. 5", "robot.mass 4", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "robot", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "mass", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "1.5", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "-1", 0},
        {"robot.mass_kg: is missing", "robot.mass", 0},
        {"robot.mass.x, robot.mass2: odd", "robot.mass", 0},
        {"robot.mass2, then robot.mass.", "robot.mass", 1}, /* the second; a sentence's end */
        {"a/robot.ini:3: [foot.l] z: is missing", "robot.ini:3 [foot.l] z", 1},
        {"a/robot.ini:3: [foot.l] z: is missing", "a/robot.ini foot.l", 1},
        {"a/robot.ini:3: [foot.l] z: is missing", "foot", 0},
        {"--forced is no option", "--force", 0},
        {"--force-x is no option", "--force", 0},
        {"give --force or 'depth'", "--force depth", 1},
        {"give --force or 'depth'", "force", 0},
        {"", "x", 0},
        {"x", "x", 1},
        {"x", "xx", 0},
        {"anything", "", 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (kit_named(rows[i].text, rows[i].names) != rows[i].named) {
            fail_msg("'%s' in '%s'", rows[i].names, rows[i].text);
        }
    }
}

TEST(errors_have_faults) {
    const struct {
        MildError error;
        MildStatus status;
        int good;
    } rows[] = {
        {{MILD_ERROR_RANGE, "robot.mass = 9 is outside"}, MILD_ERROR_RANGE, 1},
        {{MILD_ERROR_RANGE, "outside is robot.mass"}, MILD_ERROR_RANGE, 1}, /* any sentence */
        {{MILD_ERROR_RANGE, "robot.mass = 9 is outside"}, MILD_ERROR_FORMAT, 0},
        {{MILD_OK, "robot.mass = 9 is outside"}, MILD_ERROR_RANGE, 0},
        {{MILD_OK, "robot.mass = 9 is outside"}, MILD_OK, 0}, /* no error */
        {{MILD_ERROR_RANGE, "robot.height = 9 is outside"}, MILD_ERROR_RANGE, 0},
        {{MILD_ERROR_RANGE, "robot.mass\nis 9"}, MILD_ERROR_RANGE, 0},
        {{MILD_ERROR_RANGE, "robot.mass is 9\r"}, MILD_ERROR_RANGE, 0},
        {{MILD_ERROR_RANGE, ""}, MILD_ERROR_RANGE, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *fault = kit_error_fault(&rows[i].error, rows[i].status, "robot.mass");
        if ((fault == NULL) != rows[i].good) {
            fail_msg("%zu: %s", i, fault ? fault : "taken");
        }
    }
    const MildError error = {MILD_ERROR_IO, "one line"};
    assert_non_null(kit_error_fault(&error, MILD_ERROR_IO, "")); /* nothing is asked for */
    assert_non_null(kit_error_fault(&error, MILD_ERROR_IO, "  "));
}

TEST(an_error_is_taken_once) {
    MildError error = {0};
    mild_fail(&error, MILD_ERROR_IO, "no file %s", "a.ini");
    assert_error(&error, MILD_ERROR_IO, "a.ini");
    assert_int_equal(error.status, MILD_OK);
    assert_non_null(kit_error_fault(&error, MILD_ERROR_IO, "a.ini"));
}

TEST(cases_are_chosen_by_name) {
    struct CMUnitTest all[KIT_CASES];
    const size_t count = kit_case_count;
    memcpy(all, kit_cases, sizeof all);
    char *names[] = {"errors_have_faults", "whole_words_are_named", "errors_have_faults", "errors"};
    const int found = kit_choose(3, names);
    const size_t kept = kit_case_count;
    const char *first = kit_cases[0].name, *second = kit_cases[1].name;
    memcpy(kit_cases, all, sizeof all); /* which cmocka is reading */
    kit_case_count = count;
    assert_true(found);
    assert_int_equal(kept, 2);
    assert_string_equal(first, "whole_words_are_named");
    assert_string_equal(second, "errors_have_faults");
    assert_false(kit_choose(4, names));
    assert_true(kit_choose(0, names));
    assert_int_equal(kit_case_count, count);
}

TEST_MAIN(NULL, NULL)
