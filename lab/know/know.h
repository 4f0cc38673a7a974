/* Walks on grounds that are drawn, and what a belief then knows of them (docs/identify.md). */
#ifndef MILD_KNOW_KNOW_H
#define MILD_KNOW_KNOW_H

#include "base/pool.h"
#include "base/random.h"
#include "control/controller.h"
#include "env/envs.h"
#include "identify/belief/belief.h"
#include "mild/ground.h"

/* ---- study.c: the grounds that a walk is asked about ---- */

/* A preset of mild whose stiffness,
 * friction and slip length are drawn anew, each by itself and evenly in its logarithm. */

/* What is drawn: member of PriorGround, unit, lowest and highest value. */
#define PRIOR_LIST(X)                                                                              \
    X(k_pen, "N/m", 100, 2000)                                                                     \
    X(sigma_cone, "N/m^3", 5e4, 3e5)                                                               \
    X(mu, "-", 0.2, 1.3)                                                                           \
    X(slip_length, "m", 1e-3, 1)

/* [m] Half of the weight may sink a sole so deep; a softer ground is drawn again. */
#define PRIOR_SINKAGE 0.06
/* [m] From this slip length on the ground has no slip law, because slip then costs nothing. */
#define PRIOR_NO_SLIP 0.1

typedef enum {
    PRIOR_WIDE,    /* all of PRIOR_LIST, under any preset of mild */
    PRIOR_PAPER,   /* that of lab/paper/latents.py: k_pen and sigma_cone alone, under three */
    PRIOR_PRESETS, /* a preset of mild as it is */
    PRIORS
} Prior;

/* What is asked. */
typedef struct {
    double sinkage; /* [m] of a level sole under half of the robot's weight */
    double k_pen, sigma_cone, mu, slip_length;
    int preset; /* that lends the rest, see mild_material_preset_name */
} PriorGround;

/* load: [N] on the sole. */
PriorGround prior_draw(Prior prior, Random *r, const MildSole *sole, double load,
                       MildMaterial *material);
/* The same of a material of mild. */
PriorGround prior_ground(const MildMaterial *material, const MildSole *sole, double load);

/* ---- walks.c: walks of a policy, many at once, by MuJoCo ---- */

enum { WALK_COMMANDS = 4 };

/* What a robot walks on, and where to. */
typedef struct {
    MildTerrain terrain;
    int rigid; /* bool: on the engine's own contact */
    /* [m/s, m/s, rad/s] one after another, each as long; the heading is held where the third
     * is 0 */
    double command[WALK_COMMANDS][3];
    int commands;
} WalkRoute;

/* A policy step of a walk that has not fallen. */
typedef struct {
    int walk, step;
    const float *frame;           /* [TaskShape.observation] what the policy sees */
    const float *critic;          /* [TaskShape.critic] the same without noise, and the truth */
    const double *command;        /* [3] */
    int material[ROBOT_FEET_MAX]; /* of the terrain, under the foot; -1: the foot is free */
    double forward;               /* [m] of the base, world x */
    double work;                  /* [J] of the joints in the step before, by size */
} WalkStep;

/* What the robot allows itself. */
typedef struct {
    double speed;  /* [m/s] largest */
    double period; /* [s] of its gait clock; 0: that of its task */
} WalkCare;

typedef struct {
    const TaskDef *task;
    const Robot *robot;
    Pool *pool;
    Controller *controller;
    const WalkRoute *walk; /* [count] */
    int count;
    double seconds;
    uint64_t seed;
    uint32_t first; /* number of the first walk, which selects its random numbers */
    /* In the order of steps, then of walks. */
    void (*stepped)(void *context, const WalkStep *step);
    void *context;
    /* In this walk, from the next step on; NULL: it walks as commanded. */
    WalkCare (*care)(void *context, int walk);
} WalksDef;

/* lasted: [count] policy steps until a fall or the end. */
MildStatus walks_run(const WalksDef *def, int *lasted, MildError *error);

/* ---- study.c: each robot, its ground and its command, drawn from a seed ---- */

/* Walks that share a robot's noise and randomisation. */
enum { STUDY_BATCH = 48 };

typedef struct {
    const TaskDef *nominal; /* of experiment_task */
    const TaskDef *drawn;   /* the same, randomized */
    Robot *robot;
    Pool *pool;
    Controller *controller; /* of STUDY_BATCH rows */
    Prior prior;
    MildModel model;     /* another than mild: the material is matched to what was drawn */
    double change_share; /* [-] of the walks, from one ground onto another; these go straight */
    double speed[2];     /* [m/s] of straight walks alone; 0 0: any command */
    double slick[2];     /* [-] friction of the last ground of each walk, evenly in its logarithm;
                            0 0: as drawn */
    double grip;         /* [-] of grounds where slip costs support */
    double robots;       /* [-] share of the batches with randomised robots */
    double quiet;        /* [-] share of the batches with less noise than in training */
    int rigid;           /* bool: on the engine's own contact */
    const MildMaterial *preset; /* instead of the prior; NULL: none */
    double seconds;
    uint64_t seed;
} StudyDef;

typedef struct {
    PriorGround ground[2]; /* of the terrain's materials */
    int grounds;
    int drawn;      /* bool: the robot is randomised */
    double noise;   /* [-] of that of training */
    int lasted;     /* [policy steps] until a fall or the end */
    double seconds; /* [s] that were asked for */
    WalkRoute walk;
} StudyWalk;

/* Who looks at the walks; as WalksDef has it, with the number of the walk in the study. */
typedef struct {
    void (*stepped)(void *context, const WalkStep *step);
    WalkCare (*care)(void *context, int walk); /* NULL: none */
    void *context;
} StudyWatcher;

/* walk: [count] */
MildStatus study_run(const StudyDef *def, StudyWalk *walk, int count, const StudyWatcher *watcher,
                     MildError *error);

/* ---- judge.c: how well a belief knows the ground of walks that it has not seen ---- */

/* Footsteps after which the posterior is judged; the last: at the end of the walk. */
enum { JUDGE_DEPTHS = 4, JUDGE_LAST = JUDGE_DEPTHS - 1 };
extern const int judge_footsteps[JUDGE_DEPTHS];

#define JUDGE_SHARE 0.9 /* [-] nominal coverage */

typedef struct {
    int walks;       /* that came so far on one ground; without a false alarm, but for the end */
    double r2;       /* [-] of the logarithm, by the posterior mean; NaN without two values */
    double coverage; /* [-] of the walks whose true value lies in the interval */
    double factor;   /* [-] upper over lower end of the interval, median */
} JudgeCell;

/* Borders that were crossed, by how much the two grounds differ. */
typedef struct {
    int borders;
    int in_two;   /* flagged by the end of the second footstep on the new ground */
    int in_four;  /* of the fourth */
    double delay; /* [footsteps] mean of those flagged before the walk's end */
} JudgeBorders;

typedef enum {
    JUDGE_BORDERS_all,
    JUDGE_BORDERS_double,   /* of at least twice the sinkage, or half of it */
    JUDGE_BORDERS_fourfold, /* four times */
    JUDGE_BORDERS
} JudgeBorder;

typedef struct {
    JudgeCell cell[JUDGE_DEPTHS][BELIEF_PARAMETERS];
    JudgeBorders border[JUDGE_BORDERS];
    double minutes;   /* [min] of walking with footsteps, before a border */
    int false_alarms; /* in these, but for those in the last second before a fall */
    int before_falls; /* these */
    int fell;         /* walks */
    double step;      /* [s] of belief_step, mean */
} JudgeResult;

#define JUDGE_FAST 0.75 /* [m/s] from which a walk is fast */

/* What the robot does with what it knows: it walks no faster than `speed` [m/s] while the median
 * of its friction is below `mu`, and its gait clock has a period of `slow` or `fast` while the
 * median of its slip length is below `slip`. */
typedef struct {
    double mu; /* [-] 0: nothing */
    double speed;
    double slip;     /* [m] 0: nothing */
    double slow;     /* [s] of walks below JUDGE_FAST */
    double fast;     /* [s] of others */
    int true_ground; /* bool: by the true numbers of the ground under it instead of medians */
} JudgeCare;

/* How a walk went, after its first two seconds. */
typedef struct {
    PriorGround ground; /* on which it began */
    int fell;           /* bool */
    double asked;       /* [m/s] forward, before any care; mean */
    double speed;       /* [m/s] forward, world; mean */
    double cost;        /* [-] of transport */
    double seconds;     /* [s] that this is of */
} JudgeWalk;

/* count: walks. each: [count]. */
MildStatus judge_run(const StudyDef *study, const BeliefNet *net, const JudgeCare *care, int count,
                     JudgeResult *result, JudgeWalk *each, MildError *error);

#endif
