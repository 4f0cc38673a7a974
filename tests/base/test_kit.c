/* The comparisons of kit.h themselves: what counts as named, and what is wrong with an error. */
#include "kit.h"

TEST(whole_words_are_named) {
    const struct {
        const char *text, *names;
        int named;
    } rows[] = {
        {"robot.mass = -1.5 is outside 0 .. 5", "robot.mass -1.5 0 5", 1},
        {"robot.mass = -1.5 is outside 0 .. 5", " 5  robot.mass ", 1}, /* in any order */
        {"robot.mass = -1.5 is outside 0 .. 5", "robot.mass 4", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "robot", 0},
        {"robot.mass = -1.5 is outside 0 .. 5", "1.5", 0},
        {"robot.mass.x, robot.mass2: odd", "robot.mass", 0},
        {"robot.mass2, then robot.mass.", "robot.mass", 1}, /* the second; a sentence's end */
        {"a/robot.ini:3: [foot.l] z: is missing", "robot.ini:3 [foot.l] z", 1},
        {"--force-x is no option", "--force", 0},
        {"give --force or 'depth'", "--force depth", 1},
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
        {{MILD_ERROR_RANGE, "robot.mass = 9 is outside"}, MILD_ERROR_FORMAT, 0},
        {{MILD_OK, "robot.mass = 9 is outside"}, MILD_ERROR_RANGE, 0},
        {{MILD_ERROR_RANGE, "robot.height = 9 is outside"}, MILD_ERROR_RANGE, 0},
        {{MILD_ERROR_RANGE, "robot.mass\nis 9"}, MILD_ERROR_RANGE, 0},
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
}

TEST_MAIN(NULL, NULL)
