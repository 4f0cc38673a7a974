/* A robot walks on grains: the program at the other end of `mild eval --program`
 * (src/run/eval/other_ground.h has what is said). A bed for each foot, as long as the way, of which
 * only the grains around the foot move; those behind it keep the imprints. */
#ifndef GRAINS_WALK_H
#define GRAINS_WALK_H

#include <chrono>
#include <csignal>

#include "plan.h"

struct WalkDef {
    Shape shape = {};                    /* of the first foot's sole, in the foot's frame */
    std::vector<double> sides = {1, -1}; /* -1: this foot has its mirror image */
    double sole_z = 0;                   /* [m] of the sole in the foot's frame */
    float height = 0.06f;                /* [m] of the block that the foot is */
    double reach = 0.3;                  /* [m] grains nearer to the middle of the sole move */
    double track = 4;                    /* [m] length of the way */
    double frames = 25;                  /* pictures a second */
};

constexpr float WALK_LEEWAY = 0.32f;    /* [grains]: a foot throws grains, which are fast */
constexpr double PRESS_SPEED = 0.25;    /* [m/s] of the soles before the first step */
constexpr double PICTURE_UNIT = 0.0002; /* [m] */
enum : int { PICTURE_MOVED = 6 };       /* units; grains that moved less are not drawn anew */

/* ---- the long bed ---- */

/* A settled bed many times, one after another; it is periodic, so they fit. Grains of one of them
 * are in the order of slabs across the way, so those near the foot are a range. */
struct Track {
    Bed bed;
    int tiles, slabs;                           /* slabs of a tile */
    int per;                                    /* grains of a tile */
    std::vector<std::vector<int>> slab;         /* [beds][slabs + 1] first grain of each */
    std::vector<std::vector<uint16_t>> picture; /* [beds][3 grains] as last drawn */
    std::vector<int> middle;                    /* [beds] slab that the foot is over */
    int half, moves;                            /* slabs to each side; times that a window moved */
};

/* Slab of a grain of a settled bed; those that were taken away are in the last one. */
inline int slab_of(const Place &p, int slabs) {
    return p.radius > 0 ? cell_along(p.x, slabs) : slabs - 1;
}

/* The order of a tile's grains: rank to number. */
inline std::vector<int> tile_order(const Bed &tile, const Place *place, int slabs) {
    std::vector<int> order((size_t)tile.g.per);
    std::vector<uint64_t> key(order.size());
    for (size_t i = 0; i < order.size(); i++) {
        const Place &p = place[i];
        order[i] = (int)i;
        key[i] = p.radius > 0
                     ? ((uint64_t)cell_along(p.x, slabs) << 58) | (cell_order(tile.g, p) >> 6)
                     : UINT64_MAX;
    }
    std::stable_sort(order.begin(), order.end(),
                     [&key](int a, int b) { return key[(size_t)a] < key[(size_t)b]; });
    return order;
}

/* Copies an array of a tile's grains, in their new order, into each tile of bed b. */
template <class T>
void track_spread(const Track &t, int b, const std::vector<int> &order, const T *from, T *one,
                  T *other) {
    std::vector<T> sorted(order.size());
    for (size_t k = 0; k < order.size(); k++) {
        sorted[k] = from[order[k]];
    }
    const T *source = sorted.data(); /* then the first tile: a GPU copies within its own memory */
    for (int tile = 0; tile < t.tiles; tile++) {
        const size_t at = (size_t)b * (size_t)t.bed.g.per + (size_t)tile * (size_t)t.per;
        copy(one + at, source, sorted.size());
        source = tile == 0 ? one + at : source;
        copy(other + at, source, sorted.size());
    }
}

inline void track_places(Track *t, int b, const std::vector<int> &order, const Place *from) {
    const Grains &g = t->bed.g;
    std::vector<Place> place(order.size());
    for (int tile = 0; tile < t->tiles; tile++) {
        for (size_t k = 0; k < order.size(); k++) {
            place[k] = from[order[k]];
            place[k].x =
                (uint32_t)((((uint64_t)tile << 32) + place[k].x) / (uint64_t)(unsigned)t->tiles);
        }
        const size_t at = (size_t)b * (size_t)g.per + (size_t)tile * (size_t)t->per;
        for (Place *to : {g.place, g.next_place, g.listed}) {
            copy(to + at, place.data(), place.size());
        }
    }
}

/* The neighbours' new numbers: across a tile's end they are in the next one. */
inline void track_neighbours(Track *t, const Bed &tile, int b, const std::vector<int> &order,
                             const Place *place, const std::vector<int> &list) {
    const Grains &g = t->bed.g;
    const int first = b * tile.g.per;
    std::vector<int> rank(order.size()), to(order.size());
    for (size_t k = 0; k < order.size(); k++) {
        rank[(size_t)order[k]] = (int)k;
    }
    for (int s = 0; s < NEIGHBOURS; s++) {
        for (int piece = 0; piece < t->tiles; piece++) {
            for (size_t k = 0; k < order.size(); k++) {
                const int i = order[k];
                const int j = list[(size_t)s * (size_t)tile.g.count + (size_t)(first + i)];
                to[k] = -1;
                if (j >= 0) {
                    const int64_t x = place[i].x;
                    const int64_t there = x + (int32_t)(place[j - first].x - place[i].x);
                    const int across = there < 0 ? -1 : there >> 32 ? 1 : 0;
                    const int in = (piece + across + t->tiles) % t->tiles;
                    to[k] = b * g.per + in * t->per + rank[(size_t)(j - first)];
                }
            }
            const size_t at = slot(g, s, b * g.per + piece * t->per);
            copy(g.neighbour + at, to.data(), to.size());
            copy(g.next_neighbour + at, to.data(), to.size());
        }
    }
}

/* What the contacts of bed b remember. */
inline void track_contacts(Track *t, const Bed &tile, int b, const std::vector<int> &order) {
    const Grains &g = t->bed.g, &old = tile.g;
    const size_t n = (size_t)old.per, first = (size_t)b * n;
    std::vector<uint32_t> touching(n);
    copy(touching.data(), old.touching + first, n);
    track_spread(*t, b, order, touching.data(), g.touching, g.next_touching);
    std::vector<Vec3> path(n);
    for (int s = 0; s < SLOTS; s++) {
        const size_t from = slot(old, s, (int)first), to = slot(g, s, 0);
        copy(path.data(), old.slip + from, n);
        track_spread(*t, b, order, path.data(), g.slip + to, g.next_slip + to);
        if (g.roll) {
            copy(path.data(), old.roll + from, n);
            track_spread(*t, b, order, path.data(), g.roll + to, g.next_roll + to);
        }
    }
}

inline void track_slabs(Track *t, const Place *place) {
    std::vector<int> first((size_t)t->slabs + 1, 0);
    for (int i = 0; i < t->per; i++) {
        first[(size_t)slab_of(place[i], t->slabs) + 1]++;
    }
    for (int s = 0; s < t->slabs; s++) {
        first[(size_t)s + 1] += first[(size_t)s];
    }
    t->slab.push_back(first);
}

/* ---- pictures ---- */

inline void picture_of(const Grains &g, const Place &p, uint16_t *out) {
    const uint32_t at[3] = {p.x, p.y, p.z};
    const float unit[3] = {g.unit.x, g.unit.y, g.unit.z};
    for (int k = 0; k < 3; k++) {
        out[k] = (uint16_t)lrint((double)at[k] * (double)unit[k] / PICTURE_UNIT);
    }
}

/* The settled beds: a bed's grains, each x y z radius. */
inline void picture_beds(Track *t, FILE *out) {
    const Grains &g = t->bed.g;
    for (int b = 0; b < g.beds; b++) {
        std::vector<Place> place((size_t)g.per);
        copy(place.data(), g.place + (size_t)b * (size_t)g.per, place.size());
        std::vector<uint16_t> drawn(3 * place.size());
        for (size_t i = 0; i < place.size(); i++) {
            picture_of(g, place[i], &drawn[3 * i]);
            if (i < (size_t)t->per) {
                const uint16_t radius = (uint16_t)lrint((double)place[i].radius * 1e6);
                fwrite(&drawn[3 * i], sizeof(uint16_t), 3, out);
                fwrite(&radius, sizeof radius, 1, out);
            }
        }
        t->picture.push_back(drawn);
    }
}

/* Places in a range of a bed. */
inline std::vector<Place> range_places(const Grains &g, int b, const Range &range) {
    std::vector<Place> place((size_t)range.count[b]);
    const int first = range.first[b], end = std::min(first + range.count[b], g.per);
    const Place *own = g.place + (size_t)b * (size_t)g.per;
    copy(place.data(), own + first, (size_t)(end - first));
    copy(place.data() + (end - first), own, place.size() - (size_t)(end - first));
    return place;
}

/* Grains that have moved since they were drawn. For each bed: how many (32 bit), their numbers,
 * each less the one before, and by how many units they moved in x, in y, in z (16 bit). What packs
 * well stands together. */
inline void picture_take(Track *t, FILE *out) {
    const Grains &g = t->bed.g;
    for (int b = 0; b < g.beds; b++) {
        const std::vector<Place> place = range_places(g, b, g.moving);
        std::vector<uint16_t> &drawn = t->picture[(size_t)b];
        std::vector<uint32_t> number;
        std::vector<int16_t> way[3];
        uint32_t last = 0;
        for (size_t k = 0; k < place.size(); k++) {
            const size_t i = ((size_t)g.moving.first[b] + k) % (size_t)g.per;
            uint16_t now[3];
            int16_t by[3];
            picture_of(g, place[k], now);
            for (size_t a = 0; a < 3; a++) {
                by[a] = (int16_t)(now[a] - drawn[3 * i + a]);
            }
            if (std::max(abs(by[0]), std::max(abs(by[1]), abs(by[2]))) < PICTURE_MOVED) {
                continue;
            }
            std::copy(now, now + 3, &drawn[3 * i]);
            number.push_back((uint32_t)i - last);
            last = (uint32_t)i;
            for (size_t a = 0; a < 3; a++) {
                way[a].push_back(by[a]);
            }
        }
        const uint32_t count = (uint32_t)number.size();
        fwrite(&count, sizeof count, 1, out);
        if (number.empty()) {
            continue;
        }
        fwrite(number.data(), sizeof count, number.size(), out);
        for (const std::vector<int16_t> &w : way) {
            fwrite(w.data(), sizeof(int16_t), w.size(), out);
        }
    }
}

/* ---- windows ---- */

/* Slabs from `from` to `from + slabs`, around the track's end. */
inline void track_range(const Track &t, int b, int from, int slabs, Range *range) {
    const auto start = [&t, b](int s) {
        const int all = t.tiles * t.slabs, in = ((s % all) + all) % all;
        return in / t.slabs * t.per + t.slab[(size_t)b][(size_t)(in % t.slabs)];
    };
    const int per = t.bed.g.per;
    range->first[b] = start(from);
    range->count[b] = (start(from + slabs) - range->first[b] + per) % per;
    range->most = 0;
    for (int k = 0; k < t.bed.g.beds; k++) {
        range->most = std::max(range->most, range->count[k]);
    }
}

/* Grain k of those that leave the window, g.moving, comes to rest, and both halves of every double
 * array know it. */
DEVICE void grain_rest(int k, const Grains &g) {
    const int i = range_grain(g, g.moving, k);
    if (i < 0) {
        return;
    }
    const Vec3 still = vec(0, 0, 0);
    g.velocity[i] = g.next_velocity[i] = g.spin[i] = g.next_spin[i] = still;
    g.next_place[i] = g.place[i];
    g.next_touching[i] = g.touching[i];
    for (int s = 0; s < NEIGHBOURS; s++) {
        g.next_neighbour[slot(g, s, i)] = g.neighbour[slot(g, s, i)];
    }
    for (int s = 0; s < SLOTS; s++) {
        g.next_slip[slot(g, s, i)] = g.slip[slot(g, s, i)];
        if (g.roll) {
            g.next_roll[slot(g, s, i)] = g.roll[slot(g, s, i)];
        }
    }
}

/* Puts the window of bed b around slab `middle`. */
inline void track_put(Track *t, int b, int middle) {
    const int wide = 2 * t->half + 1, more = std::max(2, t->half / 2), all = t->tiles * t->slabs;
    Grains &g = t->bed.g;
    t->middle[(size_t)b] = middle;
    track_range(*t, b, middle - t->half, wide, &g.moving);
    track_range(*t, b, middle - t->half - more, std::min(wide + 2 * more, all - 1), &g.near);
    t->bed.lists = 0;
}

/* Moves the window with the foot, a slab or more at a time, and back only when it is two behind. */
inline void track_follow(Track *t, int b, double x) {
    Grains &g = t->bed.g;
    const double slab = (double)g.size_x / (t->tiles * t->slabs);
    const int now = (int)floor((x + 0.5 * (double)g.size_x) / slab), was = t->middle[(size_t)b];
    if (now == was || now == was - 1) {
        return;
    }
    Grains leaving = g;
    leaving.moving = {};
    const int way = std::min(abs(now - was), 2 * t->half + 1);
    track_range(*t, b, now > was ? was - t->half : was + t->half + 1 - way, way, &leaving.moving);
    each<Grains, grain_rest>(range_size(leaving, leaving.moving), leaving);
    track_put(t, b, now);
    t->moves++;
}

/* From settled beds, which are closed. */
inline void track_open(Track *t, Bed *tile, const WalkDef &def) {
    Grains &g = t->bed.g;
    const double length = (double)tile->g.size_x;
    t->slabs = std::min(std::max(3, (int)(length / (10 * (double)tile->def.grain))), 60);
    t->half = (int)ceil(def.reach / (length / t->slabs));
    const double wide = (2.0 * t->half + 1 + 2 * std::max(2, t->half / 2)) / t->slabs;
    t->tiles = std::max((int)ceil((def.track + 2 * def.reach) / length), (int)ceil(wide) + 1);
    t->per = tile->g.per;
    t->bed = *tile;
    t->moves = 0;
    g.per = t->tiles * t->per;
    g.count = g.beds * g.per;
    g.size_x *= (float)t->tiles;
    g.unit.x *= (float)t->tiles;
    const float widest = tile->def.grain * (1 + tile->def.spread);
    g.most_leeway = fminf(WALK_LEEWAY * tile->def.grain, 0.16f * g.size_y - 0.5f * widest);
    g.most_leeway = fmaxf(g.most_leeway, g.leeway);
    bed_cells(&g, tile->def);
    bed_allocate(&g);
    const std::vector<Place> place = bed_places(*tile);
    std::vector<int> list((size_t)tile->g.count * NEIGHBOURS);
    copy(list.data(), tile->g.neighbour, list.size());
    for (int b = 0; b < g.beds; b++) {
        const Place *own = &place[(size_t)b * (size_t)t->per];
        const std::vector<int> order = tile_order(*tile, own, t->slabs);
        track_slabs(t, own);
        track_places(t, b, order, own);
        track_neighbours(t, *tile, b, order, own, list);
        track_contacts(t, *tile, b, order);
    }
    t->middle.assign((size_t)g.beds, 0);
    bed_close(tile);
}

/* ---- the robot's side ---- */

struct Foot {
    double place[3], turn[9], twist[6]; /* of the sole's origin */
    double arm[3];                      /* [m] from the ankle to it, world */
};

struct Question {
    double time, dt;
    int trial;
    std::vector<Foot> foot;
    std::vector<double> free, response; /* at the soles' origins */
};

/* rows x 6n of A or V: from the ankle to the origin, v + w x r, in place; step: between the six
 * numbers of a twist, `count` of them. */
inline void to_origin(double *v, size_t step, const double *r) {
    const double *w[3] = {v + 3 * step, v + 4 * step, v + 5 * step};
    v[0] += *w[1] * r[2] - *w[2] * r[1];
    v[step] += *w[2] * r[0] - *w[0] * r[2];
    v[2 * step] += *w[0] * r[1] - *w[1] * r[0];
}

/* Bool: there is one more. */
inline bool question_read(Question *q, int feet, double sole_z) {
    double head[4], foot[18];
    if (fread(head, sizeof *head, 4, stdin) != 4) {
        return false;
    }
    if ((int)head[0] != feet) {
        stop("the robot has another number of feet than --sides");
    }
    const size_t rows = 6 * (size_t)feet;
    q->time = head[1];
    q->dt = head[2];
    q->trial = (int)head[3];
    q->foot.resize((size_t)feet);
    q->free.resize(rows);
    q->response.resize(rows * rows);
    for (Foot &f : q->foot) {
        if (fread(foot, sizeof *foot, 18, stdin) != 18) {
            return false;
        }
        std::copy(foot + 3, foot + 12, f.turn);
        std::copy(foot + 12, foot + 18, f.twist);
        for (int k = 0; k < 3; k++) {
            f.arm[k] = sole_z * f.turn[3 * k + 2];
            f.place[k] = foot[k] + f.arm[k];
        }
        to_origin(f.twist, 1, f.arm);
    }
    if (fread(q->free.data(), sizeof(double), rows, stdin) != rows ||
        fread(q->response.data(), sizeof(double), rows * rows, stdin) != rows * rows) {
        return false;
    }
    for (size_t f = 0; f < (size_t)feet; f++) {
        const double *arm = q->foot[f].arm;
        to_origin(&q->free[6 * f], 1, arm);
        for (size_t row = 0; row < rows; row++) {
            to_origin(&q->response[row * rows + 6 * f], 1, arm);
        }
    }
    for (size_t f = 0; f < (size_t)feet; f++) {
        for (size_t column = 0; column < rows; column++) {
            to_origin(&q->response[6 * f * rows + column], rows, q->foot[f].arm);
        }
    }
    return true;
}

/* w: force and moment about the sole's origin, means. */
inline void answer_write(const Foot &f, const double *w, double deep, double mean) {
    const double *r = f.arm;
    const double out[8] = {w[0],
                           w[1],
                           w[2],
                           w[3] + r[1] * w[2] - r[2] * w[1],
                           w[4] + r[2] * w[0] - r[0] * w[2],
                           w[5] + r[0] * w[1] - r[1] * w[0],
                           deep,
                           mean};
    fwrite(out, sizeof *out, 8, stdout);
}

/* ---- the walk ---- */

struct Walk {
    WalkDef def;
    Track track;
    Ride ride;
    std::vector<Plate> plate;
    double middle;        /* [m] of the outline along x */
    long steps;           /* of the robot */
    double pressed;       /* [m] way of the soles before the first step */
    double turned, moved; /* [m] largest way by which a pose was put right in a step */
    double parted;        /* [m/s] largest difference of the robot's speed and the sole's */
    double lost;          /* [s] when a sole was lost; below 0: none was */
};

/* Of any rotation: the largest of the four numbers is found first. */
inline void quaternion_of(const double *m, double *q) {
    const double square[4] = {m[0] + m[4] + m[8], m[0] - m[4] - m[8], m[4] - m[0] - m[8],
                              m[8] - m[0] - m[4]};
    const size_t most = (size_t)(std::max_element(square, square + 4) - square);
    const double skew[3] = {m[7] - m[5], m[2] - m[6], m[3] - m[1]};
    const double large = 0.5 * sqrt(1 + square[most]), part = 1 / (4 * large);
    q[0] = most == 0 ? large : part * skew[most - 1];
    for (size_t k = 0; k < 3; k++) {
        if (most == 0) {
            q[k + 1] = part * skew[k];
        } else {
            const size_t row = most - 1;
            q[k + 1] = k == row ? large : part * (m[3 * row + k] + m[3 * k + row]);
        }
    }
}

/* The rotation from orientation a to b as a vector [rad]; it is small. */
inline void turn_between(const double *a, const double *b, double *out) {
    const double sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -2 : 2;
    out[0] = sign * (a[0] * b[1] - b[0] * a[1] - (b[2] * a[3] - b[3] * a[2]));
    out[1] = sign * (a[0] * b[2] - b[0] * a[2] - (b[3] * a[1] - b[1] * a[3]));
    out[2] = sign * (a[0] * b[3] - b[0] * a[3] - (b[1] * a[2] - b[2] * a[1]));
}

/* [m] Below the undisturbed surface: the deepest point of the outline, and the outline's middle. */
inline void depths(const Walk &w, const Foot &f, double side, double *deep, double *mean) {
    const Shape &s = w.def.shape;
    *deep = -1e9;
    for (int k = 0; k < s.points; k++) {
        const double z =
            f.place[2] + f.turn[6] * (double)s.x[k] + f.turn[7] * side * (double)s.y[k];
        *deep = std::max(*deep, -z);
    }
    *mean = -(f.place[2] + f.turn[6] * w.middle);
}

/* Plates and ride to the device, with sums from 0. */
inline void ride_write(Walk *w) {
    Grains &g = w->track.bed.g;
    memset(w->ride.before, 0, sizeof w->ride.before);
    for (size_t b = 0; b < w->plate.size(); b++) {
        memset(w->plate[b].sum, 0, sizeof w->plate[b].sum);
        w->plate[b].side = (float)w->def.sides[b];
        ride_place(w->ride, (int)b, g, &w->plate[b]);
    }
    copy(g.plate, w->plate.data(), w->plate.size());
    copy(g.ride, &w->ride, 1);
}

/* Lowers the soles into the bed to where the robot stands at first. */
inline void walk_press(Walk *w, const Question &q) {
    Bed &bed = w->track.bed;
    double way = 0;
    for (size_t b = 0; b < q.foot.size(); b++) {
        double deep, mean;
        depths(*w, q.foot[b], w->def.sides[b], &deep, &mean);
        way = std::max(way, deep + 0.0005);
    }
    w->ride = {};
    for (size_t b = 0; b < q.foot.size(); b++) {
        const Foot &f = q.foot[b];
        std::copy(f.place, f.place + 3, &w->ride.place[3 * b]);
        w->ride.place[3 * b + 2] += (double)bed.surface[b] + way;
        quaternion_of(f.turn, &w->ride.turn[4 * b]);
        w->ride.twist[6 * b + 2] = -PRESS_SPEED;
        const double x = f.place[0] + f.turn[0] * w->middle;
        const double slab = (double)bed.g.size_x / (w->track.tiles * w->track.slabs);
        track_put(&w->track, (int)b, (int)floor((x + 0.5 * (double)bed.g.size_x) / slab));
    }
    ride_write(w);
    bed_go(&bed, bed_steps(bed, way / PRESS_SPEED));
    copy(&w->ride, bed.g.ride, 1);
    w->pressed = way;
}

/* What the robot says of its soles, against where they are. */
inline void walk_move_soles(Walk *w, const Question &q) {
    const size_t rows = q.free.size();
    Ride &r = w->ride;
    for (size_t b = 0; b < q.foot.size(); b++) {
        const Foot &f = q.foot[b];
        double turn[4], by[6];
        quaternion_of(f.turn, turn);
        for (size_t k = 0; k < 3; k++) {
            by[k] = f.place[k] - r.place[3 * b + k];
        }
        by[2] += (double)w->track.bed.surface[b];
        turn_between(&r.turn[4 * b], turn, by + 3);
        w->moved = std::max(w->moved, sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]));
        w->turned = std::max(w->turned, sqrt(by[3] * by[3] + by[4] * by[4] + by[5] * by[5]));
        for (size_t k = 0; k < 6; k++) {
            if (w->steps > 0 && k < 3) {
                w->parted = std::max(w->parted, fabs(f.twist[k] - r.twist[6 * b + k]));
            }
            r.shift[6 * b + k] = by[k] / q.dt;
            r.twist[6 * b + k] = f.twist[k];
            r.free[6 * b + k] = (q.free[6 * b + k] - f.twist[k]) / q.dt;
        }
    }
    std::copy(q.response.begin(), q.response.end(), r.response);
    if (rows * rows > sizeof r.response / sizeof *r.response) {
        stop("too many feet");
    }
}

/* Bool: a sole is upside down in the ground, at the floor, or so far along the way that it meets
 * its start. */
inline bool sole_is_lost(const Walk &w, const Question &q) {
    const Bed &bed = w.track.bed;
    const double way = (double)bed.g.size_x - 2 * w.def.reach;
    for (size_t b = 0; b < q.foot.size(); b++) {
        const Foot &f = q.foot[b];
        double deep, mean;
        depths(w, f, w.def.sides[b], &deep, &mean);
        if (!((f.turn[8] > 0 || deep < 0) && deep < (double)bed.surface[b] &&
              fabs(f.place[0]) < way)) {
            return true;
        }
    }
    return false;
}

/* A step of the robot. From a lost sole on there is no ground: the robot falls, and those who judge
 * it end the trial by their own rule. Bool: the answer was taken. */
inline bool walk_step(Walk *w, const Question &q) {
    Bed &bed = w->track.bed;
    if (w->lost < 0 && sole_is_lost(*w, q)) {
        w->lost = q.time;
    }
    if (w->lost >= 0) {
        const double none[6] = {0, 0, 0, 0, 0, 0};
        for (const Foot &f : q.foot) {
            answer_write(f, none, 0, 0);
        }
        return fflush(stdout) == 0;
    }
    if (w->steps == 0) {
        walk_press(w, q);
    }
    const long steps = (long)ceil(q.dt / (double)bed_law(bed.def).dt);
    bed.g.law.dt = (float)(q.dt / (double)steps);
    for (size_t b = 0; b < q.foot.size(); b++) {
        track_follow(&w->track, (int)b, q.foot[b].place[0] + q.foot[b].turn[0] * w->middle);
    }
    walk_move_soles(w, q);
    ride_write(w);
    bed_go(&bed, steps);
    copy(&w->ride, bed.g.ride, 1);
    copy(w->plate.data(), bed.g.plate, w->plate.size());
    for (size_t b = 0; b < q.foot.size(); b++) {
        double mean[6], deep, middle;
        for (int k = 0; k < 6; k++) {
            mean[k] = (double)w->plate[b].sum[k] / (double)(1 << SUM_BITS) / (double)steps;
        }
        depths(*w, q.foot[b], w->def.sides[b], &deep, &middle);
        const bool stands = mean[2] > 1;
        answer_write(q.foot[b], mean, stands ? std::max(deep, 0.0) : 0,
                     stands ? std::max(middle, 0.0) : 0);
    }
    w->steps++;
    return fflush(stdout) == 0;
}

inline void walk_open(Walk *w, const BedDef &bed, const WalkDef &def, int trial) {
    Bed tile;
    BedDef beds = bed;
    w->def = def;
    w->steps = 0;
    w->pressed = w->turned = w->moved = w->parted = 0;
    w->lost = -1;
    beds.seeds.clear();
    for (size_t b = 0; b < def.sides.size(); b++) {
        beds.seeds.push_back(bed.seeds[0] + (uint64_t)trial * def.sides.size() + b);
    }
    bed_open(&tile, beds);
    bed_settle(&tile);
    track_open(&w->track, &tile, def);
    float low = def.shape.x[0], high = low;
    for (int k = 0; k < def.shape.points; k++) {
        low = fminf(low, def.shape.x[k]);
        high = fmaxf(high, def.shape.x[k]);
    }
    w->middle = 0.5 * (double)(low + high);
    Grains &g = w->track.bed.g;
    g.shape = def.shape;
    g.shape.height = def.height;
    g.shape.reach = sqrtf(def.shape.reach * def.shape.reach + def.height * def.height);
    g.ride = allocate<Ride>(1);
    w->plate.resize((size_t)g.beds);
    w->track.bed.late = 0;
    w->track.bed.late_stops = false; /* a grain that a foot kicks away; they are counted */
}

inline FILE *walk_file(const std::string &folder, const char *name, int trial, const char *kind) {
    const std::string path = folder + "/" + name + "-" + std::to_string(trial) + kind;
    FILE *out = fopen(path.c_str(), "wb");
    if (!out) {
        stop("cannot write ", path.c_str());
    }
    return out;
}

/* What the pictures and the figure need to know. */
inline void walk_report(const Walk &w, int trial, int pictures, double time, double seconds,
                        const std::string &folder) {
    FILE *out = walk_file(folder, "walk", trial, ".json");
    const Track &t = w.track;
    const Grains &g = t.bed.g;
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"trial", (double)trial},
                   {"beds", (double)g.beds},
                   {"tiles", (double)t.tiles},
                   {"grains_of_tile", (double)t.per},
                   {"tile_m", (double)g.size_x / t.tiles},
                   {"width_m", (double)g.size_y},
                   {"unit_m", PICTURE_UNIT},
                   {"pictures", (double)pictures},
                   {"pictures_per_s", w.def.frames},
                   {"dt_s", (double)g.law.dt},
                   {"steps", (double)t.bed.steps},
                   {"robot_steps", (double)w.steps},
                   {"late_lists", (double)t.bed.late},
                   {"full_lists", (double)t.bed.full},
                   {"lists", (double)t.bed.lists},
                   {"windows", (double)t.moves},
                   {"moving", (double)g.moving.most},
                   {"pressed_m", w.pressed},
                   {"time_s", time},
                   {"seconds", seconds},
                   {"pose_off_m", w.moved},
                   {"pose_off_rad", w.turned},
                   {"speed_off_m_s", w.parted}};
    fprintf(out, "{");
    for (const auto &n : numbers) {
        fprintf(out, "\"%s\": %.9g,\n ", n.name, n.value);
    }
    if (w.lost < 0) {
        fprintf(out, "\"lost_sole_s\": null,\n ");
    } else {
        fprintf(out, "\"lost_sole_s\": %.9g,\n ", w.lost);
    }
    fprintf(out, "\"surface_m\": [");
    for (size_t b = 0; b < t.bed.surface.size(); b++) {
        fprintf(out, "%s%.6g", b ? ", " : "", (double)t.bed.surface[b]);
    }
    fprintf(out, "]}\n");
    fclose(out);
}

/* Files are whole after each picture, so a walk that is killed leaves what it has. */
inline void walk_run(const BedDef &bed, const WalkDef &def, const std::string &folder) {
    Question q;
    const int feet = (int)def.sides.size();
    if (!question_read(&q, feet, def.sole_z)) {
        return;
    }
    signal(SIGPIPE, SIG_IGN); /* a robot that has gone is the end of the walk */
    const int trial = q.trial;
    Walk w;
    walk_open(&w, bed, def, trial);
    const auto start = std::chrono::steady_clock::now();
    FILE *beds = walk_file(folder, "beds", trial, ".bin");
    FILE *frames = walk_file(folder, "frames", trial, ".bin");
    picture_beds(&w.track, beds);
    fclose(beds);
    int pictures = 0;
    const auto report = [&]() {
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
        walk_report(w, trial, pictures, q.time, took.count(), folder);
    };
    bool taken = true;
    do {
        taken = walk_step(&w, q);
        if (q.time * def.frames >= pictures) {
            picture_take(&w.track, frames);
            fflush(frames);
            pictures++;
            report();
        }
    } while (taken && question_read(&q, feet, def.sole_z));
    fclose(frames);
    report();
    release(w.track.bed.g.ride);
    bed_close(&w.track.bed);
}

#endif
