/* Coarser rasters of the soles (docs/model.md section 16). */
#include <math.h>

#include "ground/sole/sole.h"
#include "robot/description.h"
#include "robot/robot.h"

/* Centroid, and second moments of area about it, over the area. The elements are equal and press
 * where their centres are. The moments are the square of a lower triangle:
 *
 *     xx = a^2,  xy = a b,  yy = b^2 + c^2 */
typedef struct {
    double x, y;    /* [m] */
    double a, b, c; /* [m] c 0: all centres lie on a line */
} Moments;

static Moments moments_of(const MildSole *sole) {
    const int n = sole->elements;
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole);
    Moments m = {0};
    for (int i = 0; i < n; i++) {
        m.x += x[i] / n;
        m.y += y[i] / n;
    }
    double xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < n; i++) {
        xx += (x[i] - m.x) * (x[i] - m.x) / n;
        xy += (x[i] - m.x) * (y[i] - m.y) / n;
        yy += (y[i] - m.y) * (y[i] - m.y) / n;
    }

    const double least = 1e-6 * (xx + yy); /* [m^2] rounding makes less */
    m.a = xx > least ? sqrt(xx) : 0;
    m.b = m.a > 0 ? xy / m.a : 0;
    m.c = m.a > 0 && yy - m.b * m.b > least ? sqrt(yy - m.b * m.b) : 0;
    return m;
}

/* Moves the elements to the centroid and the second moments of `own`, by the map between the two
 * triangles. It mirrors with the sole:
 *
 *     x' = X + (A/a) (x - x0),   y' = Y + (B/a - C b/(c a)) (x - x0) + (C/c) (y - y0) */
static void move_elements(MildSole *sole, const Moments *own) {
    const Moments m = moments_of(sole);
    const double along = own->a / m.a, across = own->c / m.c;
    const double shear = (own->b - across * m.b) / m.a;
    double *x = sole->values, *y = sole->values + sole->elements;
    for (int i = 0; i < sole->elements; i++) {
        const double dx = x[i] - m.x;
        x[i] = own->x + along * dx;
        y[i] = own->y + shear * dx + across * (y[i] - m.y);
    }
}

/* The sole of foot f in that many elements: its own raster, or a new sole. NULL on failure. */
static MildSole *sole_in(const Robot *robot, int f, int elements, MildError *error) {
    const RobotFootDef *foot = &robot->def.foot[f];
    MildSole *own = robot->rasters[f];
    if (elements == own->elements) {
        return own;
    }
    const double area = own->elements * foot->pitch * foot->pitch; /* [m^2] */
    const MildSoleDef def = {foot->outline, foot->outline_points, sqrt(area / elements), foot->z,
                             elements};
    MildSole *sole = mild_sole_create(&def, error);
    if (sole && !(moments_of(sole).c > 0)) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "so few elements of [foot.%s] lie on a line; write more, or 0 for its own %d",
                  foot->name, own->elements);
        mild_sole_destroy(sole);
        return NULL;
    }
    if (sole) {
        const Moments moments = moments_of(own);
        move_elements(sole, &moments);
    }
    return sole;
}

static MildStatus check_elements(const Robot *robot, int elements, MildError *error) {
    if (robot->is_concentric) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "this ground model has one element a sole; write 0");
    }
    for (int f = 0; f < robot->def.feet; f++) {
        const char *name = robot->def.foot[f].name;
        const int own = robot->rasters[f]->elements;
        if (robot->limb[f].round) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "[foot.%s] is round, and presses at one point; write 0", name);
        }
        if (elements < 1 || elements > own) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "[foot.%s] has %d elements; write fewer, or 0 for these", name, own);
        }
    }
    return MILD_OK;
}

void robot_take_rasters(Robot *robot) {
    for (int f = 0; f < robot->def.feet; f++) {
        if (robot->soles[f] != robot->rasters[f]) {
            mild_sole_destroy(robot->soles[f]);
        }
        robot->soles[f] = robot->rasters[f];
    }
}

MildStatus robot_set_elements(Robot *robot, int elements, MildError *error) {
    MildSole *made[ROBOT_FEET_MAX] = {0};
    MildStatus status = elements ? check_elements(robot, elements, error) : MILD_OK;
    int same = 1;
    for (int f = 0; status == MILD_OK && f < robot->def.feet; f++) {
        const int wanted = elements ? elements : robot->rasters[f]->elements;
        same = same && robot->soles[f]->elements == wanted;
    }
    if (status != MILD_OK || same) {
        return status;
    }

    for (int f = 0; status == MILD_OK && f < robot->def.feet; f++) {
        MildError cause = {0};
        made[f] = elements ? sole_in(robot, f, elements, &cause) : robot->rasters[f];
        status = made[f] ? MILD_OK : mild_fail(error, cause.status, "%s", cause.text);
    }
    if (status == MILD_OK) {
        robot_take_rasters(robot);
    }
    for (int f = 0; f < robot->def.feet; f++) {
        if (status == MILD_OK) {
            robot->soles[f] = made[f];
        } else if (made[f] != robot->rasters[f]) {
            mild_sole_destroy(made[f]);
        }
    }
    return status;
}
