#include "identify/fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "identify/fit_law.h"
#include "identify/fit_solve.h"

/* [-] An effect below this share of the force is none. */
#define FIT_NOTHING 1e-12

/* [m] of slip_length; its 0 is that slip costs nothing, as of the longest. */
#define FIT_SLIP_LEAST 1e-4

/* Of more rows the mean of neighbours is fitted. */
enum { FIT_ROWS = 20000 };

/* How often a lower sum of squares, met on the way to an interval's end, starts the fit again. */
enum { FIT_AGAIN = 4 };

/* The order in which parameters are put aside, or filled, when the data do not determine all of
 * them. Those of a new model come last. */
static const char *const give_up[] = {"rho", "phi",        "alpha", "c_d",         "c_g",
                                      "nu",  "sigma_cone", "k_c",   "dissipation", "exponent"};

typedef struct {
    const FitDef *def;
    const MildField *field[FIT_PARAMETERS_MAX];
    int aside[FIT_PARAMETERS_MAX]; /* bool: no coordinate, because filled, tied or without effect */
    int tied[FIT_PARAMETERS_MAX];  /* bool */
    FitResult *result;
    Fit fit;
} Run;

static int give_up_place(const char *name) {
    const int count = (int)(sizeof give_up / sizeof *give_up);
    const int place = text_find(name, give_up, count);
    return place < 0 ? count : place;
}

/* Index of the parameter of a coordinate. */
static int parameter_of(const Run *run, int coordinate) {
    int i = 0;
    while (run->field[i] != run->fit.coordinate[coordinate].field) {
        i++;
    }
    return i;
}

/* The coordinates: all parameters that are neither held nor put aside. Of a tied parameter the
 * combination that it carries takes its place. */
static void coordinates_choose(Run *run) {
    Fit *fit = &run->fit;
    fit->coordinates = 0;
    for (int i = 0; i < run->result->parameters; i++) {
        if (run->def->held[i] || run->aside[i]) {
            continue;
        }
        FitCoordinate *c = &fit->coordinate[fit->coordinates++];
        *c = (FitCoordinate){.field = run->field[i]};
        fit_range(c->field, &c->low, &c->high);
        c->low = strcmp(c->field->name, "slip_length") == 0 ? FIT_SLIP_LEAST : c->low;
        c->combination = run->tied[i] ? fit_combination(c->field->name) : NULL;
        if (c->combination) {
            c->low = c->combination->low;
            c->high = c->combination->high;
        }
    }
}

/* Of the parameters with `marks`, puts aside the one that comes first in the order, or holds it
 * when there is something to fill it with. Returns false when none has a mark. */
static int put_aside(Run *run, const int marks[FIT_PARAMETERS_MAX], FitState state) {
    int first = -1;
    for (int i = 0; i < run->result->parameters; i++) {
        if (marks[i] && !run->aside[i] &&
            (first < 0 ||
             give_up_place(run->field[i]->name) < give_up_place(run->field[first]->name))) {
            first = i;
        }
    }
    if (first < 0) {
        return 0;
    }
    run->aside[first] = 1;
    run->result->parameter[first].state = state;
    if (run->def->fill) {
        MildMaterial fill = *run->def->fill;
        *fit_number(&run->fit.base, run->field[first]) = *fit_number(&fill, run->field[first]);
        run->result->parameter[first].state = FIT_FILLED;
    }
    return 1;
}

/* Bool: the rows change with a coordinate. */
static int has_effect(const Fit *fit, int coordinate) {
    const double *column = fit->column + coordinate * fit->count;
    double force = 0, effect = 0;
    for (int i = 0; i < fit->count; i++) {
        const double share = column[i] * fit->value[coordinate];
        effect += share * share;
        force += fit->points[i].force * fit->points[i].force;
    }
    return effect > FIT_NOTHING * FIT_NOTHING * force;
}

/* Marks the parameters without any effect on the rows, and those whose effect is a combination of
 * the others'. The columns of a material in which everything has an effect say so. At the minimum
 * some may have none by chance. */
static void ties_mark(Run *run, int without[FIT_PARAMETERS_MAX], int tied[FIT_PARAMETERS_MAX]) {
    const int probes = run->def->kind == FIT_DRAG ? FIT_PROBES : 1;
    Fit *fit = &run->fit;
    coordinates_choose(run);
    for (int p = 0; p < fit->coordinates; p++) {
        without[parameter_of(run, p)] = 1;
    }
    for (int n = 0; n < probes; n++) {
        const MildMaterial probe = fit_probe(n);
        fit_start(fit, &probe);
        fit_columns(fit);
        for (int p = 0; p < fit->coordinates; p++) {
            const int i = parameter_of(run, p);
            if (without[i] && has_effect(fit, p)) {
                without[i] = 0;
                tied[i] = fit_own(fit, p) < FIT_DEPENDENT;
            }
        }
    }
}

/* Leaves a set of coordinates that the rows determine one by one. */
static void ties_find(Run *run) {
    int found[FIT_PARAMETERS_MAX] = {0}, left = 1;
    memset(run->tied, 0, sizeof run->tied);
    while (left) {
        int without[FIT_PARAMETERS_MAX] = {0}, tied[FIT_PARAMETERS_MAX] = {0};
        ties_mark(run, without, tied);
        for (int i = 0; i < run->result->parameters; i++) {
            found[i] |= tied[i] && !run->def->fill;
        }
        left = put_aside(run, without, FIT_NO_EFFECT) || put_aside(run, tied, FIT_TIED);
    }
    memcpy(run->tied, found, sizeof found);
    coordinates_choose(run);
}

static void value_set(FitValue *value, double centre, const FitInterval *interval) {
    const int open = interval->open_low + interval->open_high;
    value->state = open == 0 ? FIT_FITTED : open == 1 ? FIT_LIMIT : FIT_OPEN;
    value->value = open == 0 ? centre : NAN;
    value->low = interval->open_low ? NAN : interval->low;
    value->high = interval->open_high ? NAN : interval->high;
}

static FitValue *combination_add(FitResult *result, const FitCombination *combination) {
    FitValue *value = &result->combination[result->combinations++];
    *value = (FitValue){.name = combination->name};
    snprintf(value->unit, sizeof value->unit, "%s", combination->unit);
    return value;
}

/* The minimum and all intervals. */
static void values_find(Run *run) {
    const MildMaterial start = fit_probe(0);
    Fit *fit = &run->fit;
    FitInterval interval[FIT_PARAMETERS_MAX];
    fit_start(fit, &start);
    for (int again = 0, met = 0; !met && again < FIT_AGAIN; again++) {
        for (int p = 0; p < fit->coordinates; p++) { /* until they are found */
            interval[p] = (FitInterval){.open_low = 1, .open_high = 1};
        }
        fit_minimise(fit);
        met = 1;
        for (int p = 0; p < fit->coordinates && met; p++) {
            met = fit_interval(fit, p, &interval[p]);
        }
    }
    run->result->combinations = 0;
    for (int p = 0; p < fit->coordinates; p++) {
        const FitCoordinate *c = &fit->coordinate[p];
        FitValue *value = c->combination ? combination_add(run->result, c->combination)
                                         : &run->result->parameter[parameter_of(run, p)];
        value_set(value, fit->value[p], &interval[p]);
    }
    for (int i = 0; i < run->result->parameters; i++) {
        if (run->tied[i]) {
            run->result->parameter[i].state = FIT_TIED;
        }
    }
}

/* Bool: the parameter may be held at the number of `fill`, because the data neither
 * determine it nor contradict that number. */
static int is_fillable(const Run *run, int index) {
    const FitValue *value = &run->result->parameter[index];
    MildMaterial fill = *run->def->fill;
    const double number = fit_counted(value->field, *fit_number(&fill, value->field));
    const int undetermined = value->state == FIT_LIMIT || value->state == FIT_OPEN;
    return undetermined && !(number < value->low) && !(number > value->high);
}

/* Fits. With something to fill them with, holds the parameters that the data do not determine,
 * one after the other, until they determine the rest. */
static void values_fill(Run *run) {
    int again = 1;
    while (again) {
        int undetermined[FIT_PARAMETERS_MAX] = {0};
        ties_find(run);
        values_find(run);
        for (int i = 0; i < run->result->parameters && run->def->fill; i++) {
            undetermined[i] = is_fillable(run, i);
        }
        again = put_aside(run, undetermined, FIT_OPEN);
    }
}

/* ---- the run ---- */

static MildStatus fit_check(const FitDef *def, const FitPoint *points, int count,
                            MildError *error) {
    MildStatus status = mild_material_check(&def->material, error);
    if (status == MILD_OK && def->fill) {
        status = mild_material_check(def->fill, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (count < FIT_POINTS_MIN) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "fit: %d loading rows, at least %d are needed",
                         count, FIT_POINTS_MIN);
    }
    if (def->plates < 1 || def->plates > FIT_PLATES_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "fit: %d plates; 1 .. %d are possible",
                         def->plates, (int)FIT_PLATES_MAX);
    }
    for (int i = 0; i < def->plates; i++) {
        const FitPlate *plate = &def->plate[i];
        if (plate->elements < 1 || !(plate->pitch > 0) || !(plate->width > 0)) {
            return mild_fail(error, MILD_ERROR_RANGE, "fit: plate %d has no element", i + 1);
        }
        if (!(plate->inner >= 0) || (plate->outer > 0 && !(plate->inner < plate->outer))) {
            return mild_fail(error, MILD_ERROR_RANGE, "fit: ring %d has no width", i + 1);
        }
    }
    for (int i = 0; i < count; i++) {
        if (points[i].plate < 0 || points[i].plate >= def->plates) {
            return mild_fail(error, MILD_ERROR_RANGE, "fit: row %d is of plate %d of %d", i + 1,
                             points[i].plate + 1, def->plates);
        }
        if (isfinite(points[i].depth) && isfinite(points[i].force) && isfinite(points[i].speed) &&
            isfinite(points[i].acceleration) && isfinite(points[i].area) &&
            isfinite(points[i].load) && (def->kind != FIT_DRAG || isfinite(points[i].slip))) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE, "fit: row %d is not finite", i + 1);
    }
    return MILD_OK;
}

/* Presses in kilonewtons: ground of which no plate carries as much as this at its greatest depth is
 * none. */
#define SOFTEST 1e3 /* [Pa/m] */

static MildStatus unit_check(const FitDef *def, const FitPoint *points, int count,
                             MildError *error) {
    const FitPoint *soft = NULL;
    double area = 0;
    for (int p = 0; def->kind == FIT_PRESS && p < def->plates; p++) {
        const FitPoint *deepest = NULL;
        area = def->plate[p].elements * def->plate[p].pitch * def->plate[p].pitch;
        for (int i = 0; i < count; i++) {
            if (points[i].plate == p && (!deepest || points[i].depth > deepest->depth)) {
                deepest = &points[i];
            }
        }
        if (deepest && !(deepest->force < SOFTEST * area * deepest->depth)) {
            return MILD_OK;
        }
        soft = deepest ? deepest : soft;
    }
    return soft ? mild_fail(error, MILD_ERROR_RANGE,
                            "fit: force_n is %g at depth_m %g under %.3g m2: no ground is that "
                            "soft; it must be in newtons",
                            soft->force, soft->depth, area)
                : MILD_OK;
}

/* [m] The width that all plates share, else 0. */
static double plates_width(const FitDef *def) {
    for (int i = 1; i < def->plates; i++) {
        if (def->plate[i].width != def->plate[0].width) {
            return 0;
        }
    }
    return def->plate[0].width;
}

/* Names, units and states before the fit, and the numbers of what is held. */
static void run_open(Run *run) {
    const FitDef *def = run->def;
    const MildMaterial probe = fit_probe(0);
    MildMaterial *base = &run->fit.base, held = def->material, unheld = probe;
    FitResult *result = run->result;
    *result = (FitResult){.points = run->fit.count};
    held.plate_width = def->plate[0].width; /* of the combination, which needs one */
    *base = held;
    result->parameters = fit_parameters((MildModel)held.model, def->kind, run->field);
    for (int i = 0; i < result->parameters; i++) {
        const MildField *field = run->field[i];
        FitValue *value = &result->parameter[i];
        *value = (FitValue){.name = field->name, .field = field, .value = NAN};
        value->state = def->held[i] ? FIT_HELD : FIT_FITTED;
        value->low = value->high = NAN;
        snprintf(value->unit, sizeof value->unit, "%.*s", (int)strcspn(field->help + 1, "]"),
                 field->help + 1);
        if (!def->held[i]) {
            *fit_number(base, field) = *fit_number(&unheld, field);
        }
    }
}

static void run_finish(Run *run) {
    FitResult *result = run->result;
    double force = 0;
    for (int i = 0; i < result->points; i++) {
        force += run->fit.points[i].force * run->fit.points[i].force;
    }
    result->curve = fit_material(&run->fit);
    result->curve.plate_width = plates_width(run->def);
    result->residual = sqrt(run->fit.least / result->points);
    result->residual_share = force > 0 ? sqrt(run->fit.least / force) : 0;
    result->neighbours = run->fit.neighbours;
    result->rows = run->fit.rows;
    for (int i = 0; i < result->parameters; i++) {
        FitValue *value = &result->parameter[i];
        if (value->state == FIT_HELD || value->state == FIT_FILLED) {
            value->value = *fit_number(&result->curve, value->field);
        } else if (value->state != FIT_FITTED) {
            value->value = NAN;
        }
        if (value->state != FIT_FITTED && value->state != FIT_LIMIT) {
            value->low = value->high = NAN;
        }
    }
}

/* Bool: a row goes on where the one before it ends, so that their mean is a row. */
static int is_neighbour(FitKind kind, const FitPoint *row) {
    if (kind == FIT_DRAG) {
        return fit_drag_is_next(row) && row->holds == row[-1].holds &&
               (row->slip > 0) == (row[-1].slip > 0);
    }
    return !(row->depth < row[-1].depth) && row->plate == row[-1].plate &&
           row->area == row[-1].area;
}

/* Means of `group` neighbouring rows, fewer where a record ends: the next begins less deep. Returns
 * their count. */
static int rows_mean(FitKind kind, const FitPoint *points, int count, int group, FitPoint *means) {
    int kept = 0;
    for (int i = 0, n = 0; i < count; i += n) {
        FitPoint sum = {.time = NAN, .plate = points[i].plate};
        for (n = 0; n < group && i + n < count; n++) {
            const FitPoint *row = &points[i + n];
            if (n && !is_neighbour(kind, row)) {
                break;
            }
            sum.slip += row->slip;
            sum.weight += row->weight;
            sum.virgin += row->virgin;
            sum.near += row->near;
            sum.holds = row->holds;
            sum.depth += row->depth;
            sum.force += row->force;
            sum.load += row->load;
            sum.area = row->area;
            sum.speed += row->speed;
            sum.acceleration += row->acceleration;
        }
        sum.depth /= n;
        sum.force /= n;
        sum.load /= n;
        sum.speed /= n;
        sum.acceleration /= n;
        sum.slip /= n;
        sum.weight /= n;
        sum.virgin /= n;
        sum.near /= n;
        means[kept++] = sum;
    }
    return kept;
}

/* No plate of the records is under a modulus below 0. */
static MildStatus plates_check(const FitDef *def, const MildMaterial *found, MildError *error) {
    for (int i = 0; i < def->plates; i++) {
        const double width = def->plate[i].width;
        if (fit_modulus(found, width) < -1e-9 * found->k_phi) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "fit: k_c = %g, k_phi = %g have k_c/b + k_phi below 0 under the "
                             "plate of b = %g m: hold k_c nearer to 0, or leave out that record",
                             found->k_c, found->k_phi, width);
        }
    }
    return MILD_OK;
}

static MildStatus run_rows(const FitDef *def, const FitPoint *points, int count, FitResult *result,
                           MildError *error) {
    Run run = {.def = def,
               .result = result,
               .fit = {.kind = def->kind,
                       .plates = def->plate,
                       .points = points,
                       .count = count,
                       .fixed = -1}};
    run_open(&run);
    if (count <= result->parameters) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%d loading rows for %d parameters; record more rows", count,
                         result->parameters);
    }
    if (!fit_open(&run.fit, result->parameters)) {
        return mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    }
    values_fill(&run);
    run_finish(&run);
    fit_close(&run.fit);
    return def->kind == FIT_PRESS ? plates_check(def, &result->curve, error) : MILD_OK;
}

MildStatus fit_run(const FitDef *def, const FitPoint *points, int count, FitResult *result,
                   MildError *error) {
    MildStatus status = fit_check(def, points, count, error);
    status = status == MILD_OK ? unit_check(def, points, count, error) : status;
    if (status != MILD_OK || count <= FIT_ROWS) {
        return status == MILD_OK ? run_rows(def, points, count, result, error) : status;
    }
    FitPoint *means = malloc(sizeof *means * (size_t)count);
    if (!means) {
        return mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    }
    const int kept = rows_mean(def->kind, points, count, (count + FIT_ROWS - 1) / FIT_ROWS, means);
    status = run_rows(def, means, kept, result, error);
    free(means);
    if (status == MILD_OK) {
        result->points = count;
        result->rows *= (double)count / kept;
    }
    return status;
}
