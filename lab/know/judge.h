/* How well a belief knows the ground of walks that it has not seen (docs/identify.md). */
#ifndef KNOW_JUDGE_H
#define KNOW_JUDGE_H

#include "identify/belief/belief.h"
#include "know/study.h"

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
