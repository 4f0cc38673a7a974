#include "view/sketch.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "view/relief.h"

#define CELL 0.02        /* [m] vertices of the ground */
#define WIDTH 1.0        /* [m] of the ground to each side */
#define STRIP 12         /* to each side of the base: imprints so many steps beside it are drawn */
#define STRIP_STEP 0.025 /* [m] */
#define LEAD 0.3         /* share of the width behind the robot */
#define ROUND 12         /* points of a circle */
#define POINTS_MAX (2 * ROUND)
#define CHARACTER 3 /* [B] of a Braille character */

struct Sketch {
    SketchDef def;
    const Robot *robot;
    mjData *data;
    Relief *relief;
    int width, height;   /* dots */
    double left, bottom; /* [m] of the picture */
    unsigned char *dots; /* [height][width] */
    int *low, *high;     /* [height] columns that a shape covers */
    char *text;
};

SketchDef sketch_def_default(void) {
    return (SketchDef){
        .columns = 76, .rows = 18, .dots = 46, .depth = 0.25, .rigid = 0, .x_min = -2, .x_max = 10};
}

Sketch *sketch_create(const SketchDef *def, const Robot *robot, const MildTerrain *terrain,
                      MildError *error) {
    Sketch *sketch = calloc(1, sizeof *sketch);
    if (!sketch) {
        mild_fail(error, MILD_ERROR_MEMORY, "picture: out of memory");
        return NULL;
    }
    sketch->def = *def;
    sketch->robot = robot;
    sketch->width = 2 * def->columns, sketch->height = 4 * def->rows;
    const size_t height = (size_t)sketch->height;
    sketch->dots = calloc(height, (size_t)sketch->width);
    sketch->low = calloc(height, sizeof *sketch->low);
    sketch->high = calloc(height, sizeof *sketch->high);
    sketch->text = calloc((size_t)def->rows * ((size_t)def->columns * CHARACTER + 1) + 1, 1);
    sketch->data = mj_makeData(robot_visual_model(robot));
    const ReliefDef ground = {def->x_min, def->x_max, -WIDTH, WIDTH, CELL, def->rigid, NULL, 1};
    sketch->relief =
        relief_create(&ground, terrain, robot_rasters(robot), robot_feet(robot), error);
    if (!sketch->dots || !sketch->low || !sketch->high || !sketch->text || !sketch->data) {
        mild_fail(error, MILD_ERROR_MEMORY, "picture: out of memory");
    } else if (sketch->relief) {
        return sketch;
    }
    sketch_destroy(sketch);
    return NULL;
}

void sketch_destroy(Sketch *sketch) {
    if (sketch) {
        relief_destroy(sketch->relief);
        mj_deleteData(sketch->data);
        free(sketch->dots);
        free(sketch->low);
        free(sketch->high);
        free(sketch->text);
        free(sketch);
    }
}

int sketch_rows(const Sketch *sketch) {
    return sketch->def.rows;
}

void sketch_observe(Sketch *sketch, const RobotSim *sim) {
    double position[ROBOT_FEET_MAX][3], rotation[ROBOT_FEET_MAX][9];
    for (int f = 0; f < robot_feet(sketch->robot); f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        memcpy(position[f], foot->position, sizeof position[f]);
        memcpy(rotation[f], foot->rotation, sizeof rotation[f]);
    }
    relief_press(sketch->relief, 0, (const double(*)[3])position, (const double(*)[9])rotation);
}

/* ---- ground ---- */

/* [m] Of the surface at x, where the deepest imprint beside the robot is. */
static double surface_at(const Sketch *sketch, double x, double y) {
    double lowest = INFINITY;
    for (int i = -STRIP; i <= STRIP; i++) {
        const double at = y + i * STRIP_STEP;
        const double height =
            relief_height_at(sketch->relief, x, at) - relief_depth_at(sketch->relief, x, at);
        lowest = fmin(lowest, height);
    }
    return lowest;
}

/* Whether the ground has a dot of its texture here; the same wherever the picture begins. */
static int grain_at(int x, int z) {
    const uint32_t mixed = ((uint32_t)x * 2654435761u) ^ ((uint32_t)z * 2246822519u);
    return ((mixed ^ mixed >> 15) * 2654435761u) >> 28 == 0;
}

static void draw_ground(Sketch *sketch, double y) {
    const int first = (int)floor(sketch->left * sketch->def.dots);
    for (int column = 0; column < sketch->width; column++) {
        const double x = (first + column + 0.5) / sketch->def.dots;
        const double surface = surface_at(sketch, x, y);
        const int top = (int)floor((surface - sketch->bottom) * sketch->def.dots);
        for (int row = 0; row < sketch->height; row++) {
            const int above = sketch->height - 1 - row; /* the bottom */
            sketch->dots[row * sketch->width + column] =
                above == top || (above < top && grain_at(first + column, top - above));
        }
    }
}

/* ---- robot ---- */

/* Widens the rows that a line covers. Points are dots from the lower left corner. */
static void cover(Sketch *sketch, const double a[2], const double b[2]) {
    const int steps = 1 + (int)(2 * fmax(fabs(b[0] - a[0]), fabs(b[1] - a[1])));
    for (int i = 0; i <= steps; i++) {
        const double share = (double)i / steps;
        const double x = a[0] + share * (b[0] - a[0]), z = a[1] + share * (b[1] - a[1]);
        const int row = sketch->height - 1 - (int)floor(z), column = (int)floor(x);
        if (row >= 0 && row < sketch->height) {
            sketch->low[row] = column < sketch->low[row] ? column : sketch->low[row];
            sketch->high[row] = column > sketch->high[row] ? column : sketch->high[row];
        }
    }
}

/* Fills the convex hull of the points; every second dot of what is `far`. */
static void fill(Sketch *sketch, const double (*point)[2], int count, int far) {
    for (int row = 0; row < sketch->height; row++) {
        sketch->low[row] = sketch->width, sketch->high[row] = -1;
    }
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < i; k++) {
            cover(sketch, point[i], point[k]);
        }
    }
    for (int row = 0; row < sketch->height; row++) {
        for (int column = sketch->low[row] > 0 ? sketch->low[row] : 0;
             column <= sketch->high[row] && column < sketch->width; column++) {
            sketch->dots[row * sketch->width + column] = !far || (row + column) % 2;
        }
    }
}

/* The points of a shape whose hull it is, seen from the side. Returns how many. */
static int points_of(const Sketch *sketch, const mjModel *m, int geom, double (*point)[2]) {
    const mjtNum *size = m->geom_size + 3 * geom, *box = m->geom_aabb + 6 * geom;
    const mjtNum *position = sketch->data->geom_xpos + 3 * geom;
    const mjtNum *rotation = sketch->data->geom_xmat + 9 * geom;
    const int type = m->geom_type[geom];
    const int round = type == mjGEOM_CAPSULE || type == mjGEOM_SPHERE;
    const int count = round ? POINTS_MAX : 8;
    for (int i = 0; i < count; i++) {
        double local[3] = {0, 0, 0}, x, z;
        if (round) { /* circles in the picture's plane, about the ends */
            local[2] = type == mjGEOM_SPHERE ? 0 : (i < ROUND ? -size[1] : size[1]);
        } else {
            for (int k = 0; k < 3; k++) {
                local[k] = box[k] + (i >> k & 1 ? box[3 + k] : -box[3 + k]);
            }
        }
        x = position[0] + mju_dot3(rotation, local);
        z = position[2] + mju_dot3(rotation + 6, local);
        if (round) {
            const double angle = 2 * mjPI * i / ROUND;
            x += size[0] * cos(angle), z += size[0] * sin(angle);
        }
        point[i][0] = (x - sketch->left) * sketch->def.dots;
        point[i][1] = (z - sketch->bottom) * sketch->def.dots;
    }
    return count;
}

/* Whether a picture has it: of a body, in a group that MuJoCo shows by itself. */
static int is_seen(const mjModel *m, int geom) {
    return m->geom_bodyid[geom] > 0 && m->geom_group[geom] < 3 && m->geom_rgba[4 * geom + 3] > 0;
}

static void draw_robot(Sketch *sketch, const RobotSim *sim) {
    const mjModel *m = robot_visual_model(sketch->robot);
    const double y = robot_sim_qpos(sim)[1];
    for (int far = 1; far >= 0; far--) { /* the left side first, behind the right one */
        for (int geom = 0; geom < m->ngeom; geom++) {
            double point[POINTS_MAX][2];
            if (is_seen(m, geom) && (sketch->data->geom_xpos[3 * geom + 1] > y + 0.02) == far) {
                fill(sketch, (const double(*)[2])point, points_of(sketch, m, geom, point), far);
            }
        }
    }
}

/* ---- text ---- */

/* The bits of a Braille character by row and column of its dots. */
static const unsigned char braille[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};

static void write_text(Sketch *sketch) {
    char *text = sketch->text;
    for (int row = 0; row < sketch->def.rows; row++) {
        for (int column = 0; column < sketch->def.columns; column++) {
            unsigned bits = 0;
            for (int i = 0; i < 8; i++) {
                const int at = (4 * row + i / 2) * sketch->width + 2 * column + i % 2;
                bits |= sketch->dots[at] ? braille[i / 2][i % 2] : 0u;
            }
            *text++ = (char)0xe2; /* U+2800 and the bits, in UTF-8 */
            *text++ = (char)(0xa0 | bits >> 6);
            *text++ = (char)(0x80 | (bits & 0x3f));
        }
        *text++ = '\n';
    }
    *text = '\0';
}

const char *sketch_draw(Sketch *sketch, const RobotSim *sim) {
    const mjModel *m = robot_visual_model(sketch->robot);
    const double *qpos = robot_sim_qpos(sim);
    robot_engine_qpos(sketch->robot, qpos, sketch->data->qpos);
    mj_kinematics(m, sketch->data);
    sketch->left = qpos[0] - LEAD * sketch->width / sketch->def.dots;
    sketch->bottom = relief_height_at(sketch->relief, qpos[0], qpos[1]) - sketch->def.depth;
    draw_ground(sketch, qpos[1]);
    draw_robot(sketch, sim);
    write_text(sketch);
    return sketch->text;
}
