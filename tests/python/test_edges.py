"""What enters and leaves, in one scenario in which no two numbers are equal: a yawed, tilted robot of two different feet on waves of two grounds, a
walk that turns and goes sideways, a sole without symmetry. Every number that leaves is held to a reading of it that comes another way."""
import json
import math
import pathlib
import re
import tempfile
import unittest
import unittest.mock

import mujoco
import numpy as np

import mild
from edges import ROOT, rows, run
from mild import gym
from mild._soles import feet_of

ROBOT = """<mujoco><compiler angle="radian"/><option timestep="0.0031" integrator="Euler"/><worldbody>
  <body name="trunk" pos=".13 -.21 .36" euler=".03 -.05 .41"><freejoint/><geom type="box" size=".11 .07 .05" pos=".013 -.008 .02" mass="7.3"/>
    <body name="left" pos=".02 .12 -.2"><joint name="l" axis=".2 1 .1" damping="0"/><geom type="box" size=".083 .041 .013" pos=".017 -.006 -.11" mass="1.1"/></body>
    <body name="right" pos="-.03 -.14 -.19"><joint name="r" axis="1 .3 -.2"/><geom type="box" size=".071 .047 .011" pos="-.009 .004 -.13" mass=".9"/></body>
  </body></worldbody></mujoco>"""
FEET, GROUNDS, MAP = ["left", "right"], ["sand_loose", "grass"], {"amplitude": 0.017, "wavelength": 0.73, "patches": "checker", "patch_size": 0.19}
STEP, STEPS, HEIGHT = 0.0031, 133, 0.0053
WALK = ("--ground", "sand_loose", "--speed", 0.43, "--sideways", -0.07, "--turn", 0.19, "--trials", 2, "--seconds", 5.3, "--seed", 7)


def problem(plain, data):
    """What a step without ground says of the feet: poses, J, V, A and V_free, of MuJoCo alone."""
    mujoco.mj_forward(plain, data)
    mass, jacobian = np.zeros((plain.nv, plain.nv)), np.zeros((12, plain.nv))
    mujoco.mj_fullM(plain, data, mass)
    for i, name in enumerate(FEET):
        body = plain.body(name).id
        mujoco.mj_jac(plain, data, jacobian[6 * i : 6 * i + 3], jacobian[6 * i + 3 : 6 * i + 6], data.xpos[body], body)
    bodies = [plain.body(name).id for name in FEET]
    velocity = jacobian @ data.qvel
    return mass, jacobian, {"position": data.xpos[bodies], "rotation": data.xmat[bodies].reshape(2, 3, 3), "velocity": velocity.reshape(2, 6),
                            "inverse_inertia": jacobian @ np.linalg.solve(mass, jacobian.T),
                            "free_velocity": (velocity + STEP * jacobian @ data.qacc).reshape(2, 6)}


def fall():
    """A fall of the robot: for each step what enters the ground, the plugin's sensor (2, 12), and J^T W from MuJoCo's equation of motion."""
    spec = mujoco.MjSpec.from_string(ROBOT)
    spec.add_sensor(name="time", type=mujoco.mjtSensor.mjSENS_CLOCK)
    mild.attach(spec, FEET, GROUNDS, sensor="felt", height=HEIGHT, terrain__kind="waves", **{f"terrain__{key}": value for key, value in MAP.items()})
    soft, plain = spec.compile(), mujoco.MjModel.from_xml_string(ROBOT)
    data, other, seen = mujoco.MjData(soft), mujoco.MjData(plain), []
    data.qvel[:] = 0.21, -0.17, -0.9, 0.4, -0.3, 0.5, 0.6, -0.7
    for _ in range(STEPS):
        other.qpos[:], other.qvel[:] = data.qpos, data.qvel
        mass, jacobian, given = problem(plain, other)
        before = data.qvel.copy()
        mujoco.mj_step(soft, data)
        pushed = mass @ (data.qvel - before) / STEP + other.qfrc_bias
        seen.append((given, data.sensor("felt").data.reshape(2, 12).copy(), jacobian, pushed))
    return plain, seen


class Scenario(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.plain, cls.seen = fall()

    def test_plugin(self):
        """Wrenches move the robot as the sensor says; the pressure's centre and the zero moment lie alike."""
        most = max(np.abs(sensor[:, :6]).max() for _, sensor, _, _ in self.seen)
        for given, sensor, jacobian, pushed in self.seen:
            np.testing.assert_allclose(jacobian.T @ sensor[:, :6].ravel(), pushed, atol=1e-6 * most)
        loaded = self.seen[-1][1]
        self.assertTrue((loaded[:, 2] > 5).all() and (np.abs(loaded[:, [0, 1, 3, 4]]) > 0.01).all(), loaded)
        self.assertEqual(len(set(np.abs(loaded).round(9).ravel())), loaded.size)

    def batch(self, soles, mapped=True, robots=1):
        batch = mild.Batch(robots, soles, STEP)
        batch.set_materials(GROUNDS)
        batch.set_map(mild.Map("waves", patch_count=2, **MAP) if mapped else None)
        return batch

    @staticmethod
    def arrays(given, robots, shells=0):
        """Inputs of a batch for so many robots, with shells that ride on the left foot, and outputs."""
        feet = 2 + shells
        more = {"position": given["position"][[0]], "rotation": given["rotation"][[0]], "velocity": given["velocity"][[0]], "free_velocity": given["free_velocity"][[0]]}
        inputs = {name: np.concatenate([given[name], *[value] * shells]) for name, value in more.items()}
        square = np.zeros((6 * feet, 6 * feet))
        square[:12, :12], square[12:, 12:] = given["inverse_inertia"], 0.1 * np.eye(6 * shells)
        inputs |= {"inverse_inertia": square, "height": np.array(HEIGHT)}
        inputs = {name: np.ascontiguousarray(np.tile(value, (robots, *[1] * value.ndim)), np.float32) for name, value in inputs.items()}
        return inputs, {"wrench": np.zeros((robots, feet, 6), np.float32), "new_velocity": np.zeros((robots, feet, 6), np.float32),
                        "foot": np.zeros((robots, feet, 6), np.float32), "residual": np.full(robots, -1, np.float32)}

    def test_batch(self):
        """mild.Batch and mild.Ground get from MuJoCo's numbers what the plugin felt; the robot on exchanged materials does not."""
        soles, label = feet_of(self.plain, FEET)[2], np.array([[0, 1], [1, 0]], np.int32)
        batch, other = self.batch(soles, robots=2), []
        terrain = mild.Terrain(GROUNDS, map=mild.Map("waves", patch_count=2, **MAP), height=HEIGHT)
        ground = mild.Ground(soles, terrain, STEP)
        most = max(np.abs(sensor[:, :6]).max() for _, sensor, _, _ in self.seen)
        for given, sensor, _, _ in self.seen:
            inputs, outputs = self.arrays(given, 2)
            batch.step(**inputs, **outputs, material=label)
            for name, value in given.items():
                getattr(ground, name)[:] = value
            self.assertTrue(ground.solve())
            ground.advance()
            np.testing.assert_allclose(np.hstack([ground.force, ground.torque]), sensor[:, :6], atol=1e-6 * most)
            np.testing.assert_allclose(outputs["wrench"][0], sensor[:, :6], atol=2e-3 * most)
            np.testing.assert_allclose(outputs["foot"][0], sensor[:, [6, 7, 8, 10, 11, 9]], atol=3e-3)
            self.assertTrue((0 <= outputs["residual"]).all() and (outputs["residual"] < 1e-3).all())
            other.append(np.abs(outputs["wrench"][1] - outputs["wrench"][0]).max())
        self.assertGreater(max(other), 0.05 * most)
        for robot in range(2):
            for column in range(2):
                for wrong in (-1, 2):
                    bad = label.copy()
                    bad[robot, column] = wrong
                    with self.assertRaisesRegex(ValueError, rf"^material: {wrong} is outside 0 \.\. 1$"):
                        batch.step(**inputs, **outputs, material=bad)

    def test_no_number(self):
        """A step of no numbers says so, and leaves the ground as it was: that of a batch, plane soles and shells, on waves and level, and of a Ground."""
        soles = feet_of(self.plain, FEET)[2]
        shin = mild.Sole.surface([{"type": "capsule", "size": [0.031, 0.043], "pos": [0.02, 0.01, -0.11]}])
        bad_of = {name: [np.nan, np.inf] for name in ("position", "rotation", "velocity", "free_velocity", "inverse_inertia")}
        bad_of["rotation"] = [np.nan, 1e30]
        for shells in (0, 1):
            for mapped in (True, False):
                label = np.array([[0, 1]] * 2 if mapped else [0] * 2, np.int32)
                two, loads = [self.batch([*soles, *[shin] * shells], mapped, 2) for _ in range(2)], []
                bad = [(name, value, k) for name, values in bad_of.items() for value in values for k in (0, 7)]
                for at, (given, *_) in enumerate(self.seen[:40]):
                    if at > 12 and bad:
                        name, value, k = bad.pop()
                        inputs, outputs = self.arrays(given, 2, shells)
                        two[0].step(**inputs, **outputs, material=label, advance=False)
                        self.assertTrue((outputs["residual"] >= 0).all())
                        inputs[name][1].ravel()[k % inputs[name][1].size] = value
                        inputs["inverse_inertia"][0] = 0  # so that the other robot's step is one without motion
                        inputs["velocity"][0] = inputs["free_velocity"][0] = 0
                        two[1].step(**inputs, **outputs, material=label)
                        self.assertTrue(np.isnan(outputs["residual"][1]), (name, value, k, outputs["wrench"][1]))
                        self.assertGreaterEqual(outputs["residual"][0], 0)
                    felt = []
                    for batch in two:
                        inputs, outputs = self.arrays(given, 2, shells)
                        batch.step(**inputs, **outputs, material=label)
                        felt.append(outputs["wrench"][1])
                    np.testing.assert_array_equal(felt[1], felt[0])
                    loads.append(felt[0][:, 2])
                self.assertEqual(bad, [])
                self.assertGreater((np.array(loads)[13:33] > 20).all(1).sum(), 8)
        ground = mild.Ground(soles, "grass", STEP)
        for name, value in ((name, value) for name, values in bad_of.items() for value in values):
            for array, number in self.seen[-1][0].items():
                getattr(ground, array)[:] = number
            self.assertTrue(ground.solve())
            getattr(ground, name).ravel()[3] = value
            if (name, value) != ("rotation", 1e30):
                self.assertFalse(ground.solve(), name)

    def test_gym(self):
        """diverged is where a robot ended with a number that is none, not where it fell, nor where it goes on."""
        env = gym.VectorEnv(4, ground="grass")
        env.reset(seed=3)
        act = env._act

        def ended(action):
            arrays = act(action)
            arrays["done"][:], arrays["timeout"][:], arrays["valid"][:] = [1, 1, 0, 1], [0, 0, 0, 1], [1, 0, 1, 1]
            return arrays

        with unittest.mock.patch.object(env, "_act", ended):
            _, _, terminated, truncated, info = env.step(np.zeros((4, 12)))
        self.assertEqual((terminated.tolist(), truncated.tolist()), ([True, True, False, False], [False, False, False, True]))
        self.assertEqual(info["final_info"]["diverged"].tolist(), [False, True, False, False])
        self.assertEqual(info["final_info"]["_diverged"].tolist(), [True, True, False, True])
        env.close()


class Program(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def test_press(self):
        """The SA01's sole, tilted: every column of the file and of mild.press, of paths, forces and falls; moments about the reference point give
        the zero moment's place; a Ground that is moved by hand pushes alike."""
        text = (ROOT / "robots/sa01/robot.ini").read_text().split("[foot.left]")[1]
        outline = np.array(re.search(r"outline = ([-\d.\s]+)", text)[1].split(), float).reshape(-1, 2)
        sole, tilt = mild.Sole(outline, pitch=0.0195, sole_z=-0.055, target_elements=77), math.radians(7)
        for keys in ({"depth": 0.023, "speed": 0.031, "step": 0.001}, {"force": (290, 70), "cycles": 2, "speed": 0.013}, {"drop": 0.053, "mass": 19},
                     {"impact": 0.71, "mass": 11}, {"depth": 0.019, "drag": 0.029, "speed": 0.023}):
            options = [part for name, value in keys.items() for part in (f"--{name}", ",".join(map(str, np.atleast_1d(value))))]
            run("press", "--ground", "grass", "--plate", "sole", "--tilt", 7, *options, "--csv", self.folder / "p.csv")
            table, press = rows(self.folder / "p.csv"), mild.press("grass", sole, tilt=tilt, **keys)
            for name, column in table.items():
                if name != "area_m2":
                    np.testing.assert_allclose(column, getattr(press, re.sub("_(s|m|n|nm|rad)$", "", name)), rtol=1e-6, atol=1e-9, err_msg=f"{name} of {keys}")
            on = press.force > 1
            self.assertGreater(np.abs(press.zmp_y[on]).max(), 1e-3)
            self.assertGreater(len(set(np.abs(press.zmp_x[on]).round(9)) - set(np.abs(press.zmp_y[on]).round(9))), 5)
            if "drop" not in keys and "impact" not in keys and "drag" not in keys:
                np.testing.assert_allclose(press.zmp_x[on], -press.moment_y[on] / press.force[on], atol=1e-9)
                np.testing.assert_allclose(press.zmp_y[on], press.moment_x[on] / press.force[on], atol=1e-9)
        press, ground = mild.press("grass", sole, depth=0.023, speed=0.031, step=0.001, tilt=tilt), mild.Ground([sole], "grass", 0.001)
        ground.rotation[:] = [[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]]
        for i in range(1, 700):
            ground.position[0] = [0, 0, -ground.rotation[0, 2, 2] * sole.z - press.depth[i - 1]]
            ground.velocity[0, 2] = ground.free_velocity[0, 2] = -0.031
            ground.solve()
            ground.advance()
            self.assertLess(abs(ground.force[0, 2] - press.force[i]), 0.02 * press.force.max())

    def test_fit(self):
        """Rows, units and numbers of `mild fit` and of GroundFit from one record with noise; both refuse other units, and a sign, in one text."""
        random, plate = np.random.default_rng(5), mild.Sole.plate(0.23, 0.11)
        press = mild.press("grass", plate, depth=0.041, speed=0.017)
        force = press.force + random.normal(0, 1.7, len(press.force)) * (press.force > 0)
        def write(name, depth=1.0, up=1.0):
            np.savetxt(self.folder / name, np.column_stack([press.time, depth * press.depth, up * force]), "%.12g", ",", header="time_s,depth_m,force_n", comments="")
            return self.folder / name
        X, y = mild.loading(press.time, press.depth, force)
        found = json.loads(run("fit", write("fit.csv"), "--plate", "0.23,0.11", "--json", "-"))
        fit = mild.GroundFit(plate).fit(X, y)
        self.assertAlmostEqual(found["residual"], np.sqrt(np.mean((fit.predict(X) - y)**2)), delta=1e-4)
        self.assertEqual(len(y), (np.diff(np.maximum.accumulate(press.depth), prepend=0) > 0).sum())  # deeper than all before
        self.assertAlmostEqual(found["independent_rows"], len(y), delta=0.01 * len(y))  # of independent noise all count
        printed = dict(re.findall(r"^(\S+(?: c_d phi rho nu)?) .*?(\S+)$", run("fit", self.folder / "fit.csv", "--plate", "0.23,0.11"), re.M))
        units = {name: re.match(r"\[(.*?)\]", text)[1] for name, text in re.findall(r"^\s*(\w+) = .*?; (\[.*)$", run("info", "config"), re.M)}
        for name, value in {**found["parameters"], **found["combinations"]}.items():
            for key, number in value.items():
                if name != "recovery":  # of the way up, which X leaves out
                    ours = fit.parameters_[name] if name in fit.parameters_ else fit.combinations_[name][0]
                    low, high = fit.intervals_.get(name, fit.combinations_.get(name, [0, 0, 0])[-2:])
                    self.assertAlmostEqual(number / {"value": ours, "low": low, "high": high}[key], 1, delta=1e-3, msg=(name, key))
                    self.assertEqual(printed[name], fit.units_[name], name)
            if name in units:
                self.assertEqual(printed[name], units[name], name)
            self.assertTrue(value["low"] < value["value"] < value["high"])
        self.assertEqual((fit.units_["sigma_cone/cos(alpha)"], fit.units_["tan(alpha)/nu"]), ("N/m^3", "-"))
        self.assertTrue(found["parameters"]["k_pen"]["low"] < mild.Material("grass").k_pen < found["parameters"]["k_pen"]["high"])
        for depth, up, words in ((1e3, 1, "depth_m [0-9.]+ is beyond 2; it must be in metres, positive down"), (1, -1, "force_n does not push back on the way down"),
                                 (1, 1e-3, "force_n is [0-9.]+ at depth_m .* it must be in newtons")):
            said = run("fit", write("bad.csv", depth, up), "--plate", "0.23,0.11", code=2)
            self.assertRegex(said, rf"^mild fit: [^\n]*{words}[^\n]*$")
            tail = re.search(words + "[^\n]*$", said)[0]
            with self.assertRaisesRegex(ValueError, re.sub(r"[0-9.]+ (?=is beyond)", "[0-9.]+ ", tail.replace("(", r"\("))):
                columns = mild.loading(press.time, depth * press.depth, up * force)
                mild.GroundFit(plate).fit(*columns)
            with self.assertRaisesRegex(ValueError, words):
                mild.GroundFit(plate).fit(X * [depth, depth, depth], up * y)

    def test_eval(self):
        """A walk that turns and goes sideways: forces of the feet change the momentum of the whole robot: over a second, each axis."""
        files = {name: self.folder / f"{name}.csv" for name in ("track", "feet")}
        run("eval", *WALK, *[part for name, file in files.items() for part in (f"--{name}", file)])
        whole, forces = rows(files["track"]), rows(files["feet"])
        for trial in range(2):
            track, feet = ({name: column[table["trial"] == trial] for name, column in table.items()} for table in (whole, forces))
            com, time = np.column_stack([track[f"com_{k}_m"] for k in "xyz"]), track["time_s"]
            speed = np.diff(com, axis=0) / 0.01  # in the middle of a policy step
            first, last = 231, 471
            inside = (feet["time_s"] > time[first] + 0.005 + 1e-6) & (feet["time_s"] <= time[last] + 0.005 + 1e-6)
            impulse = np.array([feet[f"force_{k}_n"][inside].sum() for k in "xyz"]) * (time[last] - time[first]) / (inside.sum() / 2)
            gained = speed[last] - speed[first] + [0, 0, 9.81 * (time[last] - time[first])]
            np.testing.assert_allclose(impulse, SA01_MASS * gained, atol=0.002 * impulse[2])


SA01_MASS = sum(mujoco.MjModel.from_xml_path(str(ROOT / "robots/sa01/sa01.xml")).body_mass)


if __name__ == "__main__":
    unittest.main()
