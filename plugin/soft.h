/* Private to the plugin: soft ground in one mjData. Its memory, a MildGround, is the plugin's
 * state, so that MuJoCo saves and restores it. Everything here can be made anew from the model. */
#ifndef PLUGIN_SOFT_H
#define PLUGIN_SOFT_H

#include "ground/step/state.h"
#include "mild/ground.h"
#include "plugin/foot.h"
#include "plugin/metric.h"
#include "plugin/rows.h"

/* Private to the plugin: Anderson's acceleration of a fixed-point iteration x <- x + c(x) (Anderson
 * 1965). Of all combinations of the last few steps it takes the one whose change c would be
 * smallest if c were linear. */

#define MIX_DEPTH 4                  /* steps remembered */
#define MIX_ROWS (6 * MILD_FEET_MAX) /* most numbers in x */

typedef struct {
    int rows;  /* in use */
    int known; /* bool: x and c are those of the last call */
    int steps; /* remembered */
    double x[MIX_ROWS];
    double c[MIX_ROWS];
    double dx[MIX_DEPTH][MIX_ROWS]; /* differences between successive calls */
    double dc[MIX_DEPTH][MIX_ROWS];
} Mix;

/* Forgets everything. */
void mix_start(Mix *mix, int rows);
/* Replaces x by the next one to try. c: [rows] change of x at x. */
void mix_next(Mix *mix, double *x, const double *c);

/* Newton's step in the place of mix_next, where the ground's response is known: it solves with
 *
 *     V = x + A P,    MuJoCo steps to V' = V_0 + E P,    P = P_0 - H V
 *
 * for V = V', with P the impulse of the ground and H = -dP/dV. From a change c = V' - V that is
 *
 *     x <- x + (1 + A H) (1 + E H)^-1 c
 *
 * A, E, H: [rows][rows]. Returns 0, with x as it was, when the matrix is singular. */
int mix_newton(const Mix *mix, const double *A, const double *E, const double *H, const double *c,
               double *x);

#define FOOT_ROWS (6 * MILD_FEET_MAX)

typedef struct {
    PluginDef def;
    int model;                /* of ground.model, or -1: each ground has its own */
    Foot foot[MILD_FEET_MAX]; /* those of `feet`, then the bodies of `body` */
    int feet;                 /* both */
    const MildSole *soles[MILD_FEET_MAX];
    MildMap *map; /* NULL: level ground of one material */
    MildTerrain terrain;
    float colour[MILD_MATERIALS_MAX][3]; /* of its materials */
    MildScratch *scratch;
    Metric metric;
    Rows rows;
    Mix mix;
    int near[MILD_FEET_MAX]; /* [near_rows / 6] the feet of the step: all but bodies in the air */
    int near_rows;           /* six for each of these */
    double *jacobian;        /* [near_rows][nv] twists of the feet: linear, angular; world axes */
    double *response;        /* [dofs][near_rows] of the metric's degrees of freedom: N^-1 J^T */
    double *forces;          /* [dofs][near_rows] M times a response */
    double *passive;         /* [nv] qfrc_passive without the ground */
    double *acceleration;    /* [nv] (v+ - v) / h of the metric's degrees of freedom */
    double free[FOOT_ROWS];  /* [near_rows] V_free of the input */
    double exact[FOOT_ROWS * FOOT_ROWS];      /* [near_rows][near_rows] E of mix_newton */
    double derivative[FOOT_ROWS * FOOT_ROWS]; /* [near_rows][near_rows] H of mix_newton */
    int fresh;         /* bool: qfrc_passive was computed anew since the last solve */
    int inside;        /* bool: MuJoCo calls back while it is called from here */
    int solved;        /* bool: the scratch is that of `input` and `contact` */
    int known;         /* bool: `input` and `contact` are those of a solve */
    int refused;       /* bool: the integrator has been complained about */
    int warned;        /* bool: a disagreement has been warned of since the last reset */
    int tilted;        /* bool: a foot on its side has been warned of since the last reset */
    int rounds;        /* of ground and constraints in the last solve */
    MildGround layout; /* header of a ground that remembers nothing */
    MildContactInput input;
    double inverse_inertia[FOOT_ROWS * FOOT_ROWS]; /* [near_rows][near_rows] of the input */
    MildContactResult contact;
} Soft;

/* Checks that a material bears every sole (ground/law/width.h). */
MildStatus soft_meet(const Soft *soft, const MildMaterial *material, MildError *error);

/* Makes the ground of an instance. Returns NULL with one line in *error. */
Soft *soft_create(const mjModel *m, int instance, MildError *error);
void soft_destroy(Soft *soft); /* may be NULL */

/* [B] Room for the memory of the ground that soft_create will make, a multiple of 8; 0 when it
 * would fail. While a model is compiled, where meshes have no vertices yet, so that a sole of
 * meshes gets the room that their bounding boxes may need. */
size_t soft_room(const mjModel *m, int instance);
/* Number of its feet and bodies; 0 when it would fail. */
int soft_feet(const mjModel *m, int instance);
/* [N] Weight of the robot over its feet. */
double soft_load(const Soft *soft, const mjModel *m);
/* Initialises the state, [bytes]: a ground that remembers nothing. */
void soft_reset(Soft *soft, void *state, size_t bytes);
/* Takes over what a solve left in `from`, of the same model; the scratch is filled again when it is
 * needed. */
void soft_copy(Soft *soft, const mjModel *m, const Soft *from);

/* Called where qfrc_passive has just been computed, and where actuator forces are computed. Returns
 * bool: the ground acts at this stage. The caller makes sure of the state (soft_owns), which is
 * read for the feet of the step, and calls soft_step. */
int soft_passive(Soft *soft, const mjModel *m, mjData *d);
int soft_actuation(Soft *soft, const mjModel *m, const mjData *d);
/* Adds the ground's force to qfrc_passive. */
void soft_step(Soft *soft, const mjModel *m, mjData *d, const MildGround *ground);
/* Called when MuJoCo has stepped: moves the ground's memory, which must be of this ground. */
void soft_advance(Soft *soft, const mjModel *m, const mjData *d, MildGround *ground);

/* Bool: MuJoCo leaves the stage of actuation out, for there are no actuators or they are disabled;
 * and the plugins at the stage of passive forces, which are disabled. */
int soft_without_actuation(const mjModel *m);
int soft_without_passive(const mjModel *m);

/* Bool: the state is that of this ground, and not one of another model, zeros or NaN. Everything
 * that reads the state asks first, because MuJoCo lets anybody write it at any time. It looks at
 * what is read: not at the elements of a body in the air. */
int soft_owns(const Soft *soft, const MildGround *ground);

#endif
