/* mild.Batch: the ground under many robots (include/mild/batch.h), on the CPU or a CUDA device. */
#include "ground.h"

#include <cstring>

Batch::~Batch() {
    xla_forget(*this);
    mild_batch_destroy(batch);
}

static MildBatch *open_batch(const Batch &batch) {
    if (!batch.batch) {
        raise(PyExc_RuntimeError, "Batch: it is closed");
    }
    return batch.batch;
}

static int device_of(const std::string &name) {
    if (name == "cpu") {
        return MILD_BATCH_HOST;
    }
    if (name == "cuda") {
        return 0;
    }
    int number = -1, end = 0;
    const bool good = std::sscanf(name.c_str(), "cuda:%3d%n", &number, &end) == 1 &&
                      end == (int)name.size() && number >= 0;
    if (!good) {
        raise(PyExc_ValueError, "device: '" + name + "' is neither cpu nor cuda:N");
    }
    return number;
}

static void make(Batch *at, int robots, const nb::sequence &soles, double dt, double tolerance,
                 int max_iterations, const std::string &device, bool points) {
    const nb::tuple kept(soles);
    const std::vector<const MildSole *> made = soles_of(kept);
    const MildBatchDef def = {robots,    (int)made.size(), made.data(),       dt,
                              tolerance, max_iterations,   device_of(device), points};
    MildError error = {};
    MildBatch *batch = mild_batch_create(&def, &error);
    check(batch ? MILD_OK : error.status, error);
    new (at) Batch;
    at->batch = batch;
    at->robots = robots;
    at->feet = (int)made.size();
    at->device = def.device;
    for (const MildSole *sole : made) {
        at->elements.push_back(mild_sole_elements(sole));
    }
}

/* material: of robots that stand. */
static void set_materials(Batch &batch, nb::handle materials, nb::handle material) {
    Entered entered(batch.busy, "Batch.set_materials");
    MildBatch *at = open_batch(batch);
    const std::vector<MildMaterial> list = materials_of(materials);
    MildError error = {};
    if (list.empty()) {
        raise(PyExc_ValueError, "materials: at least one is needed");
    }
    if (material.is_none()) {
        check(mild_batch_set_materials(at, list.data(), (int)list.size(), &error), error);
    } else {
        const std::vector<int32_t> index = nb::cast<std::vector<int32_t>>(material);
        if (index.size() != (size_t)(batch.robots * batch.labels)) {
            raise(PyExc_ValueError, "material: " + std::to_string(index.size()) +
                                        " numbers, but the robots stand on " +
                                        std::to_string(batch.robots * batch.labels));
        }
        check(mild_batch_change_materials(at, list.data(), (int)list.size(), index.data(), &error),
              error);
    }
    batch.materials = (int)list.size();
}

static void set_map(Batch &batch, nb::handle map) {
    Entered entered(batch.busy, "Batch.set_map");
    const MildMap *made = map_of(map);
    MildError error = {};
    check(mild_batch_set_map(open_batch(batch), made, &error), error);
    batch.has_map = made != nullptr;
    batch.labels = made ? mild_map_label_count(made) : 1;
}

/* ---- a step ---- */

/* Indices on the CPU are checked; those on a device are the caller's. */
static void check_materials(const Batch &batch, const Array &material, size_t count) {
    const int32_t *index = pointer<int32_t>(material);
    for (size_t i = 0; batch.device < 0 && index && i < count; i++) {
        if (index[i] < 0 || index[i] >= batch.materials) {
            raise(PyExc_ValueError, "material: " + std::to_string(index[i]) + " is outside 0 .. " +
                                        std::to_string(batch.materials - 1));
        }
    }
}

/* Arrays of a step in the order of its arguments. */
struct StepArrays {
    Array position, rotation, velocity, inverse_inertia, free_velocity, material, height,
        map_origin, wrench, new_velocity, foot, elements, residual, iterations;
};

/* Outputs have memory of their own, but for the two pairs that batch.h allows. */
static void check_memory(const StepArrays &a) {
    const Array none;
    const Array *velocity = a.velocity.data == a.wrench.data ? &none : &a.velocity;
    const Array *free_velocity =
        a.free_velocity.data == a.new_velocity.data ? &none : &a.free_velocity;
    check_apart({&a.position, &a.rotation, velocity, &a.inverse_inertia, free_velocity, &a.material,
                 &a.height, &a.map_origin, &a.wrench, &a.new_velocity, &a.foot, &a.elements,
                 &a.residual, &a.iterations});
}

static void step(Batch &batch, nb::handle position, nb::handle rotation, nb::handle velocity,
                 nb::handle inverse_inertia, nb::handle free_velocity, nb::handle wrench,
                 nb::handle new_velocity, nb::handle material, nb::handle height,
                 nb::handle map_origin, nb::handle foot, nb::handle elements, nb::handle residual,
                 nb::handle iterations, bool advance, uintptr_t stream) {
    Entered entered(batch.busy, "Batch.step");
    MildBatch *at = open_batch(batch);
    const int64_t n = batch.robots, feet = batch.feet, stride = mild_batch_stride(at);
    const nb::dlpack::dtype real = nb::dtype<float>(), whole = nb::dtype<int32_t>();
    const int where = batch.device;
    const std::vector<int64_t> per_label =
        batch.labels > 1 ? std::vector<int64_t>{n, batch.labels} : std::vector<int64_t>{n};
    StepArrays a;
    a.position = take_array(position, {"position", real, {n, feet, 3}, where});
    a.rotation = take_array(rotation, {"rotation", real, {n, feet, 3, 3}, where});
    a.velocity = take_array(velocity, {"velocity", real, {n, feet, 6}, where});
    a.inverse_inertia =
        take_array(inverse_inertia, {"inverse_inertia", real, {n, 6 * feet, 6 * feet}, where});
    a.free_velocity = take_array(free_velocity, {"free_velocity", real, {n, feet, 6}, where});
    a.material = take_optional(material, {"material", whole, per_label, where});
    a.height = take_optional(height, {"height", real, {n}, where});
    a.map_origin = take_optional(map_origin, {"map_origin", real, {n, 2}, where});
    a.wrench = take_array(wrench, {"wrench", real, {n, feet, 6}, where, true});
    a.new_velocity = take_array(new_velocity, {"new_velocity", real, {n, feet, 6}, where, true});
    a.foot = take_optional(foot, {"foot", real, {n, feet, 6}, where, true});
    a.elements = take_optional(elements, {"elements", real, {n, 4, feet, stride}, where, true});
    a.residual = take_optional(residual, {"residual", real, {n}, where, true});
    a.iterations = take_optional(iterations, {"iterations", whole, {n}, where, true});
    static_assert(sizeof(MildBatchFoot) == 6 * sizeof(float), "a foot is six floats");
    check_memory(a);
    check_materials(batch, a.material, (size_t)(n * batch.labels));
    MildBatchInput input = {};
    input.position = pointer<float>(a.position);
    input.rotation = pointer<float>(a.rotation);
    input.velocity = pointer<float>(a.velocity);
    input.inverse_inertia = pointer<float>(a.inverse_inertia);
    input.free_velocity = pointer<float>(a.free_velocity);
    input.material = pointer<int32_t>(a.material);
    input.height = pointer<float>(a.height);
    input.map_origin = pointer<float>(a.map_origin);
    MildBatchOutput output = {};
    output.wrench = pointer<float>(a.wrench);
    output.velocity = pointer<float>(a.new_velocity);
    output.foot = pointer<MildBatchFoot>(a.foot);
    output.elements = pointer<float>(a.elements);
    output.residual = pointer<float>(a.residual);
    output.iterations = pointer<int32_t>(a.iterations);
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = mild_batch_step(at, &input, &output, advance, stream_of(stream), &error);
    }
    check(status, error);
}

static void reset(Batch &batch, nb::handle which, uintptr_t stream) {
    Entered entered(batch.busy, "Batch.reset");
    MildBatch *at = open_batch(batch);
    const Array flags =
        take_optional(which, {"which", nb::dtype<uint8_t>(), {batch.robots}, batch.device});
    MildError error = {};
    check(mild_batch_reset(at, pointer<uint8_t>(flags), stream_of(stream), &error), error);
}

/* ---- between grounds of the CPU and robots ---- */

static MildGround *robot_ground(const Batch &batch, int robot, nb::handle ground) {
    if (robot < 0 || robot >= batch.robots) {
        raise(PyExc_IndexError, "robot = " + std::to_string(robot) + ", but there are " +
                                    std::to_string(batch.robots));
    }
    return block_of(ground);
}

static void load(Batch &batch, int robot, nb::handle ground) {
    Entered entered(batch.busy, "Batch.load");
    MildError error = {};
    check(mild_batch_load(open_batch(batch), robot, robot_ground(batch, robot, ground), &error),
          error);
}

static void store(Batch &batch, int robot, nb::handle ground) {
    Entered entered(batch.busy, "Batch.store");
    MildError error = {};
    check(mild_batch_store(open_batch(batch), robot, robot_ground(batch, robot, ground), &error),
          error);
}

static void close_batch(Batch &batch) {
    Entered entered(batch.busy, "Batch.close");
    MildBatch *at = batch.batch;
    batch.batch = nullptr;
    mild_batch_destroy(at);
}

void bind_batch(nb::module_ &module) {
    nb::class_<Batch>(
        module, "Batch",
        "Ground under many robots at once, in float (include/mild/batch.h).\n\n"
        "robots; soles: 1 .. 9 Sole of each robot, at most four plane ones, then shells of other "
        "bodies;\ndt [s]; tolerance [-] and max_iterations of Newton's method, 0: the defaults; "
        "device: cpu, cuda\nor cuda:N; points: no plane sole transmits a moment: its rows and "
        "columns of moments of every\ninverse_inertia are 0 (faster on three or four of up to "
        "eight elements). Raises ValueError for a\nnumber out of range, for a sole with too many "
        "elements or out of order, and without the device.")
        .def("__init__", make, nb::arg("robots"), nb::arg("soles"), nb::arg("dt"), nb::kw_only(),
             nb::arg("tolerance") = 0.0, nb::arg("max_iterations") = 0, nb::arg("device") = "cpu",
             nb::arg("points") = false)
        .def("set_materials", set_materials, nb::arg("materials"),
             nb::arg("material").none() = nb::none(),
             "The table that `material` of step points into: Material or presets. Waits for the "
             "device. material:\na flat list, as in the last step: standing robots are not thrown.")
        .def("set_map", set_map, nb::arg("map").none(),
             "Puts the robots on a Map; None: on level ground. All forget what the ground "
             "remembers.")
        .def("step", step, nb::arg("position").none(), nb::arg("rotation").none(),
             nb::arg("velocity").none(), nb::arg("inverse_inertia").none(),
             nb::arg("free_velocity").none(), nb::kw_only(), nb::arg("wrench").none(),
             nb::arg("new_velocity").none(), nb::arg("material").none() = nb::none(),
             nb::arg("height").none() = nb::none(), nb::arg("map_origin").none() = nb::none(),
             nb::arg("foot").none() = nb::none(), nb::arg("elements").none() = nb::none(),
             nb::arg("residual").none() = nb::none(), nb::arg("iterations").none() = nb::none(),
             nb::arg("advance") = true, nb::arg("stream") = 0,
             "Solves a contact step of every robot and, with `advance`, keeps it.\n\n"
             "Arrays, float32 but where said, contiguous, on the device of the batch: NumPy, or "
             "what has\n__dlpack__. None is copied. Inputs: position (robots, feet, 3) [m]; "
             "rotation (robots, feet,\n3, 3); velocity (robots, feet, 6) [m/s, rad/s]; "
             "inverse_inertia (robots, 6 feet, 6 feet);\nfree_velocity (robots, feet, 6); material "
             "int32 (robots,), with a map of several labels\n(robots, labels); height (robots,) "
             "[m]; map_origin (robots, 2) [m]. Outputs: wrench (robots,\nfeet, 6) [N, N m]; "
             "new_velocity (robots, feet, 6); foot (robots, feet, 6): pressure centre,\n"
             "depth_max, depth_mean [m], area [m^2]; elements (robots, 4, feet, stride); residual "
             "(robots,);\niterations int32 (robots,). With shells no elements. stream: e.g.\n"
             "torch.cuda.current_stream().cuda_stream; the call only puts work into it. wrench may "
             "be the\narray of velocity and new_velocity that of free_velocity; else outputs share "
             "no memory with\nany array. Raises TypeError or ValueError with the name of the array "
             "that does not fit.")
        .def("reset", reset, nb::arg("which").none() = nb::none(), nb::arg("stream") = 0,
             "Robots whose flag in `which`, (robots,) bool or uint8 on the device, is not 0 forget "
             "all;\nNone: all robots.")
        .def("load", load, nb::arg("robot"), nb::arg("ground"),
             "Sets what the ground under a robot remembers to what a Ground of the same soles "
             "does.")
        .def("store", store, nb::arg("robot"), nb::arg("ground"), "The other way.")
        .def("close", close_batch, "Frees the memory; further calls raise RuntimeError.")
        .def_prop_ro(
            "robots", [](const Batch &b) { return b.robots; }, "Number of robots.")
        .def_prop_ro(
            "feet", [](const Batch &b) { return b.feet; }, "Feet of each.")
        .def_prop_ro(
            "stride", [](const Batch &batch) { return mild_batch_stride(open_batch(batch)); },
            "Last dimension of `elements`: elements of a foot, rounded up.")
        .def_prop_ro(
            "robot_bytes",
            [](const Batch &batch) { return mild_batch_robot_bytes(open_batch(batch)); },
            "Memory of one robot [B].");
}
