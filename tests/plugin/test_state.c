/* The ground's memory is part of MuJoCo's state: saved and restored bit by bit, copied, stepped in
 * halves, evaluated again, and by several threads at once. */
#include <math.h>
#include <pthread.h>

#include "plugin_kit.h"

/* Two plates joined by a hinge with a motor, on two grounds, with prints. They hop. */
static mjModel *hopper(const char *more) {
    char head[1500], text[3500];
    kit_head(head, sizeof head, 0.002, "implicitfast", "left right", "sand_loose foam45",
             CONFIG("terrain.patches", "stripes") CONFIG("terrain.patch_size", "0.2")
                 CONFIG("prints", "64") CONFIG("terrain.kind", "waves")
                     CONFIG("terrain.amplitude", "0.01"));
    snprintf(text, sizeof text,
             "%s<worldbody><body name='left' pos='0 .12 0.02'><freejoint/><geom type='box' "
             "size='.1 .05 .01' mass='3' contype='0' conaffinity='0'/><body name='right' pos='0 "
             "-.24 0'><joint name='hip' axis='1 0 0' range='-40 40' damping='.5'/><geom "
             "type='box' size='.1 .05 .01' mass='3' contype='0' conaffinity='0'/></body></body>"
             "</worldbody>%s</mujoco>",
             head, more);
    return kit_model(text);
}
#define MOTOR "<actuator><position joint='hip' kp='60' kv='3'/></actuator>"

/* Swings the hinge, so that the plates lift off and land. */
static void steps(const mjModel *m, mjData *d, int count) {
    for (int i = 0; i < count; i++) {
        for (int u = 0; u < m->nu; u++) {
            d->ctrl[u] = 0.6 * sin(20 * d->time);
        }
        mj_step(m, d);
    }
}

static void check_same(const mjModel *m, const mjData *a, const mjData *b) {
    assert_memory_equal(a->qpos, b->qpos, (size_t)m->nq * sizeof(double));
    assert_memory_equal(a->qvel, b->qvel, (size_t)m->nv * sizeof(double));
    assert_memory_equal(a->plugin_state, b->plugin_state, (size_t)m->npluginstate * sizeof(double));
}

/* Elements that are deeper than 1 mm now. */
static int pressed(const mjModel *m, const mjData *d) {
    const MildGround *ground = (const MildGround *)(void *)d->plugin_state;
    const Soft *soft = plugin_soft(m, d);
    int count = 0;
    for (int f = 0; f < 2; f++) {
        for (int e = 0; e < mild_sole_elements(soft->soles[f]); e++) {
            count += mild_ground_depth_max(ground, f)[e] > 0.001;
        }
    }
    return count;
}

/* Bool: the ground remembers something, so that the comparisons mean something. */
static int remembers(const mjModel *m, const mjData *d) {
    return pressed(m, d) > 0;
}

TEST(restores_bit_by_bit) {
    mjModel *m = hopper(MOTOR);
    mjData *d = mj_makeData(m), *other = mj_makeData(m);
    const int size = mj_stateSize(m, mjSTATE_INTEGRATION);
    double *saved = calloc((size_t)size, sizeof *saved);
    steps(m, d, 237);
    assert_true(remembers(m, d));
    mj_getState(m, d, saved, mjSTATE_INTEGRATION);
    steps(m, other, 50); /* elsewhere in between */
    mj_setState(m, other, saved, mjSTATE_INTEGRATION);
    steps(m, d, 300);
    steps(m, other, 300);
    check_same(m, d, other);
    mj_setState(m, d, saved, mjSTATE_INTEGRATION);
    steps(m, d, 300);
    check_same(m, d, other);
    mj_resetData(m, d);
    mj_resetData(m, other);
    assert_false(remembers(m, d));
    steps(m, d, 537);
    steps(m, other, 237);
    mj_setState(m, other, saved, mjSTATE_INTEGRATION);
    steps(m, other, 300);
    check_same(m, d, other);
    free(saved);
    mj_deleteData(d);
    mj_deleteData(other);
    mj_deleteModel(m);
}

TEST(copies_go_on_alike) {
    mjModel *m = hopper(MOTOR);
    mjData *d = mj_makeData(m);
    steps(m, d, 237);
    mjData *copy = mj_copyData(NULL, m, d);
    steps(m, d, 100);
    steps(m, copy, 100);
    check_same(m, d, copy);
    mj_forward(m, d); /* a copy within a step */
    mj_copyData(copy, m, d);
    mj_implicit(m, d);
    mj_implicit(m, copy);
    check_same(m, d, copy);
    mj_deleteData(d);
    mj_deleteData(copy);
    mj_deleteModel(m);
}

/* Evaluating a step again changes nothing, neither as a whole nor from a later stage on, and
 * mj_step1 with mj_step2 is mj_step. */
TEST(evaluates_again) {
    mjModel *m = hopper(MOTOR);
    mjData *d = mj_makeData(m), *other = mj_makeData(m);
    for (int i = 0; i < 300; i++) {
        d->ctrl[0] = other->ctrl[0] = 0.6 * sin(20 * d->time);
        mj_step(m, d);
        if (i % 3 == 0) {
            mj_forward(m, other);
            mj_forwardSkip(m, other, mjSTAGE_POS, 1);
            mj_forwardSkip(m, other, mjSTAGE_VEL, 0);
            mj_forwardSkip(m, other, mjSTAGE_VEL, 1);
            mj_implicit(m, other);
        } else {
            mj_step1(m, other);
            mj_step2(m, other);
        }
    }
    assert_true(remembers(m, d));
    check_same(m, d, other);
    mj_deleteData(d);
    mj_deleteData(other);
    mj_deleteModel(m);
}

/* A model without actuators, or with actuation disabled, takes another way through MuJoCo and must
 * end at the same place. */
TEST(ways_through_the_stages_agree) {
    static const int integrators[] = {mjINT_EULER, mjINT_IMPLICITFAST, mjINT_IMPLICIT,
                                      mjINT_DISCRETE};
    for (int k = 0; k < 4; k++) {
        mjModel *none = hopper(""), *motor = hopper("<actuator><motor joint='hip'/></actuator>"),
                *off = hopper("<actuator><motor joint='hip'/></actuator>");
        none->opt.integrator = motor->opt.integrator = off->opt.integrator = integrators[k];
        off->opt.disableflags |= mjDSBL_ACTUATION;
        mjData *a = mj_makeData(none), *b = mj_makeData(motor), *c = mj_makeData(off);
        a->qvel[6] = b->qvel[6] = c->qvel[6] = 3;
        kit_run(none, a, 0.6);
        kit_run(motor, b, 0.6);
        kit_run(off, c, 0.6);
        assert_true(remembers(none, a));
        check_same(none, a, b);
        check_same(none, a, c);
        mj_deleteData(a);
        mj_deleteData(b);
        mj_deleteData(c);
        mj_deleteModel(none);
        mj_deleteModel(motor);
        mj_deleteModel(off);
    }
}

typedef struct {
    const mjModel *model;
    mjData *data;
    int count;
} Work;

static void *work(void *context) {
    Work *w = context;
    w->data = mj_makeData(w->model);
    steps(w->model, w->data, w->count);
    return NULL;
}

TEST(threads_agree) {
    enum { THREADS = 6 };
    mjModel *m = hopper(MOTOR);
    pthread_t thread[THREADS];
    Work works[THREADS];
    for (int t = 0; t < THREADS; t++) {
        works[t] = (Work){m, NULL, 500};
        assert_int_equal(pthread_create(&thread[t], NULL, work, &works[t]), 0);
    }
    for (int t = 0; t < THREADS; t++) {
        pthread_join(thread[t], NULL);
        check_same(m, works[0].data, works[t].data);
    }
    for (int t = 0; t < THREADS; t++) {
        mj_deleteData(works[t].data);
    }
    mj_deleteModel(m);
}

/* ---- a state that changes at any moment ---- */

static uint64_t random_bits(uint64_t *seed) {
    *seed += 0x9e3779b97f4a7c15u; /* splitmix64 */
    uint64_t z = *seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* Changes words, pieces or all of the state: any bits, small numbers, bytes moved from elsewhere in
 * it, a state of another moment, one of another model. */
static void change_state(const mjModel *m, mjData *d, const mjData *past, const mjData *other,
                         size_t others, uint64_t *seed) {
    const size_t words = (size_t)m->npluginstate * 2, bytes = words * 4;
    const size_t head = sizeof(MildGround) / 4;
    int32_t *state = (int32_t *)(void *)d->plugin_state;
    const uint64_t draw = random_bits(seed);
    const size_t at = (draw >> 8) % (draw & 8 ? words : head);
    const size_t length = (draw >> 40) % (words - at) + 1;
    switch (draw % 7) {
    case 0: state[at] = (int32_t)random_bits(seed); break;
    case 1: state[at] = (int32_t)(random_bits(seed) % 300) - 3; break;
    case 2: d->plugin_state[at / 2] = 1e300 * (double)(int64_t)random_bits(seed); break;
    case 3: memmove(state, state + at, 4 * length); break;
    case 4: memcpy(state, past->plugin_state, 4 * length); break;
    case 5: memcpy(state, other->plugin_state, others < bytes ? others : bytes); break;
    default: ((uint8_t *)state)[4 * at] ^= (uint8_t)(1u << (draw >> 60 & 7)); break;
    }
}

/* A step in its stages, with something done to the state between two of them. */
static void step_changed(const mjModel *m, mjData *d, const mjData *past, const mjData *other,
                         size_t others, mjvScene *scene, uint64_t *seed) {
    static mjvOption option;
    mjvCamera camera;
    const int moment = (int)(random_bits(seed) % 5);
    mjv_defaultCamera(&camera);
    mjv_defaultOption(&option);
    for (int stage = 0; stage < 5; stage++) {
        if (stage == moment) {
            change_state(m, d, past, other, others, seed);
        }
        switch (stage) {
        case 0: mj_step1(m, d); break;
        case 1: mj_forward(m, d); break;
        case 2: mj_forwardSkip(m, d, mjSTAGE_VEL, 0); break;
        case 3: mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, scene); break;
        default: mj_implicit(m, d); break;
        }
    }
}

/* MILD_TEST_CHANGES: number of changes, MILD_TEST_SEED: first seed. */
TEST(changed_states_are_survived) {
    const char *count = getenv("MILD_TEST_CHANGES"), *first = getenv("MILD_TEST_SEED");
    const int changes = count ? atoi(count) : 2000;
    uint64_t seed = first ? (uint64_t)strtoull(first, NULL, 10) : 1;
    char head[1000], text[1500];
    kit_head(head, sizeof head, 0.002, "implicitfast", "plate", "rubber", CONFIG("prints", "128"));
    snprintf(text, sizeof text,
             "%s<worldbody><body name='plate' pos='0 0 .01'><freejoint/><geom type='box' size='.1 "
             ".07 .01' mass='3' contype='0' conaffinity='0'/></body></worldbody></mujoco>",
             head);
    mjModel *m = hopper(MOTOR), *n = kit_model(text);
    mjData *d = mj_makeData(m), *past = mj_makeData(m), *other = mj_makeData(n);
    mjvScene scene;
    int resets = 0, loaded = 0;
    mjv_defaultScene(&scene);
    mjv_makeScene(m, &scene, 2000);
    steps(n, other, 150);
    for (int c = 0; c < changes; c++) {
        if (c % 8 == 0) {
            mj_resetData(m, d);
            d->qpos[2] += 1e-3 * (double)(c % 64);
            steps(m, d, 20 + c % 50);
            mj_copyData(past, m, d);
        }
        kit_messages = 0;
        step_changed(m, d, past, other, (size_t)n->npluginstate * sizeof(mjtNum), &scene, &seed);
        resets += kit_messages > 0 && kit_named(kit_said, "state");
        loaded += pressed(m, d) > 0;
        mj_step(m, d);
    }
    print_message("%d changes: %d said, %d times loaded after it\n", changes, resets, loaded);
    assert_in_range(resets, changes / 20, changes);
    assert_in_range(loaded, changes / 20, changes);
    mjv_freeScene(&scene);
    mj_deleteData(d);
    mj_deleteData(past);
    mj_deleteData(other);
    mj_deleteModel(m);
    mj_deleteModel(n);
}

static int count_decor(const mjvScene *scene, int type) {
    int count = 0;
    for (int i = 0; i < scene->ngeom; i++) {
        count += scene->geoms[i].category == mjCAT_DECOR && scene->geoms[i].type == type;
    }
    return count;
}

/* Bool: one of the four cells of imprints in a patch is pressed. */
static int on_print(const mjData *d, const float at[3]) {
    const MildGround *ground = (const MildGround *)(void *)d->plugin_state;
    const double off = 0.0195 / 4;
    int found = 0;
    for (int k = 0; k < 4; k++) {
        const double x = (double)at[0] + (k % 2 ? off : -off),
                     y = (double)at[1] + (k / 2 ? off : -off);
        found |= mild_ground_imprint_at(ground, x, y) > 0;
    }
    return found;
}

/* Plates of the scene that lie deeper than the ground was. */
static int count_dents(const mjModel *m, const mjData *d, const mjvScene *scene) {
    int count = 0;
    for (int i = 0; i < scene->ngeom; i++) {
        const mjvGeom *g = &scene->geoms[i];
        const double top = (double)(g->pos[2] + g->mat[8] * g->size[2]);
        count += g->category == mjCAT_STATIC && g->type == mjGEOM_BOX &&
                 top < mild_terrain_height_at(&plugin_soft(m, d)->terrain, (double)g->pos[0],
                                              (double)g->pos[1]) -
                           0.003;
    }
    return count;
}

/* The scene shows what the ground remembers: dents of uneven ground, and where that is hidden
 * patches at its surface, as many as there is room for; and an arrow for each loaded foot. */
TEST(prints_are_drawn) {
    mjModel *m = hopper(MOTOR);
    mjData *d = mj_makeData(m);
    mjvScene scene, small;
    mjvOption option;
    mjvCamera camera;
    mjv_defaultScene(&scene);
    mjv_defaultScene(&small);
    mjv_defaultOption(&option);
    mjv_defaultCamera(&camera);
    mjv_makeScene(m, &scene, 5000);
    mjv_makeScene(m, &small, 10);
    mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, &scene);
    assert_int_equal(count_decor(&scene, mjGEOM_BOX), 0);
    assert_int_equal(count_dents(m, d, &scene), 0);
    steps(m, d, 500);
    mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, &scene);
    assert_int_equal(count_decor(&scene, mjGEOM_BOX), 0);
    assert_in_range(count_dents(m, d, &scene), 40, 1500);
    option.flags[mjVIS_STATIC] = 0;
    mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, &scene);
    print_message("%d patches\n", count_decor(&scene, mjGEOM_BOX));
    assert_in_range(count_decor(&scene, mjGEOM_BOX), pressed(m, d) + 20, 1500);
    int prints = 0;
    for (int i = 0; i < scene.ngeom; i++) {
        const MildTerrain *terrain = &plugin_soft(m, d)->terrain;
        const float *at = scene.geoms[i].pos;
        const double surface = mild_terrain_height_at(terrain, (double)at[0], (double)at[1]);
        if (scene.geoms[i].category == mjCAT_DECOR) {
            assert_true(fabs((double)at[2] - surface) < 0.002);
            assert_true(hypot((double)at[0], (double)at[1]) < 1);
            prints += on_print(d, at);
        }
    }
    assert_true(prints >= count_decor(&scene, mjGEOM_BOX) - pressed(m, d));
    mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, &small);
    assert_in_range(small.ngeom, 1, 10);
    option.flags[mjVIS_CONTACTFORCE] = 1;
    mjv_updateScene(m, d, &option, NULL, &camera, mjCAT_ALL, &scene);
    int loaded = 0;
    for (int f = 0; f < 2; f++) {
        loaded += plugin_soft(m, d)->contact.foot[f].contacts > 0;
    }
    assert_true(loaded > 0);
    assert_int_equal(count_decor(&scene, mjGEOM_ARROW), loaded);
    mjv_freeScene(&scene);
    mjv_freeScene(&small);
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST_MAIN(kit_setup, NULL)
