/* mild.press: what `mild press` does (src/identify/press.h). */
#include "ground.h"

#include <cmath>

extern "C" {
#include "identify/press.h"
}

struct Press {
    PressResult result = {};
    Press() = default;
    Press(Press &&other) noexcept : result(other.result) {
        other.result.rows = nullptr;
    }
    Press(const Press &) = delete;
    ~Press() {
        press_result_close(&result);
    }
};

static void check_range(const char *name, double value, double low, double high) {
    if (!(value >= low && value <= high)) {
        MildError error = {};
        mild_fail(&error, MILD_ERROR_RANGE, "%s = %g is outside %g .. %g", name, value, low, high);
        raise(error);
    }
}

/* The turns of a press, which alternate between down and up. */
static void set_turns(nb::handle object, const char *name, double highest, PressDef *def) {
    const bool one = nb::isinstance<nb::float_>(object) || nb::isinstance<nb::int_>(object);
    const nb::object list = one ? nb::object(nb::make_tuple(object)) : nb::borrow(object);
    const auto turns = numbers_of(list, name, 1);
    if (turns.size() < 1 || turns.size() > PRESS_TURNS_MAX) {
        raise(PyExc_ValueError, std::string(name) + ": it must have 1 .. " +
                                    std::to_string(PRESS_TURNS_MAX) + " numbers");
    }
    def->turns = (int)turns.size();
    for (int i = 0; i < def->turns; i++) {
        def->turn[i] = turns.data()[i];
        check_range(name, def->turn[i], 0, highest);
        const bool good = i == 0  ? def->turn[0] > 0
                          : i % 2 ? def->turn[i] < def->turn[i - 1]
                                  : def->turn[i] > def->turn[i - 1];
        if (!good) {
            raise(PyExc_ValueError, std::string(name) + ": turns alternate between down, above 0, "
                                                        "and up");
        }
    }
}

static void set_path(PressDef *def, nb::handle depth, nb::handle force, double speed, int cycles,
                     double drag) {
    check_range("speed", speed, 1e-5, 10);
    check_range("cycles", cycles, 1, 1000);
    check_range("drag", drag, 0, 10);
    if (!depth.is_none() && !force.is_none()) {
        raise(PyExc_ValueError, "force: it cannot be used with depth; leave out one of them");
    }
    def->speed = def->drag_speed = speed;
    def->cycles = cycles;
    def->drag = drag;
    def->by_force = !force.is_none();
    if (def->by_force) {
        set_turns(force, "force", 1e6, def);
    } else if (!depth.is_none()) {
        set_turns(depth, "depth", 1, def);
    } else {
        def->turns = 1;
        def->turn[0] = 0.03;
    }
    if (drag > 0 && (cycles > 1 || def->turns > 1)) {
        raise(PyExc_ValueError, "drag: it works with one turn; leave out cycles and further turns");
    }
}

static void set_drop(PressDef *def, double drop, double impact, double mass, double seconds) {
    check_range("drop", drop, 0, 10);
    check_range("impact", impact, 0, 20);
    check_range("mass", mass, 1e-3, 1e4);
    check_range("seconds", seconds, 1e-3, 100);
    def->mass = mass;
    def->height = drop;
    def->impact = impact;
    def->seconds = seconds;
}

static Press run(nb::handle material, const Sole &sole, nb::handle depth, nb::handle force,
                 double speed, double tilt, int cycles, double drag, nb::handle drop, double impact,
                 double mass, double seconds, double step, nb::handle map, int tiles) {
    PressDef def = {};
    def.material = material_of(material, "material");
    check_range("tilt", tilt, -0.7854, 0.7854);
    check_range("step", step, 0, 1);
    check_range("tiles", tiles, 0, MILD_IMPRINT_TILES_MAX);
    def.tilt = tilt;
    def.step = step > 0 ? std::fmax(step, 1e-7) : 0;
    def.imprint_tiles = tiles;
    def.map = map_of(map);
    if (drop.is_none() && impact == 0) {
        set_path(&def, depth, force, speed, cycles, drag);
    } else if (depth.is_none() && force.is_none()) {
        double height = 0;
        if (!drop.is_none() && !nb::try_cast(drop, height)) {
            raise(PyExc_TypeError, "drop: it must be a number or None");
        }
        set_drop(&def, height, impact, mass, seconds);
    } else {
        raise(PyExc_ValueError,
              "drop, impact: the path of a dropped body cannot be prescribed; leave out depth and "
              "force");
    }
    Press press;
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = press_run(&def, sole.made, &press.result, &error);
    }
    check(status, error);
    return press;
}

template <typename T> static auto column(T PressRow::*member) {
    return [member](nb::handle self) {
        const PressResult &result = made_of<Press>(self, "self").result;
        const size_t shape[] = {(size_t)result.count};
        const int64_t strides[] = {(int64_t)(sizeof(PressRow) / sizeof(T))};
        static_assert(sizeof(PressRow) % sizeof(T) == 0, "strides are in elements");
        const T *first = result.rows ? &(result.rows->*member) : nullptr;
        return nb::ndarray<nb::numpy, const T>(first, 1, shape, self, strides);
    };
}

template <typename T> static auto number(T PressResult::*member) {
    return [member](const Press &press) { return press.result.*member; };
}

void bind_press(nb::module_ &module) {
    nb::class_<Press>(module, "Press",
                      "Result of mild.press: columns of its rows, each (rows,) and read-only, and "
                      "sums.")
        .def_prop_ro("time", column(&PressRow::time), "[s]")
        .def_prop_ro("depth", column(&PressRow::depth), "[m] of the reference point")
        .def_prop_ro("force", column(&PressRow::force), "[N] up, on the sole")
        .def_prop_ro("moment_x", column(&PressRow::moment_x), "[N m]")
        .def_prop_ro("moment_y", column(&PressRow::moment_y), "[N m]")
        .def_prop_ro("zmp_x", column(&PressRow::zmp_x), "[m]; NaN without force")
        .def_prop_ro("zmp_y", column(&PressRow::zmp_y), "[m]; NaN without force")
        .def_prop_ro("force_x", column(&PressRow::force_x), "[N]")
        .def_prop_ro("force_y", column(&PressRow::force_y), "[N]")
        .def_prop_ro("x", column(&PressRow::x), "[m] of the reference point")
        .def_prop_ro("tilt", column(&PressRow::tilt), "[rad]")
        .def_prop_ro("contacts", column(&PressRow::contacts), "number of loaded elements")
        .def_prop_ro("way", column(&PressRow::way),
                     "0 is the first way down; each turn begins the next")
        .def("__len__", number(&PressResult::count))
        .def_prop_ro("peak_force", number(&PressResult::peak_force), "[N]")
        .def_prop_ro("work_in", number(&PressResult::work_in), "[J] on the ways down")
        .def_prop_ro("work_out", number(&PressResult::work_out), "[J] returned on the ways up")
        .def_prop_ro("work_drag", number(&PressResult::work_drag), "[J] of the motion along x")
        .def_prop_ro("print_depth", number(&PressResult::print_depth),
                     "[m] where the force last vanished on a way up")
        .def_prop_ro("stop_depth", number(&PressResult::stop_depth),
                     "[m] of the first stop of a dropped body")
        .def_prop_ro("stop_time", number(&PressResult::stop_time), "[s] of that stop")
        .def_prop_ro("area", number(&PressResult::area), "[m^2] of all elements");
    module.def(
        "press", run, nb::arg("material"), nb::arg("sole"), nb::kw_only(),
        nb::arg("depth") = nb::none(), nb::arg("force") = nb::none(), nb::arg("speed") = 0.01,
        nb::arg("tilt") = 0.0, nb::arg("cycles") = 1, nb::arg("drag") = 0.0,
        nb::arg("drop") = nb::none(), nb::arg("impact") = 0.0, nb::arg("mass") = 20.0,
        nb::arg("seconds") = 1.0, nb::arg("step") = 0.0, nb::arg("map") = nb::none(),
        nb::arg("tiles") = 0,
        "Moves a sole down and up through a ground, or drops it, and records the force.\n\n"
        "depth [m] or force [N]: a number, or turns that alternate between down and up; 0.03 "
        "m\nby default. speed [m/s]; tilt [rad], front edge down; cycles: of all turns; drag "
        "[m] along\n+x after the way down. drop [m] of height, or impact [m/s]: a free body "
        "of mass [kg] is\nrecorded for `seconds`. step [s]: 0 chooses it. map, tiles: as for "
        "Ground.\nRaises ValueError for numbers out of range.");
}
