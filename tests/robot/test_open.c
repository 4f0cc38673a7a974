/* Robots by name: what is listed, what a name opens, what it says of a name that nobody has. */
#include "robot_kit.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

TEST(test_list) {
    char names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    int count = robot_list(names, ROBOT_LISTED_MAX), found = 0;
    assert_true(count >= 1 && count < ROBOT_LISTED_MAX);
    for (int i = 0; i < count; i++) {
        char ini[5000];
        snprintf(ini, sizeof ini, "%s/robots/%s/robot.ini", MILD_SOURCE_DIR, names[i]);
        assert_int_equal(access(ini, R_OK), 0);
        assert_true(i == 0 || strcmp(names[i - 1], names[i]) < 0);
        found += strcmp(names[i], "sa01") == 0;
    }
    assert_int_equal(found, 1);
    assert_int_equal(robot_list(names, 0), 0);
    assert_int_equal(robot_list(names, 1), 1);
}

TEST(test_open) {
    MildError error = {0};
    Robot *by_name = robot_open("sa01", &error), *by_folder = robot_open(SA01, &error);
    assert_non_null(by_name);
    assert_non_null(by_folder);
    assert_string_equal(robot_name(by_name), "sa01");
    assert_string_equal(robot_name(by_folder), "sa01");
    robot_destroy(by_name);
    robot_destroy(by_folder);
}

static void refuse(const char *name, MildStatus status, const char *names) {
    MildError error = {0};
    assert_null(robot_open(name, &error));
    assert_error(&error, status, names);
}

TEST(test_refused) {
    refuse("sa02", MILD_ERROR_ARGUMENT, "sa02 sa01");
    refuse("sa0", MILD_ERROR_ARGUMENT, "sa0 sa01");
    refuse("", MILD_ERROR_ARGUMENT, "robot");
    refuse("./no/such", MILD_ERROR_IO, "./no/such/robot.ini");
    refuse(".", MILD_ERROR_IO, "./robot.ini");
    robot_destroy(NULL);
}

TEST_MAIN(NULL, NULL)
