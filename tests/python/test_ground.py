"""The ground of the package: numbers compared with formulas, with the program, and with the laws of mechanics."""
import copy
import os
import pathlib
import pickle
import subprocess
import tempfile
import threading
import unittest

import numpy as np

import mild

PROGRAM = os.environ.get("MILD_PROGRAM", "")


def body(ground, mass=10.0, inertia=0.05):
    """A free rigid body as the inverse inertia of a ground with one foot."""
    ground.inverse_inertia[:3, :3] = np.eye(3) / mass
    ground.inverse_inertia[3:, 3:] = np.eye(3) / inertia


def fall(ground, steps, twist=np.zeros(6)):
    """Semi-implicit steps under gravity; returns the twist at the end."""
    for _ in range(steps):
        ground.velocity[0] = ground.free_velocity[0] = twist
        ground.free_velocity[0, 2] -= 9.81 * ground.dt
        assert ground.solve()
        ground.advance()
        twist = ground.new_velocity[0].copy()
        ground.position[0] += twist[:3] * ground.dt
    return twist


class Press(unittest.TestCase):
    def test_small_sole(self):
        """A k_c below 0 leaves no pressure under a small sole: refused where the two meet."""
        sole, soil = mild.Sole.plate(0.2, 0.05), mild.Material("clay", k_c=-40e3)
        words = r"ground\.k_c = -40000 .* b = 0\.05 m.* ground\.plate_width"
        with self.assertRaisesRegex(ValueError, words):
            mild.Ground([sole], soil, dt=1e-3)
        with self.assertRaisesRegex(ValueError, words):
            mild.press(soil, sole, depth=0.02)
        ground = mild.Ground([sole], "clay", dt=1e-3)
        with self.assertRaisesRegex(ValueError, words):
            ground.terrain = soil
        self.assertEqual(ground.terrain.materials[0].k_c, 13190)
        soil.plate_width = 0.1
        ground.terrain = soil
        with self.assertRaisesRegex(ValueError, r"plate_width = 0\.05 .* -k_c/k_phi"):
            soil.plate_width = 0.05

    def test_prints(self):
        """Ground with prints is softer the second time, because it remembers the first."""
        sole = mild.Sole.plate(0.2, 0.1)
        forgets, remembers = (mild.press("sand_loose", sole, depth=0.02, tilt=0.1, cycles=2, tiles=tiles) for tiles in (0, 64))
        self.assertLess(remembers.work_in, 0.8 * forgets.work_in)

    def test_arguments(self):
        sole = mild.Sole.plate(0.2, 0.1)
        for arguments, name in (({"depth": -1}, "depth"), ({"depth": (0.01, 0.02)}, "depth"), ({"depth": 1, "force": 1}, "force"),
                                ({"speed": np.nan}, "speed"), ({"drop": 1, "depth": 0.1}, "drop"), ({"cycles": 0}, "cycles"),
                                ({"force": 1e6}, "force"), ({"tilt": 2}, "tilt")):
            with self.assertRaisesRegex(ValueError, name):
                mild.press("grass", sole, **arguments)
        for arguments, name in (({"depth": "deep"}, "depth"), ({"drop": "high"}, "drop"), ({"map": 3}, "map")):
            with self.assertRaisesRegex(TypeError, name):
                mild.press("grass", sole, **arguments)


class Surface(unittest.TestCase):
    BOX = {"type": "box", "size": (0.1, 0.05, 0.025), "pos": (0, 0, 0.025)}

    def test_kept(self):
        """Pickled it is made again, and what it was made from may change."""
        shapes = [dict(self.BOX), {"type": "capsule", "size": [0.03, 0.2], "quat": [1, 0, 1, 0]}, {"type": "sphere", "size": [0.04]}]
        made = mild.Sole.surface(shapes, spacing=0.03)
        self.assertGreater(made.x.max(), 0.2)  # the capsule lies
        shapes[0]["size"] = (1, 1, 1)
        again = pickle.loads(pickle.dumps(made))
        self.assertEqual((again.elements, again.pitch), (made.elements, made.pitch))
        np.testing.assert_array_equal(again.x, made.x)

    def test_arguments(self):
        sphere = {"type": "sphere", "size": [0.1]}
        mesh = {"type": "mesh", "vertices": [[0, 0, 0]] * 3}
        for shapes, name in (([sphere, {"type": "ball"}], r"shapes\[1\].type"), ([{"type": "box"}], "size"), ([{"type": "box", "size": (1, 2)}], "size"),
                             ([{**sphere, "radius": 1}], "radius"), ([], "count"), ([mesh], "triangles"), ([{**mesh, "size": [1]}], "triangles"),
                             ([{**mesh, "triangles": [[0, 1, 3]]}], "triangles"), ([{**mesh, "triangles": [[0, 1, 1.5]]}], "triangles"),
                             ([{"type": "sphere", "size": [-1]}], r"shapes\[0\].size")):
            with self.assertRaisesRegex(ValueError, name):
                mild.Sole.surface(shapes)
        for shapes, name in ((3, "shapes"), ([3], r"shapes\[0\]")):
            with self.assertRaisesRegex(TypeError, name):
                mild.Sole.surface(shapes)


class Step(unittest.TestCase):
    def test_momentum(self):
        """V = V_free + A W with W the impulse of forces and torques: two feet, tilted and moving."""
        rng = np.random.default_rng(1)
        ground = mild.Ground([mild.Sole.plate(0.2, 0.1)] * 2, "sand_loose", dt=2e-3)
        half = rng.normal(size=(12, 12))
        ground.inverse_inertia[:] = half @ half.T / 50
        ground.position[:] = [[0, 0.1, -0.01], [0, -0.1, -0.005]]
        ground.rotation[0] = [[np.cos(0.05), 0, np.sin(0.05)], [0, 1, 0], [-np.sin(0.05), 0, np.cos(0.05)]]
        ground.velocity[:] = ground.free_velocity[:] = rng.normal(size=(2, 6)) * 0.2
        self.assertTrue(ground.solve())
        impulse = np.hstack([ground.force, ground.torque]).ravel() * ground.dt
        after = ground.free_velocity.ravel() + ground.inverse_inertia @ impulse
        self.assertGreater(ground.force[:, 2].min(), 1)
        np.testing.assert_allclose(ground.new_velocity.ravel(), after, atol=1e-9)
        elements = ground.elements(0)
        for name, force in zip(("tangent_x", "tangent_y", "normal"), ground.force[0], strict=True):
            self.assertAlmostEqual(elements[name].sum(), force, delta=1e-6 * ground.force[0, 2])
        center = [elements["normal"] @ elements[point] / ground.force[0, 2] for point in ("point_x", "point_y")]
        np.testing.assert_allclose(ground.pressure_center[0, :2], center, atol=1e-6)
        loaded = elements["normal"] > 0
        self.assertAlmostEqual(ground.depth_mean[0], elements["depth"][loaded].mean(), delta=1e-9)
        self.assertAlmostEqual(ground.depth_max[0], elements["depth"][loaded].max(), delta=1e-9)
        self.assertGreater(np.ptp(elements["depth"]), 1e-5)

    def test_arrays_are_views(self):
        ground = mild.Ground([mild.Sole.plate(0.2, 0.1)])
        ground.position[0, 2] = 7
        self.assertEqual(ground.position[0, 2], 7)
        self.assertTrue(np.shares_memory(ground.position, ground.position))
        self.assertTrue(np.shares_memory(ground.force, ground.force))
        with self.assertRaises(ValueError):
            ground.force[0] = 0
        array = ground.position
        del ground
        self.assertEqual(array[0, 2], 7)  # it keeps the ground

    def test_order_of_calls(self):
        ground = mild.Ground([mild.Sole.plate(0.2, 0.1)])
        with self.assertRaisesRegex(RuntimeError, "solve"):
            ground.advance()
        ground.solve()
        ground.advance()
        with self.assertRaisesRegex(RuntimeError, "solve"):
            ground.advance()
        ground.solve()
        ground.reset()
        with self.assertRaisesRegex(RuntimeError, "solve"):
            ground.advance()

    def test_threads(self):
        """Grounds of their own in threads; one ground in two threads raises or waits, and stays whole."""
        shared = mild.Ground([mild.Sole.plate(0.2, 0.1)], "grass")
        body(shared)
        shared.position[0, 2] = -0.01
        others = []

        def run():
            for _ in range(300):
                try:
                    shared.solve()
                except RuntimeError as error:
                    others.append(str(error))

        threads = [threading.Thread(target=run) for _ in range(3)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        self.assertTrue(all("another thread" in text for text in others))
        self.assertTrue(shared.solve())


class Check(unittest.TestCase):
    def test_faults(self):
        """A good input passes, and each fault is named."""
        ground = mild.Ground([mild.Sole.plate(0.2, 0.1)], "foam45", 0.001)
        body(ground)
        ground.check()
        for array, place, value, name in (("position", (0, 2), np.nan, "input.position of foot 0"),
                                          ("rotation", (0, 1, 1), 2, "not orthonormal"),
                                          ("inverse_inertia", (1, 4), 1, "not symmetric"),
                                          ("inverse_inertia", (3, 3), -1, "row 3"),
                                          ("free_velocity", (0, 5), np.inf, "input.free_velocity")):
            kept = getattr(ground, array)[place].copy()
            getattr(ground, array)[place] = value
            with self.assertRaisesRegex(ValueError, name):
                ground.check()
            getattr(ground, array)[place] = kept
        ground.check()


class State(unittest.TestCase):
    def fallen(self, steps):
        ground = mild.Ground([mild.Sole.plate(0.2, 0.1)], mild.Terrain(["sand_loose", "foam45"], map=mild.Map("waves", amplitude=0.01,
                             wavelength=0.5, patches="checker", patch_size=0.07, patch_count=2)), tiles=64)
        body(ground)
        return ground, fall(ground, steps, np.array([0.2, 0.1, 0, 0, 0, 0]))

    def test_goes_on_with_the_same_bits(self):
        ground, twist = self.fallen(200)
        copies = [pickle.loads(pickle.dumps(ground)), copy.deepcopy(ground), copy.copy(ground)]
        fresh, _ = self.fallen(0)
        fresh.position[:], fresh.state = ground.position, ground.state
        end = fall(ground, 50, twist.copy())
        self.assertGreater(ground.print_at(*ground.position[0, :2]), 0)
        for other in (*copies, fresh):
            np.testing.assert_array_equal(fall(other, 50, twist.copy()), end)
            self.assertEqual(other.state, ground.state)

    def test_foreign_bytes(self):
        """Bytes of another length or of no ground are refused; test_states.py bends them."""
        ground, _ = self.fallen(100)
        for state in (b"", ground.state[:-1], ground.state + b"\0", bytes(len(ground.state))):
            with self.assertRaisesRegex(ValueError, "state"):
                ground.state = state
        with self.assertRaises(TypeError):
            ground.state = 5

    def test_pickles(self):
        material = mild.Material("grass", mu=0.7, passive=False)
        self.assertEqual(pickle.loads(pickle.dumps(material)), material)
        self.assertNotEqual(material, mild.Material("grass"))
        outline = [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1]]
        for sole in (mild.Sole(outline, sole_z=-0.04), mild.Sole.plate(0.1, 0.1), mild.Sole.plate(0.1, 0.1).concentric()):
            again = pickle.loads(pickle.dumps(sole))
            np.testing.assert_array_equal(again.x, sole.x)
            self.assertEqual(again.z, sole.z)
        terrain = mild.Terrain(["grass", "snow"], map=mild.Map("image", heights=np.arange(12.0).reshape(3, 4), amplitude=0.1, cell=0.5),
                               height=0.3, map_x=0.1)
        terrain.add_patch(0, 1, 0, np.inf, 1)
        again = pickle.loads(pickle.dumps(terrain))
        for x, y in ((0.2, 0.3), (-0.4, 0.1), (0.9, 5)):
            self.assertEqual(again.height_at(x, y), terrain.height_at(x, y))
            self.assertEqual(again.slope_at(x, y), terrain.slope_at(x, y))
            self.assertEqual(again.material_at(x, y), terrain.material_at(x, y))


class Terrain(unittest.TestCase):
    def test_waves(self):
        """Heights and slopes of a moved map by the formula of MildMapKind."""
        waves = mild.Map("waves", amplitude=0.1, wavelength=1.0, cell=0.05)
        terrain = mild.Terrain("grass", map=waves, height=0.5, map_x=0.2, map_y=-0.3)
        for x, y in ((0.22, 0.51), (-0.33, 0.74), (2.12, 0.03)):
            angle = 2 * np.pi * (np.array([x, y]) - [0.2, -0.3])
            self.assertAlmostEqual(terrain.height_at(x, y), 0.5 + 0.05 * np.sin(angle).sum(), delta=2e-3)  # between points of the grid
            np.testing.assert_allclose(terrain.slope_at(x, y), 0.1 * np.pi * np.cos(angle), atol=0.06)

    def test_arguments(self):
        for make, name in ((lambda: mild.Map("hills"), "kind"), (lambda: mild.Map(amplitude="\ud800"), "amplitude"), (lambda: mild.Map("waves", amplitud=1), "amplitude"),
                           (lambda: mild.Map("image", heights=[[0, 1], [np.inf, 0]]), "height"), (lambda: mild.Map("image"), "height"),
                           (lambda: mild.Map(labels=[[0.5]], patches="image"), "labels"), (lambda: mild.Terrain([]), "materials"),
                           (lambda: mild.Terrain(5), "materials"), (lambda: mild.Terrain("sand"), "sand"),
                           (lambda: mild.Terrain("grass", map=3), "map"), (lambda: mild.Terrain("grass", height=np.nan), "height"),
                           (lambda: mild.Terrain("grass").add_patch(1, 0, 0, 1, 0), "patch"),
                           (lambda: mild.Terrain("grass", map=mild.Map(patches="checker", patch_size=1, patch_count=3)), "label"),
                           (lambda: mild.Sole([[0, 0], [1, 1]]), "outline"), (lambda: mild.Sole("abc"), "outline"),
                           (lambda: mild.Sole([[0, 0], [1, 1], [0, 1], [1, 0]]), "outline"), (lambda: mild.Sole.plate(0, 1), "length"),
                           (lambda: mild.Ground([]), "soles"), (lambda: mild.Ground([1]), "soles"),
                           (lambda: mild.Ground([mild.Sole.plate(0.1, 0.1)], dt=0), "dt"),
                           (lambda: mild.Ground([mild.Sole.plate(0.1, 0.1)], solver="x"), "solver"),
                           (lambda: mild.Ground([mild.Sole.plate(0.1, 0.1)], tiles=-1), "tiles"),
                           (lambda: mild.Material("grass", mu=-1), "mu"), (lambda: mild.Material("grass", my=1), "mu"),
                           (lambda: mild.Material(model="rigid"), "rigid"), (lambda: mild.Material(3), "preset"),
                           (lambda: mild.Sole.plate(0.1, 0.1).sinkage("grass", -1), "load")):
            with self.assertRaisesRegex((ValueError, TypeError), name):
                make()


class Material(unittest.TestCase):
    def test_fields(self):
        material = mild.Material("sand_dense")
        material.mu, material.model, material.passive = 0.9, "bekker", False
        self.assertEqual((material.mu, material.model, material.passive), (0.9, "bekker", False))
        with self.assertRaisesRegex(ValueError, "mu"):
            material.mu = np.nan
        with self.assertRaisesRegex(ValueError, "model"):
            material.model = "sand"
        self.assertEqual(material.mu, 0.9)
        for name in mild.presets():
            mild.Material(name)

    def test_file(self):
        """A soil's file comes back to the last digit, wherever it is read; what is wrong names file, line and key."""
        soil = mild.Material("clay", mu=1 / 3, k_c=np.nextafter(13190, 2e4))
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mars.ini"
            soil.save(path, head="from my bevameter\nring 12", notes={"mu": "tan of 18.4 degrees"})
            self.assertEqual(mild.Material(str(path)), soil)
            self.assertEqual(mild.Material(path, mu=0.5).mu, 0.5)
            text = path.read_text()
            self.assertTrue(text.startswith("# from my bevameter\n# ring 12\n[ground]\nmodel = bekker\n"), text)
            self.assertIn("# tan of 18.4 degrees\nmu = ", text)
            self.assertEqual(mild.press(path, mild.Sole.plate(0.2, 0.1), depth=0.01).peak_force,
                             mild.press(soil, mild.Sole.plate(0.2, 0.1), depth=0.01).peak_force)
            if PROGRAM:
                out = subprocess.run([PROGRAM, "press", "--ground", path, "--depth", "0.01"], capture_output=True, text=True, check=True)
                self.assertIn(f"{path} (bekker)", out.stdout)
            for call, error, words in ((lambda: soil.save(pathlib.Path(folder) / "mars.txt"), ValueError, "ends in .ini"),
                                       (lambda: soil.save(pathlib.Path(folder) / "no" / "mars.ini"), Exception, "mars.ini"),
                                       (lambda: soil.save(path, notes={"mv": "x"}), ValueError, "'mv'"),
                                       (lambda: soil.save(3), TypeError, ""),
                                       (lambda: mild.Material(folder + "/venus.ini"), Exception, "venus.ini")):
                with self.assertRaisesRegex(error, words):
                    call()
            self.assertEqual(mild.Material(path), soil)
            path.write_text(text.replace("\nmu =", "\nmv ="))
            with self.assertRaisesRegex(ValueError, r"mars.ini:\d+: .*'mv'.*'mu'"):
                mild.Material(path)


class Fit(unittest.TestCase):
    def test_recovers_a_spring(self):
        """Noise of 1 %: the interval holds the true numbers, and the curve is that of the press."""
        sole, rng = mild.Sole.plate(0.2, 0.1), np.random.default_rng(5)
        truth = mild.Material("grass")
        press = mild.press(truth, sole, depth=0.04)
        X, y = mild.loading(press.time, press.depth, press.force)
        fit = mild.GroundFit(hold={"alpha": truth.alpha, "nu": truth.nu}).fit(X, y + 0.01 * y.max() * rng.normal(size=len(y)))
        for name in ("k_pen", "sigma_cone"):
            low, high = fit.intervals_[name]
            self.assertEqual(fit.states_[name], "fitted")
            self.assertLess(low, getattr(truth, name))
            self.assertGreater(high, getattr(truth, name))
        self.assertEqual(fit.parameters_["alpha"], truth.alpha)
        self.assertLess(np.abs(fit.predict(X) - y).max(), 0.01 * y.max())
        self.assertGreater(fit.score(X, y), 0.999)
        self.assertTrue(np.isnan(fit.score(X[:1], y[:1])))
        same = np.repeat(X[-1:], 3, axis=0)  # scikit-learn's r2_score of a constant
        self.assertEqual(fit.score(same, fit.predict(same)), 1.0)
        self.assertEqual(fit.score(same, np.full(3, 0.1)), 0.0)

    def test_save(self):
        """What was fitted becomes a soil's file, the rest is the fill's; numbers that nobody knows are refused."""
        truth, X = mild.Material("clay", k_c=9000, mu=0.3), [np.linspace(0.001, 0.04, 60)[:, None]] * 2
        sizes = [(0.1, 0.08), (0.3, 0.2)]
        y = [mild.Sole.plate(*size).elements * 0.0195**2 * (truth.k_c / min(size) + truth.k_phi) * x[:, 0] ** truth.exponent
             for size, x in zip(sizes, X)]
        fit = mild.GroundFit(sizes, model="bekker", fill=truth)
        with self.assertRaisesRegex(RuntimeError, "fitted"):
            fit.save("x.ini")
        with self.assertRaisesRegex(ValueError, r"\b3 records .*\b2 plates"):
            fit.fit([*X, X[0]], [*y, y[0]])
        with self.assertRaisesRegex(ValueError, "y: "):
            fit.fit(X, y[:1])
        fit.fit(X, y)
        self.assertGreater(fit.score(X, y), 0.999)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "clay.ini"
            fit.save(path)
            found = mild.Material(path)
            self.assertAlmostEqual(found.k_c, 9000, delta=20)
            self.assertEqual((found.mu, found.cohesion), (0.3, truth.cohesion))
            self.assertEqual(found.k_c, fit.parameters_["k_c"])
            self.assertRegex(path.read_text(), r"# 95 %: [0-9.]+ \.\. [0-9.]+ N/m\^\(n\+1\)\nk_c = ")
            with self.assertRaisesRegex(ValueError, "friction"):
                mild.GroundFit(sizes, model="bekker").fit(X, y).save(path)
            with self.assertRaisesRegex(ValueError, "k_c, k_phi: "):
                mild.GroundFit(sizes[0], model="bekker").fit(X[0], y[0]).save(path)
            self.assertEqual(mild.Material(path), found)

    def sinking_slide(self, material, depth):
        """A square of 0.1 m is pressed to a depth and slides 30 mm under the load that it has: along, depth, up, along of the force."""
        ground, table = mild.Ground([mild.Sole.plate(0.1, 0.1)], material, dt=1e-3), []
        at, speed, mass = np.zeros(2), np.array([0.0, -0.05]), 0.0  # along and up
        ground.inverse_inertia[:], ground.rotation[0] = 0.0, np.eye(3)
        for step in range(round(depth / 5e-5) + 600):
            if step == round(depth / 5e-5):
                mass, speed = ground.force[0, 2] / 9.81, np.array([0.05, 0.0])
            ground.inverse_inertia[2, 2] = 1 / mass if mass else 0.0
            ground.position[0] = at[0], 0, at[1]
            ground.velocity[0] = ground.free_velocity[0] = speed[0], 0, speed[1], 0, 0, 0
            ground.free_velocity[0, 2] -= 9.81e-3 if mass else 0.0
            ground.solve()
            ground.advance()
            speed[1] = ground.new_velocity[0, 2] if mass else speed[1]
            at += 1e-3 * speed
            table.append((at[0], -at[1], ground.force[0, 2], ground.force[0, 0]))
        return np.array(table)

    def test_drags(self):
        """A plate that slides gives slip_length and grip back, and one that sinks meanwhile regain_length."""
        truth = mild.Material("sand_loose", slip_growth=0, slip_length=0.003, regain_length=0.0012, grip=0.13, recovery=0, phi=0.6, rho=2500)
        truth.model = "mild_merged"
        plate, hold = (0.1, 0.1), {name: getattr(truth, name) for name in ("alpha", "c_g", "c_d", "phi", "rho", "mu")}
        press, slide = (mild.press(truth, mild.Sole.plate(*plate), **keys) for keys in ({"depth": 0.03}, {"depth": 0.015, "drag": 0.03}))
        X, y = mild.loading(press.time, press.depth, press.force)
        level, sinking = np.column_stack([slide.x, slide.depth, slide.force, slide.force_x]), self.sinking_slide(truth, 0.015)
        self.assertGreater(sinking[-1, 1], 0.022)
        fit = mild.GroundFit(plate, "mild_merged", hold=hold)
        self.assertEqual(fit.fit(X, y, drags=[(plate, level)]).states_["regain_length"], "no_effect")
        fit.fit(X, y, drags=[(plate, level), (plate, sinking)])
        for name, within in (("slip_length", 6e-5), ("grip", 2.6e-3), ("regain_length", 1e-4)):
            self.assertAlmostEqual(fit.parameters_[name], getattr(truth, name), delta=within)
        self.assertLess(fit.drag_residual_, 0.02 * slide.force.max())
        self.assertEqual(fit.material_.slip_length, fit.parameters_["slip_length"])
        for wrong, name in (([(plate, level[:, :3])], "shape"), ([(plate, level[:5])], "slide"), ([1], "plate"), ([(3, level)], "plate"),
                            ([(plate, level)] * 17, "16")):
            with self.assertRaisesRegex((ValueError, TypeError), name):
                fit.fit(X, y, drags=wrong)
        with self.assertRaisesRegex(ValueError, "bekker"):
            mild.GroundFit(plate, "bekker").fit(X, y, drags=[(plate, level)])

    def test_estimator(self):
        fit = mild.GroundFit(model="bekker")
        self.assertEqual(fit.get_params(), {"plate": (0.2, 0.1), "model": "bekker", "hold": None, "fill": None})
        self.assertIs(fit.set_params(plate=(0.1, 0.1)), fit)
        with self.assertRaisesRegex(ValueError, "depth"):
            fit.set_params(depth=1)
        with self.assertRaisesRegex(RuntimeError, "fit"):
            fit.predict([[0.01]])
        for arguments, X, y, name in (({}, [[0.01]], [1], "rows"), ({}, [0.01], [1], "X"), ({}, [[0.01]] * 9, [1], "y"),
                                      ({"model": "rigid"}, [[0.01]] * 9, [1] * 9, "model"),
                                      ({"hold": {"mu": 1}}, [[0.01]] * 9, [1] * 9, "mu"), ({"model": "bekker", "hold": {"plate_width": 0.1}}, [[0.01]] * 9, [1] * 9, "plate_width"), ({"plate": 3}, [[0.01]] * 9, [1] * 9, "plate"),
                                      ({"hold": {"alpha": 90}}, [[0.01]] * 9, [1] * 9, "alpha"),
                                      ({"hold": 3}, [[0.01]] * 9, [1] * 9, "hold"),
                                      ({"fill": "mud"}, [[0.01]] * 9, [1] * 9, "mud"), ({}, [[np.nan]] * 9, [1] * 9, "finite"),
                                      ({}, "abc", [1], "X")):
            with self.assertRaisesRegex((ValueError, TypeError), name):
                mild.GroundFit(**arguments).fit(X, y)
        with self.assertRaisesRegex(ValueError, "lengths"):
            mild.loading([0], [0, 1], [0, 1])


class Derivative(unittest.TestCase):
    def ground(self):
        sole = mild.Sole.plate(0.2, 0.1)
        ground = mild.Ground([sole, sole], mild.Material("foam45"), dt=0.002)
        rng = np.random.default_rng(5)
        square = rng.uniform(-0.3, 0.3, (12, 12))
        ground.inverse_inertia[:] = square @ square.T + np.diag(([0.1] * 3 + [10.0] * 3) * 2)
        ground.position[:] = [[0, 0.1, -0.004], [0, -0.1, -0.006]]
        ground.velocity[:] = ground.free_velocity[:] = rng.uniform(-0.1, 0.1, (2, 6))
        ground.free_velocity[:, 2] -= 0.1
        assert ground.solve()
        return ground

    @staticmethod
    def wrench(ground):
        assert ground.solve()
        return np.hstack([ground.force, ground.torque]).ravel()

    def differences(self, ground, numbers, h):
        """dW by each of the numbers of a view."""
        columns = []
        for k in range(numbers.size):
            kept = numbers.flat[k]
            sides = []
            for side in (-h, h):
                numbers.flat[k] = kept + side
                sides.append(self.wrench(ground))
            numbers.flat[k] = kept
            columns.append((sides[1] - sides[0]) / (2 * h))
        ground.solve()
        return np.array(columns).T

    def test_differences(self):
        ground = self.ground()
        got = ground.derivative(pose=True, velocity=True, fields=["k_pen", "mu"])
        self.assertEqual({name: array.shape for name, array in got.items()},
                         {"law": (2, 6, 6), "wrench_by_free": (12, 12), "velocity_by_free": (12, 12), "wrench_by_pose": (12, 12),
                          "wrench_by_velocity": (12, 12), "wrench_by_material": (12, 2)})
        by_free = self.differences(ground, ground.free_velocity, 1e-6)
        np.testing.assert_allclose(got["wrench_by_free"], by_free, atol=1e-6 * abs(by_free).max())
        np.testing.assert_allclose(got["velocity_by_free"], np.eye(12) + ground.dt * ground.inverse_inertia @ by_free, atol=1e-6)
        by_velocity = self.differences(ground, ground.velocity, 1e-5)
        np.testing.assert_allclose(got["wrench_by_velocity"], by_velocity, atol=1e-6 * abs(by_free).max())
        by_position = self.differences(ground, ground.position, 1e-7)
        moved = got["wrench_by_pose"].reshape(12, 2, 6)[:, :, :3].reshape(12, 6)
        np.testing.assert_allclose(moved, by_position, atol=1e-6 * abs(by_position).max())

    def test_material(self):
        ground = self.ground()
        got = ground.derivative(fields=["k_pen", "mu"])["wrench_by_material"]
        for column, name in enumerate(("k_pen", "mu")):
            sides = []
            for side in (-1e-5, 1e-5):
                other, foam = self.ground(), mild.Material("foam45")
                setattr(foam, name, getattr(foam, name) * (1 + side))
                other.terrain = foam
                sides.append(self.wrench(other))
            slope = (sides[1] - sides[0]) / 2e-5 / getattr(mild.Material("foam45"), name)
            np.testing.assert_allclose(got[:, column], slope, atol=1e-5 * abs(slope).max())

    def test_refused(self):
        ground = self.ground()
        with self.assertRaisesRegex(ValueError, "'k_pan' .* 'k_pen'"):
            ground.derivative(fields=["k_pan"])
        with self.assertRaisesRegex(ValueError, "passive"):
            ground.derivative(fields=["passive"])
        with self.assertRaisesRegex(ValueError, "material = 3"):
            ground.derivative(fields=["mu"], material=3)
        ground.advance()
        with self.assertRaisesRegex(RuntimeError, "solve"):
            ground.derivative()


if __name__ == "__main__":
    unittest.main()
