/* The widest robot that fits, made for tests: a trunk on four legs of ten hinges with round feet,
 * that stand a quarter of the gait cycle apart. */
#ifndef TESTS_WIDEST_H
#define TESTS_WIDEST_H

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "robot/robot.h"

enum { WIDEST_LEGS = ROBOT_FEET_MAX, WIDEST_HINGES = ROBOT_JOINTS_MAX / ROBOT_FEET_MAX };

static const double widest_offset[WIDEST_LEGS] = {0, 0.5, 0.25, 0.75}; /* [-] of the gait cycle */

static char widest_folder[] = "/tmp/mild_widest_XXXXXX";
static char widest_paths[2][64];

static inline void widest_write_leg(FILE *file, int leg) {
    for (int i = 0; i < WIDEST_HINGES; i++) {
        fprintf(file,
                "<body name='b%d%d' pos='%g %g %g'><joint name='j%d%d' axis='%d %d 0'/>"
                "<geom type='capsule' size='0.02 0.02' mass='0.3' pos='0 0 -0.03'/>\n",
                leg, i, i ? 0.0 : leg / 2 - 0.5, i ? 0.0 : 0.2 - 0.4 * (leg % 2), i ? -0.06 : 0.0,
                leg, i, i == 0, i != 0);
    }
    for (int i = 0; i < WIDEST_HINGES; i++) {
        fputs("</body>", file);
    }
}

static inline void widest_write_mjcf(const char *path) {
    FILE *file = fopen(path, "wb");
    fputs("<mujoco><compiler angle='radian' autolimits='true'/><default>"
          "<joint range='-1 1' actuatorfrcrange='-40 40' armature='0.02'/>"
          "</default><worldbody><body name='torso' pos='0 0 1'><freejoint/>"
          "<geom name='trunk' type='box' size='0.5 0.2 0.1' mass='12'/>\n",
          file);
    for (int leg = 0; leg < WIDEST_LEGS; leg++) {
        widest_write_leg(file, leg);
    }
    fputs("</body></worldbody></mujoco>\n", file);
    fclose(file);
}

/* One value per joint, a leg a line. */
static inline void widest_write_list(FILE *file, const char *key, const char *first,
                                     const char *others) {
    fprintf(file, "%s =", key);
    for (int i = 0; i < WIDEST_LEGS * WIDEST_HINGES; i++) {
        fprintf(file, "%s %s", i && i % WIDEST_HINGES == 0 ? "\n " : "",
                i % WIDEST_HINGES ? others : first);
    }
    fputc('\n', file);
}

static inline void widest_write_names(FILE *file, const char *key, int other_side) {
    fprintf(file, "%s =", key);
    for (int i = 0; i < WIDEST_LEGS * WIDEST_HINGES; i++) {
        fprintf(file, "%s j%d%d", i && i % WIDEST_HINGES == 0 ? "\n " : "",
                (i / WIDEST_HINGES) ^ other_side, i % WIDEST_HINGES);
    }
    fputc('\n', file);
}

static inline void widest_write_ini(const char *path) {
    FILE *file = fopen(path, "wb");
    fputs("[robot]\nname = widest\nmodel = widest.xml\nbase = torso\nshells = trunk\n"
          "height = 0.6\naction_scale = 0.1\nfeet_range = 0.2 0.5\nknee_range = 0.2 0.5\n"
          "feet_least = 0.1\nknee_least = 0.1\nfoot_force = 200\nassist = 100 10 50 20\n[joints]\n",
          file);
    widest_write_names(file, "names", 0);
    widest_write_names(file, "mirror", 1);
    widest_write_list(file, "mirror_sign", "-1", "1");
    widest_write_list(file, "pose", "0", "0");
    widest_write_list(file, "swing", "-1", "0.5");
    widest_write_list(file, "kp", "60", "60");
    widest_write_list(file, "kd", "2", "2");
    for (int leg = 0; leg < WIDEST_LEGS; leg++) {
        fprintf(file,
                "[foot.f%d]\nbody = b%d9\nknee = b%d5\nmirror = f%d\noffset = %g\nshape = round\n"
                "center = 0 0 -0.06\nradius = 0.03\npitch = 0.01\n",
                leg, leg, leg, leg ^ 1, widest_offset[leg]);
    }
    fclose(file);
}

/* NULL with a message. To be followed by widest_close, whatever came of it. */
static inline Robot *widest_open(MildError *error) {
    if (!mkdtemp(widest_folder)) {
        return NULL;
    }
    snprintf(widest_paths[0], sizeof widest_paths[0], "%s/widest.xml", widest_folder);
    snprintf(widest_paths[1], sizeof widest_paths[1], "%s/robot.ini", widest_folder);
    widest_write_mjcf(widest_paths[0]);
    widest_write_ini(widest_paths[1]);
    return robot_create(widest_folder, error);
}

static inline int widest_close(Robot *widest) {
    robot_destroy(widest);
    unlink(widest_paths[0]);
    unlink(widest_paths[1]);
    return rmdir(widest_folder);
}

#endif
