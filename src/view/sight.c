#include <math.h>
#include <string.h>

#include "view/view_parts.h"

#define NEAR 12.0       /* [m] from the camera; parts farther away are boxes */
#define LEAST 1.2       /* [pixels] smaller parts are not drawn */
#define SHADOW_MAP 4096 /* [pixels] edge */

void sight_widen(mjModel *model) {
    const float extent = (float)model->stat.extent;
    model->vis.map.zfar = (float)SIGHT_FAR / extent;
    model->vis.map.shadowclip = (float)SIGHT_SHADOW / extent;
    model->vis.quality.shadowsize = SHADOW_MAP;
}

Sight sight_of(const mjvScene *scene, int width, int height) {
    const mjvGLCamera *left = &scene->camera[0], *right = &scene->camera[1];
    const double high = (double)(left->frustum_top / left->frustum_near);
    Sight sight = {.pixels = 0.5 * height / high, .wide = high * hypot(1, (double)width / height)};
    for (int k = 0; k < 3; k++) {
        sight.eye[k] = 0.5 * (double)(left->pos[k] + right->pos[k]);
        sight.ahead[k] = (double)left->forward[k];
    }
    return sight;
}

double sight_distance(const Sight *sight, const double place[3]) {
    double way[3];
    mju_sub3(way, place, sight->eye);
    const double along = mju_dot3(way, sight->ahead), all = mju_norm3(way);
    const double beside = sqrt(fmax(all * all - along * along, 0));
    return along > -1 && beside < sight->wide * fmax(along, 0) + 1.5 ? all : -1;
}

/* A box in the place of a round part: a tenth of the triangles. */
static void make_box(mjvGeom *geom) {
    const int capsule = geom->type == mjGEOM_CAPSULE;
    if (capsule || geom->type == mjGEOM_CYLINDER) {
        geom->size[2] += capsule ? 0.6F * geom->size[0] : 0;
        geom->size[0] *= 0.88F;
        geom->size[1] *= 0.88F;
    } else if (geom->type == mjGEOM_SPHERE || geom->type == mjGEOM_ELLIPSOID) {
        for (int k = 0; k < 3; k++) {
            geom->size[k] *= 0.8F;
        }
    } else {
        return;
    }
    geom->type = mjGEOM_BOX;
}

void sight_thin_out(mjvScene *scene, int first, double far, double pixels, int shaded) {
    int kept = first;
    for (int g = first; g < scene->ngeom; g++) {
        mjvGeom *geom = &scene->geoms[g];
        const float size = fmaxf(geom->size[0], fmaxf(geom->size[1], geom->size[2]));
        if (geom->type == mjGEOM_PLANE || (double)size * pixels < far * LEAST) {
            continue;
        }
        if (far > NEAR) {
            make_box(geom);
        }
        geom->category = shaded ? geom->category : mjCAT_DECOR;
        scene->geoms[kept++] = *geom;
    }
    scene->ngeom = kept;
}

void sight_draw_spot(mjvScene *scene, const double place[3], double height) {
    const double size[3] = {0.28, 0.2, 0.001};
    const double at[3] = {place[0], place[1], height + 0.004};
    const float dark[4] = {0.05F, 0.05F, 0.07F, 0.4F};
    if (scene->ngeom < scene->maxgeom) {
        mjvGeom *geom = &scene->geoms[scene->ngeom++];
        mjv_initGeom(geom, mjGEOM_ELLIPSOID, size, at, NULL, dark);
        geom->category = mjCAT_DECOR;
    }
}

/* First-order low-pass filter, x' = (u - x)/lag, exact for an input that goes evenly from u0 to u1
 * in the time elapsed: x = u1 - s lag + (x0 - u0 + s lag) exp(-elapsed/lag), s = (u1 - u0)/elapsed.
 */
static double filtered(double x0, double u0, double u1, double elapsed, double lag) {
    double behind = lag * (u1 - u0) / elapsed;
    return u1 - behind + (x0 - u0 + behind) * exp(-elapsed / lag);
}

void follow_jump(Follow *follow, const double target[3]) {
    for (int k = 0; k < 3; k++) {
        follow->once[k] = follow->twice[k] = follow->target[k] = target[k];
    }
}

void follow_step(Follow *follow, const double target[3], double elapsed, double lag) {
    if (!(elapsed > 0)) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        double before = follow->once[k];
        follow->once[k] = filtered(before, follow->target[k], target[k], elapsed, lag);
        follow->twice[k] = filtered(follow->twice[k], before, follow->once[k], elapsed, lag);
    }
    memcpy(follow->target, target, sizeof follow->target);
}

/* Behind a target that moves evenly, the first filter stays speed lag and the second twice that. */
void follow_position(const Follow *follow, double position[3]) {
    for (int k = 0; k < 3; k++) {
        position[k] = 2 * follow->once[k] - follow->twice[k];
    }
}
