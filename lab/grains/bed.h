/* Beds on the host: memory, filling, settling, levelling, and going on in time. */
#ifndef GRAINS_BED_H
#define GRAINS_BED_H

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "grains.h"

/* ---- the soles of one robot ----
 *
 * Plates that are the soles of one robot. They move as rigid bodies on the robot's own inertia:
 *
 *     dV/dt = a + A F(t)
 *
 * with the twists V of all soles, their accelerations a without ground, the wrenches F, and the
 * inverse inertia A that the robot has there, both constant over one of the robot's steps T. So
 * after it V = V_free + T A F_mean, which is the robot's velocity when it is given the mean wrench:
 * neither force nor momentum is late. */

enum : int { RIDE_ROWS = 6 * RANGE_BEDS };

struct Ride {
    double place[3 * RANGE_BEDS]; /* of the origins [m]; z from the floor, the box's middle is 0 */
    double turn[4 * RANGE_BEDS];  /* orientation, w x y z */
    double twist[RIDE_ROWS];      /* V: of the origin, then spin [m/s, rad/s] */
    double shift[RIDE_ROWS];      /* besides moves the plates to where the robot has them */
    double free[RIDE_ROWS];       /* a [m/s^2, rad/s^2] */
    double response[RIDE_ROWS * RIDE_ROWS]; /* A, rows of all plates */
    long long before[RIDE_ROWS];            /* the plates' sums before this step */
};

BOTH void ride_turn(double *q, const double *spin, double dt) {
    const double x = 0.5 * dt * spin[0], y = 0.5 * dt * spin[1], z = 0.5 * dt * spin[2];
    const double w = q[0], a = q[1], b = q[2], c = q[3];
    q[0] = w - x * a - y * b - z * c;
    q[1] = a + x * w + y * c - z * b;
    q[2] = b - x * c + y * w + z * a;
    q[3] = c + x * b - y * a + z * w;
    const double size = 1 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) {
        q[k] *= size;
    }
}

/* What grains feel of plate b. */
BOTH void ride_place(const Ride &r, int b, const Grains &g, Plate *p) {
    const double *at = r.place + 3 * b, *q = r.turn + 4 * b;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double turn[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
        2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    float v[6];
    plate_cells(p, g, at[0], at[1], at[2]);
    for (int k = 0; k < 9; k++) {
        p->turn[k] = (float)turn[k];
    }
    for (int k = 0; k < 6; k++) {
        v[k] = (float)(r.twist[6 * b + k] + r.shift[6 * b + k]);
    }
    p->velocity = vec(v[0], v[1], v[2]);
    p->spin = vec(v[3], v[4], v[5]);
}

/* Of all plates, by one thread: after grain_step, whose forces it takes. */
DEVICE void ride_step(int, const Grains &g) {
    Ride *r = g.ride;
    const int rows = 6 * g.beds;
    const double dt = (double)g.law.dt;
    double force[RIDE_ROWS];
    for (int i = 0; i < rows; i++) {
        const long long sum = g.plate[i / 6].sum[i % 6];
        force[i] = (double)(sum - r->before[i]) / (double)(1 << SUM_BITS);
        r->before[i] = sum;
    }
    for (int i = 0; i < rows; i++) {
        double faster = r->free[i];
        for (int j = 0; j < rows; j++) {
            faster += r->response[i * rows + j] * force[j];
        }
        r->twist[i] += dt * faster;
    }
    for (int b = 0; b < g.beds; b++) {
        double v[6];
        for (int k = 0; k < 6; k++) {
            v[k] = r->twist[6 * b + k] + r->shift[6 * b + k];
        }
        for (int k = 0; k < 3; k++) {
            r->place[3 * b + k] += dt * v[k];
        }
        ride_turn(r->turn + 4 * b, v + 3, dt);
        ride_place(*r, b, g, &g.plate[b]);
    }
}

/* ---- beds ---- */

constexpr float LEEWAY = 0.075f; /* [grains] that a grain moves before lists are made anew */

/* What a bed is made of; every number is an option of the program. */
struct BedDef {
    std::vector<uint64_t> seeds = {1}; /* one bed each */
    float grain = 0.005f;              /* mean diameter [m] */
    float spread = 0.1f;               /* diameters are uniform within this share of the mean */
    float length = 0.45f, width = 0.35f, depth = 0.12f; /* [m] */
    float friction = 0.5f, rolling = 0.0f, restitution = 0.5f;
    float density = 2500.0f; /* [kg/m^3] */
    float stiffness = 1e6f;  /* linear: k_n over the diameter; Hertz: E/(1 - nu^2)/2 [Pa] */
    float gravity = 9.81f;   /* [m/s^2] */
    bool hertz = false;
    float steps = 25.0f; /* steps in the shortest collision of two grains */
    float settle = 0.5f; /* time to settle before and, a quarter of it, after levelling [s] */
    std::string file;    /* a bed to read: lines of x y z radius [m] */
};

struct Bed {
    Grains g = {};
    BedDef def;
    long steps = 0, lists = 0;  /* that were made */
    long late = 0;              /* lists that came too late */
    long full = 0;              /* lists or cells without room: contacts were left out */
    bool late_stops = true;     /* that ends the program */
    std::vector<float> surface; /* of each bed [m] */
    std::vector<float> solid;   /* share of grains in the volume of each, in its middle */
    std::vector<int> filled;    /* grains of each */
};

inline std::vector<Place> bed_places(const Bed &bed) {
    std::vector<Place> place((size_t)bed.g.count);
    copy(place.data(), bed.g.place, place.size());
    return place;
}

/* ---- making one ---- */

inline Law bed_law(const BedDef &def) {
    Law law = {};
    const float least = 0.5f * def.grain * (1 - def.spread), pi = 3.14159265f;
    law.density = def.density;
    law.gravity = def.gravity;
    law.hertz = def.hertz;
    law.mu = def.friction;
    law.mu_roll = def.rolling;
    law.shear = def.hertz ? 0.82f : 2.0f / 7.0f; /* 2 (1 - nu)/(2 - nu) with nu 0.3; Silbert 2001 */
    law.damping = contact_damping(def.restitution, def.hertz);
    law.stiffness = def.hertz ? 2 * def.stiffness : def.stiffness * def.grain;
    /* a Hertz contact is looked at where it is pressed by a hundredth of the diameter */
    const float deep = sqrtf(0.5f * least * 0.01f * def.grain);
    const float slope = def.hertz ? law.stiffness * deep : law.stiffness;
    law.dt = pi * sqrtf(0.5f * grain_mass(law, least) / slope) / def.steps;
    return law;
}

/* A loose lattice with grains off their sites by chance; its sizes and places are the seed's. */
inline std::vector<Vec3> bed_fill(const BedDef &def, uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&random] { return (float)(random() >> 40) / (float)(1 << 24); };
    const float widest = def.grain * (1 + def.spread), pitch = 1.12f * widest;
    const int nx = (int)(def.length / pitch), ny = (int)(def.width / pitch);
    const float solid = 0.58f, volume = 0.5235988f * def.grain * def.grain * def.grain;
    const double wanted = 1.06 * (double)(solid * def.length * def.width * def.depth / volume);
    const int nz = (int)(wanted / (nx * ny)) + 1;
    std::vector<Vec3> grains; /* unused: the radius */
    for (int k = 0; k < nx * ny * nz; k++) {
        const float off = pitch - widest;
        Vec3 p =
            vec(((float)(k % nx) + 0.5f) * def.length / (float)nx + off * (uniform() - 0.5f),
                ((float)(k / nx % ny) + 0.5f) * def.width / (float)ny + off * (uniform() - 0.5f),
                ((float)(k / nx / ny) + 0.5f) * pitch + off * (uniform() - 0.5f));
        p.unused = 0.5f * def.grain * (1 + def.spread * (2 * uniform() - 1));
        grains.push_back(p);
    }
    return grains;
}

inline std::vector<Vec3> bed_read(const std::string &file) {
    FILE *in = fopen(file.c_str(), "r");
    if (!in) {
        stop("cannot read ", file.c_str());
    }
    std::vector<Vec3> grains;
    Vec3 p = {};
    int read = 0;
    while ((read = fscanf(in, "%f %f %f %f", &p.x, &p.y, &p.z, &p.unused)) == 4) {
        if (!std::isfinite(p.x + p.y + p.z) || !(p.unused > 0)) {
            break;
        }
        grains.push_back(p);
    }
    fclose(in);
    if (read != EOF || grains.empty()) {
        stop("not lines of `x y z radius`: ",
             (file + ", grain " + std::to_string(grains.size() + 1)).c_str());
    }
    return grains;
}

/* Of all beds. */
inline size_t cells_of(const Grains &g) {
    return (size_t)g.beds * (size_t)g.cells_x * (size_t)g.cells_y * (size_t)g.cells_z;
}

inline void bed_allocate(Grains *g) {
    const size_t n = (size_t)g->count, cells = cells_of(*g);
    g->place = allocate<Place>(n);
    g->next_place = allocate<Place>(n);
    g->listed = allocate<Place>(n);
    for (Vec3 **v : {&g->velocity, &g->next_velocity, &g->spin, &g->next_spin}) {
        *v = allocate<Vec3>(n);
    }
    for (int **list : {&g->neighbour, &g->next_neighbour}) {
        *list = allocate<int>(n * NEIGHBOURS);
    }
    for (uint32_t **bits : {&g->touching, &g->next_touching}) {
        *bits = allocate<uint32_t>(n);
    }
    for (Vec3 **v : {&g->slip, &g->next_slip}) {
        *v = allocate<Vec3>(n * SLOTS);
    }
    for (Vec3 **v : {&g->roll, &g->next_roll}) {
        *v = g->law.mu_roll > 0 ? allocate<Vec3>(n * SLOTS) : nullptr;
    }
    g->cell_count = allocate<int>(cells);
    g->cell = allocate<int>(cells * CELL_GRAINS);
    g->flags = allocate<int>(1);
    g->plate = allocate<Plate>((size_t)g->beds);
}

inline void bed_close(Bed *bed) {
    Grains &g = bed->g;
    for (void *data :
         {(void *)g.place, (void *)g.next_place, (void *)g.listed, (void *)g.velocity,
          (void *)g.next_velocity, (void *)g.spin, (void *)g.next_spin, (void *)g.neighbour,
          (void *)g.next_neighbour, (void *)g.touching, (void *)g.next_touching, (void *)g.slip,
          (void *)g.next_slip, (void *)g.roll, (void *)g.next_roll, (void *)g.cell_count,
          (void *)g.cell, (void *)g.flags, (void *)g.plate}) {
        release(data);
    }
    bed->g = {};
}

inline void bed_put(Bed *bed, int b, const std::vector<Vec3> &grains) {
    const Grains &g = bed->g;
    std::vector<Place> place((size_t)g.per);
    for (size_t i = 0; i < grains.size(); i++) {
        const Vec3 p = grains[i];
        place[i] = {shifted(0, fmodf(p.x, g.size_x), g.unit.x),
                    shifted(0, fmodf(p.y, g.size_y), g.unit.y), shifted(0, p.z, g.unit.z),
                    p.unused};
    }
    copy(g.place + (size_t)(b * g.per), place.data(), place.size());
}

/* Grains that may touch are in cells side by side. */
inline void bed_cells(Grains *g, const BedDef &def) {
    const float cell = def.grain * (1 + def.spread) + 2 * g->most_leeway;
    g->cells_x = (int)(g->size_x / cell);
    g->cells_y = (int)(g->size_y / cell);
    g->cells_z = (int)(g->size_z / cell);
}

/* The grains where they are put at first. Nothing moves before bed_go. */
inline void bed_open(Bed *bed, const BedDef &def) {
    std::vector<std::vector<Vec3>> grains;
    Grains &g = bed->g;
    float top = 0;
    bed->def = def;
    g.beds = (int)def.seeds.size();
    for (uint64_t seed : def.seeds) {
        grains.push_back(def.file.empty() ? bed_fill(def, seed) : bed_read(def.file));
        g.per = std::max(g.per, (int)grains.back().size());
        for (const Vec3 &p : grains.back()) {
            top = fmaxf(top, p.z + p.unused);
        }
    }
    g.count = g.beds * g.per;
    g.law = bed_law(def);
    g.size_x = def.length;
    g.size_y = def.width;
    g.size_z = 2.0f * fmaxf(top, def.depth) + 0.1f; /* differences reach half of it */
    const float whole = 4294967296.0f;
    g.unit = vec(g.size_x / whole, g.size_y / whole, g.size_z / whole);
    g.leeway = g.most_leeway = LEEWAY * def.grain;
    bed_cells(&g, def);
    if (g.cells_x < 3 || g.cells_y < 3) {
        stop("--box: at least four grains in length and width");
    }
    bed_allocate(&g);
    for (int b = 0; b < g.beds; b++) {
        bed_put(bed, b, grains[(size_t)b]);
    }
}

/* ---- time ---- */

inline void bed_list(Bed *bed) {
    Grains &g = bed->g;
    clear(g.cell_count, cells_of(g));
    each<Grains, grain_enter_cell>(range_size(g, g.near), g);
    each<Grains, grain_list>(range_size(g, g.moving), g);
    std::swap(g.neighbour, g.next_neighbour);
    std::swap(g.touching, g.next_touching);
    std::swap(g.slip, g.next_slip);
    std::swap(g.roll, g.next_roll);
    bed->lists++;
}

/* Makes the lists anew where a grain has moved far. Stops the program where that came too late, and
 * where there is no room for them; in a walk it counts both. */
inline void bed_look(Bed *bed) {
    Grains &g = bed->g;
    int flags = 0;
    if (bed->lists > 0) {
        each<Grains, grain_watch>(range_size(g, g.moving), g);
        copy(&flags, g.flags, 1);
    }
    bed->late += flags & LIST_LATE ? 1 : 0;
    if (flags & LIST_LATE && bed->late_stops) {
        stop("a grain moved farther than its list of neighbours reaches: take more --steps");
    }
    bed->full += flags & (CELL_FULL | LIST_FULL) ? 1 : 0;
    if (flags & (CELL_FULL | LIST_FULL) && bed->late_stops) {
        stop(flags & CELL_FULL ? "too many grains in a cell" : "too many neighbours of a grain");
    }
    if (flags) {
        clear(g.flags, 1);
    }
    if (flags & LIST_DUE || bed->lists == 0) {
        bed_list(bed);
    }
}

inline void bed_go(Bed *bed, long steps) {
    Grains &g = bed->g;
    for (long k = 0; k < steps; k++) {
        if (bed->steps++ % CHECK_STEPS == 0) {
            bed_look(bed);
        }
        each<Grains, grain_step>(range_size(g, g.moving), g);
        if (g.ride) {
            each<Grains, ride_step>(1, g);
        } else {
            each<Grains, plate_step>(g.beds, g);
        }
        std::swap(g.place, g.next_place);
        std::swap(g.velocity, g.next_velocity);
        std::swap(g.spin, g.next_spin);
    }
}

inline long bed_steps(const Bed &bed, double seconds) {
    return (long)llround(seconds / (double)bed.g.law.dt);
}

/* ---- what it is ---- */

/* Level on which a plate first touches: the mean of the highest grains of cells two grains wide. */
inline float bed_surface(const Bed &bed, const Place *place) {
    const Grains &g = bed.g;
    const int nx = (int)(g.size_x / (2 * bed.def.grain)),
              ny = (int)(g.size_y / (2 * bed.def.grain));
    std::vector<float> top((size_t)(nx * ny), 0.0f);
    for (int i = 0; i < g.per; i++) {
        float &t = top[(size_t)(cell_along(place[i].y, ny) * nx + cell_along(place[i].x, nx))];
        if (place[i].radius > 0) {
            t = fmaxf(t, (float)place[i].z * g.unit.z + place[i].radius);
        }
    }
    double sum = 0;
    for (float t : top) {
        sum += (double)t;
    }
    return (float)(sum / (nx * ny));
}

inline float bed_solid(const Bed &bed, const Place *place) {
    const Grains &g = bed.g;
    const float low = 0.2f * bed.def.depth, high = 0.8f * bed.def.depth;
    double volume = 0;
    for (int i = 0; i < g.per; i++) {
        const float z = (float)place[i].z * g.unit.z;
        volume += z > low && z < high ? 4.18879 * pow((double)place[i].radius, 3.0) : 0.0;
    }
    return (float)(volume / (double)(g.size_x * g.size_y * (high - low)));
}

inline void bed_measure(Bed *bed) {
    const std::vector<Place> place = bed_places(*bed);
    bed->surface.clear();
    bed->solid.clear();
    bed->filled.clear();
    for (int b = 0; b < bed->g.beds; b++) {
        const Place *own = &place[(size_t)(b * bed->g.per)];
        const auto there = [](const Place &p) { return p.radius > 0; };
        bed->surface.push_back(bed_surface(*bed, own));
        bed->solid.push_back(bed_solid(*bed, own));
        bed->filled.push_back((int)std::count_if(own, own + bed->g.per, there));
    }
}

/* ---- levelling ---- */

/* Bits of a number with two zeros between them. */
inline uint64_t bits_apart(int number) {
    uint64_t out = 0;
    for (int k = 0; k < 20; k++) {
        out |= (uint64_t)(number >> k & 1) << (3 * k);
    }
    return out;
}

/* The order of cells along Morton's curve: near each other in space, mostly near in memory. */
inline uint64_t cell_order(const Grains &g, const Place &p) {
    return bits_apart(cell_along(p.x, g.cells_x)) | bits_apart(cell_along(p.y, g.cells_y)) << 1 |
           bits_apart(cell_along(p.z, g.cells_z)) << 2;
}

/* Takes away the grains that stand above `depth`, puts the others in the order of their cells, and
 * forgets every contact. */
inline void bed_level(Bed *bed) {
    Grains &g = bed->g;
    std::vector<Place> place = bed_places(*bed);
    const auto key = [&g](const Place &p) { return p.radius > 0 ? cell_order(g, p) : UINT64_MAX; };
    for (Place &p : place) {
        if ((float)p.z * g.unit.z + p.radius > bed->def.depth) {
            p.radius = 0;
        }
    }
    for (int b = 0; b < g.beds; b++) {
        const auto first = place.begin() + (long)b * g.per;
        std::stable_sort(first, first + g.per,
                         [&key](const Place &a, const Place &c) { return key(a) < key(c); });
    }
    copy(g.place, place.data(), place.size());
    for (Vec3 *v : {g.velocity, g.next_velocity, g.spin, g.next_spin}) {
        clear(v, (size_t)g.count);
    }
    clear(g.touching, (size_t)g.count);
    bed->lists = 0;
}

/* Beds at rest, level, ready for a plate. */
inline void bed_settle(Bed *bed) {
    if (bed->def.file.empty()) {
        bed_go(bed, bed_steps(*bed, (double)bed->def.settle));
        bed_level(bed);
    }
    bed_go(bed, bed_steps(*bed, 0.25 * (double)bed->def.settle));
    bed_measure(bed);
}

/* ---- a copy to begin each case with ---- */

inline std::vector<std::pair<char *, size_t>> bed_parts(const Grains &g) {
    const size_t n = (size_t)g.count;
    std::vector<std::pair<char *, size_t>> parts = {
        {(char *)g.place, n * sizeof(Place)},
        {(char *)g.velocity, n * sizeof(Vec3)},
        {(char *)g.spin, n * sizeof(Vec3)},
        {(char *)g.touching, n * sizeof(uint32_t)},
        {(char *)g.neighbour, n * NEIGHBOURS * sizeof(int)},
        {(char *)g.slip, n * SLOTS * sizeof(Vec3)}};
    if (g.roll) {
        parts.push_back({(char *)g.roll, n * SLOTS * sizeof(Vec3)});
    }
    return parts;
}

inline std::vector<char *> bed_save(const Bed &bed) {
    std::vector<char *> saved;
    for (const auto &part : bed_parts(bed.g)) {
        saved.push_back(allocate<char>(part.second));
        copy(saved.back(), (const char *)part.first, part.second);
    }
    return saved;
}

inline void bed_restore(Bed *bed, const std::vector<char *> &saved) {
    const auto parts = bed_parts(bed->g);
    for (size_t k = 0; k < parts.size(); k++) {
        copy(parts[k].first, (const char *)saved[k], parts[k].second);
    }
    bed->steps = bed->lists = 0; /* the next step makes lists anew */
}

#endif
