/* What mild.GroundFit calls (src/identify/fit.h). */
#include "ground.h"

#include <cmath>

extern "C" {
#include "identify/fit.h"
#include "identify/fit_csv.h"
#include "identify/fit_law.h"
}

static FitPlate plate_of(const Sole &sole) {
    FitPlate plate = {};
    plate.elements = mild_sole_elements(sole.made);
    plate.pitch = mild_sole_pitch(sole.made);
    plate.width = mild_sole_width(sole.made);
    plate.sole = sole.made;
    return plate;
}

/* Fills plates[FIT_PLATES_MAX]; returns their number. */
static int plates_of(const nb::sequence &soles, FitPlate *plates) {
    const size_t count = nb::len(soles);
    if (count < 1 || count > FIT_PLATES_MAX) {
        raise(PyExc_ValueError,
              "plate: it must be 1 .. " + std::to_string((int)FIT_PLATES_MAX) + " plates");
    }
    for (size_t i = 0; i < count; i++) {
        const nb::object sole = soles[i];
        if (!nb::isinstance<Sole>(sole)) {
            raise(PyExc_TypeError, "plate: it must be a Sole");
        }
        plates[i] = plate_of(nb::cast<const Sole &>(sole));
    }
    return (int)count;
}

/* A number that is none, or is far too large, names no plate. */
static int plate_number(double number) {
    return number >= 0 && number < FIT_PLATES_MAX ? (int)number : -1;
}

/* rows: (n, 6) time, depth, force, speed, acceleration, number of the plate; NaN where unknown. */
static std::vector<FitPoint> points_of(nb::handle rows) {
    const auto numbers = numbers_of(rows, "rows", 2);
    if (numbers.shape(1) != 6 || numbers.shape(0) > 1000000) {
        raise(PyExc_ValueError, "rows: they must have the shape (at most 1000000, 6)");
    }
    std::vector<FitPoint> points;
    for (size_t i = 0; i < numbers.shape(0); i++) {
        const double *row = numbers.data() + 6 * i;
        FitPoint point = {};
        point.time = row[0];
        point.depth = row[1];
        point.force = row[2];
        point.speed = row[3];
        point.acceleration = row[4];
        point.plate = plate_number(row[5]);
        points.push_back(point);
    }
    return points;
}

/* What `mild fit` refuses, of each plate's rows. */
static void check_rows(const std::vector<FitPoint> &points, int plates) {
    for (int p = 0; p < plates; p++) {
        const std::string where = plates > 1 ? "X[" + std::to_string(p) + "]" : "X";
        std::vector<FitPoint> own;
        for (const FitPoint &point : points) {
            if (point.plate == p) {
                own.push_back(point);
            }
        }
        MildError error = {};
        check(fit_rows_check(where.c_str(), own.data(), (int)own.size(), &error), error);
    }
}

static const char *state_name(FitState state) {
    switch (state) {
    case FIT_HELD: return "held";
    case FIT_FILLED: return "filled";
    case FIT_FITTED: return "fitted";
    case FIT_LIMIT: return "limit";
    case FIT_OPEN: return "open";
    case FIT_TIED: return "tied";
    default: return "no_effect";
    }
}

static nb::dict value_of(const FitValue &value) {
    nb::dict all;
    all["value"] = value.value;
    all["low"] = value.low;
    all["high"] = value.high;
    all["state"] = state_name(value.state);
    all["unit"] = value.unit;
    return all;
}

/* Marks the parameter among those that rows of the kind determine; returns whether it is one. */
static bool mark(FitDef &def, FitKind kind, const std::string &name) {
    const MildField *fields[FIT_PARAMETERS_MAX];
    const int count = fit_parameters((MildModel)def.material.model, kind, fields);
    bool known = false;
    for (int i = 0; i < count; i++) {
        if (name == fields[i]->name) {
            def.held[i] = 1;
            known = true;
        }
    }
    return known;
}

/* Holds a parameter of presses in `def`, one of slides in `drag`; NULL: nothing slides. */
static void hold(FitDef &def, FitDef *drag, const std::string &name, double value) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name.c_str(), nullptr);
    bool known = field && name != "plate_width" &&
                 fit_is_geometry((MildModel)def.material.model, name.c_str());
    known |= mark(def, FIT_PRESS, name);
    known |= drag && mark(*drag, FIT_DRAG, name);
    if (!known) {
        raise(PyExc_ValueError, "hold: '" + name + "' is no parameter of " +
                                    mild_model_names[def.material.model] +
                                    " that a press straight down determines");
    }
    double low, high;
    fit_range(field, &low, &high);
    if (!(value >= low && value <= high)) {
        raise(PyExc_ValueError, "hold: " + name + " = " + std::to_string(value) + " is outside " +
                                    std::to_string(low) + " .. " + std::to_string(high));
    }
    *fit_number(&def.material, field) = value;
}

static FitDef def_of(const nb::sequence &soles, const std::string &model, const nb::dict &held,
                     const MildMaterial *fill, FitDef *drag) {
    FitDef def = {};
    MildModel number;
    if (!mild_model_find(model.c_str(), &number) || number == MILD_MODEL_RIGID) {
        raise(PyExc_ValueError, "model: '" + model + "' is none with parameters to fit");
    }
    if (fill && fill->model != (int)number) {
        raise(PyExc_ValueError, "fill: it is a material of another model");
    }
    if (drag) {
        drag->material.model = (int)number;
    }
    def.plates = plates_of(soles, def.plate);
    def.material = fill ? *fill : mild_material_default();
    def.material.model = (int)number;
    if (!fill) {
        def.material.bed_depth =
            mild_field_find(mild_material_fields, mild_material_field_count, "bed_depth", nullptr)
                ->max;
    }
    for (auto [key, value] : held) {
        double wanted = 0;
        if (!nb::try_cast(value, wanted)) {
            raise(PyExc_TypeError, "hold: every value must be a number");
        }
        hold(def, drag, utf8(key, "hold"), wanted);
    }
    def.fill = fill;
    return def;
}

static void add_values(nb::dict all, const FitResult &result) {
    nb::dict parameters = nb::cast<nb::dict>(all["parameters"]);
    nb::dict combinations = nb::cast<nb::dict>(all["combinations"]);
    for (int i = 0; i < result.parameters; i++) {
        parameters[result.parameter[i].name] = value_of(result.parameter[i]);
    }
    for (int i = 0; i < result.combinations; i++) {
        combinations[result.combination[i].name] = value_of(result.combination[i]);
    }
}

/* table: (n, 4) slip, depth, force up, force along on the plate; NaN where unknown. */
static std::vector<FitPoint> slide_of(const FitPlate &plate, int number, const MildMaterial &curve,
                                      nb::handle table) {
    const auto numbers = numbers_of(table, "drags", 2);
    const size_t count = numbers.shape(0);
    if (numbers.shape(1) != 4 || count < 1 || count > 1000000) {
        raise(PyExc_ValueError, "drags: a table must have the shape (1 .. 1000000, 4)");
    }
    std::vector<FitPoint> points(count), slide(count), rows(2 * count);
    for (size_t i = 0; i < count; i++) {
        const double *row = numbers.data() + 4 * i;
        points[i].slip = row[0];
        points[i].depth = row[1];
        points[i].force = row[2];
        points[i].along = row[3];
        points[i].plate = number;
    }
    int before = (int)count;
    int copied = 0;
    const std::string where = "drags[" + std::to_string(number) + "]";
    MildError error = {};
    check(fit_rows_check(where.c_str(), points.data(), (int)count, &error), error);
    const int slid = fit_sliding(points.data(), &before, slide.data(), &copied);
    if (slid < FIT_POINTS_MIN) {
        raise(PyExc_ValueError, "drags: fewer than " + std::to_string((int)FIT_POINTS_MIN) +
                                    " rows slide, or none by 1 mm");
    }
    const bool along = std::isfinite(slide[(size_t)copied - 1].along);
    if (const char *wrong = fit_slide_wrong(slide.data(), copied, slid, along)) {
        raise(PyExc_ValueError, where + ": " + wrong);
    }
    rows.resize((size_t)fit_slide_rows(&plate, &curve, slide.data(), copied, rows.data()));
    return rows;
}

/* Fits what slides, after the presses: a list of (Sole, table). Its numbers join the others'. */
static void run_drags(FitDef &drag, const FitDef &press, const nb::sequence &drags,
                      FitResult &pressed, nb::dict all) {
    const size_t count = nb::len(drags);
    if (count > FIT_PLATES_MAX || !fit_drag_is_modelled((MildModel)press.material.model)) {
        raise(PyExc_ValueError, count > FIT_PLATES_MAX
                                    ? "drags: more than " + std::to_string((int)FIT_PLATES_MAX)
                                    : std::string("drags: slip costs no support under ") +
                                          mild_model_names[press.material.model] +
                                          "; model must be mild or mild_merged");
    }
    const MildMaterial known = fit_slide_base(&press.material, &pressed.curve);
    std::vector<FitPoint> rows;
    for (size_t i = 0; i < count; i++) {
        const nb::sequence pair = nb::cast<nb::sequence>(drags[i]);
        drag.plate[i] = plate_of(nb::cast<const Sole &>(pair[0]));
        const std::vector<FitPoint> part = slide_of(drag.plate[i], (int)i, known, pair[1]);
        rows.insert(rows.end(), part.begin(), part.end());
    }
    drag.kind = FIT_DRAG;
    drag.plates = (int)count;
    drag.material = known;
    drag.fill = press.fill;
    FitResult result = {};
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = fit_run(&drag, rows.data(), (int)rows.size(), &result, &error);
    }
    check(status, error);
    add_values(all, result);
    all["drag_residual"] = result.residual;
    MildMaterial curve = known;
    for (int i = 0; i < result.parameters; i++) {
        const FitState state = result.parameter[i].state;
        if (state != FIT_NO_EFFECT && state != FIT_TIED) {
            *fit_number(&curve, result.parameter[i].field) =
                *fit_number(&result.curve, result.parameter[i].field);
        }
    }
    curve.plate_width = pressed.curve.plate_width;
    pressed.curve = curve;
}

static nb::dict run(const nb::sequence &soles, nb::handle rows, const std::string &model,
                    const nb::dict &held, nb::handle fill, const nb::sequence &drags) {
    FitDef drag = {};
    MildMaterial filled;
    if (!fill.is_none()) {
        filled = material_of(fill, "fill");
    }
    const FitDef def = def_of(soles, model, held, fill.is_none() ? nullptr : &filled,
                              nb::len(drags) > 0 ? &drag : nullptr);
    const std::vector<FitPoint> points = points_of(rows);
    check_rows(points, def.plates);
    FitResult result = {};
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = fit_run(&def, points.data(), (int)points.size(), &result, &error);
    }
    check(status, error);
    nb::dict all;
    all["parameters"] = nb::dict();
    all["combinations"] = nb::dict();
    add_values(all, result);
    all["drag_residual"] = std::nan("");
    if (nb::len(drags) > 0) {
        run_drags(drag, def, drags, result, all);
    }
    all["curve"] = Material{result.curve};
    all["residual"] = result.residual;
    all["residual_share"] = result.residual_share;
    all["points"] = result.points;
    return all;
}

static nb::object forces(const nb::sequence &soles, const Material &material, nb::handle rows) {
    const std::vector<FitPoint> points = points_of(rows);
    FitPlate plates[FIT_PLATES_MAX];
    const int count = plates_of(soles, plates);
    for (const FitPoint &point : points) {
        if (point.plate < 0 || point.plate >= count) {
            raise(PyExc_ValueError, "rows: one names a plate that is not there");
        }
    }
    std::vector<double> force(points.size());
    if (!points.empty()) {
        fit_forces(FIT_PRESS, plates, &material.numbers, points.data(), (int)points.size(),
                   force.data());
    }
    return array_of(std::move(force), {points.size()});
}

static nb::object loading(nb::handle rows) {
    std::vector<FitPoint> points = points_of(rows);
    const int count = points.empty() ? 0 : fit_loading(points.data(), (int)points.size());
    MildError error = {};
    check(fit_rows_check("loading", points.data(), count, &error), error);
    if (count > 0) {
        fit_speeds(points.data(), count);
    }
    std::vector<double> kept;
    for (int i = 0; i < count; i++) {
        const FitPoint &p = points[(size_t)i];
        kept.insert(kept.end(), {p.time, p.depth, p.force, p.speed, p.acceleration});
    }
    return array_of(std::move(kept), {(size_t)count, 5});
}

void bind_fit(nb::module_ &module) {
    module.def("_fit", run, nb::arg("soles"), nb::arg("rows"), nb::arg("model"), nb::arg("hold"),
               nb::arg("fill").none(), nb::arg("drags"), "See mild.GroundFit.");
    module.def("_fit_forces", forces, nb::arg("soles"), nb::arg("material"), nb::arg("rows"),
               "Forces [N] in every row: (n,).");
    module.def("_loading", loading, nb::arg("rows"),
               "The loading part of a record, with speeds and accelerations: (n, 5).");
}
