"""Gymnasium's habits: names, check_env, ground=, max_episode_steps, render_mode. Pictures are drawn where PyOpenGL is."""
import importlib.util
import os
import pathlib
import tempfile
import unittest
import warnings

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

import mild
from mild import gym

DRAWS = importlib.util.find_spec("OpenGL") is not None
if DRAWS and not os.environ.get("DISPLAY"):
    os.environ.setdefault("MUJOCO_GL", "egl")


def walk(ground, steps=60, seed=5, name="mild/SA01-v0", **keys):
    """Observations of two robots whose joints get random target angles."""
    env = gymnasium.make_vec(name, num_envs=2, ground=ground, threads=1, **keys)
    random = np.random.default_rng(1)
    seen = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        seen.append(env.step(random.uniform(-0.3, 0.3, env.action_space.shape))[0])
    env.close()
    return np.array(seen)


class Names(unittest.TestCase):
    def test_check(self):
        """Each robot by its name passes Gymnasium's own check, on a ground of its own too."""
        joints = {"SA01": 12, "G1": 12, "Go1": 12}
        for name, count in joints.items():
            for keys in ({}, {"ground": "grass", "max_episode_steps": 100, "observation": "frame"}):
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # that spaces are not -1 .. 1
                    env = gymnasium.make(f"mild/{name}-v0", **keys)
                    check_env(env.unwrapped, skip_render_check=not DRAWS)
                self.assertEqual(env.action_space.shape, (count,))
                env.close()
        self.assertRegex(mild.__version__, r"^\d+\.\d+\.\d+$")

    def test_robots(self):
        """The name is the robot's, and keys of one's own go before its config."""
        for name in gym.ROBOTS:
            env = gymnasium.make(f"mild/{name}-v0")
            self.assertTrue(env.unwrapped._envs.model.endswith(f"robots/{name.lower()}/{name.lower()}.xml"))
            env.close()
        env = gymnasium.make("mild/G1-v0", config="configs/go1.ini")
        self.assertIn("go1", env.unwrapped._envs.model)
        env.close()


class Ground(unittest.TestCase):
    def test_same_ground(self):
        """A preset by its name, as a Material, as a file and by keys is the same ground to the last bit; another is another."""
        usual = walk("foam28")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mine.ini"
            mild.Material("foam28").save(path)
            for ground in (mild.Material("foam28"), path, str(path), ["foam28"], ("foam28", "foam28")):
                found = walk(ground)
                if isinstance(ground, tuple):  # two to draw from: the draws are others, the ground is not
                    self.assertEqual(found.shape, usual.shape)
                    continue
                np.testing.assert_array_equal(found, usual)
        keys = {"randomize.presets": "foam28", "randomize.preset_share": 1, "randomize.preset_jitter": 0, "randomize.rigid_share": 0,
                "randomize.patch_share": 0}
        np.testing.assert_array_equal(walk(None, overrides=keys), usual)
        for ground in ("rubber", "rigid", "clay", mild.Material("foam28", k_pen=100)):
            self.assertTrue((walk(ground) != usual).any(), ground)

    def test_arguments(self):
        for keys, error, words in (
                ({"ground": "gras"}, ValueError, "unknown ground 'gras'; nearest is 'grass'"),
                ({"ground": "nosuch.ini"}, Exception, "nosuch.ini"),
                ({"ground": ["rigid", "grass"]}, ValueError, "'rigid' is the engine's own contact; it stands alone"),
                ({"ground": []}, ValueError, "an empty list"),
                ({"ground": 3}, TypeError, "ground: a int"),
                ({"ground": ["clay", mild.Material(model="con_cone")]}, ValueError, "bekker and con_cone in one task"),
                ({"ground": "grass", "overrides": {"randomize.preset_share": 0.5}}, ValueError, "randomize.preset_share is what ground sets"),
                ({"max_episode_steps": 50, "overrides": {"task.episode": 1}}, ValueError, "task.episode is what max_episode_steps sets"),
                ({"max_episode_steps": 1}, ValueError, "task.episode"),
                ({"render_mode": "human"}, ValueError, "'human' is none of None, 'rgb_array'; gymnasium.wrappers.HumanRendering")):
            with self.assertRaisesRegex(error, words):
                gym.Env(**keys)


class Steps(unittest.TestCase):
    def test_max_episode_steps(self):
        """Told by make, or to an environment itself: no episode is longer, and the last step is a truncation."""
        still = {"randomize.push_interval": 0, "task.assist": True}
        for env in (gymnasium.make("mild/SA01-v0", max_episode_steps=40, overrides=still), gym.Env(max_episode_steps=40, overrides=still)):
            env.reset(seed=0)
            for _ in range(3):
                for length in range(1, 100):
                    *_, ended, truncated, _ = env.step(np.zeros(12))
                    if ended or truncated:
                        break
                self.assertTrue(truncated and not ended)
                self.assertLessEqual(length, 40)
                env.reset()
            self.assertEqual(length, 40)
            env.close()
        env = gymnasium.make_vec("mild/SA01-v0", num_envs=3, max_episode_steps=40, overrides=still)
        env.reset(seed=0)
        last = np.zeros(3)
        for t in range(1, 121):
            _, _, ended, truncated, _ = env.step(np.zeros((3, 12)))
            self.assertFalse(ended.any())
            self.assertTrue((t - last <= 40).all())
            last[truncated] = t
        env.close()


class Pictures(unittest.TestCase):
    def test_pose(self):
        """The pose that is drawn is that of an mjData of the robot's file: it walks there, and lies as its sensors say."""
        env = gym.VectorEnv(2, ground="rubber")
        with self.assertRaisesRegex(RuntimeError, "reset"):
            env._envs.pose(0)
        env.reset(seed=1)
        for _ in range(30):
            env.step(np.zeros((2, 12)))
        for i in range(2):
            pose = np.array(env._envs.pose(i))
            self.assertEqual(pose.shape, (19,))
            self.assertAlmostEqual(np.linalg.norm(pose[3:7]), 1, places=9)
            self.assertTrue(0.4 < pose[2] < 1.2, pose)
        with self.assertRaises(IndexError):
            env._envs.pose(2)
        env.close()
        env = gym.Env(overrides={"train.robots": "batch"})
        env.reset(seed=1)
        with self.assertRaisesRegex(ValueError, "batch engine"):
            env._envs.pose(0)
        env.close()

    @unittest.skipUnless(DRAWS, "no PyOpenGL")
    def test_render(self):
        env = gymnasium.make("mild/Go1-v0", render_mode="rgb_array", ground="grass")
        self.assertEqual(env.metadata["render_fps"], 100)
        env.reset(seed=1)
        first = env.render()
        self.assertEqual((first.shape, first.dtype), ((480, 640, 3), np.uint8))
        below = first[300:].reshape(-1, 3).mean(0)
        self.assertTrue(below[1] > below[0] > below[2], f"grass is not green: {below}")
        for _ in range(30):
            env.step(env.action_space.sample())
        self.assertGreater(np.abs(env.render().astype(int) - first).max(), 50)
        env.close()
        env = gymnasium.make_vec("mild/Go1-v0", num_envs=2, render_mode="rgb_array", ground=["grass", mild.Material("foam45")])
        env.reset(seed=1)
        pictures = env.render()
        self.assertEqual([picture.shape for picture in pictures], [(480, 640, 3)] * 2)
        below = pictures[1][300:].reshape(-1, 3).mean(0)
        self.assertTrue(below[1] > below[0] > below[2], f"the first ground is not seen: {below}")
        env.close()

    def test_without(self):
        env = gym.Env()
        env.reset(seed=1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.assertIsNone(env.render())
        env.close()


if __name__ == "__main__":
    unittest.main()
