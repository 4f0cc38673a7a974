/* grains/: collisions, sliding and rolling by hand, the weight of a bed, Newton's third law on the
 * plate, energy, and the same bits for the same seed. On the CPU; lab/grains/README.md. */
#include "lab/grains/record.h"
#include "lab/grains/walk.h"

extern "C" { /* cmocka's header has no such words */
#include "kit.h"
}

/* A box for single grains, which are put one by one. */
static Bed stage_open(BedDef def, const std::vector<Vec3> &grains, float gravity) {
    Bed bed;
    def.length = def.width = 0.1f;
    def.depth = 0.001f;
    def.gravity = gravity;
    bed_open(&bed, def);
    std::vector<Place> none((size_t)bed.g.per, Place{0, 0, 0, 0});
    copy(bed.g.place, none.data(), none.size());
    copy(bed.g.next_place, none.data(), none.size());
    bed_put(&bed, 0, grains);
    return bed;
}

static double height_of(const Bed &bed, int i) {
    return (double)bed.g.place[i].z * (double)bed.g.unit.z;
}

static Vec3 position(const Bed &bed, int i) {
    return vec((float)bed.g.place[i].x * bed.g.unit.x, (float)bed.g.place[i].y * bed.g.unit.y,
               (float)bed.g.place[i].z * bed.g.unit.z);
}

static double energy_of(const Bed &bed, int i) {
    const double m = (double)grain_mass(bed.g.law, bed.g.place[i].radius);
    const double r = (double)bed.g.place[i].radius;
    const Vec3 v = bed.g.velocity[i], w = bed.g.spin[i];
    return 0.5 * m * ((double)dot(v, v) + 0.4 * r * r * (double)dot(w, w));
}

static Vec3 ball(float x, float y, float z, float radius) {
    Vec3 p = vec(x, y, z);
    p.unused = radius;
    return p;
}

/* ---- two grains ---- */

static double parted(bool hertz, float restitution, float speed) {
    BedDef def;
    def.hertz = hertz;
    def.restitution = restitution;
    def.steps = 200;
    def.stiffness = hertz ? 1e8f : 1e6f;
    Bed bed = stage_open(
        def, {ball(0.05f, 0.05f, 0.05f, 0.0025f), ball(0.0552f, 0.05f, 0.05f, 0.002f)}, 0);
    bed.g.velocity[0].x = speed;
    bed_go(&bed, (long)(0.004 / (double)bed.g.law.dt));
    const double after = (double)(bed.g.velocity[1].x - bed.g.velocity[0].x);
    const double m0 = (double)grain_mass(bed.g.law, 0.0025f),
                 m1 = (double)grain_mass(bed.g.law, 0.002f);
    const double momentum = m0 * (double)bed.g.velocity[0].x + m1 * (double)bed.g.velocity[1].x;
    expect_near("momentum", momentum / (m0 * (double)speed), 1, 1e-5);
    bed_close(&bed);
    return after / (double)speed;
}

TEST(grains_part_with_the_restitution) {
    for (const bool hertz : {false, true}) {
        for (const float e : {0.2f, 0.5f, 0.9f, 1.0f}) {
            const double got = parted(hertz, e, 0.3f);
            printf("%s: restitution %.2f, measured %.4f (bound 0.01)\n", hertz ? "hertz" : "linear",
                   (double)e, got);
            expect_near("restitution", got, (double)e, 0.01);
        }
    }
}

/* Steps or draws of a test that says the same of any number of them. */
static long some(long steps) {
    return kit_short() ? steps / 8 : steps;
}

/* Oblique and spinning, with friction: the two never leave with more than they had. */
TEST(a_collision_gives_no_energy) {
    double worst = -1;
    srand(1);
    const auto uniform = [] { return (float)rand() / (float)RAND_MAX - 0.5f; };
    for (int k = 0; k < some(400); k++) {
        BedDef def;
        def.hertz = k % 2;
        def.steps = 100;
        def.stiffness = def.hertz ? 1e8f : 1e6f;
        def.restitution = k % 3 ? 0.5f : 1.0f;
        def.rolling = k % 5 ? 0.0f : 0.1f;
        def.friction = k % 7 ? 0.5f : 2.0f;
        Bed bed = stage_open(def,
                             {ball(0.05f, 0.05f, 0.05f, 0.0025f),
                              ball(0.0555f, 0.05f + 0.003f * uniform(), 0.05f, 0.0025f)},
                             0);
        bed.g.velocity[0] = vec(0.5f, 0.3f * uniform(), 0.3f * uniform());
        for (int i = 0; i < 2; i++) {
            bed.g.spin[i] = vec(200 * uniform(), 200 * uniform(), 200 * uniform());
        }
        const double before = energy_of(bed, 0) + energy_of(bed, 1);
        bed_go(&bed, (long)(0.01 / (double)bed.g.law.dt));
        worst = fmax(worst, (energy_of(bed, 0) + energy_of(bed, 1)) / before - 1);
        bed_close(&bed);
    }
    printf("largest gain in a collision: %.2e of the energy (bound 3e-4)\n", worst);
    assert_true(worst < 3e-4);
}

/* ---- a grain on the floor ---- */

TEST(a_grain_slides_then_rolls) {
    BedDef def;
    def.friction = 0.3f;
    const float radius = 0.0025f, speed = 0.2f;
    Bed bed = stage_open(def, {ball(0.02f, 0.05f, radius, radius)}, 9.81f);
    bed.g.velocity[0].x = speed;
    const double mu = 0.3, g = 9.81, rolls = 2.0 * (double)speed / (7 * mu * g);
    bed_go(&bed, bed_steps(bed, 0.5 * rolls));
    const double slides = ((double)speed - (double)bed.g.velocity[0].x) / (0.5 * rolls) / g;
    bed_go(&bed, bed_steps(bed, rolls));
    printf("friction %.3f measured %.4f; rolls at %.4f of its speed, by hand 5/7 = %.4f\n", mu,
           slides, (double)bed.g.velocity[0].x / (double)speed, 5.0 / 7);
    expect_near("friction", slides, mu, 0.02 * mu);
    expect_near("rolling speed", (double)bed.g.velocity[0].x / (double)speed, 5.0 / 7, 0.01);
    bed_close(&bed);
}

TEST(rolling_is_resisted) {
    BedDef def;
    def.rolling = 0.05f;
    const float radius = 0.0025f, speed = 0.2f;
    Bed bed = stage_open(def, {ball(0.02f, 0.05f, radius, radius)}, 9.81f);
    bed.g.velocity[0].x = speed;
    bed.g.spin[0].y = speed / radius;
    bed_go(&bed, bed_steps(bed, 0.1));
    const double slowing = ((double)speed - (double)bed.g.velocity[0].x) / 0.1 / 9.81;
    printf("rolling resistance: slows by %.4f g, by hand mu_roll/1.4 = %.4f\n", slowing,
           0.05 / 1.4);
    expect_near("slowing", slowing, 0.05 / 1.4, 0.03 * 0.05 / 1.4);
    bed_close(&bed);
}

/* ---- a bed ---- */

static BedDef small_bed(void) {
    BedDef def;
    def.length = 0.04f;
    def.width = 0.035f;
    def.depth = 0.025f;
    def.settle = kit_short() ? 0.1f : 0.2f;
    return def;
}

/* The floor carries the grains' weight, measured by the overlaps on it. */
TEST(the_floor_carries_the_weight) {
    if (kit_short()) {
        skip(); /* a_resting_plate settles, too */
    }
    Bed bed;
    bed_open(&bed, small_bed());
    bed_settle(&bed);
    double weight = 0, carried = 0, kinetic = 0;
    for (int i = 0; i < bed.g.per; i++) {
        const double radius = (double)bed.g.place[i].radius;
        if (radius > 0) {
            weight += (double)grain_mass(bed.g.law, (float)radius) * 9.81;
            carried += (double)bed.g.law.stiffness * fmax(radius - height_of(bed, i), 0);
            kinetic += energy_of(bed, i);
        }
    }
    const double fall = kinetic / (weight * 0.005);
    printf("%d grains, solid share %.3f, surface %.1f mm\n", bed.filled[0], (double)bed.solid[0],
           1e3 * (double)bed.surface[0]);
    printf(
        "weight %.4f N, the floor carries %.4f N (1 %%); kinetic energy %.1e of that of a fall by "
        "a grain (bound 1e-3)\n",
        weight, carried, fall);
    expect_near("floor", carried / weight, 1, 0.01);
    assert_true(fall < 1e-3);
    bed_close(&bed);
}

/* A cloud of grains without weight flies against a tilted plate: what the grains lose in momentum
 * and angular momentum the plate has got, about its origin. */
TEST(the_plate_gets_what_the_grains_lose) {
    std::vector<Vec3> grains;
    for (int k = 0; k < 60; k++) {
        grains.push_back(
            ball(0.04f + 0.0056f * (float)(k % 5), 0.035f + 0.0056f * (float)(k / 5 % 4),
                 0.02f + 0.0056f * (float)(k / 20), 0.0022f + 0.0001f * (float)(k % 7)));
    }
    BedDef def;
    def.rolling = 0.1f;
    Bed bed = stage_open(def, grains, 0);
    const Case c = case_read("cloud rect:0.03,0.05 20 hold:0.06");
    bed.g.shape = c.shape;
    bed.g.plate[0] = {};
    bed.g.plate[0].z = 0.05;
    bed.g.plate[0].pitch = c.tilt;
    bed.g.plate[0].yaw = 0.4;
    plate_place(&bed.g.plate[0], bed.g);
    double before[6] = {0}, after[6] = {0};
    for (double *sum : {before, after}) {
        for (int i = 0; i < (int)grains.size(); i++) {
            if (sum == before) {
                bed.g.velocity[i] = vec(0.1f, 0.02f * (float)(i % 3), 0.6f);
                bed.g.spin[i] = vec((float)(i % 5), -20.0f, 7.0f);
            }
            const float m = grain_mass(bed.g.law, bed.g.place[i].radius), r = bed.g.place[i].radius;
            const Vec3 p = m * bed.g.velocity[i];
            const Vec3 arm = position(bed, i) - vec(0.05f, 0.05f, 0.05f);
            const Vec3 turn = cross(arm, p) + 0.4f * m * r * r * bed.g.spin[i];
            const float part[6] = {p.x, p.y, p.z, turn.x, turn.y, turn.z};
            for (int k = 0; k < 6; k++) {
                sum[k] += (double)part[k];
            }
        }
        if (sum == before) {
            bed_go(&bed, bed_steps(bed, 0.06));
        }
    }
    for (int k = 0; k < 6; k++) {
        const double got =
            (double)bed.g.plate[0].sum[k] / (double)(1 << SUM_BITS) * (double)bed.g.law.dt;
        const double size = k < 3 ? fabs(before[2]) : fabs(before[2]) * 0.02;
        printf("%s %d: the grains lose %+.4e, the plate gets %+.4e (bound %.0e)\n",
               k < 3 ? "momentum" : "angular momentum", k % 3, before[k] - after[k], got,
               1e-3 * size);
        expect_entry("plate", k, got, before[k] - after[k], 1e-3 * size);
    }
    assert_true(fabs(before[2] - after[2]) > 0.1 * fabs(before[2]));
    bed_close(&bed);
}

/* A point of a plate that moves and turns in all ways has the velocity that grains feel there. */
TEST(a_led_plate_moves_as_it_turns) {
    Bed bed = stage_open(BedDef(), {ball(0.01f, 0.01f, 0.01f, 0.002f)}, 0);
    Plate *p = &bed.g.plate[0];
    *p = {};
    p->z = 0.05;
    p->yaw = 0.7;
    p->pitch = -0.3;
    p->vx = 0.5;
    p->vy = -0.3;
    p->vz = 0.2;
    p->turning = 3;
    p->rate = -2;
    plate_place(p, bed.g);
    const Vec3 at = vec(0.04f, -0.03f, 0.02f), before = plate_to_world(*p, at);
    const Vec3 velocity = p->velocity + cross(p->spin, before);
    const double x = p->x, y = p->y, z = p->z, dt = (double)bed.g.law.dt;
    plate_step(0, bed.g);
    const Vec3 after = plate_to_world(*p, at);
    expect_near("x", (p->x - x + (double)(after.x - before.x)) / dt, (double)velocity.x, 2e-3);
    expect_near("y", (p->y - y + (double)(after.y - before.y)) / dt, (double)velocity.y, 2e-3);
    expect_near("z", (p->z - z + (double)(after.z - before.z)) / dt, (double)velocity.z, 2e-3);
    bed_close(&bed);
}

/* A plate that lies on the bed pushes with its weight. */
TEST(a_resting_plate_pushes_with_its_weight) {
    Bed bed;
    bed_open(&bed, small_bed());
    bed_settle(&bed);
    const Case c = case_read("rest rect:0.02,0.02 0 drop:0.05@0.05,0.2 hold:0.01");
    const char *folder = getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp";
    case_run(&bed, c, 40, folder);
    const std::string file = std::string(folder) + "/rest-1.csv";
    FILE *in = fopen(file.c_str(), "r");
    assert_non_null(in);
    char line[512];
    double force = 0, depth = 0;
    int rows = 0, stage = 0;
    while (fgets(line, sizeof line, in)) {
        double f, d;
        if (sscanf(line, "%*f,%d,%lf,%*f,%*f,%*f,%*f,%*f,%lf", &stage, &d, &f) == 3 && stage == 0) {
            force = f;
            depth = d;
            rows++;
        }
    }
    fclose(in);
    remove(file.c_str());
    printf("%d rows; a plate of 50 g lies at %.2f mm and pushes with %.4f N, by hand %.4f (2 %%)\n",
           rows, 1e3 * depth, force, 0.05 * 9.81);
    expect_near("weight", force / (0.05 * 9.81), 1, 0.02);
    bed_close(&bed);
}

/* Grains of 10 mm under a plate are in the bands of their place: a block's by the distance of a
 * centre from the edge of what centres meet, beside it and over it in the last; a sphere's from the
 * middle. */
TEST(bands_are_places_under_the_plate) {
    Shape block = case_read("a rect:0.1,0.06 0 hold:1").shape;
    Shape sphere = case_read("a sphere:0.05 0 hold:1").shape;
    block.band = sphere.band = 0.004f;
    const float r = 0.005f;
    const struct {
        Vec3 centre;
        int block, sphere;
    } rows[] = {
        {vec(0, 0, -r), 8, 0},                   /* 30 + 5 mm within */
        {vec(0.02f, -0.0135f, -r), 5, 6},        /* 16.5 + 5 mm within the long edge; 24.1 away */
        {vec(0.0525f, 0, -0.004f), 0, 13},       /* 2.5 mm outside, so 2.5 within */
        {vec(-0.049f, -0.029f, -r), 1, 14},      /* at a corner, 1 mm from both */
        {vec(0.055f, 0, 0.02f), BANDS - 1, 13},  /* beside it */
        {vec(0.054f, 0, 0.003f), BANDS - 1, 13}, /* and a little above its bottom */
        {vec(0.3f, 0, -r), 0, BANDS - 1},        /* none of these touch */
    };
    for (const auto &row : rows) {
        assert_int_equal(shape_band(block, row.centre, r), row.block);
        assert_int_equal(shape_band(sphere, row.centre, r), row.sphere);
    }
}

/* The numbers of a line after its first `skip`. */
static std::vector<double> line_numbers(const char *line, size_t skip) {
    std::vector<double> out;
    for (const std::string &word : words(line, ",\n")) {
        out.push_back(atof(word.c_str()));
    }
    out.erase(out.begin(), out.begin() + (long)std::min(skip, out.size()));
    return out;
}

/* What bands have together is the force up of the same row. */
TEST(bands_sum_to_the_force) {
    Bed bed;
    bed_open(&bed, small_bed());
    bed_settle(&bed);
    Case c = case_read("banded sphere:0.012 0 press:0.006@0.1");
    c.shape.band = 0.002f;
    const char *folder = getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp";
    case_run(&bed, c, 12, folder);
    const std::string name = std::string(folder) + "/banded-1";
    FILE *forces = fopen((name + ".csv").c_str(), "r");
    FILE *bands = fopen((name + "-bands.csv").c_str(), "r");
    assert_non_null(forces);
    assert_non_null(bands);
    char force[1024], band[4096];
    double most = 0;
    int rows = 0;
    while (fgets(force, sizeof force, forces) && fgets(band, sizeof band, bands)) {
        const std::vector<double> of = line_numbers(force, 0), up = line_numbers(band, 3);
        if (rows++ > 0) {
            double sum = 0;
            for (double part : up) {
                sum += part;
            }
            assert_int_equal(up.size(), BANDS);
            expect_near("bands", sum, of[8], 1e-3 * (fabs(of[8]) + 0.01));
            expect_near("depth", line_numbers(band, 1)[0], of[2], 1e-6);
            most = fmax(most, of[8]);
        }
    }
    fclose(forces);
    fclose(bands);
    remove((name + ".csv").c_str());
    remove((name + "-bands.csv").c_str());
    printf("%d rows, up to %.3f N\n", rows - 1, most);
    assert_true(rows > 10 && most > 0.05);
    bed_close(&bed);
}

/* A bed is its seed's, whichever beds are made beside it and whenever lists were made. */
TEST(a_seed_gives_the_same_bits) {
    BedDef def = small_bed();
    def.settle = 0.05f;
    Bed alone, beside;
    def.seeds = {7};
    bed_open(&alone, def);
    def.seeds = {3, 7};
    bed_open(&beside, def);
    beside.g.leeway *= 0.8f;
    beside.g.most_leeway *= 0.8f;
    bed_go(&alone, 4000);
    bed_go(&beside, 4000);
    const Place *same = beside.g.place + beside.g.per;
    printf("lists made %ld and %ld times\n", alone.lists, beside.lists);
    assert_int_equal(alone.g.per, beside.g.per);
    assert_true(alone.lists != beside.lists);
    assert_memory_equal(alone.g.place, same, (size_t)alone.g.per * sizeof(Place));
    assert_memory_not_equal(alone.g.place, beside.g.place, (size_t)alone.g.per * sizeof(Place));
    bed_close(&alone);
    bed_close(&beside);
}

/* Grains of its bed that overlap grain i and are not in its list. */
static int near_missed(const Grains &g, int i) {
    int missed = 0;
    for (int j = i / g.per * g.per; j < (i / g.per + 1) * g.per; j++) {
        const Vec3 d = from_to(g, g.place[i], g.place[j]);
        if (i == j || length(d) >= g.place[i].radius + g.place[j].radius) {
            continue;
        }
        bool listed = false;
        for (int s = 0; s < NEIGHBOURS; s++) {
            listed |= g.neighbour[(size_t)s * (size_t)g.count + (size_t)i] == j;
        }
        missed += !listed;
    }
    return missed;
}

/* Pairs that overlap and are not in each other's list. */
static int pairs_missed(const Grains &g) {
    int missed = 0;
    for (int i = 0; i < g.count; i++) {
        missed += near_missed(g, i);
    }
    return missed;
}

TEST(no_contact_is_missed) {
    Bed bed;
    bed_open(&bed, small_bed());
    int missed = 0;
    for (int k = 0; k < some(40); k++) { /* while they fall and while they come to rest */
        bed_go(&bed, 251);
        missed += pairs_missed(bed.g);
    }
    printf("%d pairs missed in %ld looks, with %ld lists for %ld steps\n", missed, some(40),
           bed.lists, bed.steps);
    assert_int_equal(missed, 0);
    bed_close(&bed);
}

/* What is restored goes on as it did, before the first list too. */
TEST(a_restored_bed_goes_on) {
    for (const long before : {0L, some(3000)}) {
        Bed bed;
        bed_open(&bed, small_bed());
        bed_go(&bed, before);
        const std::vector<char *> saved = bed_save(bed);
        bed_go(&bed, some(3000));
        const std::vector<Place> once = bed_places(bed);
        bed_restore(&bed, saved);
        bed_go(&bed, some(3000));
        assert_memory_equal(once.data(), bed.g.place, once.size() * sizeof(Place));
        for (char *data : saved) {
            release(data);
        }
        bed_close(&bed);
    }
}

/* The nearest point of a block, against that of an axis-aligned box; the way out of it. */
TEST(a_block_is_nearest_where_a_box_is) {
    const Shape s = shape_read("rect:0.06,0.12");
    srand(2);
    const auto uniform = [] { return (float)rand() / (float)RAND_MAX - 0.5f; };
    double worst = 0, shift = 0, inside = 0;
    for (int k = 0; k < 20000; k++) {
        const Vec3 p = vec(0.2f * uniform(), 0.2f * uniform(), 0.2f * uniform());
        const Vec3 q = vec(fminf(fmaxf(p.x, -0.03f), 0.03f), fminf(fmaxf(p.y, -0.06f), 0.06f),
                           fminf(fmaxf(p.z, 0), s.height));
        Vec3 normal = vec(0, 0, 0);
        const float far = shape_nearest(s, p, &normal), wanted = length(p - q);
        if (wanted > 0) {
            worst = fmax(worst, (double)fabsf(far - wanted));
            shift = fmax(shift, (double)length(p - far * normal - q));
        } else { /* out by the nearest of five faces */
            const float side = fminf(0.03f - fabsf(p.x), 0.06f - fabsf(p.y));
            const float out = fminf(side, fminf(p.z, s.height - p.z));
            const Vec3 face = p - far * normal;
            assert_true(far <= 0 && fabsf(far + out) < 1e-7f && fabsf(length(normal) - 1) < 1e-5f);
            inside = fmax(inside, fabs((double)shape_nearest(s, face, &normal)));
        }
    }
    /* two points of the outline can be equally near in single precision */
    printf("nearest points of a block: distance off by %.1e m (bound 1e-7), place by %.1e (1e-5)\n",
           worst, shift);
    printf("a centre within is led to a face within %.1e m (bound 1e-7)\n", inside);
    assert_true(worst < 1e-7 && shift < 1e-5 && inside < 1e-7);
}

/* ---- the soles of a robot ---- */

/* A free block of mass m with moments of inertia, tilted, with spin, hits a cloud of grains without
 * weight: what the grains gain in momentum and angular momentum about a fixed point the block has
 * lost, and its kinetic energy and theirs do not grow. */
TEST(a_free_sole_keeps_momentum) {
    std::vector<Vec3> grains;
    for (int k = 0; k < 90; k++) {
        grains.push_back(
            ball(0.035f + 0.0056f * (float)(k % 6), 0.035f + 0.0056f * (float)(k / 6 % 5),
                 0.08f + 0.0056f * (float)(k / 30), 0.0022f + 0.0001f * (float)(k % 7)));
    }
    Bed bed = stage_open(BedDef(), grains, 0);
    const double mass = 0.05, inertia = 3e-6, start[3] = {0.012, -0.012, 0.105};
    Ride ride = {};
    bed.g.shape = shape_read("polygon:-0.02,-0.015,0.02,-0.01,0.015,0.02,-0.02,0.01");
    std::copy(start, start + 3, ride.place);
    const double turn[4] = {0.98, 0.1, -0.12, 0.115};
    std::copy(turn, turn + 4, ride.turn);
    ride_turn(ride.turn, start, 0); /* makes it a unit quaternion */
    const double twist[6] = {0.1, -0.05, -0.6, 3, -2, 5};
    std::copy(twist, twist + 6, ride.twist);
    for (int k = 0; k < 6; k++) {
        ride.response[7 * k] = 1 / (k < 3 ? mass : inertia);
    }
    bed.g.ride = &ride;
    bed.g.plate[0] = {};
    bed.g.plate[0].side = -1;
    ride_place(ride, 0, bed.g, &bed.g.plate[0]);
    double sum[2][7] = {{0}, {0}};
    for (int when = 0; when < 2; when++) {
        if (when == 1) {
            bed_go(&bed, bed_steps(bed, 0.04));
        }
        for (int i = 0; i < (int)grains.size(); i++) {
            const float m = grain_mass(bed.g.law, bed.g.place[i].radius), r = bed.g.place[i].radius;
            const Vec3 p = m * bed.g.velocity[i];
            const Vec3 arm = position(bed, i) - vec(0.05f, 0.05f, 0.05f);
            const Vec3 about = cross(arm, p) + 0.4f * m * r * r * bed.g.spin[i];
            const float part[6] = {p.x, p.y, p.z, about.x, about.y, about.z};
            for (int k = 0; k < 6; k++) {
                sum[when][k] += (double)part[k];
            }
            sum[when][6] += energy_of(bed, i);
        }
        const double *x = ride.place, *v = ride.twist;
        const double about[3] = {x[1] * v[2] - (x[2] - 0.05) * v[1],
                                 (x[2] - 0.05) * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]};
        for (int k = 0; k < 3; k++) {
            sum[when][k] += mass * v[k];
            sum[when][3 + k] += mass * about[k] + inertia * v[3 + k];
            sum[when][6] += 0.5 * mass * v[k] * v[k] + 0.5 * inertia * v[3 + k] * v[3 + k];
        }
    }
    const double given = mass * fabs(ride.twist[2] - twist[2]);
    for (int k = 0; k < 6; k++) {
        const double size = k < 3 ? given : 0.02 * given;
        printf("%s %d: %+.5e before, %+.5e after (bound %.0e)\n",
               k < 3 ? "momentum" : "angular momentum", k % 3, sum[0][k], sum[1][k], 2e-3 * size);
        expect_entry("sum", k, sum[1][k], sum[0][k], 2e-3 * size);
    }
    printf("energy %.4e J before, %.4e after; the block's speed %.3f, %.3f m/s\n", sum[0][6],
           sum[1][6], twist[2], ride.twist[2]);
    assert_true(given > 0.05 * mass * fabs(twist[2]) && sum[1][6] < sum[0][6]);
    assert_true(fabs(ride.twist[3] - twist[3]) > 1 && fabs(ride.twist[4] - twist[4]) > 1);
    bed.g.ride = nullptr;
    bed_close(&bed);
}

/* Twists and inertia at the sole's origin: the wrench that comes back does the same work there as
 * about the ankle. */
TEST(wrenches_move_with_their_twists) {
    const double arm[3] = {0.02, -0.01, -0.055}, v[6] = {1, 2, -3, 4, -5, 6},
                 w[6] = {3, -1, 40, 2, 5, -7};
    double moved[6], about[3], work[2] = {0, 0};
    std::copy(v, v + 6, moved);
    to_origin(moved, 1, arm);
    about[0] = w[3] + arm[1] * w[2] - arm[2] * w[1];
    about[1] = w[4] + arm[2] * w[0] - arm[0] * w[2];
    about[2] = w[5] + arm[0] * w[1] - arm[1] * w[0];
    for (int k = 0; k < 6; k++) {
        work[0] += moved[k] * w[k];
        work[1] += v[k] * (k < 3 ? w[k] : about[k - 3]);
    }
    expect_near("work", work[0], work[1], 1e-12);
    expect_near("lever", moved[0], 1 + -5 * -0.055 - 6 * -0.01, 1e-12);
}

static double fastest_of(const Grains &g) {
    double fastest = 0;
    for (int i = 0; i < g.count; i++) {
        fastest = fmax(fastest, (double)length(g.velocity[i]));
    }
    return fastest;
}

static int moved_since(const Grains &g, const std::vector<Place> &start) {
    int moved = 0;
    for (int i = 0; i < g.count; i++) {
        moved += length(from_to(g, start[(size_t)i], g.place[i])) > 2e-5f;
    }
    return moved;
}

/* A settled bed, put behind itself four times: windows that open, close and open again make no
 * grain faster than the last ones that still roll in the settled bed, move no larger share of them
 * than move there, and miss no contact across the ends of the pieces. */
TEST(a_long_bed_stays_at_rest) {
    BedDef def = small_bed();
    def.seeds = {1, 2};
    def.length = 0.08f;
    def.settle = kit_short() ? 0.1f : 0.3f;
    Bed tile;
    bed_open(&tile, def);
    bed_settle(&tile);
    const std::vector<char *> saved = bed_save(tile);
    const std::vector<Place> rest = bed_places(tile);
    const double before = fastest_of(tile.g);
    bed_go(&tile, 900);
    const int own = moved_since(tile.g, rest);
    bed_restore(&tile, saved);
    for (char *data : saved) {
        release(data);
    }
    WalkDef walk;
    walk.reach = 0.02;
    walk.track = 0.27;
    Track t;
    track_open(&t, &tile, walk);
    Grains &g = t.bed.g;
    const std::vector<Place> start = bed_places(t.bed);
    assert_int_equal(t.tiles, 4);
    double fastest = 0;
    int missed = 0;
    for (const double x : {0.0, 0.03, 0.06, 0.11, 0.15, 0.0, 0.2}) {
        for (int b = 0; b < 2; b++) {
            track_follow(&t, b, x + 0.01 * b);
        }
        bed_go(&t.bed, 300);
        fastest = fmax(fastest, fastest_of(g));
        for (int k = 0; k < range_size(g, g.moving); k++) {
            const int i = range_grain(g, g.moving, k);
            missed += i < 0 || g.place[i].radius <= 0 ? 0 : near_missed(g, i);
        }
    }
    const int moved = moved_since(g, start);
    printf("%d windows of %d grains; fastest %.1e m/s, in the settled bed %.1e; %d grains moved by "
           "0.02 mm, in the settled bed %d of a fourth as many; %d pairs missed\n",
           t.moves, g.moving.most, fastest, before, moved, own, missed);
    assert_true(fastest < before && moved < 4 * own && t.moves > 6);
    assert_int_equal(missed, 0);
    bed_close(&t.bed);
}

TEST_MAIN(NULL, NULL)
