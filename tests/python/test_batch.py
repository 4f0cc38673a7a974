"""The batch ground on the CPU: numbers of the single ground, arrays in place, and arguments that do not fit."""
import unittest

import numpy as np

import mild


class Arrays:
    """Arrays of a step of `robots` robots with two feet in loose ground, moving."""

    def __init__(self, batch, rng):
        n, feet = batch.robots, batch.feet
        half = rng.normal(size=(n, 6 * feet, 6 * feet)) / 7
        self.inputs = {
            "position": rng.uniform([-0.3, -0.3, -0.03], [0.3, 0.3, 0.005], size=(n, feet, 3)),
            "rotation": np.tile(np.eye(3), (n, feet, 1, 1)), "velocity": rng.normal(size=(n, feet, 6)) * 0.1,
            "inverse_inertia": half @ half.transpose(0, 2, 1), "free_velocity": np.zeros((n, feet, 6))}
        self.inputs["free_velocity"][:] = self.inputs["velocity"] - [0, 0, 0.02, 0, 0, 0]
        self.inputs = {name: np.ascontiguousarray(array, np.float32) for name, array in self.inputs.items()}
        self.outputs = {"wrench": np.full((n, feet, 6), np.nan, np.float32), "new_velocity": np.full((n, feet, 6), np.nan, np.float32),
                        "foot": np.full((n, feet, 6), np.nan, np.float32), "residual": np.full(n, np.nan, np.float32),
                        "elements": np.full((n, 4, feet, batch.stride), np.nan, np.float32), "iterations": np.full(n, -1, np.int32)}

    def all(self, **changed):
        return {**self.inputs, **self.outputs, **changed}


class Batch(unittest.TestCase):
    def setUp(self):
        self.rng = np.random.default_rng(3)
        self.soles = [mild.Sole.plate(0.2, 0.1), mild.Sole.plate(0.15, 0.1)]
        self.batch = mild.Batch(6, self.soles, 0.002)

    def test_numbers_of_the_single_ground(self):
        names = ["grass", "sand_loose", "foam45"]
        self.batch.set_materials(names)
        material = np.array([0, 1, 2, 0, 1, 2], np.int32)
        grounds = [mild.Ground(self.soles, names[m], 0.002) for m in material]
        for _ in range(3):
            arrays = Arrays(self.batch, self.rng)
            self.batch.step(**arrays.all(material=material))
            for i, ground in enumerate(grounds):
                for name, array in arrays.inputs.items():
                    getattr(ground, name)[:] = array[i]
                ground.solve()
                wrench = np.hstack([ground.force, ground.torque])
                np.testing.assert_allclose(arrays.outputs["wrench"][i], wrench, rtol=1e-3, atol=1e-3 * np.abs(wrench).max())
                np.testing.assert_allclose(arrays.outputs["new_velocity"][i], ground.new_velocity, atol=1e-3)
                np.testing.assert_allclose(arrays.outputs["foot"][i, :, 5], ground.area, atol=1e-6)
                for f, sole in enumerate(self.soles):
                    of = ground.elements(f)
                    for k, name in enumerate(("depth", "normal", "tangent_x", "tangent_y")):
                        got = arrays.outputs["elements"][i, k, f, :sole.elements]
                        # of the 0.2 mN of drag on a foot without load, whose displacements of a few um are rounded
                        least = 0.1 if name.startswith("tangent") and not of["normal"].any() else 1e-3
                        np.testing.assert_allclose(got, of[name], rtol=1e-2, atol=2e-3 * max(np.abs(of[name]).max(), least))
                ground.advance()
            self.assertTrue((arrays.outputs["iterations"] >= 1).all())
            self.assertTrue((arrays.outputs["residual"] >= 0).all() and arrays.outputs["residual"].max() < 1e-3)
            self.assertGreater(np.abs(arrays.outputs["wrench"]).max(), 10)

    def test_points(self):
        """Feet that transmit no moment: what A has for moments does not count, and is not read."""
        soles, moment = [mild.Sole.plate(0.07, 0.04)] * 4, np.arange(24) % 6 >= 3
        arrays = Arrays(mild.Batch(6, soles, 0.002), self.rng)
        wrench, A = [], arrays.inputs["inverse_inertia"]
        for points, value in (False, 0), (True, np.nan):
            A[:, moment] = A[:, :, moment] = value
            mild.Batch(6, soles, 0.002, points=points).step(**arrays.all())
            wrench.append(arrays.outputs["wrench"].copy())
        self.assertGreater(np.abs(wrench[0]).max(), 10)
        np.testing.assert_allclose(wrench[1], wrench[0], rtol=1e-4, atol=1e-4 * np.abs(wrench[0]).max())

    def test_load_and_store(self):
        """A robot goes on where a ground of the CPU is, and back."""
        self.batch.set_materials(["sand_loose"])
        arrays = Arrays(self.batch, self.rng)
        arrays.inputs["position"][..., 2] = -0.02
        self.batch.step(**arrays.all())
        ground, other = mild.Ground(self.soles, "sand_loose", 0.002), mild.Ground(self.soles, "sand_loose", 0.002)
        self.batch.store(2, ground)
        self.assertGreater(ground.element_depths(0).max(), 0.01)
        self.batch.reset(np.array([0, 0, 1, 0, 0, 0], bool))
        self.batch.store(2, other)
        self.assertEqual(other.element_depths(0).max(), 0)
        self.batch.load(2, ground)
        self.batch.store(2, other)
        np.testing.assert_array_equal(other.element_depths(0), ground.element_depths(0))
        with self.assertRaisesRegex(IndexError, "robot"):
            self.batch.load(6, ground)
        with self.assertRaisesRegex(TypeError, "ground"):
            self.batch.load(0, self.soles[0])
        with self.assertRaisesRegex(ValueError, "sole"):
            self.batch.load(0, mild.Ground(self.soles[:1]))

    def test_arrays_that_do_not_fit(self):
        """Each wrong in one way: the exception names the array."""
        for name, array in Arrays(self.batch, self.rng).all().items():
            read_only = array.copy()
            read_only.flags.writeable = False
            wrong = [array[:-1], array[..., None], array.astype(np.float64), array.astype(np.float16), np.repeat(array, 2, 0)[::2],
                     "text", 3, [1.0], object(), array.tobytes(), np.frombuffer(b"\0" + array.tobytes(), np.uint8)[1:]]
            wrong += [read_only] if name in Arrays(self.batch, self.rng).outputs else [None]
            wrong += [np.asfortranarray(array)] if array.ndim > 1 else []
            for bad in wrong:
                with self.assertRaisesRegex((ValueError, TypeError), "^" + name + ":"):
                    self.batch.step(**Arrays(self.batch, self.rng).all(**{name: bad}))

    def test_shared_memory(self):
        """Every two arrays of which one is written: refused by name when they have a byte in common, but for the two pairs that
        batch.h allows, with the numbers that they have apart."""
        extra = {"material": np.zeros(6, np.int32), "height": np.zeros(6, np.float32), "map_origin": np.zeros((6, 2), np.float32)}
        plain = Arrays(self.batch, self.rng).all(**extra)
        outputs = list(Arrays(self.batch, self.rng).outputs)
        allowed, pairs = (("velocity", "wrench"), ("free_velocity", "new_velocity")), 0
        self.batch.step(**{name: array.copy() for name, array in plain.items()} | {name: plain[name] for name in outputs}, advance=False)
        for name in plain:
            for out in outputs:
                if name == out:
                    continue
                for shift in (0, 4):  # the same, and from its second number on
                    memory = np.zeros(plain[name].nbytes + plain[out].nbytes + 8, np.uint8)
                    call = {key: array.copy() for key, array in plain.items()}
                    for key, start in ((name, 0), (out, shift)):
                        view = memory[start : start + plain[key].nbytes].view(plain[key].dtype).reshape(plain[key].shape)
                        if key == name:
                            view[...] = plain[key] if key not in outputs else 0
                        call[key] = view
                    if (name, out) in allowed and not shift:
                        self.batch.step(**call, advance=False)
                        np.testing.assert_array_equal(call[out], plain[out])
                        continue
                    with self.assertRaisesRegex(ValueError, rf"^({name}, {out}|{out}, {name}): "):
                        self.batch.step(**call)
                    pairs += 1
        self.assertEqual(pairs, 2 * len(outputs) * (len(plain) - 1) - 2)

    def test_arguments(self):
        for arguments, name in (((0, self.soles, 0.002), "robots"), ((2, [], 0.002), "soles"), ((2, self.soles, -1), "dt")):
            with self.assertRaisesRegex(ValueError, name):
                mild.Batch(*arguments)
        with self.assertRaisesRegex(ValueError, "device"):
            mild.Batch(2, self.soles, 0.002, device="tpu")
        with self.assertRaisesRegex(ValueError, "materials"):
            self.batch.set_materials([])
        with self.assertRaisesRegex(ValueError, "mud"):
            self.batch.set_materials(["mud"])
        with self.assertRaisesRegex(TypeError, "materials: they must be"):
            self.batch.set_materials(3)
        self.batch.set_materials("grass")  # one, as for a Terrain
        with self.assertRaisesRegex(ValueError, "material: 5 numbers, but the robots stand on 6"):
            self.batch.set_materials(["foam45", "grass"], material=[1] * 5)
        self.batch.set_materials(["foam45", "grass"], material=[1] * 6)
        shin = mild.Sole.surface([{"type": "box", "size": [0.05, 0.04, 0.1]}])
        with self.assertRaisesRegex(ValueError, r"soles\[1\].*first"):
            mild.Batch(2, [shin, self.soles[0]], 0.002)
        with self.assertRaisesRegex(TypeError, "map"):
            self.batch.set_map(3)

    def test_map_origin(self):
        """The origin of each robot's map is that of its Terrain."""
        waves, origin = mild.Map("waves", amplitude=0.05), self.rng.uniform(-1, 1, (6, 2)).astype(np.float32)
        self.batch.set_materials(["grass"])
        self.batch.set_map(waves)
        arrays = Arrays(self.batch, self.rng)
        self.batch.step(**arrays.all(map_origin=origin))
        for i, (x, y) in enumerate(origin):
            ground = mild.Ground(self.soles, mild.Terrain("grass", map=waves, map_x=x, map_y=y), 0.002)
            for name, array in arrays.inputs.items():
                getattr(ground, name)[:] = array[i]
            ground.solve()
            np.testing.assert_allclose(arrays.outputs["wrench"][i, :, 2], ground.force[:, 2], rtol=1e-3, atol=0.05)

    def test_close(self):
        self.batch.close()
        self.batch.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            self.batch.reset()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            self.batch.step(*[None] * 5, wrench=None, new_velocity=None)


if __name__ == "__main__":
    unittest.main()
