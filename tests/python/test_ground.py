"""The ground of the package: numbers compared with formulas, with the program, and with the laws of mechanics."""
import copy
import math
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
    def test_bekker_law(self):
        """F = area (k_c/b + k_phi) u^n, Bekker 1969, for a slow press; near the surface ours is straight."""
        for name, length, width, k_c in (("clay", 0.2, 0.1, None), ("dry_sand", 0.3, 0.2, None), ("snow", 0.06, 0.2, None),
                                         ("clay", 0.2, 0.1, -30e3), ("clay", 0.06, 0.2, -30e3)):
            sole, soil = mild.Sole.plate(length, width), mild.Material(name)
            soil.k_c = soil.k_c if k_c is None else k_c  # below 0 pressure grows with the plate
            self.assertEqual(soil.plate_width, 0)  # b is the shorter side of the sole
            self.assertAlmostEqual(sole.width, min(length, width), places=12)
            press = mild.press(soil, sole, depth=0.02, speed=1e-4)
            down = (press.way == 0) & (press.depth > 2e-3)
            u = press.depth[down]
            law = press.area * (soil.k_c / min(length, width) + soil.k_phi) * u**soil.exponent
            np.testing.assert_allclose(press.force[down], law, rtol=1e-3)
            self.assertGreater(down.sum(), 800)

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

    @staticmethod
    def pressed(sole, soil):
        """[N, N m] of a heavy body that goes 10 mm deep."""
        ground = mild.Ground([sole], soil, dt=1e-3)
        ground.rotation[0], ground.inverse_inertia[:] = np.eye(3), 1e-9 * np.eye(6)
        for z in np.linspace(0.001, -0.01, 12):
            ground.position[0] = 0, 0, z
            ground.velocity[0] = ground.free_velocity[0] = 0, 0, -1, 0, 0, 0
            ground.solve()
            ground.advance()
        return np.concatenate([ground.force[0], ground.torque[0]])

    def test_box(self):
        """A box, as a shape and as its twelve triangles, stands on its lower face as a plane sole does."""
        corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.05, 0.05) for z in (0, 0.05)])
        faces = [(0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5)]
        triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
        plane = mild.Sole([(-0.1, -0.05), (0.1, -0.05), (0.1, 0.05), (-0.1, 0.05)], pitch=0.0125)
        mesh = {"type": "mesh", "vertices": corners, "triangles": triangles}
        for shape, bound in ((self.BOX, 1e-9), (mesh, 0.02)):
            body = mild.Sole.surface([shape], pitch=0.0125)
            self.assertGreater(body.elements, plane.elements)
            for soil in ("grass", "rubber"):
                wanted = self.pressed(plane, soil)
                self.assertGreater(wanted[2], 50)
                np.testing.assert_allclose(self.pressed(body, soil), wanted, atol=bound * wanted[2])

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
    def test_rest(self):
        """A body on damped elastic ground, F = K u^n, comes to rest where that carries its weight."""
        sole = mild.Sole.plate(0.2, 0.1)
        material = mild.Material(model="hunt_crossley", k_pen=500, exponent=1.5, dissipation=2)
        ground = mild.Ground([sole], material, dt=1e-3)
        body(ground)
        twist = fall(ground, 6000)
        depth = 0.01 * (98.1 / (sole.elements * 500 * 0.01)) ** (1 / 1.5)  # k_pen: force divided by depth at 10 mm
        self.assertLess(np.abs(twist).max(), 1e-6)
        self.assertAlmostEqual(-ground.position[0, 2], depth, delta=1e-3 * depth)
        self.assertAlmostEqual(ground.force[0, 2], 98.1, delta=1e-5)
        self.assertAlmostEqual(ground.depth_mean[0], depth, delta=1e-3 * depth)
        self.assertAlmostEqual(ground.area[0], sole.elements * sole.pitch**2, delta=1e-12)

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
        """Bytes that no ground wrote are refused, or can be stepped from."""
        ground, twist = self.fallen(100)
        for state in (b"", ground.state[:-1], ground.state + b"\0", bytes(len(ground.state))):
            with self.assertRaisesRegex(ValueError, "state"):
                ground.state = state
        with self.assertRaises(TypeError):
            ground.state = 5
        rng, refused = np.random.default_rng(2), 0
        for _ in range(300):
            bent = bytearray(ground.state)
            for place in rng.integers(len(bent), size=rng.integers(1, 6)):
                bent[place] = rng.integers(256)
            other = copy.deepcopy(ground)
            try:
                other.state = bytes(bent)
            except ValueError:
                refused += 1
            other.solve()
            other.advance()
        self.assertTrue(0 < refused < 300)

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
        """The formula of MildMapKind at points of the grid."""
        terrain = mild.Terrain("grass", map=mild.Map("waves", amplitude=0.1, wavelength=1.0, cell=0.05), height=0.5)
        for x, y in ((0.25, 0.05), (-0.3, 0.7), (2.1, 0)):
            wanted = 0.5 + 0.05 * (np.sin(2 * np.pi * x) + np.sin(2 * np.pi * y))
            self.assertAlmostEqual(terrain.height_at(x, y), wanted, delta=1e-6)

    def test_origin_and_slope(self):
        """A map that is moved has its heights elsewhere; the gradient is that of the heights."""
        waves = mild.Map("waves", amplitude=0.1, wavelength=1.0, cell=0.05)
        terrain, moved = mild.Terrain("grass", map=waves), mild.Terrain("grass", map=waves, map_x=0.2, map_y=-0.3)
        for x, y in ((0.22, 0.51), (-0.33, 0.74), (2.12, 0.03)):
            self.assertAlmostEqual(moved.height_at(x + 0.2, y - 0.3), terrain.height_at(x, y), delta=1e-6)
            for slope, (dx, dy) in zip(terrain.slope_at(x, y), ((1e-3, 0), (0, 1e-3)), strict=True):
                rise = terrain.height_at(x + dx, y + dy) - terrain.height_at(x - dx, y - dy)
                self.assertAlmostEqual(slope, rise / 2e-3, delta=0.02)

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

    def test_match(self):
        """The same sinkage under the load, by the definition of a match."""
        sole = mild.Sole.plate(0.2, 0.1)
        sand = mild.Material("sand_loose")
        for model in ("ecc_spring", "bekker", "hunt_crossley"):
            rival = sand.match(model, sole, 200)
            self.assertAlmostEqual(sole.sinkage(rival, 200), sole.sinkage(sand, 200), delta=1e-6)


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

    def test_speed(self):
        """A fast press, with its speeds: the curve of the true numbers is its force, which no slow press has."""
        sole, truth = mild.Sole.plate(0.2, 0.1), mild.Material("sand_dense", model="mild", slip_length=0)
        records = [mild.press(truth, sole, depth=0.03, speed=speed) for speed in (0.01, 1.0)]
        parts = [mild.loading(press.time, press.depth, press.force) for press in records]
        X, y = (np.concatenate(columns) for columns in zip(*parts))
        held = {name: getattr(truth, name) for name in ("alpha", "nu", "c_g", "phi", "rho")}
        fit = mild.GroundFit(hold=held).fit(X, y)
        low, high = fit.intervals_["c_d"]
        self.assertLess(abs(fit.parameters_["c_d"] - truth.c_d), 0.05 * abs(truth.c_d))
        fast = slice(len(y) // 2, None)
        np.testing.assert_allclose(fit.predict(X)[fast], y[fast], atol=0.01 * y.max())
        self.assertGreater(np.abs(fit.predict(X[fast, :1]) - y[fast]).max(), 0.05 * y.max())

    def test_plates(self):
        """A record on each of two plates: their numbers, and of bekker k_c and k_phi apart, because b differs."""
        sizes = [(0.15, 0.1), (0.3, 0.2)]
        for ground, model, names in (("foam45", "mild", ("k_pen",)), ("clay", "bekker", ("k_c", "k_phi", "exponent"))):
            truth = mild.Material(ground)
            records = [mild.press(truth, mild.Sole.plate(*size), depth=0.04) for size in sizes]
            X, y = zip(*(mild.loading(press.time, press.depth, press.force) for press in records))
            for plates in (sizes, tuple(mild.Sole.plate(*size) for size in sizes)):
                fit = mild.GroundFit(plate=plates, model=model).fit(X, y)
                for name in names:
                    self.assertLess(abs(fit.parameters_[name] / getattr(truth, name) - 1), 1e-3, name)
                predicted = fit.predict(X)
                for own, force in zip(predicted, y):
                    np.testing.assert_allclose(own, force, atol=0.01 * force.max())
                self.assertGreater(fit.score(X, y), 0.999)
            with self.assertRaisesRegex(ValueError, r"\b3 records .*\b2 plates"):
                fit.fit([*X, X[0]], [*y, y[0]])
            with self.assertRaisesRegex(ValueError, "y: "):
                fit.fit(X, y[:1])
        with self.assertRaisesRegex(ValueError, "plate_width"):
            mild.GroundFit(model="bekker", hold={"plate_width": 0.1}).fit(X[0], y[0])

    def test_save(self):
        """What was fitted becomes a soil's file, the rest is the fill's; numbers that nobody knows are refused."""
        truth, X = mild.Material("clay", k_c=9000, mu=0.3), [np.linspace(0.001, 0.04, 60)[:, None]] * 2
        sizes = [(0.1, 0.08), (0.3, 0.2)]
        y = [mild.Sole.plate(*size).elements * 0.0195**2 * (truth.k_c / min(size) + truth.k_phi) * x[:, 0] ** truth.exponent
             for size, x in zip(sizes, X)]
        fit = mild.GroundFit(sizes, model="bekker", fill=truth)
        with self.assertRaisesRegex(RuntimeError, "fitted"):
            fit.save("x.ini")
        fit.fit(X, y)
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

    def slide(self, material, depth, load):
        """A square of 0.1 m is pressed to a depth and slides 30 mm, led or under the load that it has: slip, depth, up, along."""
        ground, table = mild.Ground([mild.Sole.plate(0.1, 0.1)], material, dt=1e-3), []
        at, speed, mass = np.zeros(2), np.array([0.0, -0.05]), 0.0  # along and up
        ground.inverse_inertia[:] = 0.0
        for step in range(round(depth / 5e-5) + 600):
            if step == round(depth / 5e-5):
                mass = ground.force[0, 2] / 9.81 if load else 0.0
                speed = np.array([0.05, 0.0])
            ground.inverse_inertia[2, 2] = 1 / mass if mass else 0.0
            ground.position[0] = at[0], 0, at[1]
            ground.rotation[0] = np.eye(3)
            ground.velocity[0] = speed[0], 0, speed[1], 0, 0, 0
            ground.free_velocity[0] = speed[0], 0, speed[1] - (9.81e-3 if mass else 0.0), 0, 0, 0
            ground.solve()
            ground.advance()
            speed[1] = ground.new_velocity[0, 2] if mass else speed[1]
            at += 1e-3 * speed
            table.append((at[0], -at[1], ground.force[0, 2], ground.force[0, 0]))
        return np.array(table)

    def test_drags(self):
        """Plates that slide give slip_length, grip and, where they sink meanwhile, regain_length back."""
        truth = mild.Material("sand_loose", slip_growth=0, slip_length=0.003, regain_length=0.0012, grip=0.13, recovery=0, phi=0.6, rho=2500)
        truth.model = "mild_merged"
        sizes, plate = [(0.1, 0.1), (0.2, 0.12)], (0.1, 0.1)
        records = [mild.press(truth, mild.Sole.plate(*size), depth=0.03) for size in sizes]
        X, y = zip(*(mild.loading(press.time, press.depth, press.force) for press in records))
        hold = {name: getattr(truth, name) for name in ("alpha", "c_g", "c_d", "phi", "rho")}
        drags = [(plate, self.slide(truth, 0.015, load)) for load in (False, True)]
        self.assertGreater(drags[1][1][-1, 1], 0.022)  # it has sunk
        level = mild.GroundFit(sizes, "mild_merged", hold={**hold, "mu": 0.5}).fit(X, y, drags=drags[:1])
        self.assertAlmostEqual(level.parameters_["slip_length"], 0.003, delta=3e-5)
        self.assertAlmostEqual(level.parameters_["grip"], 0.13, delta=1.3e-3)
        self.assertEqual(level.states_["regain_length"], "no_effect")
        both = mild.GroundFit(sizes, "mild_merged", hold={**hold, "mu": 0.5}).fit(X, y, drags=drags)
        self.assertAlmostEqual(both.parameters_["slip_length"], 0.003, delta=6e-5)
        self.assertAlmostEqual(both.parameters_["regain_length"], 0.0012, delta=1e-4)
        self.assertLess(both.drag_residual_, 0.02 * drags[0][1][:, 2].max())
        self.assertEqual(both.material_.slip_length, both.parameters_["slip_length"])
        none = drags[0][1].copy()
        none[:, 3] = np.nan  # friction was not measured
        self.assertTrue(math.isnan(mild.GroundFit(sizes, "mild_merged", hold=hold).fit(X, y, drags=[(plate, none)]).parameters_["grip"]))
        for wrong, name in (([(plate, none[:, :3])], "shape"), ([(plate, none[:5])], "slide"), ([1], "plate"), ([(3, none)], "plate"),
                            ([(plate, none)] * 17, "16")):
            with self.assertRaisesRegex((ValueError, TypeError), name):
                mild.GroundFit(sizes, "mild_merged", hold=hold).fit(X, y, drags=wrong)
        with self.assertRaisesRegex(ValueError, "bekker"):
            mild.GroundFit(sizes, "bekker").fit(X, y, drags=drags)

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
                                      ({"hold": {"mu": 1}}, [[0.01]] * 9, [1] * 9, "mu"), ({"plate": 3}, [[0.01]] * 9, [1] * 9, "plate"),
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
