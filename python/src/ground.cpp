/* mild.Ground: contact steps on arrays that lie in the library's own structs. */
#include "ground.h"

#include <cstdlib>
#include <cstring>

#include <nanobind/stl/tuple.h>

extern "C" {
#include "ground/law/width.h"
}

struct Ground {
    nb::object soles; /* tuple of Sole */
    Terrain terrain;
    Terrain used; /* a copy: that of the solve, and of what the ground remembers */
    int feet = 0;
    int tiles = 0;
    void *block = nullptr;
    MildGround *ground = nullptr;
    MildScratch *scratch = nullptr;
    MildScratch *work = nullptr; /* of derivative; made when it is first asked for */
    MildContactInput input = {};
    std::vector<double> inverse_inertia; /* of the input */
    MildContactResult result = {};
    bool solved = false;
    std::atomic<bool> busy{false};

    Ground() = default;
    Ground(const Ground &) = delete;
    ~Ground() {
        mild_scratch_destroy(scratch);
        mild_scratch_destroy(work);
        std::free(block);
    }
};

MildGround *block_of(nb::handle ground) {
    return made_of<Ground>(ground, "ground").ground;
}

/* ---- creation ---- */

static void set_solver(Ground &ground, const std::string &solver) {
    for (int i = 0; i < MILD_SOLVERS; i++) {
        if (solver == mild_solver_names[i]) {
            ground.input.solver = static_cast<MildSolver>(i);
            return;
        }
    }
    raise(PyExc_ValueError, "solver: '" + solver + "' is none of newton, gauss_seidel, explicit");
}

/* Every material of a terrain under every sole. */
static void meet(const std::vector<const MildSole *> &soles, const Terrain &terrain) {
    for (int i = 0; i < terrain.terrain.material_count; i++) {
        for (const MildSole *sole : soles) {
            MildError error = {};
            check(width_check(&terrain.terrain.materials[i], mild_sole_width(sole), &error), error);
        }
    }
}

static void make(Ground *at, const nb::sequence &soles, nb::handle terrain, double dt, int tiles,
                 const std::string &solver, double tolerance, int max_iterations) {
    const nb::tuple kept(soles); /* a sequence may give others the next time */
    const std::vector<const MildSole *> made = soles_of(kept);
    if (tiles < 0 || tiles > MILD_IMPRINT_TILES_MAX) {
        raise(PyExc_ValueError, "tiles = " + std::to_string(tiles) + " is outside 0 .. " +
                                    std::to_string(MILD_IMPRINT_TILES_MAX));
    }
    if (!(tolerance >= 0) || max_iterations < 0) {
        raise(PyExc_ValueError, "tolerance, max_iterations: they must be 0 or above");
    }
    positive(dt, "dt");
    Terrain under = terrain_of(terrain);
    meet(made, under);
    auto ground = new (at) Ground;
    try {
        set_solver(*ground, solver);
        MildError error = {};
        ground->feet = ground->input.feet = (int)made.size();
        ground->inverse_inertia.resize(36 * made.size() * made.size());
        ground->input.inverse_inertia = ground->inverse_inertia.data();
        ground->block =
            std::aligned_alloc(64, mild_ground_bytes_imprints(made.data(), ground->feet, tiles));
        ground->scratch = mild_scratch_create(made.data(), ground->feet, &error);
        if (!ground->block || !ground->scratch) {
            raise(PyExc_MemoryError, "Ground: out of memory");
        }
        ground->ground = mild_ground_init_imprints(ground->block, made.data(), ground->feet, tiles);
        ground->soles = kept;
        ground->terrain = ground->used = under;
        ground->tiles = tiles;
        ground->input.dt = dt;
        ground->input.tolerance = tolerance;
        ground->input.max_iterations = max_iterations;
        for (int f = 0; f < ground->feet; f++) {
            for (int k = 0; k < 3; k++) {
                ground->input.rotation[f][4 * k] = 1;
            }
        }
    } catch (...) {
        at->~Ground();
        throw;
    }
}

/* ---- a step ---- */

/* The ground meets the terrain that was assigned, unless a solve waits for its end. */
static void change(Ground &ground) {
    if (!ground.solved) {
        mild_ground_change(ground.ground, &ground.used.terrain, &ground.terrain.terrain,
                           ground.scratch);
        ground.used = ground.terrain;
    }
}

static bool solve(Ground &ground) {
    Entered entered(ground.busy, "Ground.solve");
    ground.solved = false;
    change(ground);
    {
        nb::gil_scoped_release released;
        mild_ground_solve(ground.ground, &ground.used.terrain, &ground.input, ground.scratch,
                          &ground.result);
    }
    ground.solved = true;
    return ground.result.converged != 0;
}

static void check_input(Ground &ground) {
    Entered entered(ground.busy, "Ground.check");
    MildError error = {};
    check(mild_contact_check(ground.ground, &ground.terrain.terrain, &ground.input, &error), error);
}

static void advance(Ground &ground) {
    Entered entered(ground.busy, "Ground.advance");
    if (!ground.solved) {
        raise(PyExc_RuntimeError, "Ground.advance: there is no step to keep; call solve() first");
    }
    ground.solved = false;
    {
        nb::gil_scoped_release released;
        mild_ground_advance(ground.ground, &ground.used.terrain, &ground.input, ground.scratch,
                            &ground.result);
    }
    change(ground);
}

static void reset(Ground &ground) {
    Entered entered(ground.busy, "Ground.reset");
    ground.solved = false;
    mild_ground_reset(ground.ground);
}

/* Indices of a material's numbers by their names. */
static std::vector<int> fields_of(const std::vector<std::string> &names) {
    std::vector<int> fields;
    for (const std::string &name : names) {
        const char *nearest = nullptr;
        const MildField *field = mild_field_find(mild_material_fields, mild_material_field_count,
                                                 name.c_str(), &nearest);
        if (!field || field->type != MILD_FIELD_DOUBLE) {
            raise(PyExc_ValueError,
                  "fields: '" + name + "' is not a number of a material" +
                      (field || !nearest ? "" : "; is it '" + std::string(nearest) + "'?"));
        }
        fields.push_back((int)(field - mild_material_fields));
    }
    return fields;
}

static nb::dict derivative(Ground &ground, bool pose, bool velocity,
                           const std::vector<std::string> &names, int material) {
    Entered entered(ground.busy, "Ground.derivative");
    if (!ground.solved) {
        raise(PyExc_RuntimeError,
              "Ground.derivative: it is that of a solve; call solve() first, advance() after");
    }
    const std::vector<int> fields = fields_of(names);
    const size_t feet = (size_t)ground.feet, rows = 6 * feet;
    MildError error = {};
    if (!ground.work) {
        ground.work = mild_scratch_create(soles_of(nb::cast<nb::tuple>(ground.soles)).data(),
                                          ground.feet, &error);
        if (!ground.work) {
            raise(error);
        }
    }
    const struct {
        const char *name;
        bool wanted;
        std::vector<size_t> shape;
        double *MildContactDerivative::*at;
    } all[] = {
        {"law", true, {feet, 6, 6}, &MildContactDerivative::law},
        {"wrench_by_free", true, {rows, rows}, &MildContactDerivative::wrench_by_free},
        {"velocity_by_free", true, {rows, rows}, &MildContactDerivative::velocity_by_free},
        {"wrench_by_pose", pose, {rows, rows}, &MildContactDerivative::wrench_by_pose},
        {"wrench_by_velocity", velocity, {rows, rows}, &MildContactDerivative::wrench_by_velocity},
        {"wrench_by_material",
         !fields.empty(),
         {rows, fields.size()},
         &MildContactDerivative::wrench_by_material}};
    MildContactDerivative asked = {};
    asked.material = material;
    asked.field = fields.data();
    asked.field_count = (int)fields.size();
    asked.work = ground.work;
    std::vector<std::vector<double>> numbers;
    for (const auto &one : all) {
        size_t count = one.wanted;
        for (size_t side : one.shape) {
            count *= side;
        }
        numbers.emplace_back(count);
        asked.*one.at = one.wanted ? numbers.back().data() : nullptr;
    }
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = mild_ground_derivative(ground.ground, &ground.used.terrain, &ground.input,
                                        ground.scratch, &ground.result, &asked, &error);
    }
    check(status, error);
    nb::dict made;
    for (size_t k = 0; k < numbers.size(); k++) {
        if (all[k].wanted) {
            made[all[k].name] = array_of(std::move(numbers[k]), all[k].shape);
        }
    }
    return made;
}

/* ---- state ---- */

static nb::bytes get_state(Ground &ground) {
    Entered entered(ground.busy, "Ground.state");
    return nb::bytes(ground.block, mild_ground_size(ground.ground));
}

static void set_state(Ground &ground, const nb::bytes &state) {
    Entered entered(ground.busy, "Ground.state");
    MildError error = {};
    check(mild_ground_restore(ground.ground, state.c_str(), state.size(), &error), error);
    ground.solved = false;
}

static size_t inertia_bytes(const Ground &ground) {
    return ground.inverse_inertia.size() * sizeof(double);
}

static nb::tuple keep(Ground &ground) {
    const MildContactInput &input = ground.input;
    return nb::make_tuple(ground.soles, ground.terrain, input.dt, ground.tiles,
                          mild_solver_names[input.solver], input.tolerance, input.max_iterations,
                          get_state(ground), nb::bytes(&input, sizeof input),
                          nb::bytes(input.inverse_inertia, inertia_bytes(ground)));
}

/* What `keep` made: soles, terrain, dt, tiles, solver, tolerance, max_iterations, state, input,
 * inverse_inertia. */
using Kept = std::tuple<nb::sequence, nb::object, double, int, std::string, double, int, nb::bytes,
                        nb::bytes, nb::bytes>;

/* Takes the numbers that a caller can write; the others are arguments. */
static void restore_input(Ground &ground, const nb::bytes &numbers, const nb::bytes &inertia) {
    const MildContactInput made = ground.input;
    if (numbers.size() != sizeof made) {
        raise(PyExc_ValueError, "Ground: an input of " + std::to_string(numbers.size()) +
                                    " bytes, but it must have " + std::to_string(sizeof made));
    }
    if (inertia.size() != inertia_bytes(ground)) {
        raise(PyExc_ValueError, "Ground: an inverse_inertia of " + std::to_string(inertia.size()) +
                                    " bytes, but it must have " +
                                    std::to_string(inertia_bytes(ground)));
    }
    std::memcpy(&ground.input, numbers.c_str(), sizeof made);
    std::memcpy(made.inverse_inertia, inertia.c_str(), inertia.size());
    ground.input.inverse_inertia = made.inverse_inertia;
    ground.input.rows = made.rows;
    ground.input.feet = made.feet;
    ground.input.dt = made.dt;
    ground.input.solver = made.solver;
    ground.input.tolerance = made.tolerance;
    ground.input.max_iterations = made.max_iterations;
}

static void restore(Ground *ground, const Kept &kept) {
    const auto &[soles, terrain, dt, tiles, solver, tolerance, iterations, state, input, inertia] =
        kept;
    make(ground, soles, terrain, dt, tiles, solver, tolerance, iterations);
    try {
        restore_input(*ground, input, inertia);
        set_state(*ground, state);
    } catch (...) {
        ground->~Ground();
        throw;
    }
}

/* ---- arrays: views of input and result ---- */

using Numbers = nb::ndarray<nb::numpy, double>;
using Results = nb::ndarray<nb::numpy, const double>;

template <typename Choose>
static auto input_array(Choose choose, std::vector<size_t> (*shape)(size_t feet)) {
    return [choose, shape](nb::handle self) {
        Ground &ground = made_of<Ground>(self, "self");
        const std::vector<size_t> wanted = shape((size_t)ground.feet);
        return Numbers(choose(ground.input), wanted.size(), wanted.data(), self);
    };
}

/* A number or a vector of every MildFootResult. */
template <typename Choose> static auto foot_array(Choose choose, size_t width) {
    return [choose, width](nb::handle self) {
        Ground &ground = made_of<Ground>(self, "self");
        const size_t shape[] = {(size_t)ground.feet, width};
        const int64_t strides[] = {sizeof(MildFootResult) / sizeof(double), 1};
        static_assert(sizeof(MildFootResult) % sizeof(double) == 0, "strides are in doubles");
        return Results(choose(ground.result.foot[0]), width ? 2 : 1, shape, self, strides);
    };
}

static nb::dict elements(nb::handle self, int foot) {
    Ground &ground = made_of<Ground>(self, "self");
    Entered entered(ground.busy, "Ground.elements");
    if (foot < 0 || foot >= ground.feet) {
        raise(PyExc_IndexError,
              "foot = " + std::to_string(foot) + ", but there are " + std::to_string(ground.feet));
    }
    if (!ground.solved) {
        raise(PyExc_RuntimeError, "Ground.elements: they are those of a solve; call solve() first");
    }
    const MildElements at = mild_scratch_elements(ground.scratch, foot);
    const size_t count =
        (size_t)mild_sole_elements(nb::cast<Sole &>(ground.soles[(size_t)foot]).made);
    nb::dict all;
    const struct {
        const char *name;
        const double *at;
    } numbers[] = {{"depth", at.depth},         {"normal", at.normal},
                   {"tangent_x", at.tangent_x}, {"tangent_y", at.tangent_y},
                   {"point_x", at.point_x},     {"point_y", at.point_y},
                   {"point_z", at.point_z},     {"flat", at.flat}};
    for (const auto &one : numbers) {
        all[one.name] = nb::cast(Results(one.at, {count}, self)).attr("copy")();
    }
    using Flags = nb::ndarray<nb::numpy, const uint8_t>;
    all["state"] = nb::cast(Flags(at.state, {count}, self)).attr("copy")();
    all["slip"] = nb::cast(Flags(at.slip, {count}, self)).attr("astype")("bool");
    return all;
}

static Results depths(nb::handle self, int foot) {
    Ground &ground = made_of<Ground>(self, "self");
    if (foot < 0 || foot >= ground.feet) {
        raise(PyExc_IndexError,
              "foot = " + std::to_string(foot) + ", but there are " + std::to_string(ground.feet));
    }
    const size_t count =
        (size_t)mild_sole_elements(nb::cast<Sole &>(ground.soles[(size_t)foot]).made);
    return Results(mild_ground_depth_max(ground.ground, foot), {count}, self);
}

/* ---- the class ---- */

static void bind_input(nb::class_<Ground> &type) {
    type.def_prop_ro("position",
                     input_array([](MildContactInput &input) { return &input.position[0][0]; },
                                 [](size_t feet) {
                                     return std::vector<size_t>{feet, 3};
                                 }),
                     "Ankles, world [m]: (feet, 3). Assign its elements: ground.position[0] = ...")
        .def_prop_ro("rotation",
                     input_array([](MildContactInput &input) { return &input.rotation[0][0]; },
                                 [](size_t feet) {
                                     return std::vector<size_t>{feet, 3, 3};
                                 }),
                     "Foot to world, orthonormal: (feet, 3, 3); 1 at first.")
        .def_prop_ro("velocity",
                     input_array([](MildContactInput &input) { return &input.velocity[0][0]; },
                                 [](size_t feet) {
                                     return std::vector<size_t>{feet, 6};
                                 }),
                     "Present twist at the ankle, linear then angular, world axes [m/s, rad/s]: "
                     "(feet, 6).")
        .def_prop_ro("inverse_inertia",
                     input_array([](MildContactInput &input) { return input.inverse_inertia; },
                                 [](size_t feet) {
                                     return std::vector<size_t>{6 * feet, 6 * feet};
                                 }),
                     "A = J M^-1 J^T [1/kg, 1/(kg m), 1/(kg m^2)]: (6 feet, 6 feet).")
        .def_prop_ro("free_velocity",
                     input_array([](MildContactInput &input) { return input.free_velocity; },
                                 [](size_t feet) {
                                     return std::vector<size_t>{feet, 6};
                                 }),
                     "Twists after a step without ground, J (qvel + dt M^-1 (tau - b)) [m/s, "
                     "rad/s]: (feet, 6).")
        .def_prop_rw(
            "dt", [](Ground &ground) { return ground.input.dt; },
            [](Ground &ground, double dt) {
                ground.input.dt = positive(dt, "dt");
                ground.solved = false;
            },
            "Time step [s].")
        .def_prop_rw(
            "terrain", [](Ground &ground) { return ground.terrain; },
            [](Ground &ground, nb::handle terrain) {
                const Terrain under = terrain_of(terrain);
                meet(soles_of(nb::cast<nb::tuple>(ground.soles)), under);
                Entered entered(ground.busy, "Ground.terrain");
                ground.terrain = under;
                change(ground);
            },
            "A copy of the terrain; assign one, or a material, to change it. Where the new ground "
            "would carry more than the old, its surface lies lower under a foot until that lifts "
            "off.");
}

static void bind_result(nb::class_<Ground> &type) {
    type.def_prop_ro("force", foot_array([](const MildFootResult &foot) { return foot.force; }, 3),
                     "Force on each foot, world, mean over the step [N]: (feet, 3), read-only as "
                     "all results.")
        .def_prop_ro("torque",
                     foot_array([](const MildFootResult &foot) { return foot.torque; }, 3),
                     "Torque about the ankle, world [N m]: (feet, 3).")
        .def_prop_ro("pressure_center",
                     foot_array([](const MildFootResult &foot) { return foot.pressure_center; }, 3),
                     "Centre of pressure, world [m]: (feet, 3); 0 without load.")
        .def_prop_ro("area", foot_array([](const MildFootResult &foot) { return &foot.area; }, 0),
                     "Area of the loaded elements [m^2]: (feet,).")
        .def_prop_ro("depth_max",
                     foot_array([](const MildFootResult &foot) { return &foot.depth_max; }, 0),
                     "Largest depth of a loaded element [m]: (feet,).")
        .def_prop_ro("depth_mean",
                     foot_array([](const MildFootResult &foot) { return &foot.depth_mean; }, 0),
                     "Mean depth of the loaded elements [m]: (feet,).")
        .def_prop_ro(
            "new_velocity",
            [](nb::handle self) {
                Ground &ground = made_of<Ground>(self, "self");
                return Results(ground.result.velocity, {(size_t)ground.feet, 6}, self);
            },
            "Twists at the ankles after the step [m/s, rad/s]: (feet, 6).")
        .def_prop_ro(
            "converged", [](Ground &ground) { return ground.result.converged != 0; },
            "Whether the last solve reached its tolerance.")
        .def_prop_ro(
            "residual", [](Ground &ground) { return ground.result.residual; },
            "Relative residual of the last solve [-].")
        .def_prop_ro(
            "iterations", [](Ground &ground) { return ground.result.iterations; },
            "Newton steps, or sweeps, of the last solve.");
}

void bind_ground(nb::module_ &module) {
    nb::class_<Ground> type(
        module, "Ground",
        "Ground under the feet of one robot (include/mild/ground.h).\n\n"
        "soles: a list of 1 .. 16 Sole. terrain: a Terrain, or a material or preset for a uniform "
        "one.\ndt [s]. tiles: of the memory of imprints; 0: pressed ground is forgotten at "
        "lift-off.\nsolver: newton or gauss_seidel; tolerance [-] and max_iterations of it, 0: "
        "the defaults.\n\nA step: write position, rotation, velocity, inverse_inertia and "
        "free_velocity, which are\nviews of the library's memory, call solve(), read force, torque "
        "and new_velocity, which are\nviews too, and advance() once for each step that is kept. "
        "Pickle and copy.deepcopy keep all.");
    type.def("__init__", make, nb::arg("soles"), nb::arg("terrain") = "sand_loose",
             nb::arg("dt") = 0.001, nb::kw_only(), nb::arg("tiles") = 0,
             nb::arg("solver") = "newton", nb::arg("tolerance") = 0.0,
             nb::arg("max_iterations") = 0)
        .def("solve", solve,
             "Solves the contact step; the ground stays as it is. Returns whether it converged:\n"
             "False also for input that is not finite.")
        .def("check", check_input,
             "Checks what solve takes on trust: poses and twists that are finite, rotations that "
             "are\northonormal, an inverse_inertia that is symmetric and positive semidefinite. "
             "Raises\nValueError for the first that is wrong. Use it while you write an engine.")
        .def("derivative", derivative, nb::arg("pose") = false, nb::arg("velocity") = false,
             nb::arg("fields") = std::vector<std::string>(), nb::arg("material") = 0,
             "Derivatives of the step just solved (docs/gradients.md), before advance(): a dict of "
             "arrays.\nW: force and torque of each foot, V: new_velocity; row or column 6 f + k: "
             "number k of foot f.\nlaw: (feet, 6, 6) dW/dV of each foot alone. wrench_by_free, "
             "velocity_by_free: (6 feet, 6 feet)\nby free_velocity. pose: also wrench_by_pose, by "
             "the feet's positions and turns about the world's\naxes. velocity: also "
             "wrench_by_velocity, by the present twists. fields: also wrench_by_material,\n"
             "(6 feet, fields), by these numbers of a material of the terrain. Raises RuntimeError "
             "without a\nsolve, ValueError where it has not converged.")
        .def("advance", advance,
             "Moves the memory of the ground to the end of the step just solved. Raises "
             "RuntimeError\nwithout one.")
        .def("reset", reset, "Forgets everything.")
        .def("elements", elements, nb::arg("foot") = 0,
             "What the elements of a foot did in the last solve: copies of depth [m], normal, "
             "tangent_x,\ntangent_y [N], point_x, point_y, point_z [m], flat [-], state (0 free, 1 "
             "unloading, 2 virgin),\nslip.")
        .def("element_depths", depths, nb::arg("foot") = 0,
             "Greatest depth of each element since touchdown [m]: (elements,), a view.")
        .def(
            "print_at",
            [](Ground &ground, double x, double y) {
                return mild_ground_imprint_at(ground.ground, x, y);
            },
            nb::arg("x"), nb::arg("y"),
            "Greatest depth [m] that the imprint at the world point (x, y) [m] remembers.")
        .def_prop_rw("state", get_state, set_state,
                     "What the ground remembers, as bytes. Raises ValueError for those of another "
                     "ground.")
        .def_prop_ro(
            "feet", [](Ground &ground) { return ground.feet; }, "Number of feet.")
        .def("__getstate__", keep)
        .def("__setstate__", restore)
        .def("__copy__",
             [](nb::handle self) { return nb::module_::import_("copy").attr("deepcopy")(self); });
    bind_input(type);
    bind_result(type);
}

NB_MODULE(_ground, module) {
    module.doc() = "The ground of mild (include/mild), without copies of arrays.";
    module.attr("__version__") = MILD_VERSION;
    bind_material(module);
    bind_terrain(module);
    bind_ground(module);
    bind_press(module);
    bind_fit(module);
    bind_batch(module);
    bind_xla(module);
}
