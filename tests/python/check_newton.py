"""mild.warp and mild.newton beside the engine plugin in MuJoCo; needs Newton with MuJoCo Warp. `make newton-check` runs it on the CPU, in
some minutes: Warp compiles its kernels. On a GPU: check_newton.py --device cuda:0 (the build must have CUDA, or mild_cuda be there).
--kinds box,sphere: feet of these kinds alone."""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import unittest

import mujoco
import mujoco_warp as mjw
import newton
import numpy as np
import warp as wp

import mild
import mild.newton
import mild.warp
from soft_robot import APPLIED, KINDS, PUSH, SOILS, reference, robot, start

DEVICE, WANTED = "cpu", list(KINDS)


class Plugin(unittest.TestCase):
    def compare(self, kind, integrator, steps, change=lambda text: text):
        """Worst difference of a force from the plugin's over the largest one, in worlds of three soils; and of the positions at the end."""
        text, feet = robot(kind, integrator)
        text = change(text)
        model, data = mujoco.MjModel.from_xml_string(text), None
        with wp.ScopedDevice(DEVICE):
            states = [mujoco.MjData(model) for _ in SOILS]
            for seed, data in enumerate(states):
                start(data, seed)
            m, d = mjw.put_model(model), mjw.put_data(model, states[0], nworld=len(SOILS), nconmax=40, njmax=200)
            for name in ("qpos", "qvel"):
                getattr(d, name).assign(np.array([getattr(data, name) for data in states], np.float32))
            ground, seen = mild.warp.Ground(model, m, d, feet, SOILS), []
            for _ in range(steps):
                ground.step()
                seen.append(ground.wrench.numpy().copy())
            self.assertEqual(int(d.nacon.numpy()[0]), 0)  # the feet left the floor's collisions
            np.testing.assert_array_equal(d.qfrc_applied.numpy(), np.tile(np.float32(APPLIED), (len(SOILS), 1)))
        worst, apart = 0, 0
        for world, soil in enumerate(SOILS):
            wanted, data = reference(mujoco.MjSpec.from_string(text), feet, soil, world, steps)
            got = np.array([one[world] for one in seen])
            self.assertGreater(wanted[:, :, 2].max(), 20)
            if kind != "sphere":  # whose torque the plugin gives about another point, none here
                worst = max(worst, np.abs(got[..., 3:] - wanted[..., 3:]).max() / np.abs(wanted[..., 3:]).max())
            worst = max(worst, np.abs(got[..., :3] - wanted[..., :3]).max() / np.abs(wanted[..., :3]).max())
            apart = max(apart, np.abs(d.qpos.numpy()[world] - data.qpos).max())
        return worst, apart

    def test_forces(self):
        for integrator in ("implicitfast", "Euler"):
            for kind in WANTED:
                with self.subTest(kind=kind, integrator=integrator):
                    worst, apart = self.compare(kind, integrator, 1)
                    print(f"{kind:>9s} {integrator}: forces of a first step differ by {worst:.1e}", end="")
                    self.assertLess(worst, 1e-3)
                    worst, apart = self.compare(kind, integrator, 25)
                    print(f", in 25 steps by {worst:.1e}; then the robots are {apart:.1e} apart")
                    self.assertLess(worst, 0.02)
                    self.assertLess(apart, 2e-5)

    def test_limits(self):
        """Ankles that rest on their limits, which the plugin solves with the ground and this in turn."""
        worst, apart = self.compare("cylinder", "implicitfast", 300, lambda text: text.replace('range="-1.5 1.5"', 'range="-.005 .005"'))
        print(f"joints at their limits: after 300 steps the robots are {apart:.1e} apart")
        self.assertLess(apart, 3e-3)

    def test_through(self):
        """A body that is named passes the floor, others do not."""
        text = robot("box")[0]
        model, data = mujoco.MjModel.from_xml_string(text), mujoco.MjData(mujoco.MjModel.from_xml_string(text))
        data.qpos[2] = 0.05
        for through, some in (((), True), (("trunk",), False)):
            with wp.ScopedDevice(DEVICE):
                m, d = mjw.put_model(model), mjw.put_data(model, data, nconmax=40, njmax=200)
                mild.warp.Ground(model, m, d, ["left", "right"], through=through).step()
                self.assertEqual(int(d.nacon.numpy()[0]) > 0, some)

    def test_wrong(self):
        text = robot("box")[0]
        model = mujoco.MjModel.from_xml_string(text)
        with wp.ScopedDevice(DEVICE):
            m, d = mjw.put_model(model), mjw.make_data(model)
            for keys, said in (({"feet": ["left", "nose"]}, "no body or site 'nose'"), ({"feet": ["left"], "ground": "mud"}, "mud"),
                               ({"feet": ["left"], "soles": "sole"}, "no geom on the body of 'left' is named 'sole'"),
                               ({"feet": ["left", "right"], "soles": [mild.Sole.plate(0.2, 0.1)]}, "soles: 1 for 2 feet"),
                               ({"feet": ["world"]}, "fixed to the world")):
                with self.assertRaisesRegex(ValueError, said):
                    mild.warp.Ground(model, m, d, **keys)
            m.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
            with self.assertRaisesRegex(ValueError, "integrator"):
                mild.warp.Ground(model, m, d, ["left"])


class Newton(unittest.TestCase):
    DT, STEPS = 0.002, 12

    def made(self, folder, **options):
        """Newton's solver of three worlds, and the same model as MJCF."""
        robots, scene = newton.ModelBuilder(), newton.ModelBuilder()
        for builder in (robots, scene):
            newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        robots.add_mjcf(robot("box")[0].replace('<geom name="floor" type="plane" size="5 5 .1"/>', ""))
        scene.replicate(robots, len(SOILS))
        scene.add_ground_plane()
        model = scene.finalize(device=DEVICE)
        return newton.solvers.SolverMuJoCo(model, save_to_mjcf=f"{folder}/model.xml", **options), model

    def test_steps(self):
        """Newton's step with joint_f and body_f gives the plugin's forces in the same model; a reset forgets in its worlds alone."""
        with tempfile.TemporaryDirectory() as folder:
            solver, model = self.made(folder)
            spec = mujoco.MjSpec.from_file(f"{folder}/model.xml")
        ground = mild.newton.attach(solver, ["left", "right"], SOILS, dt=self.DT)
        here, there, control = model.state(), model.state(), model.control()
        wanted, data = zip(*[self.reference(spec.copy(), soil) for soil in SOILS])
        first, last = self.first
        here.joint_q.assign(np.tile(first, len(SOILS)).astype(np.float32))
        here.joint_qd.assign(np.tile(last, len(SOILS)).astype(np.float32))
        control.joint_f.assign(np.tile(APPLIED, len(SOILS)).astype(np.float32))
        force = np.zeros((len(SOILS), 3, 6), np.float32)
        force[:, 0] = PUSH
        seen = []
        for _ in range(self.STEPS):
            here.body_f.assign(force.reshape(-1, 6))
            solver.step(here, there, control, None, self.DT)
            here, there = there, here
            seen.append(ground.wrench.numpy().copy())
        for world, soil in enumerate(SOILS):
            worst = [np.abs(seen[k][world] - wanted[world][k]).max() / np.abs(wanted[world]).max() for k in range(self.STEPS)]
            apart = np.abs(here.joint_q.numpy().reshape(len(SOILS), -1)[world][:3] - data[world].qpos[:3]).max()
            print(f"Newton, {soil}: forces of a first step differ by {worst[0]:.1e}, in {self.STEPS} steps by {max(worst):.1e}; then {apart:.1e} m apart")
            self.assertLess(worst[0], 1e-3)
            self.assertLess(max(worst), 0.02)
            self.assertLess(apart, 2e-5)
        solver.reset(here, wp.array([False, True, False, False], dtype=wp.bool, device=DEVICE), flags=0)
        self.assertEqual((ground.wrench.numpy() != 0).any((1, 2)).tolist(), [True, False, True])
        at = [array.numpy()[1].copy() for array in (ground.d.qpos, ground.d.qvel)]
        here.body_f.assign(force.reshape(-1, 6))
        solver.step(here, there, control, None, self.DT)
        fresh, got = self.reference(spec.copy(), SOILS[1], 1, at)[0][0], ground.wrench.numpy()[1]
        self.assertLess(np.abs(got - fresh).max(), 1e-3 * np.abs(fresh).max())
        self.assertGreater(np.abs(wanted[1][-1] - fresh).max(), 0.1 * np.abs(fresh).max())  # what the reset has changed
        solver.reset(here)
        self.assertEqual(float(np.abs(ground.wrench.numpy()).max()), 0)

    def reference(self, spec, soil, steps=STEPS, at=None):
        feet = [body.name for body in spec.bodies if body.name.endswith(("_left", "_right"))]
        mild.attach(spec, feet=feet, ground=soil, sensor="feet", surface=False)
        model = spec.compile()
        data, seen, turn = mujoco.MjData(model), [], np.zeros(9)
        start(data, 5)
        data.ctrl[:] = 0
        mujoco.mju_quat2Mat(turn, data.qpos[3:7])  # Newton's angular velocity has the world's axes, its quaternion ends with w
        self.first = (np.concatenate([data.qpos[:3], data.qpos[4:7], data.qpos[3:4], data.qpos[7:]]),
                      np.concatenate([data.qvel[:3], turn.reshape(3, 3) @ data.qvel[3:6], data.qvel[6:]]))
        if at:
            data.qpos[:], data.qvel[:] = at
        for _ in range(steps):
            mujoco.mj_step(model, data)
            seen.append(data.sensordata.reshape(2, 12)[:, :6].copy())
        return np.array(seen), data

    def test_contacts(self):
        """With Newton's contacts in the place of MuJoCo's the feet leave the floor as well, and so do bodies that are named, but no others."""
        seen = {}
        with tempfile.TemporaryDirectory() as folder:
            for own, low, through in ((False, 0.385, ()), (True, 0.385, ()), (True, 0.08, ()), (True, 0.08, ("trunk",))):
                solver, model = self.made(folder, use_mujoco_contacts=not own)
                ground = mild.newton.attach(solver, ["left", "right"], SOILS, dt=self.DT, through=through)
                here, there, control, contacts = model.state(), model.state(), model.control(), model.contacts() if own else None
                start = here.joint_q.numpy().reshape(len(SOILS), -1)
                start[:, 2] = low
                here.joint_q.assign(start.ravel())
                newton.eval_fk(model, here.joint_q, here.joint_qd, here)
                forces = []
                for _ in range(self.STEPS):
                    if own:
                        model.collide(here, contacts)
                        self.assertGreater(int(contacts.rigid_contact_count.numpy()[0]), 0)
                    solver.step(here, there, control, contacts, self.DT)
                    here, there = there, here
                    forces.append(ground.wrench.numpy().copy())
                pairs = ground.d.contact.geom.numpy()[: int(ground.d.nacon.numpy()[0])]
                seen[own, low, through] = np.array(forces), int(ground.floor[pairs].any(1).sum())
        (wanted, none), (got, left), (_, touches), (_, passes) = seen.values()
        self.assertEqual((none, left, passes), (0, 0, 0))
        self.assertGreater(touches, 0)
        self.assertGreater(wanted[..., 2].max(), 300)
        self.assertLess(np.abs(got - wanted).max(), 1e-5 * np.abs(wanted).max())

    def test_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            solver, model = self.made(folder)
            with self.assertRaisesRegex(ValueError, "no bodies are labelled 'nose'; there are worldbody/trunk, "):
                mild.newton.attach(solver, ["nose"], dt=self.DT)
            with self.assertRaisesRegex(TypeError, "a str"):
                mild.newton.attach("solver", ["left"], dt=self.DT)
            mild.newton.attach(solver, ["left", "right"], dt=self.DT)
            with self.assertRaisesRegex(ValueError, "soft ground already"):
                mild.newton.attach(solver, ["left"], dt=self.DT)
            with self.assertRaisesRegex(ValueError, "dt: 0.001 s, but the ground was attached with 0.002 s"):
                solver.step(model.state(), model.state(), model.control(), None, 0.001)

    def test_example(self):
        """A stool sinks as deep as its weight on every ground."""
        example = pathlib.Path(__file__).parents[2] / "examples/python/newton_soft.py"
        said = subprocess.run([sys.executable, example, "--device", DEVICE, "--worlds", "4"], capture_output=True, text=True, check=True).stdout
        rows = [line.replace(",", "").split() for line in said.splitlines() if " stools of " in line]
        self.assertEqual([row[0] for row in rows], ["rubber:", "foam45:", "grass:", "sand_loose:"])
        for row in rows:
            print(" ".join(row))
            load, carried, depth, wanted = (float(row[k]) for k in (4, 7, 9, -2))
            self.assertAlmostEqual(carried, load, delta=0.01 * load)
            self.assertAlmostEqual(depth, wanted, delta=0.02)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--kinds", default=",".join(KINDS))
    given, rest = parser.parse_known_args()
    DEVICE, WANTED = given.device, given.kinds.split(",")
    wp.config.quiet = True
    unittest.main(argv=[sys.argv[0], *rest])
