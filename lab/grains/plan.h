/* A case: a plate and the stages of its way, as one line of words.
 *
 *     NAME SHAPE TILT STAGE...
 *
 * SHAPE  disc:D[,H] | rect:L,W[,H] | polygon:X,Y,X,Y,... | sphere:R   [m], the front is at +x;
 *        H: height of the block, 0.06 without it; deeper, grains come over it
 * TILT   [deg], positive when the front edge is lower
 * STAGE  press:DEPTH@SPEED   straight down or up to this depth of the bottom's middle [m, m/s]
 *        drag:PATH@SPEED     forward, at constant depth
 *        load:PATH@SPEED     forward, free in z under the force that it carries now
 *        swipe:DEG@RATE      turns about the bottom's middle [deg, rad/s]
 *        hold:SECONDS        stands
 *        drop:MASS@SPEED,S   falls for S seconds, with this mass and, at first, downward speed
 *        move:VX,VY,VZ,PITCH,YAW,S[,MASS]   moves for S seconds at these speeds [m/s], z up, and
 *                            rates [rad/s]; with a mass it is free in z
 */
#ifndef GRAINS_PLAN_H
#define GRAINS_PLAN_H

#include "bed.h"

struct Stage {
    std::string kind;
    double amount, speed, seconds;
    double move[6]; /* velocity, rates of pitch and yaw, mass */
};

struct Case {
    std::string name, line;
    Shape shape;
    double tilt; /* [rad] */
    std::vector<Stage> stages;
};

inline std::vector<std::string> words(const std::string &text, const char *separators) {
    std::vector<std::string> out;
    for (size_t at = 0; (at = text.find_first_not_of(separators, at)) != std::string::npos;) {
        const size_t end = std::min(text.find_first_of(separators, at), text.size());
        out.push_back(text.substr(at, end - at));
        at = end;
    }
    return out;
}

inline double number(const std::string &word, const std::string &where) {
    char *end = nullptr;
    const double value = strtod(word.c_str(), &end);
    if (word.empty() || *end || !std::isfinite(value)) {
        stop("not a number in ", where.c_str());
    }
    return value;
}

inline std::vector<double> numbers(const std::string &word) {
    std::vector<double> out;
    const size_t colon = word.find(':');
    for (const std::string &part : words(word.substr(std::min(colon, word.size() - 1) + 1), ",@")) {
        out.push_back(number(part, word));
    }
    return out;
}

/* ---- shapes ---- */

inline void shape_point(Shape *s, double x, double y) {
    if (s->points == SHAPE_POINTS) {
        stop("an outline with too many points");
    }
    s->x[s->points] = (float)x;
    s->y[s->points++] = (float)y;
    s->reach = fmaxf(s->reach, sqrtf((float)(x * x + y * y) + s->height * s->height));
}

inline Shape shape_read(const std::string &word) {
    const std::string kind = word.substr(0, word.find(':'));
    const std::vector<double> v = numbers(word);
    Shape s = {};
    const size_t sizes = kind == "disc" ? 1 : kind == "rect" ? 2 : 0; /* without a height */
    s.height = sizes && v.size() == sizes + 1 ? (float)v[sizes] : 0.06f;
    const auto is_size = [](double x) { return x > 0; };
    if (sizes && !std::all_of(v.begin(), v.end(), is_size)) {
        stop("the sizes of a plate are above 0, not as in ", word.c_str());
    }
    if (!(s.height > 0)) {
        stop("the height of a plate is above 0, not as in ", word.c_str());
    }
    if (kind == "disc" && (v.size() == 1 || v.size() == 2)) {
        for (int k = 0; k < 48; k++) {
            const double angle = k * 6.283185307179586 / 48;
            shape_point(&s, 0.5 * v[0] * cos(angle), 0.5 * v[0] * sin(angle));
        }
    } else if (kind == "rect" && (v.size() == 2 || v.size() == 3)) {
        for (int k = 0; k < 4; k++) {
            shape_point(&s, (k == 1 || k == 2 ? 0.5 : -0.5) * v[0], (k > 1 ? 0.5 : -0.5) * v[1]);
        }
    } else if (kind == "polygon" && v.size() >= 6 && v.size() % 2 == 0) {
        for (size_t k = 0; k < v.size(); k += 2) {
            shape_point(&s, v[k], v[k + 1]);
        }
    } else if (kind == "sphere" && v.size() == 1 && v[0] > 0) {
        s.radius = (float)v[0];
        s.reach = 2 * s.radius;
    } else {
        stop("a plate is disc:D[,H], rect:L,W[,H], polygon:X,Y,... or sphere:R, not ",
             word.c_str());
    }
    return s;
}

/* How far the lowest point of the tilted bottom is below its middle [m]. */
inline double shape_lowest(const Shape &s, double tilt) {
    double low = s.points ? 0 : s.radius * (1 - cos(tilt)); /* its centre stands askew */
    for (int k = 0; k < s.points; k++) {
        low = std::max(low, (double)s.x[k] * sin(tilt));
    }
    return low;
}

/* ---- stages ---- */

inline Stage stage_read(const std::string &word) {
    const std::vector<double> v = numbers(word);
    Stage s = {
        word.substr(0, word.find(':')), v.empty() ? 0 : v[0], v.size() > 1 ? v[1] : 0, 0, {}};
    const bool led = s.kind == "press" || s.kind == "drag" || s.kind == "load" || s.kind == "swipe";
    if (led && v.size() == 2 && v[1] > 0) {
        s.amount *= s.kind == "swipe" ? 0.017453292519943295 : 1;
        s.seconds = s.kind == "press" ? 0 : fabs(s.amount) / s.speed;
    } else if (s.kind == "hold" && v.size() == 1 && v[0] > 0) {
        s.seconds = s.amount;
    } else if (s.kind == "drop" && v.size() == 3 && v[0] > 0 && v[2] > 0) {
        s.seconds = v[2];
    } else if (s.kind == "move" && (v.size() == 6 || (v.size() == 7 && v[6] > 0)) && v[5] > 0) {
        s.seconds = v[5];
        std::copy(v.begin(), v.begin() + 5, s.move);
        s.move[5] = v.size() == 7 ? v[6] : 0;
    } else {
        stop("a stage is press:D@V, drag:X@V, load:X@V, swipe:DEG@W, hold:T, drop:M@V,T or "
             "move:VX,VY,VZ,PITCH,YAW,T[,M], not ",
             word.c_str());
    }
    return s;
}

inline Case case_read(const std::string &line) {
    const std::vector<std::string> word = words(line, " \t\r\n");
    if (word.size() < 4) {
        stop("a case is NAME SHAPE TILT STAGE..., not ", line.c_str());
    }
    Case c = {word[0], line, shape_read(word[1]), number(word[2], line) * 0.017453292519943295, {}};
    double depth = -0.0005 - shape_lowest(c.shape, c.tilt); /* as case_begin puts it */
    for (size_t k = 3; k < word.size(); k++) {
        Stage s = stage_read(word[k]);
        if (s.kind == "press") {
            s.seconds = fabs(s.amount - depth) / s.speed;
            s.speed *= s.amount < depth ? -1 : 1;
            depth = s.amount;
        }
        c.stages.push_back(s);
    }
    return c;
}

#endif
