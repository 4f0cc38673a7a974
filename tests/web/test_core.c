/* The core of the page, compiled for this machine: its files, walks and picture. */
#include "page.h"

/* What a file says that is not one. */
TEST(test_files) {
    WebModel *other = aligned_alloc(64, 1 << 20);
    assert_non_null(web_open(model, 20));
    assert_non_null(web_open(model, sizeof *model - 1));
    assert_non_null(web_open(model, model_bytes - 1));
    memcpy(other, model, model_bytes);
    other->magic[3] = 'x';
    assert_non_null(web_open(other, model_bytes));
    memcpy(other, model, model_bytes);
    other->bytes--;
    assert_non_null(web_open(other, model_bytes));
    memcpy(other, model, model_bytes);
    other->policy.actor.width[1]--;
    assert_non_null(web_open(other, model_bytes));
    other->policy.actor.layers = 1000;
    assert_non_null(web_open(other, model_bytes));
    int32_t *const numbers[] = {&other->policy.latent, &other->policy.estimates,
                                &other->policy.feet_velocity, &other->shape.actions,
                                &other->shape.observation};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        memcpy(other, model, model_bytes);
        *numbers[i] += 9;
        assert_non_null(web_open(other, model_bytes));
    }
    memcpy(other, model, model_bytes);
    other->policy.per_dimension = !other->policy.per_dimension;
    assert_non_null(web_open(other, model_bytes));
    free(other);
    start(0, WEB_LEVEL, 1);
    assert_non_null(web_start(-1, WEB_LEVEL, 1));
    assert_non_null(web_start(WEB_OWN, WEB_LEVEL, 1)); /* no soil yet */
    assert_non_null(web_start(WEB_OWN + 1, WEB_LEVEL, 1));
    assert_non_null(web_start(0, WEB_RELIEFS, 1));
}

/* ---- walks ---- */

/* Time of a walk whose speed or depth is measured: all of it, or the first steps of the gait where
 * MILD_TEST_SHORT is set, which takes the same lines on each ground. */
static double some(double seconds) {
    return kit_short() ? seconds / 5 : seconds;
}

/* Steps before a walk of so many is measured: two seconds, or half of a short one. */
static int settling(int steps) {
    return steps < 4 * SECOND ? steps / 2 : 2 * SECOND;
}

/* Walks, and returns the speed behind the first steps, from where the base gets to. */
static double walk(double seconds, float speed) {
    const WebView *view = web_view();
    const int steps = (int)(seconds * SECOND), begin = settling(steps);
    double x = 0, y = 0;
    for (int t = 0; t < steps; t++) {
        if (web_step(speed, 0, 0, 0)) {
            fail_msg("fell after %g s", 0.01 * t);
        }
        x = t == begin - 1 ? (double)view->link[0][3] : x;
        y = t == begin - 1 ? (double)view->link[0][7] : y;
    }
    return hypot((double)view->link[0][3] - x, (double)view->link[0][7] - y) /
           (0.01 * (steps - begin));
}

/* Its steps are those of the batch engine: test_beside.c. */
static void walks_of(int which) {
    const double off = which == ON_SA01 ? 0.05 : 0.1;
    choose(which);
    for (int ground = 0; ground <= WEB_STRIPES; ground++) {
        start(ground, WEB_LEVEL, 1);
        const double speed = walk(some(7), 0.6f);
        printf("  %s, ground %d: %.3f m/s of 0.6, leans by %.3f\n", pages[which].name, ground,
               speed, 1 - (double)web_view()->link[0][10]);
        assert_true(kit_short() || fabs(speed - 0.6) < off);
        assert_true(web_view()->link[0][10] > 0.95f);
    }
}

TEST(test_walks) {
    for (int i = ROBOTS - 1; i >= 0; i--) {
        walks_of(i);
    }
}

static void hills_of(int which) {
    choose(which);
    for (int relief = WEB_WAVES; relief < WEB_RELIEFS; relief++) {
        start(preset("grass"), relief, 1);
        const double speed = walk(some(10), 0.6f);
        float low = 1, high = -1;
        for (int n = 0; n < WEB_HILLS * WEB_HILLS; n++) {
            low = fminf(low, web_hills()[n]);
            high = fmaxf(high, web_hills()[n]);
        }
        printf("  %s, relief %d: %.3f m/s, ground from %.3f to %.3f m\n", pages[which].name, relief,
               speed, (double)low, (double)high);
        assert_true(kit_short() || fabs(speed - 0.6) < 0.1);
        assert_true(low < -0.02f && high > 0.02f);
    }
}

TEST(test_hills) {
    for (int i = ROBOTS - 1; i >= 0; i--) {
        hills_of(i);
    }
}

/* ---- the picture ---- */

/* [m^2] of the window that lies deeper than a centimetre. */
static double pressed(void) {
    const double cell = (double)web_view()->cell;
    int cells = 0;
    for (int n = 0; n < WEB_WINDOW * WEB_WINDOW; n++) {
        cells += web_window()[n] > 0.01f;
    }
    return cells * cell * cell;
}

/* Prints stay on sand, 0.6 m/s in steps of 0.4 s; foam springs back. */
TEST(test_prints) {
    start(preset("sand_loose"), WEB_LEVEL, 1);
    walk(5, 0.6f);
    const double sand = pressed();
    start(preset("foam45"), WEB_LEVEL, 1);
    walk(5, 0.6f);
    const double foam = pressed();
    printf("  pressed after 5 s: sand %.3f m^2, foam %.3f m^2\n", sand, foam);
    assert_true(sand > 10 * 0.02 && sand < 26 * 0.04);
    assert_true(foam > 0.01 && foam < 0.2);
    start(preset("sand_loose"), WEB_LEVEL, 1);
    assert_true(pressed() == 0);
}

/* [m] Drawn at a point. */
static double drawn(const double point[3]) {
    const double cell = (double)web_view()->cell;
    const int i = (int)floor(point[0] / cell) & (WEB_WINDOW - 1);
    const int j = (int)floor(point[1] / cell) & (WEB_WINDOW - 1);
    return (double)web_window()[j * WEB_WINDOW + i];
}

/* [m, world] The lowest corner of a shell as drawn. */
static void lowest_corner(int s, double lowest[3]) {
    const EngineShell *shell = &model->model.number.shell[s];
    const float *link = web_view()->link[model->model.tree.shell_link[s]];
    lowest[0] = lowest[1] = 0;
    lowest[2] = 1e9;
    for (int corner = 0; corner < 8; corner++) {
        double p[3], at[3];
        for (int k = 0; k < 3; k++) {
            p[k] = (double)shell->center[k];
            for (int c = 0; c < 3; c++) {
                const double half = (double)(shell->rotation[3 * k + c] * shell->half[c]);
                p[k] += corner >> c & 1 ? half : -half;
            }
        }
        for (int k = 0; k < 3; k++) {
            const float *row = link + 4 * k;
            at[k] = (double)row[0] * p[0] + (double)row[1] * p[1] + (double)row[2] * p[2] +
                    (double)row[3];
        }
        if (at[2] < lowest[2]) {
            memcpy(lowest, at, sizeof at);
        }
    }
}

/* Shanks in the ground press what is drawn of it, as deep as they are: an imprint that stays in
 * sand and springs back in foam. A corner of their boxes on end is narrower than a cell. */
TEST(test_imprints_of_shells) {
    static const float still[TASK_COMMANDS] = {0};
    static const float kneel[6] = {0, 0, -0.5f, 4, -2, 0};
    for (int sand = 0; sand < 2; sand++) {
        float action[SA01_JOINTS];
        double deepest[3] = {0, 0, 0}, above = 0, shown = 0;
        memcpy(action, kneel, sizeof kneel);
        memcpy(action + 6, kneel, sizeof kneel);
        start(preset(sand ? "sand_loose" : "foam28"), WEB_LEVEL, 1);
        for (int end = 0; !end;) {
            end = web_move(action, still);
            web_show();
            for (int s = 1; s < model->model.tree.shells; s++) { /* shell 0 is the base */
                double at[3];
                lowest_corner(s, at);
                above = fmax(above, -at[2] - drawn(at));
                if (at[2] < deepest[2]) {
                    memcpy(deepest, at, sizeof at);
                    shown = drawn(at);
                }
            }
        }
        web_again();
        web_move(action, still);
        web_show();
        const double left = drawn(deepest);
        printf(
            "  a shank %.0f mm in %s, drawn %.0f mm deep; at most %.1f mm deeper than drawn (bound "
            "25); %.0f mm once it has left\n",
            -1e3 * deepest[2], sand ? "sand" : "foam", 1e3 * shown, 1e3 * above, 1e3 * left);
        assert_true(deepest[2] < -0.03 && above < 0.025 && shown < 0.01 - deepest[2]);
        assert_true(sand ? left > 0.9 * shown : left == 0);
    }
}

/* [m^2] Deeper than `depth` between two places along x. */
static double pressed_between(double low, double high, float depth) {
    const double cell = (double)web_view()->cell;
    int cells = 0;
    for (int i = (int)floor(low / cell); i < (int)floor(high / cell); i++) {
        for (int j = 0; j < WEB_WINDOW; j++) {
            cells += web_window()[j * WEB_WINDOW + (i & (WEB_WINDOW - 1))] > depth;
        }
    }
    return cells * cell * cell;
}

/* [rad] Where the robot faces, by its drawn base. */
static double facing(void) {
    return atan2((double)web_view()->link[0][4], (double)web_view()->link[0][0]);
}

/* Walks at a speed along x, past x [m]. The page holds no heading, and in sand the robot turns. */
static void walk_past(double x, float speed) {
    const WebView *view = web_view();
    for (int t = 0; speed * ((double)view->link[0][3] - x) < 0; t++) {
        assert_true(t < 30 * SECOND);
        assert_false(web_step(speed, 0, (float)-facing(), 0));
    }
}

/* The window follows the robot: what left it and comes back is what the ground remembers, which
 * standing up again leaves as it is. The slope around a print, which is drawn first, is no part of
 * that; it is up to 80 mm deep. */
TEST(test_window) {
    start(preset("sand_loose"), WEB_LEVEL, 1);
    walk_past(3, 0.6f);
    const double before = pressed_between(0.2, 2.2, 0.085f);
    web_again();
    walk_past(11, 1.0f);
    const double ahead = pressed_between(12, 15, 0);
    assert_true(pressed_between(0.2, 2.2, 0.085f) != before); /* it has left the window */
    walk_past(4, -1.0f);
    const double after = pressed_between(0.2, 2.2, 0.085f);
    printf("  %.3f m^2 pressed; after a way to 11 m and back to 4 m %.3f m^2\n", before, after);
    assert_true(before > 0.05 && fabs(after / before - 1) < 0.05 && ahead == 0);
}

/* [m] The deepest elements of the two feet of a robot that stands: means over six of eight seconds,
 * in which it sways; only the first of them where MILD_TEST_SHORT is set. */
static double standing_depth(double stiffness) {
    const int steps = (int)(some(8) * SECOND), begin = settling(steps);
    double sum = 0;
    web_change(stiffness, 1);
    for (int t = 0; t < steps; t++) {
        assert_false(web_step(0, 0, 0, 0));
        sum += t < begin ? 0 : (double)(web_view()->depth[0] + web_view()->depth[1]) / 2;
    }
    return sum / (steps - begin);
}

/* [N] The sum of what the elements press. */
static double carried(void) {
    const WebView *view = web_view();
    double sum = 0;
    for (int e = 0; e < 2 * view->elements; e++) {
        sum += (double)view->pressure[e / view->elements][e % view->elements];
    }
    return sum * pow((double)view->pitch, 2);
}

/* The centre of pressure that is shown is that of the elements, and so is the load of each foot;
 * the feet carry the weight, with a little help of the shells. */
static void soles_of(int which) {
    const WebView *view = web_view();
    double worst = 0, load = 0, shells = 0, apart = 0;
    int seen = 0;
    choose(which);
    const double weight = 9.81 * robot_total_mass(robot);
    start(preset("sand_loose"), WEB_LEVEL, 1);
    for (int t = 0; t < 3 * SECOND; t++) {
        assert_false(web_step(0.6f, 0, 0, 0));
        shells += (double)view->shell_load / (3 * SECOND);
        for (int f = 0; f < view->feet; f++) {
            double sum = 0, center[2] = {0, 0};
            for (int e = 0; e < view->elements; e++) {
                const double pressure = (double)view->pressure[f][e];
                sum += pressure;
                center[0] += pressure * (double)view->x[f][e];
                center[1] += pressure * (double)view->y[f][e];
            }
            const double force = sum * pow((double)view->pitch, 2);
            load += (double)view->load[f] / (3 * SECOND);
            apart = fmax(apart, fabs((double)view->load[f] - force));
            for (int k = 0; k < 2 && force > 0.25 * weight; k++, seen++) {
                worst = fmax(worst, fabs(center[k] / sum - (double)view->center[f][k]));
            }
        }
    }
    printf("  %s: the centre of pressure is apart by at most %.1f mm; %d feet carry %.1f N of %.1f "
           "N, shells %.1f N\n",
           pages[which].name, 1e3 * worst, view->feet, load, weight, shells);
    printf("  each foot's load is apart from that of its elements by at most %.2f N\n", apart);
    assert_int_equal(view->feet, which == ON_GO1 ? 4 : 2);
    assert_true(seen > SECOND && worst < 5e-4 && apart < 0.1);
    assert_true(fabs((load + shells) / weight - 1) < 0.1 && load > 0.7 * weight);
}

/* The G1 that runs: 3 m/s over grass, with both feet off the ground; then it turns in place. */
TEST(test_run) {
    const WebView *view = web_view();
    int flies = 0;
    choose(ON_G1_RUN);
    start(preset("grass"), WEB_LEVEL, 1);
    walk(3, 3);
    const double from = (double)view->link[0][3], left = (double)view->link[0][7];
    for (int t = 0; t < 3 * SECOND; t++) {
        assert_false(web_step(3, 0, 0, 0));
        flies += view->load[0] == 0 && view->load[1] == 0;
    }
    const double speed =
        hypot((double)view->link[0][3] - from, (double)view->link[0][7] - left) / 3;
    double turned = 0;
    for (int t = 0; t < 24 * SECOND; t++) {
        assert_false(web_step(0, 0, 0.8f, 0));
        turned += t < 4 * SECOND ? 0 : 0.01 / 20 * (double)view->velocity[2];
    }
    printf("  it runs at %.2f m/s, flies %d %% of the time, and turns at %.2f rad/s\n", speed,
           flies * 100 / (3 * SECOND), turned);
    choose(ON_SA01);
    assert_true(speed > 2.7 && flies > 3 * SECOND / 10);
    assert_true(fabs(turned - 0.8) < 0.04); /* by the speed hold; 0.72 without */
}

/* The G1 that jumps: the highest that its base gets [m] while no foot carries, in so many steps. */
static double flight(int steps, float rise) {
    const WebView *view = web_view();
    float top = 0;
    for (int t = 0; t < steps; t++) {
        assert_false(web_step(0, 0, 0, rise));
        const int flies = view->load[0] == 0 && view->load[1] == 0;
        top = flies ? fmaxf(top, view->link[0][11]) : top;
    }
    return (double)top;
}

/* It stands without a rise; with one it jumps twice, each time for 0.6 s and a flight of 0.57 s. */
TEST(test_jump) {
    choose(ON_G1_JUMP);
    start(preset("grass"), WEB_LEVEL, 1);
    assert_true(flight(2 * SECOND, 0) == 0);
    const double stands = (double)web_view()->link[0][11], top = flight(234, 0.4f);
    printf("  it stands at %.2f m and jumps to %.2f m\n", stands, top);
    flight(SECOND, 0);
    assert_true(top - stands > 0.2 && flight(SECOND, 0) == 0 && web_view()->link[0][10] > 0.95f);
    choose(ON_SA01);
}

TEST(test_soles) {
    for (int i = ROBOTS - 1; i >= 0; i--) {
        soles_of(i);
    }
}

static void walk_to(double x) {
    for (int t = 0; (double)web_view()->link[0][3] < x; t++) {
        assert_true(t < 20 * SECOND);
        assert_false(web_step(1, 0, 0, 0));
    }
}

/* In stripes of WEB_STRIPE, as the page draws them: prints stay in sand, and not in foam. */
TEST(test_stripes) {
    const double foam = preset("foam28") * WEB_STRIPE, sand = preset("sand_loose") * WEB_STRIPE;
    start(WEB_STRIPES, WEB_LEVEL, 1);
    walk_to(foam + 2 * WEB_STRIPE);
    const double left = pressed_between(foam + 0.3, foam + WEB_STRIPE - 0.3, 0.01f);
    walk_to(sand + 1.5 * WEB_STRIPE);
    const double kept = pressed_between(sand + 0.3, sand + WEB_STRIPE - 0.3, 0.01f);
    printf("  pressed behind it: %.3f m^2 of foam, %.3f m^2 of sand\n", left, kept);
    assert_true(left == 0 && kept > 0.1);
}

/* The same of the batch engine's robot on a material of that stiffness. */
static double rival_depth(double stiffness) {
    const int steps = (int)(some(8) * SECOND), begin = settling(steps);
    Rival rival = {0};
    double sum = 0;
    rival_start(&rival, preset("foam45"), stiffness, 0);
    EnvsSample sample[16];
    assert_true(envs_physics_steps(rival.envs) <= 16);
    envs_set_samples(rival.envs, sample);
    for (int t = 0; t < steps; t++) {
        float action[SA01_JOINTS];
        web_act(rival.history, action);
        rival_step(&rival, action);
        assert_false(rival.done);
        sum += t < begin ? 0 : (sample[0].foot[0].depth + sample[0].foot[1].depth) / 2;
    }
    envs_destroy(rival.envs);
    return sum / (steps - begin);
}

TEST(test_sliders) {
    double load = 0;
    start(preset("foam45"), WEB_LEVEL, 1);
    /* on softer foam it leans, and how deep its feet are depends on how it came to stand */
    const double stiffness[2] = {3, 1};
    double depth[2];
    for (int i = 0; i < 2; i++) {
        depth[i] = standing_depth(stiffness[i]);
    }
    for (int i = 0; i < 2; i++) {
        const double rival = rival_depth(stiffness[i]);
        printf("  depth on foam45 at %.1f times its stiffness: %.1f mm; the batch engine's %.1f\n",
               stiffness[i], 1e3 * depth[i], 1e3 * rival);
        /* with k_pen alone three times as large the feet are twice as deep */
        assert_true(kit_short() || fabs(depth[i] - rival) < 0.1 * rival);
    }
    for (int t = 0; t < 4 * SECOND; t++) {
        web_step(0, 0, 0, 0);
        load += carried() / (4 * SECOND);
    }
    printf("  the soles carry %.1f N of %.1f N\n", load, 9.81 * robot_total_mass(robot));
    assert_true(fabs(load / (9.81 * robot_total_mass(robot)) - 1) < 0.03);
    for (int rigid = 0; rigid < 2; rigid++) {
        start(rigid ? WEB_RIGID : preset("rubber"), WEB_LEVEL, 1);
        web_change(1, 0.05);
        float fastest = 0;
        for (int t = 0; t < 3 * SECOND && !web_step(0.8f, 0, 0, 0); t++) {
            fastest = fmaxf(fastest, web_view()->velocity[0]);
        }
        printf("  on ice it gets to %.2f of 0.8 m/s\n", (double)fastest);
        assert_true(fastest < 0.6f);
    }
}

/* Four seconds that turn and go sideways: the velocity that is shown is, in the mean over the last
 * one, that of the drawn base, along its heading, to the left, and of its turning. */
static void turn_away(void) {
    const WebView *view = web_view();
    double from[3] = {0, 0, 0}, shown[3] = {0, 0, 0};
    for (int t = 0; t < 4 * SECOND; t++) {
        assert_false(web_step(0.37f, 0.11f, 0.5f, 0));
        for (int k = 0; k < 3 && t >= 3 * SECOND; k++) {
            shown[k] += (double)view->velocity[k] / SECOND;
        }
        if (t == 3 * SECOND - 1) {
            from[0] = (double)view->link[0][3];
            from[1] = (double)view->link[0][7];
            from[2] = facing();
        }
    }
    const double x = (double)view->link[0][3] - from[0], y = (double)view->link[0][7] - from[1];
    const double turned = facing() - from[2], way = facing() - turned / 2;
    const double went[3] = {x * cos(way) + y * sin(way), y * cos(way) - x * sin(way), turned};
    printf("  shown %.3f m/s, %.3f m/s, %.3f rad/s; went %.3f, %.3f, %.3f\n", shown[0], shown[1],
           shown[2], went[0], went[1], went[2]);
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(shown[k] - went[k]) < 0.08);
    }
}

/* It stands up where it fell, as it faced, and the prints are there still. */
TEST(test_again) {
    start(preset("sand_loose"), WEB_LEVEL, 1);
    walk(4, 0.6f);
    const double before = pressed(), x = (double)web_view()->link[0][3];
    web_again();
    walk(3, 0.0f);
    printf("  at %.2f m, then %.2f m; pressed %.3f, then %.3f m^2\n", x,
           (double)web_view()->link[0][3], before, pressed());
    assert_true(fabs((double)web_view()->link[0][3] - x) < 0.1);
    assert_true(pressed() >= before);
    const double from = facing();
    turn_away();
    const double turned = facing();
    web_again();
    printf("  turned from %.2f to %.2f rad, shown %.2f rad, then %.2f rad\n", from, turned,
           (double)web_view()->yaw, facing());
    assert_true(fabs(turned - from - 2) < 0.3); /* 4 s at 0.5 rad/s */
    assert_true(fabs((double)web_view()->yaw - turned) < 1e-5);
    assert_true(fabs(facing() - turned) < 0.01);
    start(preset("foam25"), WEB_LEVEL, 1);
    walk(4, 0.6f);
    const double foam = pressed();
    web_again();
    printf("  foam pressed %.3f m^2, then %.3f m^2\n", foam, pressed());
    assert_true(foam > 0.01 && pressed() == 0);
}

/* Where the base is after two seconds of walking, and the deepest element on the way. soil: text of
 * a file, NULL: the ground. */
static void walk_two_seconds(const char *soil, int ground, float found[3]) {
    assert_null(web_open(model, model_bytes));
    if (soil) {
        strcpy(web_text(), soil);
        assert_null(web_soil());
        ground = WEB_OWN;
    }
    assert_null(web_start(ground, WEB_LEVEL, 1));
    found[2] = 0;
    for (int t = 0; t < 2 * SECOND; t++) {
        assert_false(web_step(0.5f, 0, 0, 0));
        found[2] = fmaxf(found[2], fmaxf(web_view()->depth[0], web_view()->depth[1]));
    }
    found[0] = web_view()->link[0][3];
    found[1] = web_view()->link[0][7];
}

/* A soil's file is the ground that it names: to the last bit the preset's, where it changes nothing
 * of it. */
TEST(test_soil) {
    float own[3], usual[3];
    walk_two_seconds("[ground]\npreset = grass\n", 0, own);
    walk_two_seconds(NULL, preset("grass"), usual);
    assert_memory_equal(own, usual, sizeof own);
    walk_two_seconds("[ground]\npreset = grass\nk_pen = 200\nsigma_cone = 1e5\n", 0, own);
    assert_true(own[2] > 1.2f * usual[2]);
    walk_two_seconds("[ground]\npreset = sandy_loam\n", 0, usual); /* another model */
    assert_true(usual[2] > 0 && usual[2] < own[2]);
    strcpy(web_text(), "[ground]\npreset = gras\n");
    assert_non_null(strstr(web_soil(), "soil.ini:2: preset: unknown ground 'gras'"));
    memset(web_text(), '#', WEB_TEXT); /* its end is the core's */
    assert_non_null(web_soil());
    strcpy(web_text(), "[ground]\nmodel = con_spring\nk_pen = 2e4\nmu = 1\nk_drift = 1\n"
                       "b_drift = 1\nrecovery = 1\nbed_depth = 1\n");
    assert_non_null(strstr(web_soil(), "many elements"));
    assert_null(
        web_start(WEB_OWN, WEB_LEVEL, 1)); /* the soil before stays, for another robot too */
    choose(ON_GO1);
    start(WEB_OWN, WEB_LEVEL, 1);
    choose(ON_SA01);
}

TEST_MAIN(setup, teardown)
