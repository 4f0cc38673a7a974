#include "identify/belief/belief.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { JOINTS = 12, LEG = 6, FOOTSTEP_MIN = 20, FOOTSTEP_MAX = 80 };
#define KNOT_LAST 3.0
#define TWO_PI 6.283185307179586
#define VARIANCE_LEAST 1e-8

#define BELIEF_ROW(name, unit, scale, help) {#name, unit, help, scale},
const BeliefName belief_names[BELIEF_PARAMETERS] = {BELIEF_LIST(BELIEF_ROW)};
#undef BELIEF_ROW

void belief_reset(Belief *belief) {
    memset(belief, 0, sizeof *belief);
    belief->waiting = BELIEF_START;
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        belief->spread[i] = 1;
    }
}

/* ---- a footstep ---- */

/* Channels of a frame: angular velocity, gravity, joints' angles, speeds, actions; and the command.
 * mirror: bool. Both legs have roll, yaw, pitch, knee, ankle pitch, ankle roll. */
static void read_frame(const float *frame, int mirror, double channel[BELIEF_CHANNELS],
                       double command[3]) {
    static const double axial[3] = {-1, 1, -1}, polar[3] = {1, -1, 1};
    static const double joint[LEG] = {-1, -1, 1, 1, 1, -1}, turn[3] = {1, -1, -1};
    for (int i = 0; i < 3; i++) {
        channel[i] = (double)frame[i] * (mirror ? axial[i] : 1);
        channel[3 + i] = (double)frame[6 + i] * (mirror ? polar[i] : 1);
        command[i] = (double)frame[3 + i] * (mirror ? turn[i] : 1);
    }
    for (int i = 0; i < 3 * JOINTS; i++) {
        const int kind = i / JOINTS, at = i % JOINTS;
        const int from = mirror ? (at + LEG) % JOINTS : at;
        channel[6 + i] = (double)frame[9 + kind * JOINTS + from] * (mirror ? joint[at % LEG] : 1);
    }
}

static void begin_footstep(Belief *belief, int right, int whole) {
    memset(belief->sum, 0, sizeof belief->sum);
    memset(belief->square, 0, sizeof belief->square);
    memset(belief->command, 0, sizeof belief->command);
    memset(belief->count, 0, sizeof belief->count);
    belief->frames = 0;
    belief->right = right;
    belief->whole = whole;
}

static void add_frame(Belief *belief, const float *frame, int bin) {
    double channel[BELIEF_CHANNELS], command[3];
    read_frame(frame, belief->right, channel, command);
    for (int c = 0; c < BELIEF_CHANNELS; c++) {
        belief->sum[bin][c] += channel[c];
        belief->square[bin][c] += channel[c] * channel[c];
    }
    for (int i = 0; i < 3; i++) {
        belief->command[i] += command[i];
    }
    belief->count[bin]++;
    belief->frames++;
}

/* The features of the footstep that the next frame ends; 0: it is none that counts. */
static int footstep_features(const Belief *belief, double *features) {
    const double frames = belief->frames;
    if (frames < FOOTSTEP_MIN || frames > FOOTSTEP_MAX) {
        return 0;
    }
    double rest[BELIEF_CHANNELS] = {0};
    double *at = features;
    for (int b = 0; b < BELIEF_BINS; b++) {
        const double count = belief->count[b];
        if (count == 0) {
            return 0;
        }
        for (int c = 0; c < BELIEF_CHANNELS; c++) {
            const double mean = belief->sum[b][c] / count;
            rest[c] += fmax(belief->square[b][c] - count * mean * mean, 0);
            *at++ = mean;
        }
    }
    for (int i = 0; i < 3; i++) {
        *at++ = belief->command[i] / frames;
    }
    for (int c = 0; c < BELIEF_CHANNELS; c++) {
        *at++ = log(rest[c] / frames + VARIANCE_LEAST);
    }
    *at = frames / 50;
    return 1;
}

/* ---- networks ---- */

/* y += W^T x; weight: [in][out]. */
static void add_product(int in, int out, const float *weight, const float *x, float *y) {
    for (int i = 0; i < in; i++) {
        const float *row = weight + i * out;
        const float factor = x[i];
#pragma omp simd
        for (int j = 0; j < out; j++) {
            y[j] += factor * row[j];
        }
    }
}

static void elu(float *x, int count) {
    for (int i = 0; i < count; i++) {
        x[i] = x[i] > 0 ? x[i] : expm1f(x[i]);
    }
}

/* Linear in log2 of the footsteps. */
static float widened(const float factor[BELIEF_DEPTHS], float footsteps) {
    const float place = fminf(log2f(footsteps), BELIEF_DEPTHS - 1);
    const int at = place < BELIEF_DEPTHS - 2 ? (int)place : BELIEF_DEPTHS - 2;
    const float share = place - (float)at;
    return (1 - share) * factor[at] + share * factor[at + 1];
}

static void find_posterior(Belief *belief, const BeliefNet *net, const float *mean,
                           float footsteps) {
    float in[BELIEF_EMBED + 2], hidden[BELIEF_HIDDEN], out[2 * BELIEF_PARAMETERS];
    memcpy(in, mean, BELIEF_EMBED * sizeof *in);
    in[BELIEF_EMBED] = 1 / footsteps;
    in[BELIEF_EMBED + 1] = logf(footsteps) / 3;
    memcpy(hidden, net->hidden_bias, sizeof hidden);
    add_product(BELIEF_EMBED + 2, BELIEF_HIDDEN, net->hidden[0], in, hidden);
    elu(hidden, BELIEF_HIDDEN);
    memcpy(out, net->out_bias, sizeof out);
    add_product(BELIEF_HIDDEN, 2 * BELIEF_PARAMETERS, net->out[0], hidden, out);
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        const float log_variance = fminf(fmaxf(out[BELIEF_PARAMETERS + i], -6), 3);
        belief->center[i] = out[i];
        belief->spread[i] = expf(0.5f * log_variance) * widened(net->widen[i], footsteps);
    }
}

/* Log odds that the last two footsteps are on other ground than those of the mean. */
static float find_odds(const Belief *belief, const BeliefNet *net) {
    float in[3 * BELIEF_EMBED + 8], hidden[BELIEF_ODDS], second[BELIEF_ODDS_SECOND];
    float *commands = in + 3 * BELIEF_EMBED, out = net->odds_out_bias;
    for (int i = 0; i < BELIEF_EMBED; i++) {
        in[i] = belief->last[0][i] - belief->mean[i];
        in[BELIEF_EMBED + i] = belief->last[1][i] - belief->mean[i];
        in[2 * BELIEF_EMBED + i] = belief->mean[i];
    }
    for (int i = 0; i < 3; i++) {
        commands[i] = belief->last_command[0][i] - belief->mean_command[i];
        commands[3 + i] = belief->last_command[1][i] - belief->mean_command[i];
    }
    commands[6] = 1 / belief->before;
    commands[7] = logf(belief->before) / 3;
    memcpy(hidden, net->odds_bias, sizeof hidden);
    add_product(3 * BELIEF_EMBED + 8, BELIEF_ODDS, net->odds[0], in, hidden);
    elu(hidden, BELIEF_ODDS);
    memcpy(second, net->odds_second_bias, sizeof second);
    add_product(BELIEF_ODDS, BELIEF_ODDS_SECOND, net->odds_second[0], hidden, second);
    elu(second, BELIEF_ODDS_SECOND);
    for (int i = 0; i < BELIEF_ODDS_SECOND; i++) {
        out += second[i] * net->odds_out[i];
    }
    return out;
}

/* In double, because a reading that hardly varies has large weights. */
static void embed(const BeliefNet *net, const double *features, float embedded[BELIEF_EMBED]) {
    double wide[BELIEF_EMBED];
    for (int j = 0; j < BELIEF_EMBED; j++) {
        wide[j] = (double)net->embed_bias[j];
    }
    for (int i = 0; i < BELIEF_FEATURES; i++) {
        for (int j = 0; j < BELIEF_EMBED; j++) {
            wide[j] += features[i] * (double)net->embed[i][j];
        }
    }
    for (int j = 0; j < BELIEF_EMBED; j++) {
        embedded[j] = (float)wide[j];
    }
    elu(embedded, BELIEF_EMBED);
}

/* ---- recursion ---- */

/* Moves the older of the last two footsteps into the mean. */
static void shift(Belief *belief, const float *embedded, const double *command) {
    if (belief->lasts == 2) {
        belief->before = fminf(belief->before + 1, BELIEF_MEMORY);
        for (int i = 0; i < BELIEF_EMBED; i++) {
            belief->mean[i] += (belief->last[1][i] - belief->mean[i]) / belief->before;
        }
        for (int i = 0; i < 3; i++) {
            belief->mean_command[i] +=
                (belief->last_command[1][i] - belief->mean_command[i]) / belief->before;
        }
    }
    memcpy(belief->last[1], belief->last[0], sizeof belief->last[1]);
    memcpy(belief->last[0], embedded, sizeof belief->last[0]);
    memcpy(belief->last_command[1], belief->last_command[0], sizeof belief->last_command[1]);
    for (int i = 0; i < 3; i++) {
        belief->last_command[0][i] = (float)command[i];
    }
    belief->lasts += belief->lasts < 2;
}

/* The mean of all footsteps, and their number. */
static float mean_of_all(const Belief *belief, float *mean) {
    const float all = belief->before + (float)belief->lasts;
    for (int i = 0; i < BELIEF_EMBED; i++) {
        float sum = belief->before * belief->mean[i];
        for (int k = 0; k < belief->lasts; k++) {
            sum += belief->last[k][i];
        }
        mean[i] = sum / all;
    }
    return fminf(all, BELIEF_MEMORY);
}

static int take_footstep(Belief *belief, const BeliefNet *net) {
    double features[BELIEF_FEATURES];
    float embedded[BELIEF_EMBED], mean[BELIEF_EMBED];
    if (!belief->whole || !footstep_features(belief, features)) {
        return 0;
    }
    if (belief->waiting > 0) {
        belief->waiting--;
        return 0;
    }
    int event = BELIEF_FOOTSTEP;
    embed(net, features, embedded);
    shift(belief, embedded, features + BELIEF_BINS * BELIEF_CHANNELS);
    belief->footsteps++;
    belief->log_odds = belief->before > 0 ? find_odds(belief, net) : -INFINITY;
    if (belief->log_odds > net->alarm) {
        belief->before = 0; /* the last two footsteps are all that is known of the new ground */
        memset(belief->mean, 0, sizeof belief->mean);
        memset(belief->mean_command, 0, sizeof belief->mean_command);
        belief->footsteps = belief->lasts;
        belief->alarms++;
        event |= BELIEF_ALARM;
    }
    const float footsteps = mean_of_all(belief, mean);
    find_posterior(belief, net, mean, footsteps);
    return event;
}

int belief_step(Belief *belief, const BeliefNet *net, const float *frame) {
    const double sine = (double)frame[BELIEF_FRAME - 2], cosine = (double)frame[BELIEF_FRAME - 1];
    if (fabs(sine) + fabs(cosine) < 0.5) { /* it stands */
        belief->frames = belief->whole = 0;
        belief->waiting = BELIEF_START;
        return 0;
    }
    const double turn = atan2(sine, cosine) / TWO_PI;
    const double phase = turn < 0 ? turn + 1 : turn;
    const int right = phase >= 0.5;
    const int bin = (int)(BELIEF_BINS * fmod(2 * phase, 1));
    int event = 0;
    if (belief->frames == 0) {
        begin_footstep(belief, right, 0);
    } else if (right != belief->right) {
        event = take_footstep(belief, net);
        begin_footstep(belief, right, 1);
    }
    add_frame(belief, frame, bin < BELIEF_BINS ? bin : BELIEF_BINS - 1);
    return event;
}

/* ---- the posterior ---- */

/* Inverse of the normal distribution function, to 1e-9 (Acklam's start, one step of Halley). */
static double normal_quantile(double share) {
    static const double a[] = {-3.969683028665376e1, 2.209460984245205e2,  -2.759285104469687e2,
                               1.383577518672690e2,  -3.066479806614716e1, 2.506628277459239};
    static const double b[] = {-5.447609879822406e1, 1.615858368580409e2, -1.556989798598866e2,
                               6.680131188771972e1, -1.328068155288572e1};
    static const double c[] = {-7.784894002430293e-3, -3.223964580411365e-1, -2.400758277161838,
                               -2.549732539343734,    4.374664141464968,     2.938163982698783};
    static const double d[] = {7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996,
                               3.754408661907416};
    const double tail = fmin(share, 1 - share), sign = share < 0.5 ? 1 : -1;
    double x;
    if (tail < 0.02425) {
        const double q = sqrt(-2 * log(tail));
        x = sign * (((((c[0] * q + c[1]) * q + c[2]) * q + c[3]) * q + c[4]) * q + c[5]) /
            ((((d[0] * q + d[1]) * q + d[2]) * q + d[3]) * q + 1);
    } else {
        const double q = share - 0.5, r = q * q;
        x = (((((a[0] * r + a[1]) * r + a[2]) * r + a[3]) * r + a[4]) * r + a[5]) * q /
            (((((b[0] * r + b[1]) * r + b[2]) * r + b[3]) * r + b[4]) * r + 1);
    }
    const double e = 0.5 * erfc(-x / sqrt(2)) - share, u = e * sqrt(TWO_PI) * exp(x * x / 2);
    return x - u / (1 + x * u / 2);
}

/* [log SI] Value at a place of its prior. */
static double value_at(const float knot[BELIEF_KNOTS], double place) {
    const double step = 2 * KNOT_LAST / (BELIEF_KNOTS - 1);
    const double at = fmin(fmax((place + KNOT_LAST) / step, 0), BELIEF_KNOTS - 1);
    const int i = at < BELIEF_KNOTS - 2 ? (int)at : BELIEF_KNOTS - 2;
    return (double)knot[i] + (at - i) * (double)(knot[i + 1] - knot[i]);
}

double belief_quantile(const Belief *belief, const BeliefNet *net, BeliefParameter parameter,
                       double share) {
    return exp(value_at(net->prior[parameter],
                        (double)belief->center[parameter] +
                            (double)belief->spread[parameter] * normal_quantile(share)));
}

double belief_log_mean(const Belief *belief, const BeliefNet *net, BeliefParameter parameter) {
    double sum = 0, weights = 0;
    for (int k = -40; k <= 40; k++) {
        const double z = 0.1 * k, weight = exp(-0.5 * z * z);
        sum += weight * value_at(net->prior[parameter], (double)belief->center[parameter] +
                                                            (double)belief->spread[parameter] * z);
        weights += weight;
    }
    return sum / weights;
}

double belief_place(const BeliefNet *net, BeliefParameter parameter, double value) {
    const float *knot = net->prior[parameter];
    const double log_value = log(value), step = 2 * KNOT_LAST / (BELIEF_KNOTS - 1);
    int i = 0;
    while (i < BELIEF_KNOTS - 2 && log_value > (double)knot[i + 1]) {
        i++;
    }
    const double share = (log_value - (double)knot[i]) / (double)(knot[i + 1] - knot[i]);
    return fmin(fmax(step * (i + share) - KNOT_LAST, -KNOT_LAST), KNOT_LAST);
}

static void write_all(const Belief *belief, const BeliefNet *net, const char *between,
                      const char *end, char *text, int size) {
    int used = 0;
    text[0] = 0;
    for (int i = 0; i < BELIEF_PARAMETERS && used < size; i++) {
        const BeliefName *name = &belief_names[i];
        const BeliefParameter p = (BeliefParameter)i;
        const char *unit = name->unit[0] == '-' ? "" : name->unit;
        used += snprintf(text + used, (size_t)(size - used), "%s%s%s %.3g%s%s (%.3g .. %.3g)%s",
                         i ? between : "", name->name, i == BELIEF_sinkage ? " at rest" : "",
                         name->scale * belief_quantile(belief, net, p, 0.5), *unit ? " " : "", unit,
                         name->scale * belief_quantile(belief, net, p, 0.05),
                         name->scale * belief_quantile(belief, net, p, 0.95), end);
    }
}

void belief_text(const Belief *belief, const BeliefNet *net, char *text, int size) {
    write_all(belief, net, ", ", "", text, size);
}

void belief_lines(const Belief *belief, const BeliefNet *net, char *text, int size) {
    write_all(belief, net, "", "\n", text, size);
}
