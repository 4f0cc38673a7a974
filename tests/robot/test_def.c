/* robot.ini as text: every key of a made-up robot comes back, defaults included; what is missing,
 * twice, too much or inconsistent is refused with the line or the key in the message. And robots by
 * name. */
#include <sys/stat.h>
#include <unistd.h>

#include "files.h"
#include "robot/def.h"
#include "robot/robot.h"
#include "sa01.h"

/* Two flat feet that alternate; numbers all different. Keys with defaults are left out of it. */
static const char plain[] = "; a comment\n"
                            "# another\n"
                            "[robot]\n"
                            "name = walker\n"
                            "model = walker.xml\n"
                            "base = torso\n"
                            "shells = chest, hip_box\n"
                            "height = 0.7 ; [m]\n"
                            "action_scale = 0.25\n"
                            "feet_range = 0.11 0.31\n"
                            "knee_range = 0.12 0.32\n"
                            "feet_least = 0.09\n"
                            "knee_least = 0.08\n"
                            "foot_force = 450\n"
                            "assist = 301 31 101 32\n"
                            "[joints]\n"
                            "names = a\n"
                            "  b\tc, d\n"
                            "mirror = b a\n"
                            "\td c\n"
                            "mirror_sign = -1 -1 1 1\n"
                            "pose = 0.1 0.2 -0.3 0.4\n"
                            "kp = 11 12 13 14\n"
                            "kd = 1.1 1.2 1.3 1.4\n"
                            "[foot.l]\n"
                            "body = lf\n"
                            "knee = lk\n"
                            "mirror = r\n"
                            "offset = 0.25\n"
                            "shape = outline\n"
                            "outline = 0 0 1 0 1 2\n"
                            "z = -0.05\n"
                            "corners = 1 2 3 4 5 6\n"
                            "[foot.r]\n"
                            "body = rf\n"
                            "knee = rk\n"
                            "mirror = l\n"
                            "offset = 0.75\n"
                            "shape = round\n"
                            "center = 0.7 0.8 0.9\n"
                            "radius = 0.02\n";

static char edited[1 << 16];

/* `plain` with the first `from` written as `to`. */
static const char *edit(const char *from, const char *to) {
    const char *at = strstr(plain, from);
    assert_non_null(at);
    snprintf(edited, sizeof edited, "%.*s%s%s", (int)(at - plain), plain, to, at + strlen(from));
    return edited;
}

static RobotDef accept(const char *text) {
    static RobotDef def;
    MildError error = {0};
    memset(&def, 0x55, sizeof def); /* nothing may be left of it */
    if (robot_def_parse(text, "dir/robot.ini", &def, &error) != MILD_OK) {
        fail_msg("refused: %s", error.text);
    }
    return def;
}

static void refuse_as(MildStatus status, const char *text, const char *names) {
    static RobotDef def;
    MildError error = {0};
    assert_int_equal(robot_def_parse(text, "dir/robot.ini", &def, &error), status);
    assert_names(error.text, "dir/robot.ini");
    assert_error(&error, status, names);
}

static void refuse_text(const char *text, const char *names) {
    refuse_as(MILD_ERROR_FORMAT, text, names);
}

static void refuse(const char *from, const char *to, const char *names) {
    refuse_text(edit(from, to), names);
}

static void expect_numbers(const char *what, const double *got, int count, const double *wanted) {
    for (int i = 0; i < count; i++) {
        if (got[i] != wanted[i]) {
            fail_msg("%s[%d]: %g instead of %g", what, i, got[i], wanted[i]);
        }
    }
}

TEST(test_robot_keys) {
    RobotDef def = accept(plain);
    assert_string_equal(def.name, "walker");
    assert_string_equal(def.model, "walker.xml");
    assert_string_equal(def.base, "torso");
    assert_string_equal(def.source, "");
    assert_int_equal(def.shells, 2);
    assert_string_equal(def.shell[0], "chest");
    assert_string_equal(def.shell[1], "hip_box");
    const double numbers[] = {0.7, 0.25, 0.11, 0.31, 0.12, 0.32, 0.09, 0.08, 450, 301, 31, 101, 32};
    const double got[] = {def.height,        def.action_scale,  def.feet_range[0],
                          def.feet_range[1], def.knee_range[0], def.knee_range[1],
                          def.feet_least,    def.knee_least,    def.foot_force,
                          def.assist[0],     def.assist[1],     def.assist[2],
                          def.assist[3]};
    expect_numbers("[robot]", got, 13, numbers);
    assert_true(def.mirror_shift == 0.5);
    assert_int_equal(def.feet, 2);
    def = accept(edit("base =", "source = somebody, CC0\nbase ="));
    assert_string_equal(def.source, "somebody, CC0");
}

TEST(test_joint_keys) {
    RobotDef def = accept(plain);
    const char *const names[] = {"a", "b", "c", "d"}, *const mirrors[] = {"b", "a", "d", "c"};
    const double sign[] = {-1, -1, 1, 1}, pose[] = {0.1, 0.2, -0.3, 0.4}, zero[4] = {0};
    const double kp[] = {11, 12, 13, 14}, kd[] = {1.1, 1.2, 1.3, 1.4};
    assert_int_equal(def.joints, 4);
    for (int i = 0; i < 4; i++) {
        assert_string_equal(def.joint[i], names[i]);
        assert_string_equal(def.mirror[i], mirrors[i]);
    }
    expect_numbers("mirror_sign", def.mirror_sign, 4, sign);
    expect_numbers("pose", def.pose, 4, pose);
    expect_numbers("kp", def.kp, 4, kp);
    expect_numbers("kd", def.kd, 4, kd);
    expect_numbers("stand_kp", def.stand_kp, 4, kp); /* defaults */
    expect_numbers("stand_kd", def.stand_kd, 4, kd);
    expect_numbers("effort", def.effort, 4, zero);
    expect_numbers("speed", def.speed, 4, zero);
    expect_numbers("full_speed", def.full_speed, 4, zero);
    expect_numbers("swing", def.swing, 4, zero);
    expect_numbers("still", def.still, 4, zero);
    assert_int_equal(def.driven, 0);
    def = accept(edit(
        "kd =", "stand_kp = 21 22 23 24\nstand_kd = 0.1 0.2 0.3 0.4\n"
                "effort = 31 32 33 34\nspeed = 1 2 3 4\nfull_speed = 1 0 2 3\nswing = -1 2 -1 0\n"
                "still = 1 0 1 0\nkd ="));
    const double columns[7][4] = {{21, 22, 23, 24}, {0.1, 0.2, 0.3, 0.4}, {31, 32, 33, 34},
                                  {1, 2, 3, 4},     {1, 0, 2, 3},         {-1, 2, -1, 0},
                                  {1, 0, 1, 0}};
    const double *got[7] = {def.stand_kp,   def.stand_kd, def.effort, def.speed,
                            def.full_speed, def.swing,    def.still};
    for (int k = 0; k < 7; k++) {
        expect_numbers("column", got[k], 4, columns[k]);
    }
    expect_numbers("kd", def.kd, 4, kd);
}

TEST(test_driven) {
    assert_int_equal(accept(edit("kd =", "driven = 0 0 1 1\nkd =")).driven, 2);
    refuse("kd =", "driven = 1 1 0 0\nkd =", "[joints] driven 1 last");
    refuse("kd =", "driven = 0 0 0 1\nkd =", "[joints] driven mirrored");
    refuse("kd =", "driven = 0 0 0.5 0.5\nkd =", "[joints] driven 0 or 1");
    refuse("kd =", "driven = 1 1 1 1\nkd =", "[joints] driven no joint is left to the policy");
}

TEST(test_foot_keys) {
    RobotDef def = accept(plain);
    const RobotFootDef *l = &def.foot[0], *r = &def.foot[1];
    assert_string_equal(l->name, "l");
    assert_string_equal(l->body, "lf");
    assert_string_equal(l->knee, "lk");
    assert_string_equal(l->mirror, "r");
    assert_string_equal(l->ankle, "");
    assert_int_equal(l->shape, ROBOT_SOLE_OUTLINE);
    assert_true(l->offset == 0.25 && l->z == -0.05);
    const double outline[] = {0, 0, 1, 0, 1, 2}, corners[] = {1, 2, 3, 4, 5, 6};
    const double center[] = {0.7, 0.8, 0.9};
    assert_int_equal(l->outline_points, 3);
    expect_numbers("outline", l->outline, 6, outline);
    assert_int_equal(l->corner_count, 2);
    expect_numbers("corners", l->corners, 6, corners);
    assert_true(l->pitch == 0.0195 && l->corner_radius == 0.005 && l->elements == 0);
    assert_string_equal(r->name, "r");
    assert_string_equal(r->body, "rf");
    assert_int_equal(r->shape, ROBOT_SOLE_ROUND);
    assert_true(r->offset == 0.75 && r->radius == 0.02 && r->pitch == 0.0195);
    expect_numbers("center", r->center, 3, center);
    assert_int_equal(r->corner_count, 1); /* its own sphere */
    expect_numbers("corner", r->corners, 3, center);
    assert_true(r->corner_radius == 0.02);
    def = accept(edit("z =", "ankle = c\npitch = 0.03\nelements = 12\ncorner_radius = 0.007\nz ="));
    assert_string_equal(l->ankle, "c");
    assert_true(l->pitch == 0.03 && l->elements == 12 && l->corner_radius == 0.007);
    def = accept(edit("offset = 0.25", "offset = 0.75"));
    assert_true(def.mirror_shift == 0);
}

TEST(test_reading) {
    accept(edit("height = 0.7 ; [m]\n", "height = 0.7\t# [m]\r\n\n   \r"));
    accept(edit("[joints]\n", "[joints] ; of all\n"));
    refuse("[robot]", "[robots]", "dir/robot.ini:3 [robots] [robot] [joints]");
    refuse("[foot.r]", "[feet.r]", "dir/robot.ini:34 [feet.r]");
    refuse("[foot.r]", "[foot.]", "dir/robot.ini:34 [foot.]");
    refuse("[foot.r]", "[foot.r", "dir/robot.ini:34");
    refuse("height", "heihgt", "dir/robot.ini:8 [robot] heihgt height");
    refuse("height = 0.7", "height", "dir/robot.ini:8");
    refuse_as(MILD_ERROR_ARGUMENT, edit("height = 0.7", "height = tall"),
              "dir/robot.ini:8 robot.height tall");
    refuse_as(MILD_ERROR_RANGE, edit("height = 0.7", "height = 6"),
              "dir/robot.ini:8 robot.height 6");
    refuse_as(MILD_ERROR_RANGE, edit("height = 0.7", "height = 0.001"),
              "dir/robot.ini:8 robot.height 0.001");
    refuse("[joints]\n", "height = 0.8\n[joints]\n", "dir/robot.ini:16 [robot] height 8");
    refuse("height = 0.7 ; [m]\n", "height = 0.7\n  0.8\n", "dir/robot.ini:9");
    refuse("[robot]\n", "key = 1\n[robot]\n", "dir/robot.ini:3");
    refuse_text("", "[robot] name");
}

/* With the last number of a line, which begins with `line`, at its least and at its greatest it is
 * accepted; a little less and a little more are refused with the `names`. */
static void expect_range(const char *from, const char *line, double least, double greatest,
                         const char *names) {
    char to[128];
    for (int k = 0; k < 4; k++) {
        const double beyond = 1e-6 * fmax(fabs(least), 1e-3);
        const double numbers[] = {least, greatest, least - beyond, greatest * (1 + 1e-6)};
        snprintf(to, sizeof to, "%s %.9g\n", line, numbers[k]);
        if (k < 2) {
            accept(edit(from, to));
        } else {
            refuse_as(MILD_ERROR_RANGE, edit(from, to), names);
        }
    }
}

TEST(test_ranges) {
    expect_range("height = 0.7 ; [m]\n", "height =", 0.01, 5, "robot.height");
    expect_range("action_scale = 0.25\n", "action_scale =", 0.01, 2, "robot.action_scale");
    expect_range("feet_range = 0.11 0.31\n", "feet_range = 0", 0, 5, "robot.feet_range");
    expect_range("knee_range = 0.12 0.32\n", "knee_range = 0", 0, 5, "robot.knee_range");
    expect_range("feet_least = 0.09\n", "feet_least =", 0, 5, "robot.feet_least");
    expect_range("knee_least = 0.08\n", "knee_least =", 0, 5, "robot.knee_least");
    expect_range("foot_force = 450\n", "foot_force =", 0.1, 1e6, "robot.foot_force");
    expect_range("assist = 301 31 101 32\n", "assist = 0 0 0", 0, 1e6, "robot.assist");
    expect_range("center = 0.7 0.8 0.9\n", "center = 0 0", -5, 5, "foot.r.center");
    expect_range("z = -0.05\n", "z =", -5, 5, "foot.l.z");
    expect_range("radius = 0.02\n", "radius =", 1e-4, 1, "foot.r.radius");
    expect_range("z = -0.05\n", "z = -0.05\npitch =", 1e-4, 1, "foot.l.pitch");
    expect_range("z = -0.05\n", "z = -0.05\ncorner_radius =", 1e-5, 1, "foot.l.corner_radius");
    accept(edit("z = -0.05", "z = -0.05\nelements = 65536"));
    static const char *const refused[][3] = {
        {"assist = 301 31 101 32", "assist = -0.001 0 0 0", "robot.assist -0.001"},
        {"center = 0.7 0.8 0.9", "center = -5.001 0 5", "foot.r.center -5.001"},
        {"offset = 0.25", "offset = -0.001", "foot.l.offset -0.001"},
        {"offset = 0.25", "offset = 1.001", "foot.l.offset 1.001"},
        {"z = -0.05", "z = -0.05\nelements = 65537", "foot.l.elements 65537"},
        {"z = -0.05", "z = -0.05\nelements = -1", "foot.l.elements -1"}};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        refuse_as(MILD_ERROR_RANGE, edit(refused[i][0], refused[i][1]), refused[i][2]);
    }
    refuse_as(MILD_ERROR_ARGUMENT, edit("assist = 301 31 101 32", "assist = 1 2 3"),
              "dir/robot.ini:15 robot.assist 3 4");
}

/* Each key of [robot] but `source` is needed. */
TEST(test_missing) {
    static const char *const robot[] = {"name",       "model",        "base",       "shells",
                                        "height",     "action_scale", "feet_range", "knee_range",
                                        "feet_least", "knee_least",   "foot_force", "assist"};
    for (size_t i = 0; i < sizeof robot / sizeof *robot; i++) {
        char line[64], names[64];
        snprintf(line, sizeof line, "\n%s = ", robot[i]);
        snprintf(names, sizeof names, "[robot] %s", robot[i]);
        refuse(line, "\n; = ", names);
    }
    static const char *const foot[][2] = {{"body = rf\n", "[foot.r] body"},
                                          {"knee = rk\n", "[foot.r] knee"},
                                          {"mirror = l\n", "[foot.r] mirror"},
                                          {"offset = 0.75\n", "[foot.r] offset"},
                                          {"shape = round\n", "[foot.r] shape"}};
    for (int i = 0; i < 5; i++) {
        refuse(foot[i][0], "", foot[i][1]);
    }
    const char *feet = strstr(plain, "[foot.l]");
    snprintf(edited, sizeof edited, "%.*s", (int)(feet - plain), plain);
    refuse_text(edited, "foot [foot.NAME]");
}

TEST(test_joints_refused) {
    refuse("names = a\n  b\tc, d\n", "", "[joints] names");
    refuse("  b\tc, d\n", "  b c a\n", "[joints] names a");
    refuse("\td c\n", "\td\n", "[joints] mirror");
    refuse("\td c\n", "\te c\n", "[joints] mirror e");
    RobotDef def = accept(edit("\td c\n", "\tc d\n")); /* in the middle plane: their own images */
    assert_string_equal(def.mirror[2], "c");
    refuse("mirror = b a\n\td c\n", "mirror = b c d a\n", "[joints] mirror a b c");
    refuse("-1 -1 1 1", "-1 1 1 1", "[joints] mirror_sign 1 -1 a b");
    refuse("-1 -1 1 1", "-1 -1 0.5 0.5", "[joints] mirror_sign 1 -1 c d");
    refuse("mirror_sign = -1 -1 1 1\n", "", "[joints] mirror_sign 0 4");
    refuse("pose = 0.1 0.2 -0.3 0.4\n", "", "[joints] pose 0 4");
    refuse("kp = 11", "kp = 10 11", "[joints] kp 5 4");
    refuse("kp = 11", "kp = -0.1", "[joints] kp -0.1 a 0");
    refuse("kp =", "stand_kp = 1 1 1 -1\nkp =", "[joints] stand_kp -1 d 0");
    refuse("kp =", "speed = 1 1 1 -1\nkp =", "[joints] speed -1 d 0");
    refuse("kp =", "speed = 1 1 1 1\nfull_speed = 1 1 1 1.1\nkp =", "[joints] full_speed above");
    refuse("kp = 11", "kp = 11x", "[joints] kp 11x");
    refuse("kp = 11", "kp = nan", "[joints] kp nan");
    refuse("kp = 11", "kp = 1000001", "[joints] kp 1000001");
    accept(edit("kp = 11", "kp = 1e6"));
    refuse("feet_range = 0.11 0.31", "feet_range = 0.32 0.31", "[robot] feet_range knee_range");
    refuse("knee_range = 0.12 0.32", "knee_range = 0.33 0.32", "[robot] feet_range knee_range");
    accept(edit("feet_range = 0.11 0.31", "feet_range = 0.31 0.31"));
}

TEST(test_feet_refused) {
    refuse("offset = 0.75", "offset = 1", "[foot.r] offset 1");
    refuse("offset = 0.75", "offset = 0.7", "[foot.l] offset 0.5 0");
    refuse("z = -0.05", "z = -0.05\nankle = e", "[foot.l] ankle [joints]");
    accept(edit("z = -0.05", "z = -0.05\nankle = a"));
    refuse("z = -0.05\n", "", "[foot.l] z");
    refuse("outline = 0 0 1 0 1 2\n", "", "[foot.l] outline");
    refuse("corners = 1 2 3 4 5 6\n", "", "[foot.l] corners");
    refuse("z = -0.05", "z = -0.05\nradius = 0.1", "[foot.l] radius");
    refuse("z = -0.05", "z = -0.05\ncenter = 0 0 0", "[foot.l] center");
    refuse("radius = 0.02\n", "", "[foot.r] radius");
    refuse("center = 0.7 0.8 0.9\n", "", "[foot.r] center");
    static const char *const flat[] = {"outline = 0 0 1 0 1 1", "z = 0", "corners = 0 0 0",
                                       "corner_radius = 0.01", "ankle = a"};
    for (int i = 0; i < 5; i++) {
        char text[64], names[64];
        snprintf(text, sizeof text, "radius = 0.02\n%s", flat[i]);
        snprintf(names, sizeof names, "[foot.r] %.*s", (int)strcspn(flat[i], " "), flat[i]);
        refuse("radius = 0.02", text, names);
    }
    refuse("outline = 0 0 1 0 1 2", "outline = 0 0 1 0", "[foot.l] outline");
    refuse("outline = 0 0 1 0 1 2", "outline = 0 0 1 0 1 y", "[foot.l] outline y");
    refuse("corners = 1 2 3 4 5 6", "corners = 1 2 3 4 5", "[foot.l] corners");
    accept(edit("corners = 1 2 3 4 5 6", "corners = 1 2 3"));
    refuse("mirror = r", "mirror = x", "[foot.l] mirror");
    refuse("mirror = r", "mirror = l", "[foot.r] mirror");
    refuse_as(MILD_ERROR_ARGUMENT, edit("shape = round", "shape = square"),
              "dir/robot.ini:39 foot.r.shape square round");
}

/* The longest name of a foot comes back whole; one more character is refused, not cut: two feet
 * that differ at its end would be one. */
TEST(test_long_names) {
    const char *const name = "a23456789_123456789_123456789_123456789_1234";
    char section[64];
    snprintf(section, sizeof section, "[foot.%s]\n", name);
    const char *text =
        edit("mirror = r\n", "mirror = a23456789_123456789_123456789_123456789_1234\n");
    static char whole[sizeof edited];
    const char *at = strstr(text, "[foot.r]\n");
    snprintf(whole, sizeof whole, "%.*s%s%s", (int)(at - text), text, section, at + 9);
    const RobotDef def = accept(whole);
    assert_string_equal(def.foot[1].name, name);
    refuse("[foot.r]", "[foot.a23456789_123456789_123456789_123456789_12345]",
           "dir/robot.ini:34 [foot.a23456789_12345...] 50 49");
}

/* All feet must agree whether the mirror image of the gait is half a cycle later. */
TEST(test_gaits_that_disagree) {
    const char *one = strstr(plain, "[foot.l]");
    char head[4096];
    snprintf(head, sizeof head, "%.*s", (int)(one - plain), plain);
    for (int agree = 0; agree < 2; agree++) {
        int length = snprintf(edited, sizeof edited, "%s", head);
        const char *const names[] = {"a", "b", "c", "d"}, *const mirrors[] = {"b", "a", "d", "c"};
        const double offsets[2][4] = {{0, 0.5, 0.25, 0.25}, {0, 0.5, 0.5, 0}};
        for (int f = 0; f < 4; f++) {
            length += snprintf(edited + length, sizeof edited - (size_t)length,
                               "[foot.%s]\nbody = b\nknee = k\nmirror = %s\noffset = %g\n"
                               "shape = round\ncenter = 0 0 0\nradius = 0.1\n",
                               names[f], mirrors[f], offsets[agree][f]);
        }
        if (agree) {
            RobotDef def = accept(edited);
            assert_int_equal(def.feet, 4);
            assert_true(def.mirror_shift == 0.5);
            strcat(edited, "[foot.e]\n");
            refuse_text(edited, "[foot.e] 4");
        } else {
            refuse_text(edited, "[foot.c] offset 0.5 0");
        }
    }
}

/* ---- sizes ---- */

/* "n0 n1 ..." */
static void list_names(char *text, size_t size, int count, int width) {
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        used += (size_t)snprintf(text + used, size - used, "%*sn%0*d%s", 0, "", width, i,
                                 i % 10 == 9 ? "\n  " : " ");
    }
}

static void list_numbers(char *text, size_t size, int count, const char *number) {
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        used +=
            (size_t)snprintf(text + used, size - used, "%s%s", number, i % 10 == 9 ? "\n  " : " ");
    }
}

/* `plain` with the line `from` as a list of a key. */
static const char *edit_list(const char *from, const char *key, const char *list) {
    static char line[8000];
    snprintf(line, sizeof line, "%s = %s\n", key, list);
    return edit(from, line);
}

/* A robot of `joints` joints, each its own mirror image. */
TEST(test_joints_that_fit) {
    const char *from = strstr(plain, "[joints]"), *to = strstr(plain, "[foot.l]");
    char names[4000], ones[1000];
    static const int counts[] = {1, 40, 41};
    for (int k = 0; k < 3; k++) {
        int joints = counts[k];
        list_names(names, sizeof names, joints, 3);
        list_numbers(ones, sizeof ones, joints, "1");
        snprintf(edited, sizeof edited,
                 "%.*s[joints]\nnames = %s\nmirror = %s\nmirror_sign = %s\npose = %s\nkp = %s\n"
                 "kd = %s\n%s",
                 (int)(from - plain), plain, names, names, ones, ones, ones, ones, to);
        if (joints <= 40) {
            RobotDef def = accept(edited);
            assert_int_equal(def.joints, joints);
            assert_string_equal(def.joint[joints - 1], k ? "n039" : "n000");
            assert_true(def.stand_kd[joints - 1] == 1);
        } else {
            refuse_text(edited, "[joints] names 40 63");
        }
    }
    list_numbers(ones, sizeof ones, 41, "1");
    refuse_text(edit_list("kp = 11 12 13 14\n", "kp", ones), "[joints] kp 40");
}

TEST(test_lists_that_fit) {
    static const char shells[] = "shells = chest, hip_box\n", outline[] = "outline = 0 0 1 0 1 2\n",
                      corners[] = "corners = 1 2 3 4 5 6\n";
    char list[7000];
    list_names(list, sizeof list, 32, 3);
    assert_int_equal(accept(edit_list(shells, "shells", list)).shells, 32);
    list_names(list, sizeof list, 33, 3);
    refuse_text(edit_list(shells, "shells", list), "[robot] shells 32 63");
    list_names(list, sizeof list, 1, 62); /* n and 62 digits */
    assert_int_equal(strlen(accept(edit_list(shells, "shells", list)).shell[0]), 63);
    list_names(list, sizeof list, 1, 63);
    refuse_text(edit_list(shells, "shells", list), "[robot] shells 32 63");
    list_numbers(list, sizeof list, 256, "1");
    assert_int_equal(accept(edit_list(outline, "outline", list)).foot[0].outline_points, 128);
    list_numbers(list, sizeof list, 258, "1");
    refuse_text(edit_list(outline, "outline", list), "[foot.l] outline 256");
    list_numbers(list, sizeof list, 48, "1");
    const RobotDef many = accept(edit_list(corners, "corners", list));
    assert_int_equal(many.foot[0].corner_count, 16);
    assert_true(many.foot[0].corners[47] == 1 && many.foot[0].corner_radius == 0.005);
    list_numbers(list, sizeof list, 51, "1");
    refuse_text(edit_list(corners, "corners", list), "[foot.l] corners 48");
    list_numbers(list, sizeof list, 300, "0.12345678901234");
    refuse_text(edit_list(outline, "outline", list), "dir/robot.ini:55");
    memset(list, '1', sizeof list);
    list[4000] = '\0';
    refuse_text(edit_list("height = 0.7 ; [m]\n", "height", list), "dir/robot.ini:8");
    list[63] = '\0';
    refuse_text(edit_list("kp = 11 12 13 14\n", "kp", list), "[joints] kp"); /* 1e62 */
}

/* ---- files ---- */

static void refuse_folder(const char *folder, MildStatus status, const char *names) {
    static RobotDef def;
    MildError error = {0};
    assert_refused(robot_def_read(folder, &def, &error), status, &error, names);
}

TEST(test_files) {
    char folder[] = "/tmp/mild_robot_XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/robot.ini", folder);
    refuse_folder(folder, MILD_ERROR_IO, path);
    kit_write(path, plain, sizeof plain - 1);
    static RobotDef def;
    assert_int_equal(robot_def_read(folder, &def, NULL), MILD_OK);
    assert_string_equal(def.name, "walker");
    kit_write(path, plain, sizeof plain); /* with its final zero byte */
    refuse_folder(folder, MILD_ERROR_FORMAT, path);
    size_t size = (1 << 20) + 1;
    char *large = malloc(size);
    assert_non_null(large);
    memset(large, '\n', size);
    memcpy(large, plain, sizeof plain - 1);
    kit_write(path, large, size);
    refuse_folder(folder, MILD_ERROR_FORMAT, path);
    kit_write(path, large, size - 1);
    assert_int_equal(robot_def_read(folder, &def, NULL), MILD_OK);
    free(large);
    unlink(path);
    assert_int_equal(mkdir(path, 0700), 0);
    refuse_folder(folder, MILD_ERROR_IO, path);
    rmdir(path);
    rmdir(folder);
    char deep[1100];
    memset(deep, 'x', sizeof deep);
    deep[1013] = '\0'; /* with /robot.ini 1023 characters */
    char cut[201];
    snprintf(cut, sizeof cut, "%.200s", deep);
    refuse_folder(deep, MILD_ERROR_IO, cut); /* and the reason behind it */
    deep[1013] = 'x';
    deep[1014] = '\0';
    refuse_folder(deep, MILD_ERROR_ARGUMENT, "path robot.ini");
}

/* ---- robots by name ---- */

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

static void refuse_name(const char *name, MildStatus status, const char *names) {
    MildError error = {0};
    assert_null(robot_open(name, &error));
    assert_error(&error, status, names);
}

TEST(test_names_refused) {
    refuse_name("sa02", MILD_ERROR_ARGUMENT, "sa02 sa01");
    refuse_name("sa0", MILD_ERROR_ARGUMENT, "sa0 sa01");
    refuse_name("", MILD_ERROR_ARGUMENT, "robot");
    refuse_name("./no/such", MILD_ERROR_IO, "./no/such/robot.ini");
    refuse_name(".", MILD_ERROR_IO, "./robot.ini");
    robot_destroy(NULL);
}

TEST_MAIN(NULL, NULL)
