/* Runs a case on all beds and writes a CSV for each. */
#ifndef GRAINS_RECORD_H
#define GRAINS_RECORD_H

#include "plan.h"

struct Record {
    std::vector<FILE *> file, bands; /* a bed each; bands: empty where none are summed */
    std::vector<Plate> plate;
    std::vector<double> start; /* depth where the stage began [m] */
    double time = 0, path = 0;
    std::vector<double> force; /* the last row's, up [N] */
};

inline void plates_read(const Bed &bed, std::vector<Plate> *plate) {
    plate->resize((size_t)bed.g.beds);
    copy(plate->data(), bed.g.plate, plate->size());
}

inline void plates_write(const Bed &bed, const std::vector<Plate> &plate) {
    copy(bed.g.plate, plate.data(), plate.size());
}

inline std::string case_file(const Bed &bed, const Case &c, int b, const std::string &folder,
                             const char *what) {
    return folder + "/" + c.name + "-" + std::to_string(bed.def.seeds[(size_t)b]) + what + ".csv";
}

inline FILE *case_open(const std::string &name, const char *columns) {
    FILE *out = fopen((name + ".part").c_str(), "w");
    if (!out) {
        stop("cannot write ", name.c_str());
    }
    fputs(columns, out);
    return out;
}

inline void case_close(FILE *out, const std::string &name) {
    const bool failed = ferror(out) != 0;
    if (fclose(out) || failed || rename((name + ".part").c_str(), name.c_str())) {
        stop("cannot write ", name.c_str());
    }
}

/* The plate's lowest point half a millimetre above each bed's own surface. */
inline void case_begin(Bed *bed, const Case &c, Record *r, const std::string &folder) {
    bed->g.shape = c.shape;
    plates_read(*bed, &r->plate);
    r->start.assign(r->plate.size(), 0);
    r->force.assign(r->plate.size(), 0);
    for (int b = 0; b < bed->g.beds; b++) {
        Plate *p = &r->plate[(size_t)b];
        *p = {};
        p->pitch = c.tilt;
        p->z = (double)bed->surface[(size_t)b] + 0.0005 + shape_lowest(c.shape, c.tilt);
        plate_place(p, bed->g);
        r->file.push_back(case_open(
            case_file(*bed, c, b, folder, ""),
            "time_s,stage,depth_m,path_m,pitch_rad,sinkage_m,force_x_n,force_y_n,force_z_n,"
            "moment_x_nm,moment_y_nm,moment_z_nm,cop_x_m,cop_y_m\n"));
        if (c.shape.band > 0) {
            r->bands.push_back(case_open(case_file(*bed, c, b, folder, "-bands"),
                                         "time_s,depth_m,band_m,force_z_n...\n"));
        }
    }
    plates_write(*bed, r->plate);
}

inline void case_end(const Bed &bed, const Case &c, Record *r, const std::string &folder) {
    for (int b = 0; b < bed.g.beds; b++) {
        case_close(r->file[(size_t)b], case_file(bed, c, b, folder, ""));
        if (!r->bands.empty()) {
            case_close(r->bands[(size_t)b], case_file(bed, c, b, folder, "-bands"));
        }
    }
}

inline void stage_begin(const Bed &bed, const Stage &s, Record *r) {
    plates_read(bed, &r->plate);
    for (size_t b = 0; b < r->plate.size(); b++) {
        Plate *p = &r->plate[b];
        const bool moves = s.kind == "move";
        const bool free = s.kind == "load" || s.kind == "drop";
        p->vx = s.kind == "drag" || s.kind == "load" ? s.speed * (s.amount < 0 ? -1 : 1) : 0;
        p->rate = s.kind == "swipe" ? s.speed * (s.amount < 0 ? -1 : 1) : 0;
        p->vz = s.kind == "press" || s.kind == "drop" ? -s.speed : 0;
        p->vy = p->turning = 0;
        p->mass = !free ? 0 : s.kind == "drop" ? s.amount : r->force[b] / (double)bed.g.law.gravity;
        if (moves) {
            p->vx = s.move[0];
            p->vy = s.move[1];
            p->vz = s.move[2];
            p->rate = s.move[3];
            p->turning = s.move[4];
            p->mass = s.move[5];
        }
        r->start[b] = (double)bed.surface[b] - p->z;
        if (free && p->mass <= 0) {
            stop("a load stage begins on a plate that carries nothing: ", s.kind.c_str());
        }
        plate_place(p, bed.g);
    }
    plates_write(bed, r->plate);
}

/* Centre of pressure in the plate's frame, where its normal force acts. */
inline void row_write(FILE *out, const Plate &p, int stage, double time, double path, double depth,
                      double start, const double w[6]) {
    const double s = sin(p.pitch), c = cos(p.pitch), left = sin(p.yaw), ahead = cos(p.yaw);
    const double along = ahead * w[0] + left * w[1], mx0 = ahead * w[3] + left * w[4];
    const double my = ahead * w[4] - left * w[3];
    const double normal = s * along + c * w[2], mx = c * mx0 - s * w[5];
    const bool pressed = fabs(normal) > 1e-3;
    fprintf(out, "%.5g,%d,%.5g,%.5g,%.4g,%.4g", time, stage, depth, path, p.pitch, depth - start);
    for (int k = 0; k < 6; k++) {
        fprintf(out, ",%.4g", w[k]);
    }
    fprintf(out, ",%.3g,%.3g\n", pressed ? -my / normal : 0, pressed ? mx / normal : 0);
}

inline void bands_write(FILE *out, Plate *p, float width, double time, double depth, long steps) {
    fprintf(out, "%.5g,%.5g,%.4g", time, depth, (double)width);
    for (long long &band : p->band) {
        fprintf(out, ",%.4g", (double)band / (double)(1 << SUM_BITS) / (double)steps);
        band = 0;
    }
    fputc('\n', out);
}

/* Goes on by `steps`; writes a row of each bed: means over these steps, the pose at their end. */
inline void case_row(Bed *bed, int stage, long steps, Record *r) {
    bed_go(bed, steps);
    const double dt = (double)bed->g.law.dt;
    plates_read(*bed, &r->plate);
    r->time += (double)steps * dt;
    for (size_t b = 0; b < r->plate.size(); b++) {
        Plate *p = &r->plate[b];
        double w[6];
        for (int k = 0; k < 6; k++) {
            w[k] = (double)p->sum[k] / (double)(1 << SUM_BITS) / (double)steps;
            p->sum[k] = 0;
        }
        p->pushed = 0;
        r->force[b] = w[2];
        const double depth = (double)bed->surface[b] - p->z;
        row_write(r->file[b], *p, stage, r->time, p->x, depth, r->start[b], w);
        if (!r->bands.empty()) {
            bands_write(r->bands[b], p, bed->g.shape.band, r->time, depth, steps);
        }
    }
    plates_write(*bed, r->plate);
}

/* About `rows` rows, as many for each stage as its share of the time, at least ten. */
inline void case_run(Bed *bed, const Case &c, int rows, const std::string &folder) {
    Record r;
    double seconds = 0;
    for (const Stage &s : c.stages) {
        seconds += s.seconds;
    }
    case_begin(bed, c, &r, folder);
    for (size_t k = 0; k < c.stages.size(); k++) {
        const Stage &s = c.stages[k];
        const long steps = std::max(bed_steps(*bed, s.seconds), 1L);
        const long count = std::min(steps, std::max(10L, lround(rows * s.seconds / seconds)));
        stage_begin(*bed, s, &r);
        for (long row = 0; row < count; row++) {
            case_row(bed, (int)k, (row + 1) * steps / count - row * steps / count, &r);
        }
    }
    case_end(*bed, c, &r, folder);
}

#endif
