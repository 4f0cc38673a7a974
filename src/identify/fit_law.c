#include "identify/fit_law.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/text.h"
#include "ground/law/models.h"
#include "ground/sole/sole.h"

/* ---- combinations ---- */

static double cone_stress(const MildMaterial *m) {
    return m->sigma_cone / cos(m->alpha);
}

static void cone_stress_set(MildMaterial *m, double value) {
    m->sigma_cone = value * cos(m->alpha);
}

/* value, at most and at least what the field of that name may be. */
static double allowed(const char *name, double value) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name, NULL);
    return fmin(fmax(value, field->min), field->max);
}

static double cone_shape(const MildMaterial *m) {
    return tan(m->alpha) / m->nu;
}

static void cone_shape_set(MildMaterial *m, double value) {
    m->nu = allowed("nu", tan(m->alpha) / value);
    m->alpha = atan(m->nu * value); /* as it was, where that nu is allowed */
}

static double drag(const MildMaterial *m) {
    return m->c_g * m->c_d * m->phi * m->rho * m->nu;
}

static void drag_set_c_g(MildMaterial *m, double value) {
    const double c_g = value / (m->c_d * m->phi * m->rho * m->nu);
    m->c_g = allowed("c_g", c_g);
    m->c_d *= m->c_g != 0 ? c_g / m->c_g : 1; /* 1 where that c_g is allowed */
}

static void drag_set_c_d(MildMaterial *m, double value) {
    m->c_d = value / (m->c_g * m->phi * m->rho * m->nu);
}

double fit_modulus(const MildMaterial *material, double width) {
    return material->model == MILD_MODEL_BEKKER ? material->k_c / width + material->k_phi : 0;
}

static double modulus(const MildMaterial *m) {
    return fit_modulus(m, m->plate_width);
}

static void modulus_set(MildMaterial *m, double value) {
    m->k_phi = value - m->k_c / m->plate_width;
}

static const FitCombination combinations[] = {
    {"tan(alpha)/nu", "-", "nu", 0.01, 141, 0, cone_shape, cone_shape_set},
    {"sigma_cone/cos(alpha)", "N/m^3", "sigma_cone", 0, 7.1e7, 1, cone_stress, cone_stress_set},
    {"c_g c_d phi rho nu", "kg/m^3", "c_g", 0, 3.75e7, 1, drag, drag_set_c_g},
    {"c_g c_d phi rho nu", "kg/m^3", "c_d", 0, 3.75e7, 1, drag, drag_set_c_d},
    {"k_c/plate_width + k_phi", "N/m^(n+2)", "k_phi", 0, 3e12, 1, modulus, modulus_set},
};

const FitCombination *fit_combination(const char *carrier) {
    for (size_t i = 0; i < sizeof combinations / sizeof *combinations; i++) {
        if (strcmp(combinations[i].carrier, carrier) == 0) {
            return &combinations[i];
        }
    }
    return NULL;
}

/* ---- parameters ---- */

double *fit_number(MildMaterial *material, const MildField *field) {
    return (double *)((uintptr_t)material + field->offset);
}

void fit_range(const MildField *field, double *low, double *high) {
    *low = strcmp(field->name, "c_d") == 0 ? 0.5 : strcmp(field->name, "c_g") == 0 ? 0 : field->min;
    *high = field->max;
}

double fit_counted(const MildField *field, double number) {
    return number == 0 && strcmp(field->name, "slip_length") == 0 ? field->max : number;
}

/* Bool: the model reads the field. */
static int reads(MildModel model, const char *name) {
    const MildModelInfo *info = mild_model_info(model);
    int read = 0;
    for (int i = 0; i < MILD_MODEL_FIELDS && info->fields[i]; i++) {
        read |= strcmp(info->fields[i], name) == 0;
    }
    return read;
}

MildMaterial fit_probe(int number) {
    MildMaterial probe = mild_material_default();
    probe.recovery = 0.5;
    probe.slip_length = 0.003;
    probe.mu = number ? 0.15 : probe.mu;
    probe.grip = number ? 0.3 : 0.1;
    return probe;
}

/* Bool: the force in some row changes with the parameter. */
static int is_sensed(MildModel model, FitKind kind, const MildField *field, double speed,
                     double acceleration) {
    const FitPlate plate = {.elements = 1, .pitch = 0.0195, .width = 0.1};
    const FitPoint points[2] = {
        {.depth = 0.005, .force = 1, .speed = speed, .acceleration = acceleration, .load = 0.005},
        {.depth = 0.004,
         .force = 0.5,
         .speed = speed,
         .acceleration = acceleration,
         .load = 0.005}};
    MildMaterial material = fit_probe(0);
    double before[2], after[2];
    material.model = (int)model;
    fit_forces(kind, &plate, &material, points, 2, before);
    *fit_number(&material, field) *= 1.01;
    fit_forces(kind, &plate, &material, points, 2, after);
    return after[0] != before[0] || after[1] != before[1];
}

int fit_is_geometry(MildModel model, const char *name) {
    return reads(model, name) &&
           (strcmp(name, "bed_depth") == 0 || strcmp(name, "plate_width") == 0 ||
            strcmp(name, "slip_growth") == 0);
}

/* Bool: a plate that slides where slip costs support determines the parameter. */
static int is_dragged(const char *name) {
    static const char *const names[] = {"mu", "slip_length", "regain_length", "grip"};
    return text_find(name, names, sizeof names / sizeof *names) >= 0;
}

int fit_parameters(MildModel model, FitKind kind, const MildField *fields[FIT_PARAMETERS_MAX]) {
    const MildModelInfo *info = mild_model_info(model);
    int count = 0;
    if (kind == FIT_DRAG && !fit_drag_is_modelled(model)) {
        return 0;
    }
    for (int i = 0; i < MILD_MODEL_FIELDS && info->fields[i]; i++) {
        const MildField *field =
            mild_field_find(mild_material_fields, mild_material_field_count, info->fields[i], NULL);
        if (field->type == MILD_FIELD_DOUBLE && !fit_is_geometry(model, field->name) &&
            (kind == FIT_DRAG ? is_dragged(field->name) : is_sensed(model, kind, field, 1, 1))) {
            fields[count++] = field;
        }
    }
    return count;
}

int fit_is_rate(MildModel model, const MildField *field) {
    return !is_sensed(model, FIT_PRESS, field, 0, 0);
}

/* ---- force ---- */

/* Force of an element at a row. */
static double point_force(const Law *law, int curves, const FitPoint *point) {
    const double depth = fmax(point->depth, 0);
    const double speed = point->speed;
    const double elastic = law_elastic_force(law, curves, depth);
    double sum = law_force(law, curves, depth) + elastic * (1 + law->elastic_damping * speed);
    if (curves & LAW_CONE) {
        sum += law->drag_rate * law_moved_share(law, curves, depth) * speed * speed;
        sum += law->mass_rate * law_moved(law, curves, depth) * point->acceleration;
    }
    return sum;
}

/* Elements whose cones are alike: a plate has few kinds, because it is symmetric. */
enum { HEAPS = 64 };
typedef struct {
    SoleHeap heap;
    int elements;
} Heaps;

/* Gathers elements from number `first` on until there are HEAPS kinds. Returns the next element. */
static int heaps_gather(const MildSole *sole, int first, Heaps *kind, int *kinds) {
    const double same = 1e-9;
    *kinds = 0;
    for (int e = first; e < mild_sole_elements(sole); e++) {
        const SoleHeap own = sole_heap(sole, e);
        int k = 0;
        while (k < *kinds && !(fabs(kind[k].heap.begin - own.begin) < same &&
                               fabs(kind[k].heap.width - own.width) < same)) {
            k++;
        }
        if (k == HEAPS) {
            return e;
        }
        if (k == *kinds) {
            kind[(*kinds)++] = (Heaps){own, 0};
        }
        kind[k].elements++;
    }
    return mild_sole_elements(sole);
}

/* The forces of neighbouring rows that share a plate whose cones merge. */
static void merged_forces(const FitPlate *plate, const MildMaterial *raw, const FitPoint *points,
                          int count, double *force) {
    const Law law = law_of(raw, plate->pitch, plate->width);
    const int curves = curves_of(raw, &law);
    Heaps kind[HEAPS];
    int kinds;
    memset(force, 0, (size_t)count * sizeof *force);
    for (int e = 0; e < mild_sole_elements(plate->sole);) {
        e = heaps_gather(plate->sole, e, kind, &kinds);
        for (int k = 0; k < kinds; k++) {
            const Law own = law_of_heap(law, kind[k].heap.begin, kind[k].heap.width);
            for (int i = 0; i < count; i++) {
                force[i] += kind[k].elements * point_force(&own, curves, &points[i]);
            }
        }
    }
}

/* The same of any plate. */
static void plate_forces(const FitPlate *plate, const MildMaterial *raw, const FitPoint *points,
                         int count, double *force) {
    if (plate->sole && model_row(raw->model)->merged) {
        merged_forces(plate, raw, points, count, force);
        return;
    }
    /* The ground takes a modulus below 0 for 0. The search needs a slope there: here it pulls. */
    const double sign = fit_modulus(raw, plate->width) < 0 ? -1 : 1;
    MildMaterial mirrored = *raw;
    mirrored.k_c *= sign;
    mirrored.k_phi *= sign;
    const Law law = law_of(&mirrored, plate->pitch, plate->width);
    const int curves = law_curves(&law);
    const double each = plate->pitch * plate->pitch;
    const int pressure = reads((MildModel)raw->model, "plate_width");
    for (int i = 0; i < count; i++) {
        const double area = points[i].area > 0 ? points[i].area : plate->area;
        const double elements = pressure && area > 0 ? area / each : plate->elements;
        force[i] = sign * elements * point_force(&law, curves, &points[i]);
    }
}

/* The same of rows on one way up. The force at its beginning is what fits them best. */
static void unload_forces(const MildMaterial *raw, const FitPoint *points, int count,
                          double *force) {
    double along = 0, square = 0;
    for (int i = 0; i < count; i++) {
        const double deepest = points[i].load;
        const double travel = fmax(raw->recovery * deepest, fmin(ELEMENT_ELASTIC, deepest));
        force[i] = fmax(1 - (deepest - points[i].depth) / travel, 0);
        along += force[i] * points[i].force;
        square += force[i] * force[i];
    }
    const double most = square > 0 ? fmax(along / square, 0) : 0;
    for (int i = 0; i < count; i++) {
        force[i] *= most;
    }
}

/* [-] Share of the shear strength that a slip, or a ring's angle, has built up. Of a ring by
 * Simpson's rule. */
static double built_up(const FitPlate *plate, double slip, double length) {
    enum { PARTS = 32 };
    if (plate->outer <= 0) {
        return -expm1(-slip / length);
    }
    const double width = (plate->outer - plate->inner) / PARTS;
    double sum = 0, all = 0;
    for (int i = 0; i <= PARTS; i++) {
        const double radius = plate->inner + i * width;
        const double weight = (i == 0 || i == PARTS ? 1 : i % 2 ? 4 : 2) * radius * radius;
        sum += weight * -expm1(-slip * radius / length);
        all += weight;
    }
    return sum / all;
}

/* [N/m^2] The same of rows that slide. */
static void shear_forces(const FitPlate *plate, const MildMaterial *raw, const FitPoint *points,
                         int count, double *force) {
    const int sheared = reads((MildModel)raw->model, "shear_length");
    for (int i = 0; i < count; i++) {
        force[i] = sheared ? (raw->cohesion + points[i].load * raw->mu) *
                                 built_up(plate, points[i].depth, raw->shear_length)
                           : 0;
    }
}

#define STRIDE 2e-4 /* [m] slip in a step of the path */
#define STRIDES_MAX 100

int fit_drag_is_modelled(MildModel model) {
    return model_row((int)model)->slips;
}

int fit_drag_is_next(const FitPoint *row) {
    const FitPoint *last = row - 1;
    return row->plate == last->plate &&
           (row->holds == last->holds ? row->slip >= last->slip : row->holds > last->holds);
}

/* ---- the law ---- */

typedef struct {
    double slip, deepest, share;
} Path;

/* Moves on to the slip and depth of a row. */
static void path_go(Path *path, const FitPoint *row, const Share *share, int grows) {
    const double way = row->slip - path->slip;
    const double fresh = fmax(row->depth - path->deepest, 0);
    const int strides = (int)fmin(1 + way / STRIDE, STRIDES_MAX);
    const double longer = strides * (1 + (double)share->growth * fmax(row->depth, 0));
    for (int i = 0; i < strides; i++) {
        const double left = grows ? exp(-fresh / longer * (double)share->regain_rate) : 1;
        path->share /= 1 + path->share * way / longer * (double)share->slip_rate;
        path->share = 1 - (1 - path->share) * left;
    }
    path->slip = row->slip;
    path->deepest += fresh;
}

/* [-] Friction of ground that carries the share q of its virgin load. */
static double friction(const MildMaterial *material, const Share *share, double q) {
    const double grips = (double)SHARE_YIELD * (double)share->grip * (1 - q) / (2 - q);
    return share->grip > 0 ? fmin(material->mu, fmax(grips, (double)share_least(share)))
                           : material->mu;
}

/* Shares of the rows up, in `share`; the shares of the rows along are between theirs. */
static int shares_find(const Share *law, const MildMaterial *material, const FitPoint *points,
                       int count, double *share) {
    Path path = {.deepest = points[0].depth, .share = 1};
    int ups = 0;
    for (; ups < count && !points[ups].holds; ups++) {
        const int grows = material->recovery * points[ups].depth <= (double)ELEMENT_ELASTIC;
        if (points[ups].slip <= 0) { /* still pressed */
            path.deepest = fmax(path.deepest, points[ups].depth);
        }
        path_go(&path, &points[ups], law, grows);
        share[ups] = path.share;
    }
    for (int i = ups, k = 0; i < count; i++) {
        while (k + 1 < ups && points[k].slip < points[i].slip) {
            k++;
        }
        const double way = k > 0 ? points[k].slip - points[k - 1].slip : 0;
        const double part = way > 0 ? (points[i].slip - points[k - 1].slip) / way : 1;
        share[i] = k > 0 ? share[k - 1] + fmin(part, 1) * (share[k] - share[k - 1]) : share[k];
    }
    return ups;
}

/* The same of rows that slide, of one record. */
static void drag_forces(const FitPlate *plate, const MildMaterial *material, const FitPoint *points,
                        int count, double *force) {
    const double width = plate->sole ? mild_sole_width(plate->sole) : 0;
    const Share law = share_of(material, plate->pitch, width);
    const int ups = shares_find(&law, material, points, count, force);
    double along = 0, square = 0;
    for (int i = ups; i < count; i++) {
        const double side = (double)law.side * plate->elements * points[i].depth * points[i].depth;
        force[i] = friction(material, &law, force[i]) * points[i].near + side;
    }
    for (int i = 0; i < ups; i++) {
        force[i] *= points[i].weight * points[i].virgin;
        along += force[i] * points[i].force;
        square += force[i] * force[i];
    }
    for (int i = 0; i < ups; i++) {
        force[i] *= square > 0 ? along / square : 0;
    }
}

/* Bool: a row belongs with the one before it. */
static int is_next(FitKind kind, const FitPoint *row) {
    if (kind == FIT_DRAG) {
        return fit_drag_is_next(row);
    }
    return row->plate == row[-1].plate && (kind != FIT_UNLOAD || row->depth < row[-1].depth);
}

void fit_forces(FitKind kind, const FitPlate *plates, const MildMaterial *material,
                const FitPoint *points, int count, double *force) {
    MildMaterial raw = *material;
    raw.passive = 0;
    raw.plate_width = 0;
    for (int first = 0, end; first < count; first = end) {
        const FitPlate *plate = &plates[points[first].plate];
        for (end = first + 1; end < count && is_next(kind, &points[end]); end++) {
            continue;
        }
        if (kind == FIT_UNLOAD) {
            unload_forces(&raw, points + first, end - first, force + first);
        } else if (kind == FIT_SHEAR) {
            shear_forces(plate, &raw, points + first, end - first, force + first);
        } else if (kind == FIT_DRAG) {
            drag_forces(plate, &raw, points + first, end - first, force + first);
        } else {
            plate_forces(plate, &raw, points + first, end - first, force + first);
        }
    }
}

/* [m] Where rows determine friction: grains need some millimetres of slip to build it up, and later
 * heap up before the plate. */
#define BUILT 0.005
#define HEAPED 0.012

#define LEAST 0.01 /* [-] of the largest force: a row counts as if it were that at least */

MildMaterial fit_slide_base(const MildMaterial *known, const MildMaterial *press) {
    MildMaterial base = press ? *press : *known;
    base.mu = known->mu;
    base.phi = known->phi;
    base.rho = known->rho;
    base.recovery = known->recovery;
    base.slip_length = known->slip_length;
    base.regain_length = known->regain_length;
    base.grip = known->grip;
    base.slip_growth = known->slip_growth;
    return base;
}

/* [N] Mean force around a row of those that slide, from `first` on. */
static double near_force(const FitPoint *slide, int first, int count, int row) {
    const int half = (count - first) / 40 > 1 ? (count - first) / 40 : 1;
    const int low = row - half > first ? row - half : first;
    const int high = row + half < count - 1 ? row + half : count - 1;
    double sum = 0;
    for (int i = low; i <= high; i++) {
        sum += slide[i].force;
    }
    return sum / (high - low + 1);
}

int fit_slide_rows(const FitPlate *plate, const MildMaterial *curve, const FitPoint *slide,
                   int count, FitPoint *rows) {
    int kept = 0, first = 0;
    double most = 0;
    while (first < count && slide[first].slip <= 0) {
        first++;
    }
    for (int i = 0; i < count; i++) {
        most = fmax(most, slide[i].force);
    }
    for (int i = 0; most > 0 && i < count; i++) {
        const FitPoint still = {.depth = slide[i].depth, .area = slide[i].area};
        FitPoint *row = &rows[kept++];
        *row = slide[i];
        row->near = fmax(i < first ? most : near_force(slide, first, count, i), LEAST * most);
        row->weight = sqrt(most / row->near);
        fit_forces(FIT_PRESS, plate, curve, &still, 1, &row->virgin);
        row->force *= row->weight;
        row->speed = row->acceleration = 0;
        row->holds = 0;
    }
    for (int i = first; most > 0 && i < count; i++) {
        if (slide[i].slip >= BUILT && slide[i].slip <= HEAPED && isfinite(slide[i].along)) {
            rows[kept] = rows[i];
            rows[kept].force = slide[i].along;
            rows[kept].weight = 1;
            rows[kept++].holds = 1;
        }
    }
    return kept;
}
