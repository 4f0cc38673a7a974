"""The Gymnasium environments: Gymnasium's checkers, episodes, seeds, rewards, memory, misuse."""
import argparse
import json
import os
import pathlib
import pickle
import sys
import tempfile
import unittest
import unittest.mock

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from mild import envs, gym

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "examples/python" / part) for part in ("", "plan")]
import gait  # noqa: E402
import plan  # noqa: E402
import policy  # noqa: E402

SHORT = {"task.episode": 1, "task.assist": False}


def make_vec(count=8, overrides=None, **keys):
    return gymnasium.make_vec("mild/SA01-v0", num_envs=count, threads=2, overrides={**SHORT, **(overrides or {})}, **keys)


def actions_of(env, step):
    return (1.5 * np.sin(0.3 * step + np.arange(env.action_space.shape[0] * env.action_space.shape[-1]))).reshape(
        env.action_space.shape).astype(np.float32)


def run_of(task):
    """Observations of environments after five steps, which robots tell apart; the environments are closed."""
    arrays = {name: np.empty(task.envs, bool) for name in ("done", "timeout", "valid")}
    history = np.empty((task.envs, task.frames, task.observation), np.float32)
    buffers = task.buffers(history=history, reward=np.empty(task.envs, np.float32), **arrays)
    task.reset(buffers)
    for _ in range(5):
        task.step(np.full((task.envs, task.actions), 0.3, np.float32), buffers)
    task.close()
    return history


def stepped(env, seed):
    """The same of a Gymnasium environment."""
    env.reset(seed=seed)
    return [env.step(np.full(env.action_space.shape, 0.3, np.float32))[0] for _ in range(5)][-1]


class Checkers(unittest.TestCase):
    def test_vector(self):
        env = make_vec()
        self.assertEqual(env.metadata["autoreset_mode"], AutoresetMode.SAME_STEP)
        observation, info = env.reset(seed=4)
        self.assertEqual(info, {})
        for step in range(130):
            self.assertIn(observation, env.observation_space)
            observation, reward, ended, truncated, info = env.step(actions_of(env, step))
            self.assertEqual((reward.shape, ended.dtype, truncated.dtype), ((8,), bool, bool))
            self.assertFalse((ended & truncated).any())
            self.assertTrue(np.isfinite(observation).all() and np.isfinite(reward).all())
        self.assertIn("SA01", repr(env))
        env = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
        env.reset()
        for step in range(130):
            info = env.step(actions_of(env, step))[4]
        env.close()


class Episodes(unittest.TestCase):
    def test_same_step(self):
        """The observation after an end is the first of the next episode; final_obs is what a twin that is not reset sees."""
        env, single = make_vec(1), gymnasium.make("mild/SA01-v0", overrides=SHORT)
        observation, _ = env.reset(seed=9)
        other, _ = single.reset(seed=9)
        np.testing.assert_array_equal(observation[0], other)
        for step in range(200):
            observation, reward, ended, truncated, info = env.step(actions_of(env, step))
            other, paid, other_ended, other_truncated, last = single.step(actions_of(env, step)[0])
            self.assertEqual((reward[0], ended[0], truncated[0]), (np.float32(paid), other_ended, other_truncated))
            if ended[0] or truncated[0]:
                break
            np.testing.assert_array_equal(observation[0], other)
        self.assertTrue(info["_final_obs"][0] and info["_final_info"][0])
        np.testing.assert_array_equal(info["final_obs"][0], other)
        self.assertGreater(np.abs(observation[0] - other).max(), 0.01)
        self.assertEqual(set(last["reward_terms"]), set(single.unwrapped._envs.reward_names))
        with self.assertRaisesRegex(RuntimeError, "the episode has ended"):
            single.unwrapped.step(np.zeros(12))
        env.close()
        single.close()

    def test_reward_terms(self):
        """Where the sum is not clipped, the terms of an episode add up to its rewards."""
        env = make_vec(8, {"reward.clip_sum": False})
        env.reset(seed=2)
        paid, seen = np.zeros(8), 0
        for step in range(250):
            _, reward, ended, truncated, info = env.step(actions_of(env, step))
            paid += reward
            for i in np.flatnonzero(ended | truncated):
                total = info["final_info"]["reward_terms"][i].sum()
                self.assertAlmostEqual(total, paid[i], delta=1e-4 * max(1, abs(paid[i])))
                paid[i], seen = 0, seen + 1
            if info:  # rows that did not end have zeros, not what memory held
                goes_on = ~(ended | truncated)
                self.assertFalse(any(rows[goes_on].any() for rows in (info["final_obs"], info["final_info"]["reward_terms"], info["final_info"]["diverged"])))
        self.assertGreater(seen, 8)
        self.assertEqual(info["final_info"]["reward_terms"].shape if info else (8, len(env.reward_names)), (8, len(env.reward_names)))
        self.assertGreaterEqual(env.statistics()["episodes"], seen)
        env.close()

    def test_seeds(self):
        runs = []
        for seed in (5, 5, 6):
            env = make_vec(4)
            first, _ = env.reset(seed=seed)
            runs.append([first] + [env.step(actions_of(env, step))[0] for step in range(20)])
            self.assertEqual(env.np_random_seed, seed)
            again, _ = env.reset(seed=seed)
            np.testing.assert_array_equal(again, first)
            env.close()
        np.testing.assert_array_equal(runs[0], runs[1])
        self.assertGreater(np.abs(runs[0][-1] - runs[2][-1]).max(), 0.1)
        self.assertGreater(np.abs(runs[0][0][0] - runs[0][0][1]).max(), 0.01)  # environments differ


class Memory(unittest.TestCase):
    def test_no_copy(self):
        """The library writes into the array that the user gets, which is a new one each step."""
        env, made = make_vec(4), []
        make = env._arrays
        env._arrays = lambda: made.append(make()) or made[-1]
        observations = [env.reset()[0]] + [env.step(actions_of(env, step))[0] for step in range(3)]
        for arrays, observation in zip(made, observations, strict=True):
            self.assertTrue(np.shares_memory(arrays["history"], observation))
        self.assertFalse(any(np.shares_memory(a, b) for i, a in enumerate(observations) for b in observations[:i]))
        env.close()


    def test_every_array(self):
        """What each array of the buffers holds, without noise: the frame in the history and first in the critic's numbers, with
        the estimates behind it; the last of an episode in rows of their own."""
        quiet = {**SHORT, "task.observe_noise": False, "randomize.latency": (0, 0)}
        task, env = envs.open_envs(4, threads=1, overrides=quiet), gym.VectorEnv(4, overrides=quiet)
        arrays = env._arrays()
        for name, width in (("critic", task.critic), ("last_critic", task.critic), ("frame", task.observation),
                            ("estimate", task.estimates)):
            arrays[name] = np.full((4, width), np.nan, np.float32)
        with self.assertRaisesRegex(TypeError, "last_critic"):
            task.buffers(**{**arrays, "last": None})
        buffers = task.buffers(**arrays)
        task.reset(buffers)
        ended = 0
        for step in range(120):
            task.step(actions_of(env, step), buffers)
            frame = arrays["history"][:, -1]
            np.testing.assert_array_equal(arrays["frame"], frame)
            np.testing.assert_allclose(arrays["critic"][:, : task.observation], frame, atol=1e-5)
            np.testing.assert_array_equal(arrays["critic"][:, task.observation : task.observation + task.estimates],
                                          arrays["estimate"])
            done = arrays["done"]
            np.testing.assert_allclose(arrays["last_critic"][done, : task.observation], arrays["last"][done, -1], atol=1e-5)
            ended += done.sum()
        self.assertGreater(ended, 3)
        self.assertGreater(np.abs(arrays["estimate"]).max(), 0.01)
        task.close()
        env.close()


QUIET = {"task.assist": False, "task.observe_noise": False, "randomize.push_interval": 0, "train.robots": "batch", "train.grounds": 1,
         "randomize.patch_share": 0, "task.physics_dt": 0.005}


class Fork(unittest.TestCase):
    def open(self, count, seed=1):
        task = envs.open_envs(count, overrides=QUIET, seed=seed, threads=2)
        self.addCleanup(task.close)
        flags = {name: np.zeros(count, np.uint8) for name in ("done", "timeout", "valid")}
        history = np.zeros((count, task.frames, task.observation), np.float32)
        buffers = task.buffers(history=history, reward=np.zeros(count, np.float32), **flags)
        task.reset(buffers)
        return task, buffers, history

    def test_all_do_the_same(self):
        plant, buffers, seen = self.open(3)
        planner, more, all_seen = self.open(8)
        for step in range(5):
            plant.step(np.float32(0.3 * np.sin(step + np.arange(36)).reshape(3, 12)), buffers)
        blocks = np.zeros((2, plant.block_bytes), np.uint8)
        plant.save(blocks, first=1)
        planner.fork(blocks)
        for _ in range(5):
            plant.step(np.full((3, 12), 0.2, np.float32), buffers)
            planner.step(np.full((8, 12), 0.2, np.float32), more)
        np.testing.assert_array_equal(all_seen, seen[np.repeat([1, 2], 4)])
        qpos, torque = np.zeros((8, 19), np.float32), np.zeros((8, 12), np.float32)
        planner.read(qpos=qpos, torque=torque)
        self.assertTrue((qpos[:4] == qpos[0]).all() and (qpos[0] != qpos[4]).any() and torque.all())

    def test_misuse(self):
        task, buffers, _ = self.open(4)
        blocks = np.zeros((3, task.block_bytes), np.uint8)
        for call, text in ((lambda: task.fork(blocks), "3 blocks"), (lambda: task.fork(blocks[:1, :-16].copy()), "block of"),
                           (lambda: task.save(blocks[0]), "blocks"), (lambda: task.fork(None), "blocks")):
            with self.assertRaisesRegex((ValueError, TypeError), text):
                call()
        with self.assertRaisesRegex(IndexError, "environment 4"):
            task.save(blocks, first=2)
        other = envs.open_envs(4, threads=2)
        self.addCleanup(other.close)
        self.assertEqual(other.block_bytes, 0)
        with self.assertRaisesRegex(RuntimeError, "reset"):
            other.save(blocks)


class Plan(unittest.TestCase):
    """examples/python/plan."""

    def test_walks(self):
        """A plan of few samples keeps the Go1 up, and goes forward; the policy of another robot is refused."""
        given = argparse.Namespace(robot="go1", ground="foam45", believes="rigid", speed=0.5, seconds=1.5, samples=6, trials=2, seed=1, device="cpu",
                                   threads=1, policy="", jump=0)
        numbers = json.loads((ROOT / "examples/python/plan/plan.json").read_text())["go1"]
        result, path = plan.walk(given, numbers, log=None)
        self.assertEqual((result["upright"], path.shape), (2, (150, 2, 19)))
        self.assertTrue(all(0.5 < trial["forward"] < 0.9 for trial in result["trials"]), result)
        given.policy = str(ROOT / "policies/g1.safetensors")
        with self.assertRaisesRegex(ValueError, "g1.safetensors is not a policy of go1"):
            plan.walk(given, numbers, log=None)

    def test_jumps(self):
        """A plan of few samples throws the Go1 up as high as it is told."""
        given = argparse.Namespace(robot="go1", ground="rigid", believes="", speed=0, seconds=0.5, samples=24, trials=2, seed=1, device="cpu",
                                   threads=1, policy="", jump=0.15)
        result, path = plan.walk(given, json.loads((ROOT / "examples/python/plan/plan.json").read_text())["go1"], log=None)
        for trial, z in zip(result["trials"], path[:, :, 2].T):
            self.assertEqual((trial["upright"], trial["highest"]), (0.5, z.max()))
            self.assertAlmostEqual(trial["highest"], 0.32 + 0.15, delta=0.05)

    def test_film(self):
        """Each step of a path is shown at its time, then the film ends."""
        shown, path = [], np.random.default_rng(1).normal(size=(3, 19))
        film = unittest.mock.Mock()
        film.show = lambda walker: shown.append((walker.data.time, walker.data.qpos.copy()))
        with unittest.mock.patch("mild.trials.Film", return_value=film) as made:
            plan.film("go1", path, "walk.mp4")
        made.assert_called_once_with("walk.mp4")
        film.close.assert_called_once_with()
        np.testing.assert_allclose([time for time, _ in shown], [0, 0.01, 0.02], atol=1e-12)
        np.testing.assert_array_equal([qpos for _, qpos in shown], path)

    def test_mirror(self):
        """Half a period later each joint does what its mirror image did."""
        for robot, numbers in json.loads((ROOT / "examples/python/plan/plan.json").read_text()).items():
            ini = gait.robot_ini(ROOT / "robots" / robot / "robot.ini")
            joints, mirror = (ini["joints"][key].split() for key in ("names", "mirror"))
            sign, phase = np.array(ini["joints"]["mirror_sign"].split(), float), np.linspace(-1, 1, 23)
            walk = gait.Gait(ini, numbers["gait"], 0.5)
            (now, swings), (later, swing_later) = walk.actions(phase), walk.actions(phase + 0.5)
            image = [joints.index(name) for name in mirror]
            np.testing.assert_allclose(later, sign * now[:, image], atol=1e-9, err_msg=robot)
            np.testing.assert_array_equal(swing_later, swings[:, image])

    def test_policy(self):
        """Over histories of an environment the planner's policy does what the policy of one frame after the other does."""
        path = ROOT / "policies/go1.safetensors"
        ours, one = gait.Policy(plan.Arrays("cpu"), str(path), "go1"), policy.Policy(path)
        robots = plan.Robots(plan.Arrays("cpu"), 1, "go1", {**plan.KEYS, **ours.keys}, "cpu", 1, 1)
        for _ in range(60):
            action = ours.act(np.array(robots.history))
            np.testing.assert_allclose(action[0], one.act(np.array(robots.frame[0], float)), rtol=0, atol=2e-3)
            robots.step(action.astype(np.float32))
        robots.close()


class Misuse(unittest.TestCase):
    def test_arguments(self):
        for keys, name in (({"overrides": 3}, "overrides"), ({"config": 0}, "config"), ({"overrides": {"task.vxx": 1}}, "task.vx"),
                           ({"overrides": {"task.vx": "fast"}}, "task.vx"), ({"overrides": {"task.vx": object()}}, "task.vx"), ({"overrides": {"train.envs": 3}}, "train.envs"),
                           ({"config": "configs/none.ini"}, "none.ini"), ({"robot": "cat"}, "cat"), ({"observation": "all"}, "observation"),
                           ({"device": "tpu"}, "device"), ({"render_mode": "human"}, "render_mode"), ({"wheels": 4}, "wheels"),
                           ({"overrides": {"train.robots": "batch"}}, None)):
            if name:
                with self.assertRaisesRegex((ValueError, TypeError, OSError), name):
                    gym.VectorEnv(2, **keys)
        for count in (0, -1, "many", 1.5):
            with self.assertRaisesRegex((ValueError, TypeError), "envs"):
                gym.VectorEnv(count)

    def test_calls(self):
        env = make_vec(2)
        with self.assertRaisesRegex(RuntimeError, "reset"):
            env.step(actions_of(env, 0))
        env.reset()
        for action in (np.zeros((2, 11)), np.zeros(12), np.zeros((3, 12)), 0, np.zeros((2, 12, 1))):
            with self.assertRaisesRegex(ValueError, "action"):
                env.step(action)
        for action in ("fast", None, [[object()] * 12] * 2):
            with self.assertRaises((ValueError, TypeError)):
                env.step(action)
        for seed in (-1, 2**64, 1.5, "one", [1, 2]):
            with self.assertRaisesRegex((ValueError, TypeError), "seed"):
                env.reset(seed=seed)
        with self.assertRaisesRegex(ValueError, "reset_mask"):
            env.reset(options={"reset_mask": np.ones(2, bool)})
        env.close()
        env.close()
        for call in (lambda: env.step(actions_of(env, 0)), env.reset, env.statistics):
            with self.assertRaisesRegex(RuntimeError, "closed"):
                call()

    def test_actions(self):
        """An action that is not finite is refused with its place, and the step was not made."""
        for bad in (np.nan, np.inf, -np.inf):
            env, twin = make_vec(3), make_vec(3)
            env.reset(seed=1), twin.reset(seed=1)
            wrong = actions_of(env, 0)
            wrong[1, 7] = bad
            with self.assertRaisesRegex(ValueError, r"^action: -?(nan|inf) at \[1, 7\], but it must be finite$"):
                env.step(wrong)
            np.testing.assert_array_equal(env.step(actions_of(env, 1))[0], twin.step(actions_of(env, 1))[0])
            env.close(), twin.close()
            single = gymnasium.make("mild/SA01-v0", overrides=SHORT, disable_env_checker=True)
            single.reset()
            with self.assertRaisesRegex(ValueError, r"action: .* at \[0, 7\]"):
                single.step(wrong[1])
            single.close()

    def test_config_holds(self):
        """What a config says of robot, number, threads and seed holds unless an argument says otherwise."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "mine.ini")
            with open(path, "w", encoding="utf-8") as file:
                file.write("[train]\nrobot = go1\nenvs = 3\nseed = 77\nthreads = 1\n")
            runs = {name: run_of(envs.open_envs(**keys)) for name, keys in (
                ("config", {"config": path}), ("said", {"num_envs": 3, "robot": "go1", "seed": 77, "config": path}),
                ("sa01", {"config": path, "robot": "sa01"}), ("seed", {"config": path, "seed": 78}),
                ("two", {"config": path, "num_envs": 2}), ("other", {"num_envs": 3, "threads": 1}))}
            np.testing.assert_array_equal(runs["config"], runs["said"])
            self.assertEqual((len(runs["config"]), len(runs["two"])), (3, 2))
            self.assertFalse(np.array_equal(runs["config"], runs["sa01"]) or np.array_equal(runs["config"], runs["seed"]))
            self.assertFalse(np.array_equal(runs["sa01"], runs["other"]))  # its seed
            env = gym.VectorEnv(config=path)
            self.assertEqual((env.num_envs, env.action_space.shape), (3, (3, 12)))
            np.testing.assert_array_equal(stepped(env, 77).reshape(runs["config"].shape), runs["config"])
            env.close()
            with self.assertRaisesRegex(ValueError, "train.robot"):
                envs.open_envs(robot="go1", overrides={"train.robot": "sa01"})
            np.testing.assert_array_equal(run_of(envs.open_envs(config=path, overrides={"train.seed": 78})), runs["seed"])
            with open(path, "a", encoding="utf-8") as file:
                file.write("robots = batch\ndevice = cuda\n")
            with self.assertRaisesRegex(ValueError, "train.device|CUDA|cuda"):
                gym.VectorEnv(config=path)

    def test_batch_engine(self):
        """Its environments cannot report the end of an episode, and say so."""
        env = gym.VectorEnv(2, overrides={"train.robots": "batch", "randomize.patch_share": 0, "train.grounds": 4})
        env.reset()
        with self.assertRaisesRegex(ValueError, "train.robots"):
            env.step(np.zeros((2, 12)))
        env.close()

    def test_buffers(self):
        """Arrays that do not fit, each in one way."""
        task, env = envs.open_envs(3, threads=1), gym.VectorEnv(3)
        good = env._arrays()
        task.reset(task.buffers(**good))
        for name, array in good.items():
            read_only = array.copy()
            read_only.flags.writeable = False
            for bad in (array[:-1], array.astype(np.float64), np.repeat(array, 2, 0)[::2], array[..., None], "text", 5, read_only,
                        np.asfortranarray(array) if array.ndim > 1 else array[None]):
                with self.assertRaisesRegex((ValueError, TypeError), "^" + name + ":"):
                    task.buffers(**{**good, name: bad})
        names = list(good)
        for one, other in ((a, b) for i, a in enumerate(names) for b in names[:i]):
            memory = np.zeros(good[one].nbytes + good[other].nbytes, np.uint8)
            shared = {name: memory[: good[name].nbytes].view(good[name].dtype).reshape(good[name].shape) for name in (one, other)}
            with self.assertRaisesRegex(ValueError, rf"^({one}, {other}|{other}, {one}): "):
                task.buffers(**{**good, **shared})
        with self.assertRaisesRegex(ValueError, "action"):
            task.step(good["history"].reshape(-1)[:36].reshape(3, 12), task.buffers(**good))
        with self.assertRaisesRegex(ValueError, "buffers"):
            task.step(np.zeros((3, 12), np.float32), envs.open_envs(2).buffers(**gym.VectorEnv(2)._arrays()))
        with self.assertRaises(TypeError):
            pickle.dumps(task)
        task.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            task.reset(task.buffers(**good))
        env.close()

    def test_fork(self):
        """A fork has none of the threads: an exception there, not a wait without end."""
        env = make_vec(2)
        env.reset()
        child = os.fork()
        if child == 0:
            try:
                env.step(actions_of(env, 0))
            except RuntimeError as error:
                os._exit(0 if "process" in str(error) else 1)
            os._exit(2)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        env.step(actions_of(env, 0))
        env.close()


if __name__ == "__main__":
    unittest.main()
