/* What a robot believes of its ground (docs/identify.md): from the frames that its policy sees, one
 * each 10 ms, a posterior over the ground's parameters, and an alarm when the ground changes.
 *
 *     Belief belief;
 *     belief_reset(&belief);
 *     for (;;) {
 *         const int event = belief_step(&belief, net, frame);
 *         const double low = belief_quantile(&belief, net, BELIEF_k_pen, 0.05);
 *     }
 *
 * A footstep is half a period of the gait clock. Each gives BELIEF_FEATURES numbers: means of the
 * readings over eighths of it, in the mirror image where the right foot stands. A layer of weights
 * embeds them; the mean of the embedding over the footsteps so far is all that is remembered. A
 * network reads the posterior off the mean, another the odds that the last two footsteps are on
 * other ground than those before. Nothing here allocates, or knows of files; both structs are plain
 * numbers. For a robot of 12 joints in two legs (SA01). */
#ifndef IDENTIFY_BELIEF_H
#define IDENTIFY_BELIEF_H

#include <stdint.h>

/* What is asked of the ground: name, unit, help. The last column scales the unit for people. */
#define BELIEF_LIST(X)                                                                             \
    X(sinkage, "mm", 1e3, "static sinkage of a sole under half of the robot's weight")             \
    X(k_pen, "N/m", 1, "penetration stiffness of an element")                                      \
    X(sigma_cone, "kN/m^3", 1e-3, "depth-dependent conical stress")                                \
    X(mu, "-", 1, "friction coefficient")                                                          \
    X(slip_length, "mm", 1e3, "path over which slip halves the support; 100 mm and more: none")
#define BELIEF_ENUM(name, unit, scale, help) BELIEF_##name,
typedef enum { BELIEF_LIST(BELIEF_ENUM) BELIEF_PARAMETERS } BeliefParameter;
#undef BELIEF_ENUM

typedef struct {
    const char *name, *unit, *help;
    double scale; /* value in `unit` = scale times SI */
} BeliefName;
extern const BeliefName belief_names[BELIEF_PARAMETERS];

#define BELIEF_PERIOD 0.01 /* [s] from frame to frame */
enum {
    BELIEF_FRAME = 47,    /* of a robot of 12 joints: docs/policy.md section 3 */
    BELIEF_BINS = 8,      /* of a footstep */
    BELIEF_CHANNELS = 42, /* of a frame, all but command and clock */
    BELIEF_FEATURES = (BELIEF_BINS + 1) * BELIEF_CHANNELS + 4,
    BELIEF_EMBED = 96,
    BELIEF_HIDDEN = 64,
    BELIEF_ODDS = 48, /* hidden widths of the alarm */
    BELIEF_ODDS_SECOND = 16,
    BELIEF_KNOTS = 31,  /* of a prior, from -3 to 3 standard deviations */
    BELIEF_DEPTHS = 6,  /* of evidence: 1, 2, 4, 8, 16, 32 footsteps */
    BELIEF_MEMORY = 24, /* footsteps; of more the oldest fade */
    BELIEF_START = 2    /* footsteps after standing that are not looked at */
};

/* Weights, as [in][out]. */
typedef struct {
    float embed[BELIEF_FEATURES][BELIEF_EMBED];
    float embed_bias[BELIEF_EMBED];
    float hidden[BELIEF_EMBED + 2][BELIEF_HIDDEN]; /* mean embedding, 1/n, log(n)/3 */
    float hidden_bias[BELIEF_HIDDEN];
    float out[BELIEF_HIDDEN][2 * BELIEF_PARAMETERS]; /* means, then log variances */
    float out_bias[2 * BELIEF_PARAMETERS];
    /* log of the value [log SI] at -3, -2.8 .. 3 standard deviations of its prior */
    float prior[BELIEF_PARAMETERS][BELIEF_KNOTS];
    /* factors of the standard deviations, by log2 of the footsteps: calibrated */
    float widen[BELIEF_PARAMETERS][BELIEF_DEPTHS];
    /* last two footsteps less the mean, the mean, the same of their commands, 1/n, log(n)/3 */
    float odds[3 * BELIEF_EMBED + 8][BELIEF_ODDS];
    float odds_bias[BELIEF_ODDS];
    float odds_second[BELIEF_ODDS][BELIEF_ODDS_SECOND];
    float odds_second_bias[BELIEF_ODDS_SECOND];
    float odds_out[BELIEF_ODDS_SECOND];
    float odds_out_bias;
    float alarm; /* log odds above which the ground has changed */
} BeliefNet;

typedef struct {
    double sum[BELIEF_BINS][BELIEF_CHANNELS];
    double square[BELIEF_BINS][BELIEF_CHANNELS];
    double command[3];
    int32_t count[BELIEF_BINS];
    int32_t frames;  /* of this footstep */
    int32_t whole;   /* bool: its beginning was seen */
    int32_t right;   /* bool: the right foot stands */
    int32_t waiting; /* footsteps that are not looked at yet */
    /* of the last two footsteps, the newer one first, and the mean of those before */
    float last[2][BELIEF_EMBED];
    float mean[BELIEF_EMBED];
    float last_command[2][3]; /* as in the frames */
    float mean_command[3];
    int32_t lasts;     /* 0 .. 2 */
    float before;      /* footsteps in the mean */
    int32_t footsteps; /* since the reset or the last alarm */
    int32_t alarms;    /* since the reset */
    float log_odds;    /* of a change at the newest footstep */
    /* posterior in standard deviations of the prior; that is (0, 1) before the first footstep */
    float center[BELIEF_PARAMETERS];
    float spread[BELIEF_PARAMETERS];
} Belief;

/* What a step has brought, as bits. */
enum { BELIEF_FOOTSTEP = 1, BELIEF_ALARM = 2 };

void belief_reset(Belief *belief);
/* A policy step. frame: [BELIEF_FRAME] with the noise of the sensors. */
int belief_step(Belief *belief, const BeliefNet *net, const float *frame);

/* [SI] Value below which a parameter is with the probability `share`. */
double belief_quantile(const Belief *belief, const BeliefNet *net, BeliefParameter parameter,
                       double share);
/* Posterior mean of the parameter's logarithm [log SI]. */
double belief_log_mean(const Belief *belief, const BeliefNet *net, BeliefParameter parameter);
/* [prior standard deviations] Of a value [SI]; the prior ends at 3. */
double belief_place(const BeliefNet *net, BeliefParameter parameter, double value);
/* Writes the median and the 90 % interval of each parameter in a line: "sinkage 12 mm (9 .. 16)" */
void belief_text(const Belief *belief, const BeliefNet *net, char *text, int size);
/* The same with a line for each. */
void belief_lines(const Belief *belief, const BeliefNet *net, char *text, int size);

#endif
