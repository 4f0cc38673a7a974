/* The numbers of a model: each one spoilt is refused with its name, before anything is simulated. */
#include "robot_kit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "robot/description.h"

static void assert_refused(double *number, double bad, const char *what) {
    MildError error = {0};
    double kept = *number;
    *number = bad;
    MildStatus status = robot_check_model(robot->model, "robot.xml", &error);
    *number = kept;
    if (status != MILD_ERROR_RANGE || !strstr(error.text, what)) {
        fail_msg("%s = %g: %d, '%s'", what, bad, (int)status, error.text);
    }
    assert_non_null(strstr(error.text, "robot.xml"));
}

static void test_every_number(void **state) {
    (void)state;
    mjModel *m = robot->model;
    const int body = robot_foot_body(robot, 1), dof = 6 + 4, joint = 1 + 3;
    const struct {
        const char *what;
        double *number;
        int signless; /* bool: a negative number is fine */
    } numbers[] = {
        {"mass", m->body_mass + body, 0},
        {"inertia", m->body_inertia + 3 * body + 2, 0},
        {"pos", m->body_pos + 3 * body, 1},
        {"quat", m->body_quat + 4 * body, 1},
        {"inertial pos", m->body_ipos + 3 * body, 1},
        {"armature", m->dof_armature + dof, 0},
        {"damping", m->dof_damping + dof, 0},
        {"frictionloss", m->dof_frictionloss + dof, 0},
        {"stiffness", m->jnt_stiffness + joint, 0},
        {"range", m->jnt_range + 2 * joint + 1, 1},
        {"actuatorfrcrange", m->jnt_actfrcrange + 2 * joint, 1},
        {"axis", m->jnt_axis + 3 * joint + 1, 1},
        {"size", m->geom_size, 0},
    };
    const int count = (int)(sizeof numbers / sizeof *numbers);
    MildError error = {0};
    assert_int_equal(robot_check_model(robot->model, "robot.xml", &error), MILD_OK);
    for (int i = 0; i < count; i++) {
        assert_refused(numbers[i].number, NAN, numbers[i].what);
        assert_refused(numbers[i].number, INFINITY, numbers[i].what);
        assert_refused(numbers[i].number, -INFINITY, numbers[i].what);
        if (!numbers[i].signless) {
            assert_refused(numbers[i].number, -0.01, numbers[i].what);
        }
    }
    assert_refused(m->body_mass + body, 0, "mass");
    assert_refused(m->body_inertia + 3 * body, 0, "inertia");
    assert_refused(m->jnt_range + 2 * joint, 9, "range");
    assert_refused(m->jnt_actfrcrange + 2 * joint + 1, -900, "actuatorfrcrange");
    print_message("%d kinds of numbers, each spoilt three or four ways\n", count);
}

/* The same from a file; and a file that would never end. */
static void test_files(void **state) {
    (void)state;
    static const char *const bad[] = {"  nan", "  inf", "-0.04"}; /* as long as what they replace */
    char folder[] = "/tmp/mild_test_check_XXXXXX", path[64], ini[64];
    static char text[65536];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/sa01.xml", folder);
    snprintf(ini, sizeof ini, "%s/robot.ini", folder);
    assert_int_equal(symlink(SA01 "/robot.ini", ini), 0);
    FILE *file = fopen(SA01 "/sa01.xml", "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    char *armature = strstr(text, "armature=\"0.042\"");
    assert_non_null(armature);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        MildError error = {0};
        memcpy(armature + strlen("armature=\""), bad[i], 5);
        file = fopen(path, "w");
        assert_non_null(file);
        fputs(text, file);
        fclose(file);
        assert_null(robot_create(folder, &error));
        print_message("%s\n", error.text);
        assert_true(error.status == MILD_ERROR_RANGE && strstr(error.text, "armature"));
    }
    MildError error = {0};
    unlink(path);
    assert_int_equal(mkfifo(path, 0600), 0);
    alarm(20); /* a reader that waits at the pipe ends the test */
    assert_null(robot_create(folder, &error));
    alarm(0);
    assert_non_null(strstr(error.text, "pipe"));
    unlink(path);
    unlink(ini);
    rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_number),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
