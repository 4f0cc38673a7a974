/* Turns the measures of the trials into a row of the table. */
#include <math.h>
#include <stdio.h>

#include "base/student.h"
#include "base/text.h"
#include "run/eval/eval.h"

#define STEADY_LEAST 0.5    /* [s] a shorter steady part is too short to measure speed */
#define DISTANCE_LEAST 1e-3 /* [m] keeps the cost of transport of a standing robot finite */

/* Standard deviation of `count` numbers with this mean and this mean of their squares; NaN for one.
 */
static double deviation(double mean, double square, int count) {
    return count > 1 ? sqrt(fmax(square - mean * mean, 0) * count / (count - 1)) : NAN;
}

/* A mean; NaN where nothing was measured. */
static double mean(double sum, int count) {
    return count ? sum / count : NAN;
}

/* Speed, cost of transport and base motion over the steady part of the trials without a fall,
 * because a robot that dives forward and falls is not fast. If all trials fell, of all trials. */
static void summarise_motion(EvalRow *row, const Measure *measures, const uint8_t *ends,
                             double weight) {
    double v_sum = 0, v_square = 0, cot_sum = 0, cot_square = 0, left_sum = 0, turn_sum = 0;
    double oscillation = 0;
    int steady = 0;
    for (int i = 0; i < row->trials; i++) {
        const Measure *m = &measures[i];
        if (m->steady_time <= STEADY_LEAST || (row->success && ends[i] != TASK_END_time)) {
            continue;
        }
        const int turns = row->turn != 0; /* world x is then nobody's direction */
        double distance = turns ? m->way[0] : m->end[0] - m->start[0];
        double left = turns ? m->way[1] : m->end[1] - m->start[1];
        double v = distance / m->steady_time;
        double way = row->sideways != 0 ? hypot(distance, left) : fabs(distance);
        v_sum += v;
        v_square += v * v;
        left_sum += left / m->steady_time;
        turn_sum += m->turned / m->steady_time;
        const double cot = m->work / (weight * fmax(way, DISTANCE_LEAST));
        cot_sum += cot;
        cot_square += cot * cot;
        oscillation += m->base_high - m->base_low;
        steady++;
    }
    const int walks = row->speed != 0 || row->sideways != 0; /* standing has no cost of transport */
    row->measured = steady;
    row->velocity = mean(v_sum, steady);
    row->velocity_deviation = deviation(row->velocity, mean(v_square, steady), steady);
    double half =
        steady > 1 ? student_95(steady - 1) * row->velocity_deviation / sqrt(steady) : NAN;
    row->velocity_low = row->velocity - half;
    row->velocity_high = row->velocity + half;
    row->velocity_sideways = mean(left_sum, steady);
    row->velocity_turn = mean(turn_sum, steady);
    row->cot = walks ? mean(cot_sum, steady) : NAN;
    row->cot_deviation = deviation(row->cot, mean(cot_square, steady), steady);
    row->base_oscillation = mean(oscillation, steady);
}

void eval_print_stances_header(FILE *csv) {
    fprintf(csv, "ground,speed_m_s,trial,foot,start_s,duration_s,depth_m,forward_m,left_m,apex_m,"
                 "x_m,y_m,torque_n_m\n");
}

static MildStatus print_stances(const EvalRow *row, int trial, const Measure *m, FILE *csv,
                                MildError *error) {
    if (m->stances && !m->kept) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d stances", m->stances);
    }
    for (int i = 0; i < m->stances; i++) {
        const MeasureStance *s = &m->kept[i];
        fprintf(csv, "%s,%g,%d,%d,%.4f,%.4f,%.6f,%.6f,%.6f,%.6f,%.5f,%.5f,%.3f\n", row->ground,
                row->speed, trial, s->foot, s->start, s->duration, s->depth, s->way[0], s->way[1],
                s->apex, s->at[0], s->at[1], s->torque);
    }
    return MILD_OK;
}

/* What the feet did, over all stances, swings and strides of the trials. */
static void summarise_feet(EvalRow *row, const Measure *measures) {
    int swings = 0, stances = 0, strides = 0;
    double apex = 0, deepest = 0, drift = 0, path = 0, way[2] = {0, 0}, stride = 0, time = 0;
    for (int i = 0; i < row->trials; i++) {
        const Measure *m = &measures[i];
        apex += m->apex_sum;
        swings += m->swings;
        deepest += m->deepest_sum;
        drift += m->drift_sum;
        path += m->path_sum;
        way[0] += m->way_sum[0];
        way[1] += m->way_sum[1];
        stances += m->stances;
        stride += m->stride_sum;
        time += m->stride_time;
        strides += m->strides;
    }
    row->clearance = mean(apex, swings);
    row->penetration = mean(deepest, stances);
    row->drift = mean(drift, stances);
    row->drift_path = mean(path, stances);
    row->drift_forward = mean(way[0], stances);
    row->drift_left = mean(way[1], stances);
    row->stride = mean(stride, strides);
    row->cadence = strides ? strides / time : NAN;
}

/* Contact and motors over the steady parts of all trials. */
static void summarise_loads(EvalRow *row, const Measure *measures, double weight) {
    double time = 0, flight = 0, flight_rise = 0, stance = 0, peak = 0, rise = 0,
           square[ROBOT_JOINTS_MAX] = {0}, limited[ROBOT_JOINTS_MAX] = {0}, squares = 0, most = 0;
    int stances = 0, motors = 0, flights = 0;
    for (int i = 0; i < row->trials; i++) {
        const Measure *m = &measures[i];
        time += m->steady_time;
        flight += m->flight;
        flights += m->flights;
        flight_rise += m->flight_rise;
        stance += m->stance;
        peak += m->peak_sum;
        rise += m->rise_sum;
        stances += m->stances;
        motors |= m->motor != NULL;
        row->joint_speed_max = fmax(row->joint_speed_max, m->joint_speed);
        for (int j = 0; j < ROBOT_JOINTS_MAX; j++) {
            squares = fmax(squares, square[j] += m->torque_square[j]);
            most = fmax(most, limited[j] += m->limited[j]);
        }
    }
    row->joint_speed_max = time > 0 ? row->joint_speed_max : NAN;
    row->flight = time > 0 ? flight / time : NAN;
    row->rise = mean(flight_rise, flights);
    row->duty = time > 0 ? stance / time : NAN;
    row->load_peak = mean(peak / weight, stances);
    row->load_rate = mean(rise / weight / MEASURE_RISE, stances);
    row->torque_rms = time > 0 ? sqrt(squares / time) : NAN;
    row->at_limit = motors && time > 0 ? most / time : NAN;
}

MildStatus eval_summarise(EvalRow *row, const char *ground, const EvalDef *eval, Measure *measures,
                          const uint8_t *ends, double weight, MildError *error) {
    const int trials = eval->trials;
    MildStatus status = MILD_OK;
    double torque_square = 0, up = 0;
    Smooth smooth = {0};
    *row = (EvalRow){.speed = eval->speed,
                     .sideways = eval->sideways,
                     .turn = eval->turn,
                     .push = eval->push,
                     .jump = eval->jump,
                     .start = eval->start,
                     .trials = trials,
                     .legs = NAN};
    snprintf(row->ground, sizeof row->ground, "%s", ground);
    for (int i = 0; i < trials; i++) {
        Measure *m = &measures[i];
        measure_finish(m);
        row->success += ends[i] == TASK_END_time;
        if (ends[i] == TASK_END_time && !isnan(measure_up(m))) {
            row->righted++;
            up += measure_up(m);
        }
        row->ends[ends[i]]++;
        row->energy += m->energy / trials;
        row->seconds += m->time / trials;
        row->shells += measure_shells(m) / trials;
        row->legs = fmin(row->legs, measure_legs(m)); /* of a number and NaN the number */
        smooth_add(&smooth, &m->smooth);
        row->torque_max += m->torque_max / trials;
        torque_square += m->torque_max * m->torque_max / trials;
        if (eval->stances && status == MILD_OK) {
            status = print_stances(row, i, m, eval->stances, error);
        }
    }
    row->up = mean(up, row->righted);
    row->smooth = smooth_result(&smooth);
    row->torque_deviation = deviation(row->torque_max, torque_square, trials);
    summarise_motion(row, measures, ends, weight);
    summarise_feet(row, measures);
    summarise_loads(row, measures, weight);
    return status;
}

void eval_print_header(char *text, int size) {
    snprintf(text, (size_t)size, "%-26s %5s %7s %14s %5s %7s %7s %7s %7s %7s", "ground", "m/s",
             "upright", "measured m/s", "COT", "Nm max", "clear", "sink", "drift", "J/s");
}

/* The measured speed, and its interval if there are two trials at least. */
static void print_speed(const EvalRow *row, char *text, size_t size) {
    const double half = 0.5 * (row->velocity_high - row->velocity_low);
    if (row->measured > 1) {
        snprintf(text, size, "%6.3f +- %5.3f", row->velocity, half);
    } else if (row->measured == 1) {
        snprintf(text, size, "%6.3f +-     -", row->velocity);
    } else {
        snprintf(text, size, "     - +-     -");
    }
}

/* "  ended by: 2 tilt, 1 base", if not all by time. */
static void print_ends(const EvalRow *row, char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int end = TASK_END_time + 1; end < TASK_END_COUNT; end++) {
        if (row->ends[end] && used < size) {
            used +=
                (size_t)snprintf(text + used, size - used, "%s%d %s",
                                 used ? ", " : "  ended by: ", row->ends[end], task_end_names[end]);
        }
    }
}

/* "  up after 2.1 s", if the robots began lying. */
static void print_up(const EvalRow *row, char *text, size_t size) {
    char up[TEXT_CELL];
    text[0] = '\0';
    if (row->start != TASK_START_STAND) {
        snprintf(text, size, "  up after %s s", text_cell("%.1f", row->up, up));
    }
}

/* "  flight 21 %", "  at limit 3 %": how much of the time, where there is any. */
static void print_loads(const EvalRow *row, char *text, size_t size) {
    int used = 0;
    text[0] = '\0';
    if (row->flight >= 0.01) {
        used = snprintf(text, size, "  flight %.0f %%", 100 * row->flight);
    }
    if (row->jump > 0 && !isnan(row->rise)) {
        used += snprintf(text + used, size - (size_t)used, "  rise %.3f m", row->rise);
    }
    if (row->at_limit >= 0.01) {
        snprintf(text + used, size - (size_t)used, "  at limit %.0f %%", 100 * row->at_limit);
    }
}

void eval_print_row(const EvalRow *row, char *text, int size) {
    const int upright = row->start == TASK_START_STAND ? row->success : row->righted;
    char velocity[32], sideways[64] = "", turning[64] = "", up[64];
    char cot[TEXT_CELL], clearance[TEXT_CELL], sink[TEXT_CELL], drift[TEXT_CELL], part[TEXT_CELL];
    char power[TEXT_CELL], ends[96], loads[64];
    print_loads(row, loads, sizeof loads);
    print_ends(row, ends, sizeof ends);
    print_speed(row, velocity, sizeof velocity);
    print_up(row, up, sizeof up);
    if (row->sideways != 0) {
        snprintf(sideways, sizeof sideways, "  sideways %s of %.2f m/s",
                 text_cell("%.3f", row->velocity_sideways, part), row->sideways);
    }
    if (row->turn != 0) {
        snprintf(turning, sizeof turning, "  turning %s of %.2f rad/s",
                 text_cell("%.3f", row->velocity_turn, part), row->turn);
    }
    snprintf(
        text, (size_t)size, "%-26s %5.2f %4d/%-2d %s %5s %7.1f %4s mm %4s mm %4s mm %7s%s%s%s%s%s",
        row->ground, row->speed, upright, row->trials, velocity, text_cell("%.2f", row->cot, cot),
        row->torque_max, text_cell("%.0f", 1e3 * row->clearance, clearance),
        text_cell("%.1f", 1e3 * row->penetration, sink), text_cell("%.1f", 1e3 * row->drift, drift),
        text_cell("%.0f", row->seconds > 0 ? row->energy / row->seconds : NAN, power), sideways,
        turning, up, loads, ends);
}
