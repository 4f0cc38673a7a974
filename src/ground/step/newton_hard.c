#include "ground/step/newton_step.h"

#include "ground/law/friction.h"

#define NEWTON_ROUND 20    /* steps of one minimisation at fixed bounds */
#define NEWTON_TRY 6       /* plain steps tried after each minimisation */
#define NEWTON_SEARCH 30   /* bisections of a line search */
#define BOUNDS_LEAST 0.02  /* [-] smallest step length of the friction bounds */
#define BOUNDS_MOST 1e4    /* [-] largest */
#define BOUNDS_SLOW 0.5    /* [-] a move that shrank by less than this factor is slow */
#define BOUNDS_PATIENCE 10 /* rounds before the bounds restart from wider ones */

static int least(int a, int b) {
    return a < b ? a : b;
}

/* With the friction bounds held fixed, the step minimises a convex function. This is its slope
 * along the step between two points, (P - W)^T A dP, at the point of the last pass. */
static double step_slope(const System *system, const MildScratch *scratch, const Point *at,
                         const Point *from, const Point *to) {
    double slope = 0.0;
    for (int i = 0; i < system->n; i++) {
        slope += (at->impulse.at[i] - scratch->wrench[listed_row(scratch, i)]) *
                 (to->twist.at[i] - from->twist.at[i]);
    }
    return slope;
}

/* Minimises the convex function that the step has at fixed friction bounds. Newton's method with a
 * line search converges from any start. Returns the number of steps. */
static int newton_held(const System *system, MildScratch *scratch, Point *at, int limit) {
    int steps = 0, moves = 1;
    Point full, next = *at;
    contact_pass_held(scratch, system->dt, at->twist.at);
    while (moves && steps < limit && point_step(system, scratch, at, &full, 0)) {
        steps++;
        double start = step_slope(system, scratch, at, at, &full);
        double end;
        double low = 0.0;
        double high = 1.0;
        double t = 1.0;
        for (int k = 0; k <= NEWTON_SEARCH; k++) {
            point_between(system, at, &full, t, &next);
            contact_pass_held(scratch, system->dt, next.twist.at);
            end = step_slope(system, scratch, &next, at, &full);
            if (!(fabs(end) > 0.1 * fabs(start)) || (end < 0.0 && t == 1.0)) {
                break;
            }
            *(end < 0.0 ? &low : &high) = t;
            t = 0.5 * (low + high);
        }
        double moved[TWIST_MAX];
        double scale = system_norm(system, next.impulse.at);
        for (int i = 0; i < system->n; i++) {
            moved[i] = next.impulse.at[i] - at->impulse.at[i];
        }
        *at = next;
        moves = !(system_norm(system, moved) <= 0.1 * system->tolerance * scale);
    }
    return steps;
}

/* [N s] Friction bound for the normal impulse of the last pass. */
static inline double bound_wanted(const Slots *s, int i) {
    const Element element = slot_element(s, i);
    return friction_bound(&element, s->iz[i]);
}

/* Sets the friction bounds to a multiple of those for the last pass. */
static void bounds_begin(MildScratch *scratch, double times) {
    for (int k = 0; k < scratch->listed; k++) {
        const FootScratch *foot = &scratch->foot[scratch->list[k]];
        for (int slot = 0; slot < foot_end(foot); slot++) {
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            s->bound[i] = times * bound_wanted(s, i);
            s->bound_moved[i] = 0.0;
        }
    }
}

/* Step length of the friction bounds. */
typedef struct {
    double share; /* [-] of the distance to the wanted bounds, in the last move */
    int turned;   /* bool: that move reversed direction */
} Pace;

/* Chooses the next step length. It doubles while the moves keep their direction and hardly shorten,
 * because where friction presses the foot into the ground the bounds grow slowly over many orders
 * of magnitude. When the moves reverse, it goes the whole way back, but at most to the middle of
 * the last move. */
static void bounds_pace(const MildScratch *scratch, Pace *pace) {
    double along = 0.0;  /* [N^2 s^2] wanted move times last move */
    double now = 0.0;    /* [N^2 s^2] square of the wanted move */
    double before = 0.0; /* [N^2 s^2] square of the last move */
    double share = pace->share;
    for (int k = 0; k < scratch->listed; k++) {
        const FootScratch *foot = &scratch->foot[scratch->list[k]];
        for (int slot = 0; slot < foot_end(foot); slot++) {
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            double way = bound_wanted(s, i) - s->bound[i], last = s->bound_moved[i];
            along += way * last;
            now += way * way;
            before += last * last;
        }
    }
    int turned = along < 0.0;
    if (turned) {
        share = fmin(1.0, 0.5 * before / -along);
    } else if (!pace->turned && now * share * share > BOUNDS_SLOW * BOUNDS_SLOW * before) {
        share = fmin(2.0 * share, BOUNDS_MOST);
    }
    *pace = (Pace){fmax(share, BOUNDS_LEAST), turned};
}

/* Moves the friction bounds towards those for the last pass. */
static void bounds_move(MildScratch *scratch, Pace *pace) {
    bounds_pace(scratch, pace);
    for (int k = 0; k < scratch->listed; k++) {
        const FootScratch *foot = &scratch->foot[scratch->list[k]];
        for (int slot = 0; slot < foot_end(foot); slot++) {
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            double way = pace->share * (bound_wanted(s, i) - s->bound[i]);
            s->bound_moved[i] = fmax(way, -s->bound[i]);
            s->bound[i] += s->bound_moved[i];
        }
    }
}

int newton_patient(const System *system, MildScratch *scratch, Point *best, int limit) {
    static const double wider[] = {3.0, 100.0, 10.0, 1e4};
    Point at = *best;
    Pace pace = {0.5, 0}; /* the first move doubles it */
    int steps = 0;
    if (isinf(at.residual)) {
        at.twist = system->free; /* the point with zero impulse */
    }
    contact_pass(scratch, system->dt, at.twist.at);
    bounds_begin(scratch, 1.0);
    for (int round = 1; steps < limit && !point_solves(system, best); round++) {
        int held = newton_held(system, scratch, &at, least(limit - steps, NEWTON_ROUND));
        if (held == 0) {
            break; /* singular or not a number */
        }
        steps += held;
        point_evaluate(system, scratch, &at);
        if (round % BOUNDS_PATIENCE == 0) {
            bounds_begin(scratch, wider[(round / BOUNDS_PATIENCE - 1) % 4]);
            pace = (Pace){1.0, 1};
        } else {
            bounds_move(scratch, &pace);
        }
        Point tried = at;
        steps += newton_plain(system, scratch, &tried, least(limit - steps, NEWTON_TRY));
        if (tried.rests || tried.residual < best->residual) {
            *best = tried;
        }
    }
    return steps;
}

/* Sets a point to what would be returned for it: P = W of the last pass and V = V^ + A W. Its
 * residual becomes relative. It is infinite where W = 0 but the law at V is not. */
static void point_return(const System *system, MildScratch *scratch, Point *point) {
    row_clear(system, &point->impulse);
    for (int i = 0; i < system->n; i++) {
        point->impulse.at[i] = scratch->wrench[listed_row(scratch, i)];
    }
    point->twist = system->free;
    system_times(system, point->impulse.at, &point->twist);
    point_evaluate(system, scratch, point);
    if (point->residual > 0.0) {
        point->residual /= system_norm(system, point->impulse.at);
    }
}

int newton_unsolved(const System *system, MildScratch *scratch, const Point *best,
                    MildContactResult *result) {
    Point safe = {.residual = INFINITY}, found = *best;
    safe.twist = system->free;
    bounds_begin(scratch, 0.0);
    int steps = newton_held(system, scratch, &safe, NEWTON_ROUND);
    contact_pass(scratch, system->dt, safe.twist.at);
    bounds_begin(scratch, 1.0);
    steps += newton_held(system, scratch, &safe, NEWTON_ROUND);
    const Row safe_twist = safe.twist;
    point_return(system, scratch, &safe);
    contact_pass(scratch, system->dt, best->twist.at);
    point_return(system, scratch, &found);
    if (found.residual <= safe.residual) {
        contact_pass(scratch, system->dt, best->twist.at);
    } else {
        contact_pass_held(scratch, system->dt, safe_twist.at);
    }
    result->residual = fmin(found.residual, safe.residual);
    return steps;
}
