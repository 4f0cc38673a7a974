"""mild.mjlab beside mjlab itself, on the CPU; needs PyTorch and mjlab. `make mjlab-check` runs it, in some minutes: Warp compiles its kernels."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

os.environ["CUDA_VISIBLE_DEVICES"] = ""
os.environ["MJLAB_WARP_QUIET"] = "1"
import mjlab.tasks  # noqa: E402, F401 (fills the registry)
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import torch  # noqa: E402
import warp as wp  # noqa: E402
from mjlab.envs import ManagerBasedRlEnv  # noqa: E402
from mjlab.tasks.registry import list_tasks, load_env_cfg, load_rl_cfg  # noqa: E402

import mild  # noqa: E402
import mild.mjlab as ours  # noqa: E402
from mild.describe import Description, Observer, State  # noqa: E402

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples/python/mjlab_soft.py"


def standing(robot, grounds, steps, change=lambda config: None):
    """An environment of two robots that nothing pushes, after some steps without an action."""
    config = load_env_cfg(f"Mjlab-Velocity-Soft-Unitree-{robot}", play=True)
    config.scene.num_envs, config.seed = 2, 1
    config.events["ground"].params["ground"] = grounds
    change(config)
    env = ManagerBasedRlEnv(config, "cpu")
    env.reset()
    action = torch.zeros(2, env.action_manager.total_action_dim)
    for _ in range(steps):
        env.step(action)
    return env


class Tasks(unittest.TestCase):
    def test_registered(self):
        """By the entry point of the package: nothing but mjlab was imported in that process."""
        for robot in ("Go1", "G1"):
            self.assertIn(f"Mjlab-Velocity-Soft-Unitree-{robot}", list_tasks())
        with tempfile.TemporaryDirectory() as empty:
            said = subprocess.run([sys.executable, "-c", "import mjlab.tasks.registry as r, mjlab.tasks; print(*r.list_tasks())"], capture_output=True,
                                  text=True, cwd=empty, check=True).stdout
        self.assertIn("Mjlab-Velocity-Soft-Unitree-Go1", said)

    def test_in_turn(self):
        """Each robot has its own ground, mjlab's sensor of contacts has the ground's forces, and a reset forgets them."""
        env = standing("Go1", ["foam45", "sand_loose"], 15)
        soft = env.soft_ground
        self.assertEqual(soft.material.tolist(), [0, 1])
        self.assertTrue((soft.wrench[..., 2].sum(1) > 20).all())
        self.assertGreater(soft.shape[1, :, 4].mean(), 1.1 * soft.shape[0, :, 4].mean())
        sensed = env.scene["feet_ground_contact"].data
        torch.testing.assert_close(sensed.force, -soft.wrench[..., :3])
        env.reset()
        self.assertEqual(float(soft.wrench.abs().max()), 0)
        self.assertEqual(float(soft.imprint.abs().max()), 0)
        env.close()

    def test_heights(self):
        """A foot that stands is half its depth below mjlab's height of a foot on rigid ground; one in the air keeps its imprint's depth."""
        env = standing("Go1", ["rubber", "sand_loose"], 15)
        soft, scan, sites = env.soft_ground, env.scene["foot_height_scan"], wp.to_torch(env.sim.wp_data.site_xpos)[:, env.soft_ground.sites, 2]
        self.assertTrue((soft.shape[..., 5] > 0).all())
        self.assertTrue((env.scene["feet_ground_contact"].data.found > 0).all())
        deep = soft.shape[..., 4].clone()
        torch.testing.assert_close(scan.data.heights, soft.radius - deep / 2, atol=2e-3, rtol=0)
        self.assertGreater(deep[1].min(), 0.02)
        soft.shape[0] = 0  # as of feet that have left the ground
        scan._invalidate_cache()
        torch.testing.assert_close(scan.data.heights, sites + deep / 2)
        self.assertEqual(env.reward_manager.get_term_cfg("track_linear_velocity").weight, 4)
        env.close()

    def test_levels(self):
        """The G1's curriculum: all begin on the first ground, unpushed; who stays up goes on, who falls at once goes back."""
        def change(config):
            walks = load_env_cfg("Mjlab-Velocity-Soft-Unitree-G1")
            config.events["push_robot"] = walks.events["push_robot"]
            config.events["push_robot"].params["velocity_range"] = {"x": (-0.5, 0.5)}
            config.curriculum["ground_levels"] = walks.curriculum["ground_levels"]

        env = standing("Go1", ["rubber", "sand_loose"], 2, change)
        soft, push, second = env.soft_ground, env.event_manager.get_term_cfg("push_robot").params["velocity_range"], torch.tensor([1])
        self.assertEqual((soft.material.tolist(), push["x"]), ([0, 0], (0, 0)))
        for level in (1, 2, 2):
            env.common_step_counter += round(8.1 / env.step_dt)
            env.curriculum_manager.compute(env_ids=second)
            self.assertEqual(soft.level.tolist(), [0, level])
            self.assertEqual((soft.material[0], push["x"]), (0, (-0.125 * level, 0.125 * level)))
        self.assertIn(soft.material[1], (0, 1))
        env.curriculum_manager.compute(env_ids=second)
        self.assertEqual((soft.level.tolist(), soft.material.tolist()), ([0, 1], [0, 1]))
        env.close()
        learns = [load_rl_cfg(f"Mjlab-Velocity-Soft-Unitree-{robot}") for robot in ("Go1", "G1")]
        self.assertEqual([(agent.algorithm.desired_kl, agent.num_steps_per_env) for agent in learns], [(0.01, 24), (0.02, 16)])
        self.assertNotIn("ground_levels", load_env_cfg("Mjlab-Velocity-Soft-Unitree-Go1").curriculum)

    def test_stand(self):
        """A robot that stands sinks as deep as its weight, on round feet and on soles of capsules."""
        for robot, depth in (("Go1", 61.0), ("G1", 33.6)):
            said = subprocess.run([sys.executable, EXAMPLE, robot, "--stand", "6", "--envs", "1", "--ground", "sand_loose"], capture_output=True, text=True,
                                  check=True).stdout.splitlines()[-1]
            carried, load, sunk, wanted = (float(number) for number in re.match(
                r"feet carry ([\d.]+) N of ([\d.]+); mean sinkage ([\d.]+) mm, of these loads ([\d.]+) mm", said).groups())
            self.assertAlmostEqual(carried, load, delta=0.02 * load)
            self.assertAlmostEqual(sunk, wanted, delta=0.02 * wanted)
            self.assertAlmostEqual(sunk, depth, delta=1)
            print(robot, said)

    def test_wrong(self):
        def feet(config):
            config.events["ground"].params["feet"] = ("FR", "nose")

        def soles(config):
            config.events["ground"].params["soles"] = "sole"

        for change, said in ((feet, "feet: the model has no site 'robot/nose'"), (soles, "soles: no geom on the body of 'robot/FR_calf' is named 'robot/")):
            with self.assertRaisesRegex(ValueError, said):
                standing("Go1", ["rubber"], 0, change)
        with self.assertRaisesRegex(ValueError, "mud"):
            standing("Go1", ["mud"], 0)


class Export(unittest.TestCase):
    def test_observation(self):
        """In mjlab's own state mild.trial makes mjlab's own observation, of both robots."""
        for robot, site in (("Go1", "robot/imu"), ("G1", "robot/imu_in_pelvis")):
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([sys.executable, "-m", "mild.mjlab", f"Mjlab-Velocity-Soft-Unitree-{robot}", "--out", folder + "/o"], check=True, capture_output=True)
                again = subprocess.run([sys.executable, "-m", "mild.mjlab", f"Mjlab-Velocity-Soft-Unitree-{robot}", "--out", folder + "/o"],
                                       capture_output=True, text=True, check=False)
                self.assertEqual((again.returncode, f"{folder}/o exists" in again.stderr), (2, True))
                description = Description(pathlib.Path(folder, "o/policy.ini"))
                model = mujoco.MjModel.from_xml_path(folder + "/o/scene.xml")
            config = load_env_cfg(f"Mjlab-Velocity-Flat-Unitree-{robot}", play=True)
            config.scene.num_envs, config.seed = 1, 3
            env = ManagerBasedRlEnv(config, "cpu")
            env.reset()
            action = 0.3 * torch.sin(torch.arange(float(env.action_manager.total_action_dim)))[None]
            for _ in range(5):
                seen = env.step(action)[0]["actor"][0].numpy()
            data, names = mujoco.MjData(model), [model.joint(j).name for j in range(1, model.njnt)]
            data.qpos[:], data.qvel[:] = env.sim.data.qpos[0].numpy(), env.sim.data.qvel[0].numpy()
            bias = env.scene["robot"].data.encoder_bias[0].numpy() if hasattr(env.scene["robot"].data, "encoder_bias") else 0
            state = State(description, model, data, (mujoco.mjtObj.mjOBJ_SITE, model.site(site).id), (np.arange(7, model.nq), np.arange(6, model.nv)))
            state.read(lambda amplitude, count: np.zeros(count))
            state.joint_position = state.joint_position + bias
            state.default = np.zeros(len(names))
            for pattern, value in description.default:
                state.default[[bool(pattern.fullmatch(name)) for name in names]] = value
            state.command, state.action = env.command_manager.get_command("twist")[0].numpy(), action[0].numpy()
            np.testing.assert_allclose(Observer(description, len(names), len(names)).observe(state), seen, atol=2e-4)
            scale = np.zeros(len(names))
            for pattern, value in description.scale:
                scale[[bool(pattern.fullmatch(name)) for name in names]] = value
            np.testing.assert_allclose(scale, env.action_manager.get_term("joint_pos")._scale[0].numpy() * np.ones(len(names)), rtol=1e-6)
            env.close()


if __name__ == "__main__":
    unittest.main()
