/* Beds of grains, several at once: `beds` boxes with `per` grains each, periodic in x and y, with a
 * floor at z = 0 and a plate each. A grain knows the neighbours within its reach by a list, which
 * is made anew, by cells, before any grain outside it can touch.
 *
 * Positions are whole numbers of 2^-32 of the box. So differences are right across the box's
 * borders without a test, and a grain that moves 1e-9 m in a step does move: in single precision
 * such a step would be lost beside a position of 0.4 m. */
#ifndef GRAINS_GRAINS_H
#define GRAINS_GRAINS_H

#include "contact.h"

enum : int {
    NEIGHBOURS = 30,
    FLOOR = NEIGHBOURS, /* slots of the contacts with the floor and the plate */
    PLATE,
    SLOTS,
    CELL_GRAINS = 20,
    CHECK_STEPS = 8, /* between two looks at how far grains have moved */
    LIST_STEPS = 64, /* that a list lasts, if grains keep their speeds */
};

/* What can go wrong, as bits. */
enum : int { LIST_DUE = 1, LIST_LATE = 2, CELL_FULL = 4, LIST_FULL = 8 };

struct alignas(16) Place {
    uint32_t x, y, z;
    float radius; /* [m]; 0: a grain that was taken away */
};

/* Grains of each bed by number, from `first` on and around the bed's end. */
enum : int { RANGE_BEDS = 4 };
struct Range {
    int most; /* in any bed; 0: all grains of all beds */
    int first[RANGE_BEDS], count[RANGE_BEDS];
};

struct Ride;

struct Grains {
    int beds, per, count;
    Range moving;                 /* the others stand still */
    Range near;                   /* the others are far from those that move */
    float size_x, size_y, size_z; /* of the box [m] */
    Vec3 unit;                    /* of positions [m] */
    float leeway, most_leeway;    /* [m] that a grain may move before lists are due; a fast one */
    int cells_x, cells_y, cells_z;
    Law law;
    Shape shape;

    Place *place, *next_place; /* after a step they change places */
    Vec3 *velocity, *next_velocity, *spin, *next_spin;
    Place *listed; /* places when the lists were made; its radius has the grain's leeway in it */
    int *neighbour, *next_neighbour;
    uint32_t *touching, *next_touching; /* bits of the slots that remember something */
    Vec3 *slip, *next_slip, *roll, *next_roll;
    int *cell_count, *cell;
    int *flags;
    Plate *plate;
    Ride *ride; /* moves the plates; NULL: their own cases do */
};

BOTH int range_size(const Grains &g, const Range &range) {
    return range.most ? g.beds * range.most : g.count;
}

/* Number of the k-th grain of a range; -1: there is none. */
BOTH int range_grain(const Grains &g, const Range &range, int k) {
    if (range.most == 0) {
        return k;
    }
    const int bed = k / range.most, at = k % range.most;
    return at < range.count[bed] ? bed * g.per + (range.first[bed] + at) % g.per : -1;
}

BOTH Vec3 from_to(const Grains &g, const Place &a, const Place &b) {
    return vec((float)(int32_t)(b.x - a.x) * g.unit.x, (float)(int32_t)(b.y - a.y) * g.unit.y,
               (float)(int32_t)(b.z - a.z) * g.unit.z);
}

BOTH uint32_t shifted(uint32_t at, float way, float unit) {
    return at + (uint32_t)(int32_t)lrintf(way / unit);
}

/* Where slot s of grain i is. */
BOTH size_t slot(const Grains &g, int s, int i) {
    return (size_t)s * (size_t)g.count + (size_t)i;
}

/* ---- neighbours ---- */

BOTH int cell_along(uint32_t at, int cells) {
    return (int)(((uint64_t)at * (uint64_t)cells) >> 32);
}

BOTH int cell_index(const Grains &g, int bed, int x, int y, int z) {
    return ((bed * g.cells_z + z) * g.cells_y + y) * g.cells_x + x;
}

DEVICE void raise(const Grains &g, int flag) {
#ifdef __CUDACC__
    atomicOr(g.flags, flag);
#else
    __atomic_fetch_or(g.flags, flag, __ATOMIC_RELAXED);
#endif
}

/* Lists hold the grains whose surfaces are nearer than both leeways. So until one of the two has
 * moved as far as its own, they cannot touch unseen. A fast grain gets more of it. */
DEVICE void grain_enter_cell(int k, const Grains &g) {
    const int i = range_grain(g, g.near, k);
    if (i < 0) {
        return;
    }
    const Place a = g.place[i];
    g.listed[i] = a;
    if (a.radius <= 0.0f) {
        return;
    }
    const float way = (float)LIST_STEPS * g.law.dt * length(g.velocity[i]);
    g.listed[i].radius = a.radius + fminf(fmaxf(way, g.leeway), g.most_leeway);
    const int c = cell_index(g, i / g.per, cell_along(a.x, g.cells_x), cell_along(a.y, g.cells_y),
                             cell_along(a.z, g.cells_z));
    const int at = take_one(&g.cell_count[c]);
    if (at < CELL_GRAINS) {
        g.cell[c * CELL_GRAINS + at] = i;
    } else {
        raise(g, CELL_FULL);
    }
}

/* Adds to `list`, which is sorted by number, the grains of a cell that are near enough. */
DEVICE int list_cell(const Grains &g, int i, const Place &a, int c, int *list, int count) {
    const int grains = g.cell_count[c] < CELL_GRAINS ? g.cell_count[c] : CELL_GRAINS;
    for (int k = 0; k < grains; k++) {
        const int j = g.cell[c * CELL_GRAINS + k];
        const Place b = g.listed[j];
        const Vec3 d = from_to(g, b, a);
        const float near = a.radius + b.radius;
        if (j == i || dot(d, d) >= near * near) {
            continue;
        }
        if (count == NEIGHBOURS) {
            raise(g, LIST_FULL);
            return count;
        }
        int at = count++;
        for (; at > 0 && list[at - 1] > j; at--) {
            list[at] = list[at - 1];
        }
        list[at] = j;
    }
    return count;
}

/* Brings what contact `from` remembers to slot `to` of the new list. */
DEVICE uint32_t carry(const Grains &g, int i, int from, int to) {
    const size_t at = slot(g, to, i), old = slot(g, from, i);
    g.next_slip[at] = g.slip[old];
    if (g.roll) {
        g.next_roll[at] = g.roll[old];
    }
    return 1u << to;
}

DEVICE void grain_keep_contacts(const Grains &g, int i, const int *list, int count) {
    const uint32_t touching = g.touching[i];
    uint32_t kept = 0;
    for (int s = 0; s < NEIGHBOURS; s++) {
        g.next_neighbour[slot(g, s, i)] = s < count ? list[s] : -1;
    }
    for (int old = 0; old < NEIGHBOURS; old++) {
        const int j = touching >> old & 1u ? g.neighbour[slot(g, old, i)] : -1;
        for (int s = 0; s < count && j >= 0; s++) {
            kept |= list[s] == j ? carry(g, i, old, s) : 0u;
        }
    }
    for (int s = FLOOR; s < SLOTS; s++) {
        kept |= touching >> s & 1u ? carry(g, i, s, s) : 0u;
    }
    g.next_touching[i] = kept;
}

DEVICE void grain_list(int number, const Grains &g) {
    const int i = range_grain(g, g.moving, number);
    if (i < 0) {
        return;
    }
    const Place a = g.listed[i];
    int list[NEIGHBOURS], count = 0;
    if (a.radius > 0.0f) {
        const int x = cell_along(a.x, g.cells_x), y = cell_along(a.y, g.cells_y);
        const int z = cell_along(a.z, g.cells_z);
        for (int k = 0; k < 27; k++) {
            const int cz = z + k / 9 - 1;
            if (cz < 0 || cz >= g.cells_z) {
                continue;
            }
            const int cy = (y + k / 3 % 3 - 1 + g.cells_y) % g.cells_y;
            const int cx = (x + k % 3 - 1 + g.cells_x) % g.cells_x;
            count = list_cell(g, i, a, cell_index(g, i / g.per, cx, cy, cz), list, count);
        }
    }
    grain_keep_contacts(g, i, list, count);
}

/* Says when lists are due: two grains that each move less than their leeway stay apart. */
DEVICE void grain_watch(int k, const Grains &g) {
    const int i = range_grain(g, g.moving, k);
    if (i < 0) {
        return;
    }
    const Vec3 d = from_to(g, g.listed[i], g.place[i]);
    const float moved = length(d), leeway = g.listed[i].radius - g.place[i].radius;
    const float next = 2.0f * (float)CHECK_STEPS * g.law.dt * length(g.velocity[i]);
    if (moved + next > leeway) {
        raise(g, moved > leeway ? LIST_DUE | LIST_LATE : LIST_DUE);
    }
}

/* ---- a step ---- */

struct Body {
    Place place;
    Vec3 velocity, spin;
    float mass;
    Vec3 force, torque;
};

BOTH float grain_mass(const Law &law, float radius) {
    return law.density * 4.18879020f * radius * radius * radius;
}

/* What grain `i` remembers of slot `s`; nothing when it is new. */
DEVICE Memory recall(const Grains &g, int i, int s, uint32_t touching) {
    Memory memory = {vec(0, 0, 0), vec(0, 0, 0)};
    if (touching >> s & 1u) {
        memory.slip = g.slip[slot(g, s, i)];
        if (g.roll) {
            memory.roll = g.roll[slot(g, s, i)];
        }
    }
    return memory;
}

/* Adds the force of a contact to grain `i`, and returns it. `arm` is from its centre. */
DEVICE Vec3 grain_touch(const Grains &g, int i, int s, uint32_t touching, const Contact &c,
                        float arm, Body *a) {
    Memory memory = recall(g, i, s, touching);
    const Vec3 force = contact_force(g.law, c, &memory, &a->torque);
    g.slip[slot(g, s, i)] = memory.slip;
    if (g.roll) {
        g.roll[slot(g, s, i)] = memory.roll;
    }
    a->force = a->force + force;
    a->torque = a->torque - arm * cross(c.normal, force);
    return force;
}

DEVICE bool grain_touch_grain(const Grains &g, int i, int s, uint32_t touching, Body *a) {
    const int j = g.neighbour[slot(g, s, i)];
    const Place b = g.place[j];
    const Vec3 d = from_to(g, b, a->place);
    const float reach = a->place.radius + b.radius, square = dot(d, d);
    if (square >= reach * reach) {
        return false;
    }
    const float apart = fmaxf(sqrtf(square), 1e-9f), mass = grain_mass(g.law, b.radius);
    const Vec3 spin = g.spin[j];
    Contact c;
    c.normal = (1.0f / apart) * d;
    c.overlap = reach - apart;
    c.mass = a->mass * mass / (a->mass + mass);
    c.radius = a->place.radius * b.radius / reach;
    c.turning = a->spin - spin;
    const float arm = a->place.radius - 0.5f * c.overlap, other = b.radius - 0.5f * c.overlap;
    c.velocity = a->velocity - g.velocity[j] - cross(arm * a->spin + other * spin, c.normal);
    grain_touch(g, i, s, touching, c, arm, a);
    return true;
}

/* A wall that moves with `velocity` and turns with `turning`, at `overlap`. */
DEVICE Vec3 grain_touch_wall(const Grains &g, int i, int s, uint32_t touching, Vec3 normal,
                             float overlap, Vec3 velocity, Vec3 turning, Body *a) {
    Contact c;
    c.normal = normal;
    c.overlap = overlap;
    c.mass = a->mass;
    c.radius = a->place.radius;
    c.turning = a->spin - turning;
    const float arm = a->place.radius - 0.5f * overlap;
    c.velocity = a->velocity - velocity - cross(arm * a->spin, normal);
    return grain_touch(g, i, s, touching, c, arm, a);
}

DEVICE bool grain_touch_floor(const Grains &g, int i, uint32_t touching, Body *a) {
    const float overlap = a->place.radius - (float)a->place.z * g.unit.z;
    if (overlap <= 0.0f) {
        return false;
    }
    const Vec3 still = vec(0, 0, 0);
    grain_touch_wall(g, i, FLOOR, touching, vec(0, 0, 1), overlap, still, still, a);
    return true;
}

DEVICE bool grain_touch_plate(const Grains &g, int i, uint32_t touching, Body *a) {
    if (g.shape.reach <= 0.0f) {
        return false;
    }
    Plate *plate = &g.plate[i / g.per];
    const Place origin = {plate->cell_x, plate->cell_y, plate->cell_z, 0};
    const Vec3 d = from_to(g, origin, a->place);
    const float radius = a->place.radius, far = g.shape.reach + radius;
    const Vec3 p = plate_from_world(*plate, d);
    if (dot(d, d) >= far * far || p.z < -radius) {
        return false;
    }
    Vec3 normal;
    const float gap = shape_nearest(g.shape, p, &normal) - radius;
    if (gap >= 0.0f) {
        return false;
    }
    normal = plate_to_world(*plate, normal);
    const Vec3 at = d - (radius + 0.5f * gap) * normal; /* of the contact, from the origin */
    const Vec3 velocity = plate->velocity + cross(plate->spin, at), turning = plate->spin;
    const Vec3 before = a->torque;
    const Vec3 force = grain_touch_wall(g, i, PLATE, touching, normal, -gap, velocity, turning, a);
    const float arm = radius + 0.5f * gap;
    const Vec3 rolling = a->torque - before + arm * cross(normal, force);
    const Vec3 back = vec(-force.x, -force.y, -force.z);
    plate_add(plate, back, cross(at, back) - rolling);
    if (g.shape.band > 0.0f) {
        const double up = (double)back.z * (double)(1 << SUM_BITS);
        add_to(&plate->band[shape_band(g.shape, p, radius)], (long long)up);
    }
    return true;
}

/* Leapfrog: velocities half a step before the places. */
DEVICE void grain_move(const Grains &g, int i, const Body &a) {
    const float h = g.law.dt / a.mass, r = a.place.radius;
    const Vec3 velocity = a.velocity + h * a.force;
    const Vec3 spin = a.spin + (2.5f * h / (r * r)) * a.torque;
    Place place = a.place;
    place.x = shifted(place.x, g.law.dt * velocity.x, g.unit.x);
    place.y = shifted(place.y, g.law.dt * velocity.y, g.unit.y);
    place.z = shifted(place.z, g.law.dt * velocity.z, g.unit.z);
    g.next_place[i] = place;
    g.next_velocity[i] = velocity;
    g.next_spin[i] = spin;
}

DEVICE void grain_step(int k, const Grains &g) {
    const int i = range_grain(g, g.moving, k);
    if (i < 0) {
        return;
    }
    Body a;
    a.place = g.place[i];
    if (a.place.radius <= 0.0f) {
        g.next_place[i] = a.place;
        return;
    }
    a.velocity = g.velocity[i];
    a.spin = g.spin[i];
    a.mass = grain_mass(g.law, a.place.radius);
    a.force = vec(0, 0, -a.mass * g.law.gravity);
    a.torque = vec(0, 0, 0);
    const uint32_t touching = g.touching[i];
    uint32_t now = 0;
    for (int s = 0; s < NEIGHBOURS && g.neighbour[slot(g, s, i)] >= 0; s++) {
        now |= grain_touch_grain(g, i, s, touching, &a) ? 1u << s : 0u;
    }
    now |= grain_touch_floor(g, i, touching, &a) ? 1u << FLOOR : 0u;
    now |= grain_touch_plate(g, i, touching, &a) ? 1u << PLATE : 0u;
    if (now != touching) {
        g.touching[i] = now;
    }
    grain_move(g, i, a);
}

/* The origin's place in the units of the grains. */
BOTH void plate_cells(Plate *p, const Grains &g, double x, double y, double z) {
    p->cell_x = (1u << 31) + (uint32_t)llrint(x / (double)g.unit.x);
    p->cell_y = (1u << 31) + (uint32_t)llrint(y / (double)g.unit.y);
    p->cell_z = (uint32_t)llrint(z / (double)g.unit.z);
}

/* What grains feel, from pose and motion of a case. A positive pitch lowers the edge at +x. */
BOTH void plate_place(Plate *p, const Grains &g) {
    const float sine = (float)sin(p->pitch), cosine = (float)cos(p->pitch);
    const float left = (float)sin(p->yaw), ahead = (float)cos(p->yaw);
    const float turn[9] = {ahead * cosine, -left, ahead * sine, left * cosine, ahead, left * sine,
                           -sine,          0,     cosine};
    plate_cells(p, g, p->x, p->y, p->z);
    for (int k = 0; k < 9; k++) {
        p->turn[k] = turn[k];
    }
    p->side = 1;
    p->velocity = vec((float)p->vx, (float)p->vy, (float)p->vz);
    p->spin = vec(-left * (float)p->rate, ahead * (float)p->rate, (float)p->turning);
}

DEVICE void plate_step(int bed, const Grains &g) {
    Plate *p = &g.plate[bed];
    const double dt = (double)g.law.dt;
    const double force = (double)(p->sum[2] - p->pushed) / (double)(1 << SUM_BITS);
    p->pushed = p->sum[2];
    if (p->mass > 0) {
        p->vz += dt * (force / p->mass - (double)g.law.gravity);
    }
    p->x += dt * p->vx;
    p->y += dt * p->vy;
    p->z += dt * p->vz;
    p->yaw += dt * p->turning;
    p->pitch += dt * p->rate;
    plate_place(p, g);
}

#endif
