/* The module mild._envs: environments of the task (src/run/envs/envs.h) on arrays of the caller. */
#include "arrays.h"

#include <cmath>
#include <memory>
#include <optional>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/unique_ptr.h>
#include <sys/types.h>
#include <unistd.h>

extern "C" {
#include "run/envs/envs.h"
}

/* Where results of a step go. Its arrays are kept as long as it is. */
struct Buffers {
    MildEnvsShape shape = {}; /* of the environments that they are for */
    EnvsStep step = {};
    std::vector<Array> arrays;
};

struct Envs {
    MildEnvs *envs = nullptr;
    MildEnvsShape shape = {};
    pid_t process = 0; /* a fork has none of the threads */
    bool begun = false;
    std::atomic<bool> busy{false};

    Envs() = default;
    Envs(const Envs &) = delete;
    ~Envs() {
        if (process == getpid()) {
            mild_envs_close(envs);
        }
    }
};

static MildEnvs *open_envs(const Envs &envs) {
    if (!envs.envs) {
        raise(PyExc_RuntimeError, "Envs: they are closed");
    }
    if (envs.process != getpid()) {
        raise(PyExc_RuntimeError, "Envs: opened in another process, whose threads a fork does not "
                                  "have; open them in this one");
    }
    return envs.envs;
}

static void make(Envs *at, const std::optional<std::string> &config,
                 const std::vector<std::string> &overrides) {
    std::vector<const char *> keys;
    for (const std::string &key : overrides) {
        keys.push_back(key.c_str());
    }
    MildError error = {};
    MildEnvs *envs =
        mild_envs_open(config ? config->c_str() : nullptr, keys.data(), (int)keys.size(), &error);
    check(envs ? MILD_OK : error.status, error);
    new (at) Envs;
    at->envs = envs;
    at->shape = mild_envs_shape(envs);
    at->process = getpid();
}

static void close_envs(Envs &envs) {
    Entered entered(envs.busy, "Envs.close");
    if (envs.envs) {
        MildEnvs *at = open_envs(envs);
        envs.envs = nullptr;
        mild_envs_close(at);
    }
}

/* ---- arrays ---- */

static float *view_row(Buffers &buffers, nb::handle array, const char *name,
                       std::vector<int64_t> shape, int device) {
    buffers.arrays.push_back(
        take_optional(array, {name, nb::dtype<float>(), std::move(shape), device, true}));
    return pointer<float>(buffers.arrays.back());
}

static uint8_t *flag_row(Buffers &buffers, nb::handle array, const char *name, const Envs &envs) {
    buffers.arrays.push_back(take_array(
        array, {name, nb::dtype<uint8_t>(), {envs.shape.envs}, envs.shape.device, true}));
    return pointer<uint8_t>(buffers.arrays.back());
}

static std::unique_ptr<Buffers> make_buffers(const Envs &envs, nb::handle history,
                                             nb::handle reward, nb::handle done, nb::handle timeout,
                                             nb::handle valid, nb::handle critic, nb::handle frame,
                                             nb::handle estimate, nb::handle last,
                                             nb::handle last_critic, nb::handle terms) {
    const MildEnvsShape &shape = envs.shape;
    const int64_t n = shape.envs;
    const int where = shape.device;
    const std::vector<int64_t> frames = {n, shape.frames, shape.observation};
    auto buffers = std::make_unique<Buffers>();
    EnvsStep &step = buffers->step;
    if (history.is_none() || reward.is_none()) {
        raise(PyExc_TypeError, "history, reward: they must be arrays");
    }
    if (last.is_none() && !last_critic.is_none()) {
        raise(PyExc_TypeError, "last_critic: it is written together with last, which is None");
    }
    step.next.history = view_row(*buffers, history, "history", frames, where);
    step.next.critic = view_row(*buffers, critic, "critic", {n, shape.critic}, where);
    step.next.frame = view_row(*buffers, frame, "frame", {n, shape.observation}, where);
    step.next.estimate = view_row(*buffers, estimate, "estimate", {n, shape.estimates}, where);
    step.last.history = view_row(*buffers, last, "last", frames, where);
    step.last.critic = view_row(*buffers, last_critic, "last_critic", {n, shape.critic}, where);
    step.terms = view_row(*buffers, terms, "terms", {n, shape.rewards}, where);
    step.reward = view_row(*buffers, reward, "reward", {n}, where);
    step.done = flag_row(*buffers, done, "done", envs);
    step.timeout = flag_row(*buffers, timeout, "timeout", envs);
    step.valid = flag_row(*buffers, valid, "valid", envs);
    buffers->shape = shape;
    std::vector<const Array *> arrays;
    for (const Array &array : buffers->arrays) {
        arrays.push_back(&array);
    }
    check_apart(arrays);
    return buffers;
}

/* ---- calls ---- */

/* Buffers are of these environments when they were made with their shape. */
static void check_buffers(const Envs &envs, const Buffers &buffers) {
    const MildEnvsShape &a = envs.shape, &b = buffers.shape;
    if (a.envs != b.envs || a.frames != b.frames || a.observation != b.observation ||
        a.critic != b.critic || a.estimates != b.estimates || a.rewards != b.rewards ||
        a.device != b.device) {
        raise(PyExc_ValueError, "buffers: they were made for environments of another shape");
    }
}

static void reset(Envs &envs, Buffers &buffers, uintptr_t stream) {
    Entered entered(envs.busy, "Envs.reset");
    MildEnvs *at = open_envs(envs);
    check_buffers(envs, buffers);
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = mild_envs_reset(at, &buffers.step.next, stream_of(stream), &error);
    }
    check(status, error);
    envs.begun = true;
}

/* On the CPU; on a device the caller's. One NaN would spread over the robot and into statistics. */
static void check_action(const Envs &envs, const Array &action) {
    const MildEnvsShape &shape = envs.shape;
    const float *at = pointer<float>(action);
    for (int i = 0; shape.device < 0 && i < shape.envs; i++) {
        for (int k = 0; k < shape.actions; k++, at++) {
            if (!std::isfinite(*at)) {
                raise(PyExc_ValueError, "action: " + std::to_string(*at) + " at [" +
                                            std::to_string(i) + ", " + std::to_string(k) +
                                            "], but it must be finite");
            }
        }
    }
}

static void step(Envs &envs, nb::handle action, Buffers &buffers, uintptr_t stream) {
    Entered entered(envs.busy, "Envs.step");
    MildEnvs *at = open_envs(envs);
    if (!envs.begun) {
        raise(PyExc_RuntimeError, "Envs.step: no episode has begun; call reset() first");
    }
    check_buffers(envs, buffers);
    const Array actions = take_array(
        action,
        {"action", nb::dtype<float>(), {envs.shape.envs, envs.shape.actions}, envs.shape.device});
    check_action(envs, actions);
    for (const Array &array : buffers.arrays) {
        check_apart(actions, array);
    }
    EnvsStep call = buffers.step;
    call.action = pointer<float>(actions);
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = mild_envs_step(at, &call, stream_of(stream), &error);
    }
    check(status, error);
}

/* ---- save and fork ---- */

static MildEnvs *begun_envs(const Envs &envs, const char *call) {
    MildEnvs *at = open_envs(envs);
    if (!envs.begun) {
        raise(PyExc_RuntimeError, std::string(call) + ": no episode has begun; call reset() first");
    }
    return at;
}

/* Blocks of as many bytes as the caller's have. */
static Array take_blocks(const Envs &envs, MildEnvs *at, nb::handle blocks, bool write,
                         std::vector<int64_t> &shape) {
    if (mild_envs_block_bytes(at, 0) == 0) {
        raise(PyExc_ValueError,
              "blocks: MuJoCo steps these environments; set train.robots = batch");
    }
    const int64_t bytes = (int64_t)mild_envs_block_bytes(at, 0);
    shape = {1, bytes};
    if (nb::hasattr(blocks, "shape")) {
        const nb::tuple own(blocks.attr("shape"));
        if (own.size() == 2) {
            shape[0] = nb::cast<int64_t>(own[0]);
            shape[1] = write ? bytes : nb::cast<int64_t>(own[1]);
        }
    }
    return take_array(blocks, {"blocks", nb::dtype<uint8_t>(), shape, envs.shape.device, write});
}

static size_t block_bytes(const Envs &envs) {
    return mild_envs_block_bytes(open_envs(envs), 0);
}

static void save(Envs &envs, nb::handle blocks, int first, uintptr_t stream) {
    Entered entered(envs.busy, "Envs.save");
    MildEnvs *at = begun_envs(envs, "Envs.save");
    std::vector<int64_t> shape;
    const Array to = take_blocks(envs, at, blocks, true, shape);
    if (first < 0 || first + shape[0] > envs.shape.envs) {
        raise(PyExc_IndexError, "save: there is no environment " +
                                    std::to_string(first < 0 ? first : first + shape[0] - 1));
    }
    MildError error = {};
    check(mild_envs_save(at, first, (int)shape[0], pointer<uint8_t>(to), stream_of(stream), &error),
          error);
}

static void fork_envs(Envs &envs, nb::handle blocks, bool own_ground, uintptr_t stream) {
    Entered entered(envs.busy, "Envs.fork");
    MildEnvs *at = begun_envs(envs, "Envs.fork");
    std::vector<int64_t> shape;
    const Array from = take_blocks(envs, at, blocks, false, shape);
    MildError error = {};
    MildStatus status;
    {
        nb::gil_scoped_release released;
        status = mild_envs_fork(at, pointer<uint8_t>(from), (int)shape[0], (size_t)shape[1],
                                own_ground, stream_of(stream), &error);
    }
    check(status, error);
}

static void read_motion(Envs &envs, nb::handle qpos, nb::handle qvel, nb::handle torque,
                        uintptr_t stream) {
    Entered entered(envs.busy, "Envs.read");
    MildEnvs *at = begun_envs(envs, "Envs.read");
    const int64_t n = envs.shape.envs, joints = envs.shape.actions;
    const int where = envs.shape.device;
    const Array a = take_optional(qpos, {"qpos", nb::dtype<float>(), {n, 7 + joints}, where, true});
    const Array b = take_optional(qvel, {"qvel", nb::dtype<float>(), {n, 6 + joints}, where, true});
    const Array c = take_optional(torque, {"torque", nb::dtype<float>(), {n, joints}, where, true});
    check_apart({&a, &b, &c});
    const EnvsMotion motion = {pointer<float>(a), pointer<float>(b), pointer<float>(c)};
    MildError error = {};
    check(mild_envs_read(at, &motion, stream_of(stream), &error), error);
}

static std::string model(const Envs &envs) {
    return mild_envs_model(open_envs(envs));
}

static std::string robot(const Envs &envs) {
    return mild_envs_robot(open_envs(envs));
}

static std::string task(const Envs &envs) {
    return mild_envs_task(open_envs(envs));
}

static std::vector<double> pose(Envs &envs, int index) {
    Entered entered(envs.busy, "Envs.pose");
    const MildEnvs *at = open_envs(envs);
    if (index < 0 || index >= envs.shape.envs) {
        raise(PyExc_IndexError, "pose: there is no environment " + std::to_string(index));
    }
    if (!envs.begun) {
        raise(PyExc_RuntimeError, "pose: reset() comes first");
    }
    std::vector<double> numbers(256);
    numbers.resize((size_t)mild_envs_pose(at, index, numbers.data(), (int)numbers.size()));
    if (numbers.empty()) {
        raise(PyExc_ValueError, "render_mode: the batch engine's robots cannot be drawn; set "
                                "overrides={'train.robots': 'mujoco'}");
    }
    return numbers;
}

static nb::dict statistics(Envs &envs, uintptr_t stream) {
    Entered entered(envs.busy, "Envs.statistics");
    EnvsStats of = {};
    MildError error = {};
    check(mild_envs_stats(open_envs(envs), &of, stream_of(stream), &error), error);
    nb::dict all;
    all["episodes"] = of.episodes;
    all["falls"] = of.falls;
    all["diverged"] = of.diverged;
    all["steps"] = of.steps;
    all["paid"] = of.paid;
    all["length"] = of.length;
    all["reward"] = of.reward;
    all["speed_error"] = of.speed_error;
    all["assist"] = of.assist;
    for (int i = 0; i < envs.shape.rewards; i++) {
        all[(std::string("reward.") + mild_envs_reward_name(i)).c_str()] = of.terms[i];
    }
    return all;
}

static nb::tuple mirror(Envs &envs) {
    const size_t observation = (size_t)envs.shape.observation, actions = (size_t)envs.shape.actions;
    std::vector<int> frame_index(observation), action_index(actions);
    std::vector<float> frame_sign(observation), action_sign(actions);
    mild_envs_mirror(open_envs(envs), frame_index.data(), frame_sign.data(), action_index.data(),
                     action_sign.data());
    return nb::make_tuple(nb::make_tuple(frame_index, frame_sign),
                          nb::make_tuple(action_index, action_sign));
}

template <typename T> static auto number(T MildEnvsShape::*member) {
    return [member](const Envs &envs) { return envs.shape.*member; };
}

static void bind_shape(nb::class_<Envs> &type) {
    type.def_prop_ro("envs", number(&MildEnvsShape::envs), "Environments.")
        .def_prop_ro("actions", number(&MildEnvsShape::actions), "Numbers of an action.")
        .def_prop_ro("observation", number(&MildEnvsShape::observation), "Numbers of a frame.")
        .def_prop_ro("frames", number(&MildEnvsShape::frames), "Frames of a history.")
        .def_prop_ro("critic", number(&MildEnvsShape::critic), "Numbers that a critic may see.")
        .def_prop_ro("estimates", number(&MildEnvsShape::estimates),
                     "True numbers that an estimator regresses on.")
        .def_prop_ro("rewards", number(&MildEnvsShape::rewards), "Terms of the reward.")
        .def_prop_ro("device", number(&MildEnvsShape::device),
                     "CUDA device of the arrays; -1: the CPU.")
        .def_prop_ro("period", number(&MildEnvsShape::period), "Policy step [s].")
        .def_prop_ro("episode", number(&MildEnvsShape::episode), "Longest episode [s].")
        .def_prop_ro("clip", number(&MildEnvsShape::clip), "Actions are clipped to -clip .. clip.")
        .def_prop_ro(
            "reward_names",
            [](const Envs &envs) {
                std::vector<std::string> names;
                for (int i = 0; i < envs.shape.rewards; i++) {
                    names.push_back(mild_envs_reward_name(i));
                }
                return names;
            },
            "Names of the terms of the reward.");
}

NB_MODULE(_envs, module) {
    module.doc() = "Environments of the task (docs/task.md) on arrays of the caller.";
    nb::class_<Buffers>(module, "Buffers", "Where results of a step go; see Envs.buffers.");
    nb::class_<Envs> type(
        module, "Envs",
        "train.envs environments. config: a file, or None; overrides: texts section.key=value.\n"
        "Raises ValueError with the key that is wrong.");
    type.def("__init__", make, nb::arg("config").none(), nb::arg("overrides"))
        .def("buffers", make_buffers, nb::kw_only(), nb::arg("history").none(),
             nb::arg("reward").none(), nb::arg("done").none(), nb::arg("timeout").none(),
             nb::arg("valid").none(), nb::arg("critic").none() = nb::none(),
             nb::arg("frame").none() = nb::none(), nb::arg("estimate").none() = nb::none(),
             nb::arg("last").none() = nb::none(), nb::arg("last_critic").none() = nb::none(),
             nb::arg("terms").none() = nb::none(),
             "Checks arrays once, for many steps. float32: history (envs, frames, observation), "
             "critic\n(envs, critic), frame (envs, observation), estimate (envs, estimates), terms "
             "(envs,\nrewards), reward (envs,), and last, with it last_critic: as history and "
             "critic at the end of\nepisodes, not of the batch engine. bool or uint8 (envs,): "
             "done, timeout, valid. On the device\nof the environments, no two in the same memory. "
             "Raises TypeError or ValueError with the\nname of the array that does not fit.")
        .def("reset", reset, nb::arg("buffers"), nb::arg("stream") = 0,
             "New episodes; writes history, critic, frame and estimate.")
        .def("step", step, nb::arg("action").none(), nb::arg("buffers"), nb::arg("stream") = 0,
             "A policy step. action: (envs, actions) float32 in units of the action scale; on the "
             "CPU\nValueError for one that is not finite. Environments that ended begin anew in "
             "the same step.")
        .def_prop_ro("block_bytes", block_bytes,
                     "Bytes of what save() writes; 0 where MuJoCo steps the robots.")
        .def("save", save, nb::arg("blocks").none(), nb::arg("first") = 0, nb::arg("stream") = 0,
             "Writes environments from `first` on to blocks: uint8 (count, block_bytes), on the "
             "device.\nRobot, ground under it and task; not its random numbers. Of the batch "
             "engine (train.robots: batch).")
        .def(
            "fork", fork_envs, nb::arg("blocks").none(), nb::arg("own_ground") = false,
            nb::arg("stream") = 0,
            "Puts blocks into all environments, the first into the first of as many equal groups, "
            "and so\non; of these or of others with the same keys but train.envs and "
            "task.physics_dt (and train.seed,\nif it draws the same grounds). own_ground: each "
            "keeps its ground. Where both are soft, robot\nand prints move up or down until the "
            "feet bear at rest what they bore; where one is\nrigid, prints go and the robot is set "
            "down as deep as it stands; randomize may differ, too.")
        .def("read", read_motion, nb::kw_only(), nb::arg("qpos").none() = nb::none(),
             nb::arg("qvel").none() = nb::none(), nb::arg("torque").none() = nb::none(),
             nb::arg("stream") = 0,
             "Writes where the robots are: float32 qpos (envs, 7 + joints) [m, -, rad], base, "
             "quaternion\nw x y z, joints; qvel (envs, 6 + joints) [m/s, rad/s], world axes, base "
             "axes, joints; torque\n(envs, joints) [N m] of the last physics step. Of the batch "
             "engine.")
        .def_prop_ro("model", model, "The robot's MJCF.")
        .def_prop_ro("robot", robot, "The robot's name.")
        .def_prop_ro("task", task, "What a policy's file says of how it walks.")
        .def("pose", pose, nb::arg("index"), "qpos of one robot for an mjData of that file.")
        .def("statistics", statistics, nb::arg("stream") = 0,
             "Means over the episodes that ended since the last call.")
        .def("mirror", mirror,
             "((index, sign) of a frame, (index, sign) of an action), left to right.")
        .def("close", close_envs, "Ends the threads; further calls raise RuntimeError.");
    bind_shape(type);
}
