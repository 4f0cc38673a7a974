/* A robot that walks in a browser (docs/web.md): the batch engine, the ground and a policy without
 * MuJoCo and oneDNN. core.c is compiled to WebAssembly, and by the tests for this machine.
 *
 * One robot, one thread; the state is static. */
#ifndef WEB_CORE_H
#define WEB_CORE_H

#include <stddef.h>
#include <stdint.h>

#include "control/speed_hold.h"
#include "env/task/state.h"
#include "identify/belief/belief.h"
#include "learn/policy_def.h"
#include "mild/ground.h"
#include "robot/engine/model.h"
#include "robot/table.h"

/* ---- the file that pack.c writes ---- */

enum { WEB_GEOMS_MAX = 160, WEB_LAYERS_MAX = POLICY_LAYERS_MAX + 1 };

typedef enum { WEB_BOX, WEB_CYLINDER, WEB_CAPSULE, WEB_ELLIPSOID } WebShape;

/* A part of the picture. */
typedef struct {
    int32_t shape;     /* WebShape */
    int32_t link;      /* that it moves with */
    float size[3];     /* [m] box, ellipsoid: half axes; else radius, half length along z */
    float position[3]; /* [m] link's frame */
    float rotation[9]; /* [-] shape -> link, row major */
    float color[3];    /* [-] sRGB */
    float shine;       /* [-] share of light that is mirrored */
    float glow;        /* [-] share of the colour that shines by itself */
} WebGeom;

typedef struct {
    int32_t points;
    int32_t elements;
    double pitch;                          /* [m] */
    double z;                              /* [m] */
    double outline[2 * ROBOT_OUTLINE_MAX]; /* [m] */
} WebSole;

/* A shell of a body, as RobotShell; see MildShape. */
typedef struct {
    int32_t body; /* of EngineTree.bodies */
    int32_t type; /* MildShapeType */
    double size[3];
    double pos[3];
    double quat[4];
} WebShell;

/* The widths of a network: input, hidden layers, output. */
typedef struct {
    int32_t layers;
    int32_t width[WEB_LAYERS_MAX + 1];
} WebNetwork;

/* What the policy is made of; see learn/network.h. */
typedef struct {
    WebNetwork encoder;
    WebNetwork modulation;
    WebNetwork actor;
    int32_t estimates;
    int32_t latent;
    int32_t feet_velocity; /* first of the estimates that drive the modulation; it reads these, or
                              all that follow and then the clock of the frame */
    int32_t per_dimension; /* bool */
} WebPolicy;

#define WEB_MAGIC "mildweb1"

/* The whole file but for the weights, which follow: numbers only, in the same places on all
 * machines that have 4-byte int and align 8-byte numbers to 8, as x86-64 and wasm32 do. */
typedef struct {
    char magic[8];
    int32_t bytes;   /* of this struct: another layout is refused */
    int32_t weights; /* that follow it */
    EngineModel model;
    alignas(16) unsigned char task[offsetof(TaskDef, map)];
    RobotTable robot;
    TaskShape shape;
    TaskGains gains;
    double gravity; /* [m/s^2] */
    WebSole sole[ROBOT_FEET_MAX];
    double shell_spacing; /* [m] */
    int32_t shells;       /* that stand on soft ground */
    WebShell shell[ROBOT_SHELLS_MAX];
    SpeedHoldDef hold;
    WebPolicy policy;
    int32_t knows; /* bool: the robot knows its ground, by `belief` */
    BeliefNet belief;
    int32_t geoms;
    WebGeom geom[WEB_GEOMS_MAX];
} WebModel;
/* Then the weights as IEEE 754 numbers of 16 bits: encoder, modulation, actor; of each layer the
 * weights as [in][out], then the biases. */

/* ---- the core ---- */

enum {
    WEB_ELEMENTS_MAX = 128, /* of a sole */
    WEB_WINDOW = 1024,      /* cells along an edge of the ground drawn */
    WEB_HILLS = 512,        /* the same of a period of its heights */
    WEB_TILES = 32768,      /* of prints: some 3000 */
    WEB_TEXT = 65536,       /* bytes of a soil's file, with the 0 at its end */
    WEB_DIRTY_MAX = 64
};
#define WEB_STRIPE 2.4 /* [m] width of a ground where all are shown */

/* Ground 0 .. WEB_PRESETS - 1 are the first presets, the paper's; then these three. */
#define WEB_PRESETS 8
#define WEB_RIGID WEB_PRESETS
#define WEB_STRIPES (WEB_PRESETS + 1)
#define WEB_OWN (WEB_PRESETS + 2) /* that of web_soil, which may name any preset */

typedef enum { WEB_LEVEL, WEB_WAVES, WEB_ROUGH, WEB_RELIEFS } WebRelief;

/* A rectangle of the window that changed. */
typedef struct {
    int32_t x, y, width, height;
} WebDirty;

/* What a page draws, all in words of four bytes: filled by web_start and web_step. */
typedef struct {
    int32_t bytes; /* of this struct */
    int32_t links;
    int32_t feet;
    int32_t elements;                /* of each sole */
    int32_t knows;                   /* bool: the robot knows its ground, as `known` says */
    float pitch;                     /* [m] edge of an element */
    float cell;                      /* [m] edge of a cell of the window */
    float period;                    /* [m] of the heights */
    float velocity[3];               /* [m/s, m/s, rad/s] measured, in the heading frame */
    float yaw;                       /* [rad] */
    float load[ROBOT_FEET_MAX];      /* [N] on each foot */
    float depth[ROBOT_FEET_MAX];     /* [m] deepest element */
    float center[ROBOT_FEET_MAX][2]; /* [m] of pressure, foot's frame */
    float shell_load;                /* [N] on the shells: legs and body */
    float footsteps;                 /* on this ground, for `known`, or 0 */
    float alarms;                    /* changes of ground that the robot felt */
    float known[15];                 /* of each BeliefParameter 5 %, 50 %, 95 %, in its unit */
    float x[ROBOT_FEET_MAX][WEB_ELEMENTS_MAX];        /* [m] elements, foot's frame */
    float y[ROBOT_FEET_MAX][WEB_ELEMENTS_MAX];        /* [m] */
    float pressure[ROBOT_FEET_MAX][WEB_ELEMENTS_MAX]; /* [Pa] */
    float link[ENGINE_LINKS_MAX][12];                 /* [-, m] link -> world, three rows of four */
    int32_t dirty_count;                              /* of `dirty`; -1: the whole window */
    WebDirty dirty[WEB_DIRTY_MAX];
} WebView;

/* Takes a file of pack.c, aligned to 16 bytes, which the caller keeps, in the place of the robot
 * before; web_start comes next. Returns NULL, or what is wrong. A file that is none leaves the
 * robot before as it was. */
const char *web_open(const WebModel *file, size_t bytes);
/* Where the text of a soil's file goes, ended by a 0: [WEB_TEXT]. web_soil reads it; WEB_OWN is its
 * ground from the next web_start on. Returns NULL, or what is wrong; then the soil before stays. */
char *web_text(void);
const char *web_soil(void);
/* Stands the robot up at the origin of a ground without prints, facing x. Returns NULL, or what is
 * wrong. prints: bool, they stay from then on. web_again: where it is, on the same ground. */
const char *web_start(int ground, int relief, int prints);
void web_again(void);
/* Changes the ground while the robot walks: factor of stiffness, factor of friction [-]. */
void web_change(double stiffness, double friction);
/* A policy step of 10 ms with a command [m/s, m/s, rad/s] and, for a robot that jumps, the rise of
 * each jump [m]; 0: none. Returns why the trial has ended, a TaskEnd; 0: it has not. */
int web_step(float vx, float vy, float wz, float rise);
WebView *web_view(void);
/* The number of the robot's parts, and behind it the parts (WebModel.geom). */
const int32_t *web_picture(void);
/* Depths of the ground [m], [WEB_WINDOW][WEB_WINDOW]: cell (i, j) of the world is at i and j modulo
 * WEB_WINDOW. Who has drawn what is dirty sets dirty_count to 0. */
const float *web_window(void);
/* Heights of the undisturbed ground [m], [WEB_HILLS][WEB_HILLS] over a period. */
const float *web_hills(void);

/* ---- its parts, for tests ---- */

/* [history] What the policy sees. */
const float *web_history(void);
/* Action for a history. */
void web_act(const float *history, float *action);
/* The same with a given action, but for the picture. */
int web_move(const float *action, const float command[TASK_COMMANDS]);
/* The picture of the present. */
void web_show(void);

/* ---- window.c ---- */

/* The ground around the robot as the page draws it: the depth of each cell of a window that moves
 * with the robot. Soles, and the elements of other bodies that are in the ground, press it down;
 * what they leave is what the ground remembers. */

/* The last step on soft ground. */
typedef struct {
    int feet;
    int standing;           /* feet, and behind them bodies with shells */
    const WebSole *outline; /* [feet] */
    MildSole *const *sole;  /* [standing] */
    const MildTerrain *terrain;
    const MildGround *ground;
    const MildContactInput *input;
    const MildScratch *scratch;
    double cell; /* [m] */
} WindowScene;

/* Bool: there was memory for it. */
int window_open(const WindowScene *scene);
void window_close(void);
/* A ground that nothing has pressed. */
void window_clear(WebView *view);
/* Moves the window so that (x, y) [m] is in its middle, and presses the bodies into it. Marks what
 * is dirty. rigid: bool, nothing yields. */
void window_show(const WindowScene *scene, double x, double y, int rigid, WebView *view);
/* [WEB_WINDOW][WEB_WINDOW] as web_window. */
const float *window_depths(void);

#endif
