/* Evaluation's measures on a scripted walk, without simulator, with numbers worked out by hand. */
#include "robots.h"
#include "run/eval/eval.h"
#include "sa01.h"

/* A power of two: sums of it are exact, so the script meets every threshold where it should. */
#define DT (1.0 / 1024)
#define STEPS(seconds) ((int)((seconds)*1024))

/* One step; the feet stand still under 100 N unless set. Behind the robot's feet stands what must
 * not count. */
typedef struct {
    EnvsSample sample;
} Script;

static void script_start(Script *s) {
    *s = (Script){0};
    s->sample =
        (EnvsSample){.feet = SA01_FEET, .joints = SA01_JOINTS, .above = 0.8, .quaternion = {1}};
    for (int f = 0; f < SA01_FEET; f++) {
        s->sample.foot[f].load = 100;
    }
    for (int f = SA01_FEET; f < ROBOT_FEET_MAX; f++) {
        s->sample.foot[f] = (EnvsFoot){.load = 100, .depth = 9};
    }
}

/* ---- power, speed, base ---- */

/* 5 s; two joints work at 10 x 2 = 20 W and -4 x 3 = -12 W, in the second half with both signs
 * turned. Sum 8 W or -8 W, sum of magnitudes 32 W. The base moves at 0.25 m/s for 2 s, then at
 * 0.5 m/s forward and 0.1 m/s to the left. The steady part may end before the trial. */
static Measure script_walk(double steady_end) {
    Script s;
    Measure m;
    script_start(&s);
    measure_start(&m, DT);
    m.steady_end = steady_end;
    for (int k = 1; k <= STEPS(5); k++) {
        double t = k * DT, sign = t <= 2.5 ? 1 : -1;
        int steady = t > 2;
        s.sample.torque[0] = sign * 10;
        s.sample.speed[0] = 2;
        s.sample.torque[11] = -4;
        s.sample.speed[11] = sign * 3;
        s.sample.torque[5] = k == 100 ? -45 : k == 200 ? 30 : 0; /* at rest: no power */
        s.sample.base[0] = -1 + (steady ? 0.5 + 0.5 * (t - 2) : 0.25 * t);
        s.sample.base[1] = 3 + (steady ? 0.1 * (t - 2) : 0);
        s.sample.above = !steady ? (k % 2 ? 0.5 : 1.0) : k % 3 ? 0.79 : 0.82;
        measure_sample(&m, &s.sample);
    }
    return m;
}

/* Two feet carry 100 N each for a second, and then shells 50 N more for a second. */
TEST(shells_share_the_load) {
    Script s;
    Measure m;
    script_start(&s);
    measure_start(&m, DT);
    expect_near("no step", measure_shells(&m), 0, 0);
    for (int k = 1; k <= STEPS(2); k++) {
        s.sample.shell_load = k > STEPS(1) ? 50 : 0;
        measure_sample(&m, &s.sample);
    }
    expect_near("share of the shells", measure_shells(&m), 50.0 / 450, 1e-12);
    measure_start(&m, DT); /* a trial that ended at once: 201 N for a millisecond */
    s.sample.shell_load = 1;
    measure_sample(&m, &s.sample);
    expect_near("share of a step", measure_shells(&m), 1.0 / 201, 1e-12);
}

TEST(power_and_speed) {
    Measure m = script_walk(0);
    expect_near("time", m.time, 5, 0);
    expect_near("steady time", m.steady_time, 3, 0);
    expect_near("energy", m.energy, 8 * 5, 1e-9);
    expect_near("work", m.work, 32 * 3, 1e-9);
    expect_near("greatest torque", m.torque_max, 45, 0);
    expect_near("torque of the last step", m.torque, 10, 0);
    expect_near("start of the steady part", m.start[0], -0.5, 1e-12);
    expect_near("end of the steady part", m.end[0], 1.0, 1e-12);
    expect_near("start of the steady part, y", m.start[1], 3.0, 1e-12);
    expect_near("end of the steady part, y", m.end[1], 3.3, 1e-12);
    expect_near("lowest base", m.base_low, 0.79, 0);
    expect_near("highest base", m.base_high, 0.82, 0);
    m = script_walk(4);
    expect_near("time", m.time, 5, 0);
    expect_near("steady time", m.steady_time, 2, 0);
    expect_near("energy", m.energy, 8 * 5, 1e-9);
    expect_near("work", m.work, 32 * 2, 1e-9);
    expect_near("end of the steady part", m.end[0], 0.5, 1e-12);
    Script s; /* joints that hold still, with less than a newton metre */
    script_start(&s);
    measure_start(&m, DT);
    for (int k = 2; k > 0; k--) {
        s.sample.torque[3] = -0.25 * k;
        measure_sample(&m, &s.sample);
        expect_near("torque of the step", m.torque, 0.25 * k, 0);
        expect_near("greatest torque", m.torque_max, 0.5, 0);
    }
    assert_true(m.base_low > 1e8 && m.base_high < -1e8); /* nothing is steady yet */
}

/* On a circle to the left: 0.5 m/s forward and 0.1 m/s to the left of a heading that turns by 0.8
 * rad/s, 10 s, so that the heading passes pi and the robot comes back to where it was. The steady
 * part lasts 8 s. */
TEST(speeds_of_a_turning_robot) {
    const double v = 0.5, left = 0.1, w = 0.8;
    const uint8_t fallen = 0;
    EvalDef eval = {.speed = 0.5, .turn = 0.7, .trials = 1, .seconds = 10};
    Script s;
    Measure m;
    EvalRow row;
    script_start(&s);
    measure_start(&m, DT);
    for (int k = 1; k <= STEPS(10); k++) {
        const double yaw = w * k * DT;
        s.sample.base[0] = (v * sin(yaw) + left * (cos(yaw) - 1)) / w;
        s.sample.base[1] = (v * (1 - cos(yaw)) + left * sin(yaw)) / w;
        s.sample.quaternion[0] = cos(0.5 * yaw);
        s.sample.quaternion[3] = sin(0.5 * yaw);
        measure_sample(&m, &s.sample);
    }
    expect_near("turned", m.turned, w * 8, 1e-9);
    expect_near("way forward", m.way[0], v * 8, 1e-2);
    expect_near("way to the left", m.way[1], left * 8, 1e-2);
    eval_summarise(&row, "foam45", &eval, &m, &fallen, 400, NULL);
    expect_near("speed", row.velocity, v, 1e-3);
    expect_near("speed to the left", row.velocity_sideways, left, 1e-3);
    expect_near("turning", row.velocity_turn, w, 1e-9);
    assert_true(row.turn == 0.7);
    eval.turn = 0; /* along x, however it turns */
    eval_summarise(&row, "foam45", &eval, &m, &fallen, 400, NULL);
    expect_near("speed along x", row.velocity, (m.end[0] - m.start[0]) / 8, 1e-12);
    assert_true(fabs(row.velocity) < 0.1);
}

/* The heading of a base that is turned about z, then pitched and rolled. */
TEST(yaw_of_an_orientation) {
    for (double yaw = -3; yaw < 3.1; yaw += 0.5) {
        const double cz = cos(0.5 * yaw), sz = sin(0.5 * yaw), cy = cos(0.2), sy = sin(0.2);
        const double q[4] = {cz * cy, -sz * sy, cz * sy, sz * cy};
        expect_near("yaw", measure_yaw(q), yaw, 1e-12);
    }
}

/* What the random start does in the first second does not count: two trials whose legs overlap then
 * and come nearest later, and one that is over by then. */
TEST(legs_after_the_first_second) {
    const uint8_t ends[] = {TASK_END_time, TASK_END_time, TASK_END_tilt};
    const EvalDef eval = {.trials = 3};
    Script s;
    Measure m[3];
    EvalRow row;
    script_start(&s);
    for (int i = 0; i < 3; i++) {
        measure_start(&m[i], DT);
        for (int k = 1; k < STEPS(1) + (i < 2 ? 3 : 0); k++) {
            s.sample.legs = k < STEPS(1) ? -0.02 : k == STEPS(1) + i ? 0.01 * (i + 1) : 0.03;
            measure_sample(&m[i], &s.sample);
        }
    }
    eval_summarise(&row, "foam45", &eval, m, ends, 400, NULL);
    expect_near("legs", row.legs, 0.01, 0);
    eval_summarise(&row, "foam45", &(EvalDef){.trials = 1}, m + 1, ends, 400, NULL);
    expect_near("legs", row.legs, 0.02, 0);
    eval_summarise(&row, "foam45", &(EvalDef){.trials = 1}, m + 2, ends, 400, NULL);
    assert_true(isnan(row.legs));
}

/* ---- feet ---- */

/* Holds both feet as they are for some steps. */
static void hold(Measure *m, Script *s, int steps) {
    for (int k = 0; k < steps; k++) {
        measure_sample(m, &s->sample);
    }
}

static void set_foot(Script *s, int f, double load, double x, double y, double depth) {
    s->sample.foot[f] = (EnvsFoot){.load = load, .center = {x, y}, .depth = depth};
}

static void lift(Script *s, int f, double height) {
    s->sample.foot[f].load = 0;
    s->sample.foot[f].height = height;
}

/* The same stances one by one, of a robot that looks 0.5 rad to the left: of 3 mm along x and 4 mm
 * along y. */
TEST(stances_are_kept) {
    char *text = NULL;
    size_t size = 0;
    FILE *csv = open_memstream(&text, &size);
    const EvalDef eval = {.speed = 0.5, .trials = 1, .seconds = 1, .stances = csv};
    const uint8_t fallen = 0;
    const double forward = 0.003 * cos(0.5) + 0.004 * sin(0.5);
    const double left = 0.004 * cos(0.5) - 0.003 * sin(0.5);
    Script s;
    Measure *m = calloc(1, sizeof *m);
    EvalRow row;
    script_start(&s);
    s.sample.quaternion[0] = cos(0.25);
    s.sample.quaternion[3] = sin(0.25);
    measure_start(m, DT);
    m->keep = 1;
    s.sample.torque[2] = -7; /* while foot 1 stands; more when it is in the air */
    hold(m, &s, 50);
    for (int k = 0; k < 40; k++) {
        set_foot(&s, 1, 100, 0.2, -0.1, 0.012);
        hold(m, &s, 100);
        set_foot(&s, 1, 100, 0.203, -0.096, 0.006);
        hold(m, &s, 100);
        lift(&s, 1, 0.05);
        s.sample.torque[2] = 30;
        hold(m, &s, 50);
        s.sample.torque[2] = -7;
    }
    assert_int_equal(m->stances, 40);
    for (int k = 0; k < 40; k++) {
        const MeasureStance *stance = &m->kept[k];
        assert_int_equal(stance->foot, 1);
        expect_near("start", stance->start, k ? (50 + 250 * k) * DT : 0, 1e-12);
        expect_near("duration", stance->duration, (k ? 200 : 250) * DT, 1e-12);
        expect_near("depth", stance->depth, 0.012, 0);
        expect_near("forward", stance->way[0], k ? forward : 0.203 * cos(0.5) - 0.096 * sin(0.5),
                    1e-12);
        expect_near("left", stance->way[1], k ? left : -0.096 * cos(0.5) - 0.203 * sin(0.5), 1e-12);
        expect_near("apex", stance->apex, k ? 0.05 : 0, 0);
    }
    assert_int_equal(eval_summarise(&row, "foam45", &eval, m, &fallen, 400, NULL), MILD_OK);
    expect_near("magnitude along the heading", row.drift_forward,
                (39 * forward + m->kept[0].way[0]) / 40, 1e-12);
    expect_near("and across it", row.drift_left, (39 * left - m->kept[0].way[1]) / 40, 1e-12);
    fclose(csv);
    assert_memory_equal(text, "foam45,0.5,0,1,0.0000,", 22);
    assert_non_null(strstr(text, "foam45,0.5,0,1,0.2930,0.1953,0.012000,0.004550,0.002072,0.050000,"
                                 "0.20000,-0.10000,7.000\n"));
    expect_near("way of the sole", row.drift_path,
                (39 * hypot(0.003, 0.004) + hypot(0.2, 0.1) + hypot(0.003, 0.004)) / 40, 1e-12);
    free(text);
    measure_free(m, 1);
}

/* A foot comes down every second, at 0.25, 1.25, ... s, first 0.3 m further on, from 5 s on 0.5 m,
 * 0.7 rad to the left of x; meanwhile it goes 20 mm forward and back. The other foot stands.
 * Strides count whose both ends are between 2 and 8.5 s: two of 0.3 m, then four of 0.5 m. */
TEST(strides_and_the_way_of_a_sole) {
    const EvalDef eval = {.speed = 0.5, .trials = 1, .seconds = 10, .stop = 8.5};
    const uint8_t walked = TASK_END_time;
    const double c = cos(0.7), d = sin(0.7);
    Script s;
    Measure m;
    EvalRow row;
    double x = 0;
    script_start(&s);
    measure_start(&m, DT);
    m.steady_end = eval.stop;
    lift(&s, 1, 0.05);
    hold(&m, &s, STEPS(0.25));
    for (int k = 0; k < 10; k++) {
        x += k < 5 ? 0.3 : 0.5;
        for (int out = 0; out < 3; out++) {
            const double at = x + (out == 1 ? 0.02 : 0);
            set_foot(&s, 1, 100, c * at, d * at, 0);
            hold(&m, &s, STEPS(0.125));
        }
        lift(&s, 1, 0.05);
        hold(&m, &s, STEPS(0.625));
    }
    eval_summarise(&row, "foam45", &eval, &m, &walked, 400, NULL);
    assert_int_equal(m.strides, 6); /* from 2.25 s to 8.25 s */
    expect_near("stride", row.stride, (2 * 0.3 + 4 * 0.5) / 6, 1e-12);
    expect_near("cadence", row.cadence, 1, 1e-12);
    expect_near("drift", row.drift, 0, 1e-15);
    expect_near("way", row.drift_path, 0.04, 1e-12);
}

/* Strides of a second, each foot down for 3/8 of it and half a second apart: 1 - 2 3/8 of flight,
 * but from 4 s on the knees are down. A foot bears 300 N, then 900 N, after 3 s 700 N: at most
 * twice the weight on average, and 500 N more at once. Joint 1 drives at 25 rad/s, where its 40 N m
 * have fallen to 20, for 3/4 of the time, and brakes with as much for the rest. */
TEST(flight_and_loads) {
    const EvalDef eval = {.speed = 3, .trials = 1, .seconds = 6};
    const uint8_t ran = TASK_END_time;
    TaskMotor motor[SA01_JOINTS];
    Script s;
    Measure m;
    EvalRow row;
    script_start(&s);
    measure_start(&m, DT);
    m.motor = motor;
    for (int i = 0; i < SA01_JOINTS; i++) {
        motor[i] = (TaskMotor){.limit = 10};
    }
    motor[1] = (TaskMotor){.limit = 40, .full = 20, .fastest = 30};
    for (int k = 0; k < STEPS(6); k++) {
        for (int f = 0; f < SA01_FEET; f++) {
            const int since = (k + f * STEPS(0.5)) % STEPS(1);
            const double late = k < STEPS(3) ? 900 : 700;
            s.sample.foot[f].load = since >= STEPS(0.375) ? 0 : since < STEPS(0.125) ? 300 : late;
        }
        s.sample.shell_load = k < STEPS(4) ? 5 : 6;
        s.sample.torque[0] = 9.8;
        s.sample.speed[1] = 25;
        s.sample.torque[1] = k % 4 ? 20 : -20;
        s.sample.torque[2] = k == STEPS(1) ? 70 : 0; /* before the steady part */
        measure_sample(&m, &s.sample);
    }
    eval_summarise(&row, "foam45", &eval, &m, &ran, 400, NULL);
    expect_near("flight", row.flight, 0.125, 1e-12);
    expect_near("duty", row.duty, 0.375, 1e-12);
    expect_near("peak", row.load_peak, 2, 1e-12);
    expect_near("rate", row.load_rate, 500 / 400.0 / 0.01, 1e-9);
    expect_near("fastest joint", row.joint_speed_max, 25, 0);
    expect_near("torque", row.torque_rms, 20, 1e-12);
    expect_near("at its limit", row.at_limit, 0.75, 1e-12);
    m.motor = NULL;
    eval_summarise(&row, "foam45", &eval, &m, &ran, 400, NULL);
    assert_true(isnan(row.at_limit));
}

/* Flights of 1/4 s about each second, 0.2 m and from 3.5 s on 0.4 m above the 0.6 m at which the
 * centre of mass was after a second; it is lower in stance. One of 1/32 s is no jump, and one that
 * is under way at 2 s does not count. */
TEST(rise_of_jumps) {
    const EvalDef eval = {.jump = 0.3, .trials = 1, .seconds = 4.5};
    const uint8_t ran = TASK_END_time;
    char line[256];
    Script s;
    Measure m;
    EvalRow row;
    script_start(&s);
    measure_start(&m, DT);
    for (int k = 0; k < STEPS(4.5); k++) {
        const int since = (k + STEPS(0.625)) % STEPS(1);
        const int flies = since >= STEPS(0.5) && since < STEPS(0.75);
        const int hops = since >= STEPS(0.875) && since < STEPS(0.90625);
        const double apex = k < STEPS(2.5) ? 9 : k < STEPS(3.5) ? 0.8 : 1;
        for (int f = 0; f < SA01_FEET; f++) {
            s.sample.foot[f].load = flies || hops ? 0 : 100;
        }
        s.sample.mass_center[2] = k < STEPS(1) ? 0.6 : flies ? apex - 0.001 * (since % 2) : 0.4;
        measure_sample(&m, &s.sample);
    }
    eval_summarise(&row, "foam45", &eval, &m, &ran, 400, NULL);
    assert_int_equal(m.flights, 2);
    expect_near("rise", row.rise, 0.3, 1e-12);
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "  rise 0.300 m"));
    row.rise = NAN; /* of the batch engine */
    eval_print_row(&row, line, sizeof line);
    assert_null(strstr(line, "rise"));
}

/* Contact is more than 5 N. */
TEST(contact_is_a_load_above_five_newton) {
    for (int loaded = 0; loaded < 2; loaded++) {
        Script s;
        Measure m;
        script_start(&s);
        measure_start(&m, DT);
        set_foot(&s, 0, 100, 0, 0, 0.01);
        hold(&m, &s, 10);
        s.sample.foot[0].load = loaded ? 5.1 : 5.0;
        hold(&m, &s, STEPS(0.5));
        assert_int_equal(m.stances, !loaded);
    }
}

/* A loss of contact of less than 30 ms (30 steps here are 29.3 ms) neither ends a stance nor makes
 * a swing, and what is lost twice is not added up; 31 steps end it. */
TEST(chatter_ends_no_stance) {
    Script s;
    Measure m;
    script_start(&s);
    measure_start(&m, DT);
    for (int k = 0; k < 5; k++) {
        set_foot(&s, 1, 100, 0.001 * k, 0, 0.001 * k);
        hold(&m, &s, 10);
        lift(&s, 1, 0.02);
        hold(&m, &s, 30);
    }
    assert_true(m.stances == 0 && m.swings == 0);
    hold(&m, &s, 1);
    assert_int_equal(m.stances, 1);
    expect_near("drift over pauses", m.drift_sum, 0.004, 1e-15);
    expect_near("penetration over pauses", m.deepest_sum, 0.004, 0);
    lift(&s, 1, 0.001);
    hold(&m, &s, 100);
    set_foot(&s, 1, 100, 1, 0, 0);
    hold(&m, &s, 1);
    assert_int_equal(m.swings, 1);
    expect_near("the apex counts from the last contact on", m.apex_sum, 0.02, 0);
}

/* A lift up to 5 mm is a stance that ends, but no swing. */
TEST(low_lifts_are_no_swings) {
    static const double height[3] = {0.0049, 0.005, 0.0051};
    for (int i = 0; i < 3; i++) {
        Script s;
        Measure m;
        script_start(&s);
        measure_start(&m, DT);
        hold(&m, &s, 10);
        lift(&s, 0, height[i]);
        hold(&m, &s, 100);
        set_foot(&s, 0, 100, 0, 0, 0);
        hold(&m, &s, 10);
        assert_int_equal(m.stances, 1);
        assert_int_equal(m.swings, i == 2);
    }
}

/* A kept stance has the apex of its own foot's swing before it, and 0 after a low lift. */
TEST(the_apex_before_a_stance) {
    static const double apex[5] = {0, 0, 0.05, 0.04, 0};
    static const int foot[5] = {0, 1, 1, 0, 1};
    Script s;
    Measure *m = calloc(1, sizeof *m);
    script_start(&s);
    measure_start(m, DT);
    m->keep = 1;
    hold(m, &s, 100);
    lift(&s, 0, 0.04);
    hold(m, &s, 100);
    lift(&s, 1, 0.05);
    hold(m, &s, 100);
    set_foot(&s, 0, 100, 0, 0, 0);
    set_foot(&s, 1, 100, 0, 0, 0);
    hold(m, &s, 100);
    lift(&s, 1, 0.003);
    hold(m, &s, 100);
    set_foot(&s, 1, 100, 0, 0, 0);
    hold(m, &s, 100);
    lift(&s, 0, 0.003);
    hold(m, &s, 100);
    lift(&s, 1, 0.003);
    hold(m, &s, 100);
    assert_int_equal(m->stances, 5);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(m->kept[i].foot, foot[i]);
        expect_near("apex", m->kept[i].apex, apex[i], 0);
    }
    measure_free(m, 1);
}

/* Never lifted: both stances count as they are at the end, once. */
TEST(open_stances_count_when_no_foot_was_lifted) {
    Script s;
    Measure m;
    script_start(&s);
    measure_start(&m, DT);
    set_foot(&s, 0, 100, 0, 0, 0.01);
    set_foot(&s, 1, 100, 0, 1, 0.02);
    hold(&m, &s, 10);
    set_foot(&s, 0, 100, 0.006, 0.008, 0.01);
    set_foot(&s, 1, 100, 0, 0.98, 0.02);
    hold(&m, &s, 10);
    measure_finish(&m);
    assert_int_equal(m.stances, 2);
    expect_near("drift", m.drift_sum, 0.03, 1e-15);
    expect_near("penetration", m.deepest_sum, 0.03, 1e-15);
    measure_finish(&m);
    assert_int_equal(m.stances, 2);
    measure_start(&m, DT); /* and one foot that never touches the ground has none */
    lift(&s, 1, 0.1);
    hold(&m, &s, 10);
    measure_finish(&m);
    assert_int_equal(m.stances, 1);
}

/* ---- the row ---- */

/* A trial of `time` seconds, steady from 2 s on, at `speed`. */
static Measure trial(double time, double speed, double work) {
    Measure m;
    measure_start(&m, DT);
    m.time = time;
    m.steady_time = fmax(time - 2, 0);
    m.start[0] = 0.7;
    m.end[0] = 0.7 + speed * m.steady_time;
    m.start[1] = m.end[1] = -2;
    m.work = work;
    m.base_low = 0.80;
    m.base_high = 0.81;
    return m;
}

static EvalRow summarise(Measure *m, const uint8_t *fallen, int trials) {
    const EvalDef eval = {.speed = 0.5, .trials = trials};
    EvalRow row;
    memset(&row, 0xff, sizeof row);
    eval_summarise(&row, "foam45", &eval, m, fallen, 400, NULL);
    assert_string_equal(row.ground, "foam45");
    assert_true(row.speed == 0.5 && row.sideways == 0);
    return row;
}

/* Three trials at 0.4, 0.5 and 0.9 m/s over 4 s: mean 0.6, deviations -0.2, -0.1, 0.3, variance
 * 0.14/2 = 0.07, t = 4.303 at 2 degrees of freedom. Weight 400 N: cost of transport 320/(400 x 1.6)
 * = 0.5, 400/(400 x 2) = 0.5, 2880/(400 x 3.6) = 2, mean 1. The fourth falls at 3 s and counts
 * where all trials do: success, energy, torque, seconds, feet. */
TEST(a_row_from_four_trials) {
    Measure m[4] = {trial(6, 0.4, 320), trial(6, 0.5, 400), trial(6, 0.9, 2880), trial(3, 2, 50)};
    const uint8_t fallen[4] = {0, 0, 0, 1};
    for (int i = 0; i < 4; i++) {
        m[i].energy = 100 * (i + 1);
        m[i].torque_max = 20 + 10 * i;
        m[i].base_high = 0.81 + 0.01 * i;
        m[i].swings = i;
        m[i].apex_sum = 0.04 * i * i;
        m[i].stances = 2 * i + 1;
        m[i].deepest_sum = 0.008 * (i + 1);
        m[i].drift_sum = 0.004 * (i + 2);
    }
    EvalRow row = summarise(m, fallen, 4);
    assert_int_equal(row.trials, 4);
    assert_int_equal(row.success, 3);
    assert_int_equal(row.measured, 3);
    expect_near("velocity", row.velocity, 0.6, 1e-12);
    double half = 4.303 * sqrt(0.07 / 3);
    expect_near("low", row.velocity_low, 0.6 - half, 2e-3 * half);
    expect_near("high", row.velocity_high, 0.6 + half, 2e-3 * half);
    expect_near("cost of transport", row.cot, 1, 1e-12);
    expect_near("deviation of velocity", row.velocity_deviation, sqrt(0.07), 1e-12);
    expect_near("deviation of cot", row.cot_deviation, sqrt(0.75), 1e-12);
    expect_near("deviation of torque", row.torque_deviation, sqrt(500.0 / 3), 1e-12);
    expect_near("oscillation", row.base_oscillation, 0.02, 1e-12);
    expect_near("energy", row.energy, 250, 1e-12);
    expect_near("torque", row.torque_max, 35, 1e-12);
    expect_near("seconds", row.seconds, 21.0 / 4, 1e-12);
    expect_near("clearance", row.clearance, 0.04 * 14 / 6, 1e-12);
    expect_near("penetration", row.penetration, 0.08 / 16, 1e-12);
    expect_near("drift", row.drift, 0.004 * 14 / 16, 1e-12);
}

/* When no trial stayed up the fallen ones that walked for more than half a steady second count. */
TEST(a_row_of_falls) {
    Measure m[3] = {trial(3, 0.5, 200), trial(2.5, 5, 1e6), trial(1.5, 7, 1e6)};
    const uint8_t fallen[3] = {1, 1, 1};
    EvalRow row = summarise(m, fallen, 3);
    assert_int_equal(row.success, 0);
    assert_int_equal(row.measured, 1);
    expect_near("velocity", row.velocity, 0.5, 1e-12);
    assert_true(isnan(row.velocity_low) && isnan(row.velocity_high)); /* one trial has none */
    expect_near("cost of transport", row.cot, 1, 1e-12);
    expect_near("oscillation", row.base_oscillation, 0.01, 1e-12);
    row = summarise(m + 2, fallen, 1); /* too short for any: nothing was measured */
    assert_int_equal(row.measured, 0);
    assert_true(isnan(row.velocity) && isnan(row.cot) && isnan(row.velocity_low));
    assert_true(isnan(row.velocity_high) && isnan(row.base_oscillation) && row.seconds == 1.5);
    assert_true(isnan(row.clearance) && isnan(row.penetration) && isnan(row.drift));
}

/* Backward is a distance too; one that does not move is divided by a millimetre, not by zero. */
TEST(cost_of_transport_backward_and_at_rest) {
    Measure back = trial(4, -0.5, 200), rest = trial(4, 0, 200);
    const uint8_t fallen = 0;
    EvalRow row = summarise(&back, &fallen, 1);
    expect_near("velocity", row.velocity, -0.5, 1e-12);
    expect_near("cost of transport", row.cot, 0.5, 1e-12);
    row = summarise(&rest, &fallen, 1);
    expect_near("at rest", row.cot, 200 / (400 * 1e-3), 1e-9);
}

/* Aside at 0.3 m/s and forward at 0.4 m/s over 2 s: 0.6 m to the left, 0.5 m/s along the way, which
 * counts for the cost of transport when it was asked for, else only the way forward. */
TEST(sideways) {
    const uint8_t fallen[2] = {0};
    for (int asked = 0; asked < 2; asked++) {
        Measure m[2] = {trial(4, 0.4, 200), trial(4, 0.4, 200)};
        m[0].end[1] = m[0].start[1] + 0.8;
        m[1].end[1] = m[1].start[1] + 0.4;
        const EvalDef eval = {.speed = 0.4, .sideways = asked ? 0.3 : 0, .trials = 2};
        EvalRow row;
        eval_summarise(&row, "foam45", &eval, m, fallen, 400, NULL);
        expect_near("asked", row.sideways, asked ? 0.3 : 0, 0);
        expect_near("velocity", row.velocity, 0.4, 1e-12);
        expect_near("to the left", row.velocity_sideways, 0.3, 1e-12);
        double cot = 0.25 * (1 / hypot(0.8, 0.8) + 1 / hypot(0.8, 0.4));
        expect_near("cost of transport", row.cot, asked ? cot : 0.5 / 0.8, 1e-12);
    }
}

TEST(the_printed_row) {
    EvalRow row = {.ground = "sand_loose",
                   .speed = 0.5,
                   .trials = 20,
                   .success = 19,
                   .measured = 19,
                   .velocity = 0.4567,
                   .velocity_low = 0.4467,
                   .velocity_high = 0.4667,
                   .cot = 1.234,
                   .torque_max = 98.76,
                   .clearance = 0.0521,
                   .penetration = 0.0123,
                   .drift = 0.0045,
                   .energy = 1200,
                   .seconds = 10};
    char text[256];
    eval_print_row(&row, text, sizeof text);
    assert_string_equal(text,
                        "sand_loose                  0.50   19/20  0.457 +- 0.010  1.23    98.8"
                        "   52 mm 12.3 mm  4.5 mm     120");
    row.seconds = 0;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "mm       -"));
    row.speed = 0; /* standing has no cost of transport */
    row.cot = NAN;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "0.010     -    98.8"));
    row.sideways = -0.3;
    row.velocity_sideways = -0.2468;
    row.cot = 1.234;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "0.010  1.23    98.8"));
    assert_non_null(strstr(text, "       -  sideways -0.247 of -0.30 m/s"));
    row.measured = 2;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "19/20  0.457 +- 0.010  1.23    98.8"));
    row.measured = 1; /* one trial has no interval */
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "19/20  0.457 +-     -  1.23    98.8"));
    row.measured = 0; /* all fell before there was a speed to measure */
    row.cot = NAN;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "19/20      - +-     -     -    98.8"));
    row.turn = row.sideways = 0;
    row.ends[TASK_END_time] = 17;
    row.ends[TASK_END_tilt] = 2;
    row.ends[TASK_END_joint] = 1;
    eval_print_row(&row, text, sizeof text);
    assert_non_null(strstr(text, "       -  ended by: 2 tilt, 1 joint"));
    row.ends[TASK_END_base] = 3;
    eval_print_row(&row, text, sizeof text);
    assert_names(text, "2 tilt 3 base 1 joint");
    char header[256];
    eval_print_header(header, sizeof header);
    assert_string_equal(header,
                        "ground                       m/s upright   measured m/s   COT  Nm max"
                        "   clear    sink   drift     J/s");
}

/* ---- from a robot ---- */

static void check_stances(const Measure *m, const RobotSim *sim, int rigid) {
    for (int f = 0; f < SA01_FEET; f++) {
        assert_true(m->in_stance[f]);
        const double *center = robot_sim_foot(sim, f)->sole_center;
        assert_true(m->touchdown[f][0] == center[0] && m->touchdown[f][1] == center[1]);
        double deepest = robot_sim_foot(sim, f)->result.depth_max;
        assert_true(m->deepest[f] == (rigid ? 0 : deepest));
    }
}

/* The base is above the ground under it. */
static void check_slope(TaskEnv *env, RobotSim *sim) {
    MildError error = {0};
    MildMapDef slope = mild_map_def_default();
    slope.kind = MILD_MAP_SLOPE;
    slope.slope = 0.1;
    MildMap *map = mild_map_create(&slope, &error);
    assert_non_null(map);
    task_env_rest(env)->terrain.map = map;
    Measure m;
    const double none[SA01_JOINTS] = {0}, *q = robot_sim_qpos(sim);
    measure_start(&m, 1e-3);
    m.time = 3;
    measure_step(&m, env, sim, none);
    expect_near("height on a slope", m.base_high, q[2] - 0.3 - 0.1 * q[0], 1e-12);
    mild_map_destroy(map);
}

/* The same numbers read from a robot: what is put into its state is what the measure must see. */
TEST(a_robot_is_read) {
    MildError error = {0};
    Robot *robot = kit_robot(SA01);
    TaskDef def = task_def_default();
    RobotSim *sim = robot_sim_create(robot, 1e-3, &error);
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    assert_true(sim && env);
    task_env_init(env, &def, robot, 1, 0);
    MildMaterial sand = mild_material_default();
    task_env_rest(env)->terrain = mild_terrain_uniform(&sand);
    task_env_rest(env)->terrain.height = 0.3;
    for (int rigid = 0; rigid < 2; rigid++) {
        RobotVariation variation = robot_variation_nominal();
        variation.rigid = env->variation.rigid = rigid;
        RobotState start = {.qpos = {1.5, 0.2, 0.3 + robot_stand_height(robot) - 0.01, 1}};
        memcpy(start.qpos + 7, robot_default_pose(robot), SA01_JOINTS * sizeof(double));
        double none[SA01_JOINTS] = {0}, torque[SA01_JOINTS] = {[0] = 10, [11] = -4};
        robot_sim_load(sim, &start, &variation);
        for (int k = 0; k < 20; k++) {
            assert_int_equal(
                robot_sim_step(sim, none, NULL, task_env_terrain(env), task_env_ground(env)), 0);
        }
        double load = robot_sim_foot(sim, 0)->force[2],
               depth = robot_sim_foot(sim, 0)->result.depth_max;
        assert_true(load > 5 && (rigid || depth > 1e-3));
        Measure m;
        measure_start(&m, 1e-3);
        m.time = 3; /* in the steady part */
        measure_step(&m, env, sim, torque);
        const double *q = robot_sim_qpos(sim), *qd = robot_sim_qvel(sim);
        double left = 10 * qd[6], right = -4 * qd[17];
        expect_near("energy", m.energy, fabs(left + right) * 1e-3, 1e-15);
        expect_near("work", m.work, (fabs(left) + fabs(right)) * 1e-3, 1e-15);
        expect_near("torque", m.torque_max, 10, 0);
        expect_near("x", m.end[0], 1.5, 0.05);
        expect_near("y", m.end[1], 0.2, 0.05);
        assert_true(m.end[0] == q[0] && m.end[1] == q[1] && fabs(q[0] - 1.5) > 1e-9);
        expect_near("height", m.base_high, q[2] - 0.3, 1e-15);
        check_stances(&m, sim, rigid);
        start.qpos[2] += 0.11; /* 100 mm above the ground */
        robot_sim_load(sim, &start, &variation);
        mild_ground_reset(task_env_ground(env));
        assert_int_equal(
            robot_sim_step(sim, none, NULL, task_env_terrain(env), task_env_ground(env)), 0);
        measure_step(&m, env, sim, torque);
        expect_near("apex", m.apex[0], 0.1, 1e-4);
        expect_near("apex", m.apex[1], 0.1, 1e-4);
    }
    check_slope(env, sim);
    free(env);
    robot_sim_destroy(sim);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
