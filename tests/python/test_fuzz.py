"""Random arguments for everything that the modules offer: an exception or a result, never a crash, and the objects stay
usable. Seeded; FUZZ_SECONDS, FUZZ_SEED."""
import os
import time
import unittest

import numpy as np

import mild
from mild import _ground, envs

SECONDS = float(os.environ.get("FUZZ_SECONDS", "6"))
SEED = int(os.environ.get("FUZZ_SEED", "1"))
ALLOWED = (ValueError, TypeError, RuntimeError, IndexError, OverflowError, MemoryError, OSError, AttributeError, KeyError)


class Odd:
    """Answers DLPack and the buffer protocol with nonsense."""

    def __init__(self, answer):
        self.answer = answer

    def __dlpack__(self, **_):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    def __dlpack_device__(self):
        return self.answer


class Fuzz(unittest.TestCase):
    def setUp(self):
        self.rng = np.random.default_rng(SEED)
        self.soles = [mild.Sole.plate(0.1, 0.1), mild.Sole.plate(0.06, 0.04)]

    def number(self):
        numbers = (0, 1, -1, 2, 3, 7, 0.5, -0.01, 1e-300, 1e300, float("nan"), float("inf"), -float("inf"), 2**31, -(2**31), 2**63,
                   2**64, 10**30, True)
        return numbers[self.rng.integers(len(numbers))]

    def array(self):
        shape = tuple(int(n) for n in self.rng.integers(0, 7, size=self.rng.integers(0, 5)))
        kinds = ("f4", "f8", "f2", "i4", "u1", "?", "c8", ">f4", "O", "U2", "M8[s]", "V3")
        array = np.zeros(shape, kinds[self.rng.integers(len(kinds))])
        change = self.rng.integers(7)
        if change == 0 and array.ndim:
            array = array[::-1]
        elif change == 1:
            array = array.T
        elif change == 2:
            array = np.broadcast_to(array, (2, *shape))
        elif change == 3:
            array.flags.writeable = False
        elif change == 4 and array.dtype.kind == "f":
            array[...] = self.number() if abs(self.number()) < 1e30 else 1
        return array

    def thing(self, deep=0):
        """Any argument."""
        pick = self.rng.integers(16)
        if pick < 4:
            return self.number()
        if pick < 8:
            return self.array()
        if pick == 8 and deep < 2:
            return [self.thing(deep + 1) for _ in range(self.rng.integers(5))]
        odd = (None, "", "grass", "newton", "cpu", "cuda:0", "image", "x" * 5000, "\0", "\ud800", b"", b"123456789", {}, {"a": 1}, (),
               object(), Odd(3), Odd(None), Odd(ValueError("no")), Odd((1, 0)), memoryview(b"12345678"), bytearray(8), range(3),
               mild.Material("snow"), mild.Map("waves"), mild.Terrain("grass"), self.soles[0], self.soles, self.soles[:1],
               mild.Ground(self.soles[:1]))
        return odd[self.rng.integers(len(odd))]

    def call(self, function, names):
        """Calls it with random arguments, some by name."""
        arguments = [self.thing() for _ in range(self.rng.integers(0, 4))]
        keys = {names[i]: self.thing() for i in self.rng.integers(len(names), size=self.rng.integers(0, 5))} if names else {}
        try:
            return function(*arguments, **keys)
        except ALLOWED as error:
            self.assertLess(len(str(error)), 20000)
        return None

    def good_step(self, batch):
        n, feet = batch.robots, batch.feet
        shapes = {"position": (n, feet, 3), "rotation": (n, feet, 3, 3), "velocity": (n, feet, 6),
                  "inverse_inertia": (n, 6 * feet, 6 * feet), "free_velocity": (n, feet, 6), "wrench": (n, feet, 6),
                  "new_velocity": (n, feet, 6)}
        return {name: np.zeros(shape, np.float32) for name, shape in shapes.items()}

    def test_everything(self):
        until, calls = time.monotonic() + SECONDS, 0
        makers = ((mild.Sole, ("outline", "pitch", "sole_z", "target_elements")), (mild.Sole.plate, ("length", "width")),
                  (mild.Map, ("kind", "heights", "labels", "patch_count", "amplitude", "cell", "size", "patches", "seed")),
                  (mild.Terrain, ("materials", "map", "height", "map_x")), (mild.Material, ("preset", "mu", "model", "k_pen")),
                  (mild.Ground, ("soles", "terrain", "dt", "tiles", "solver", "tolerance", "max_iterations")),
                  (mild.Batch, ("robots", "soles", "dt", "tolerance", "max_iterations", "device")),
                  (mild.loading, ("time", "depth", "force", "speed")), (_ground._loading, ("rows",)),
                  (_ground._fit, ("soles", "rows", "model", "hold", "fill")),
                  (_ground._fit_forces, ("soles", "material", "rows")))
        methods = {mild.Sole: ("sinkage", "concentric"), mild.Terrain: ("add_patch", "height_at", "slope_at", "material_at"),
                   mild.Material: ("match", "__eq__", "__setstate__"), mild.Map: (),
                   mild.Ground: ("solve", "check", "advance", "reset", "elements", "element_depths", "print_at", "__setstate__"),
                   mild.Batch: ("set_materials", "set_map", "step", "reset", "load", "store")}
        settable = {mild.Ground: ("dt", "terrain", "state"), mild.Terrain: ("height",), mild.Material: ("mu", "model", "passive")}
        task = envs.open_envs(2, threads=1)
        while time.monotonic() < until:
            maker, names = makers[self.rng.integers(len(makers))]
            made = [self.call(maker, names), mild.Ground(self.soles[:1]), mild.Batch(2, self.soles, 0.01), mild.Terrain("grass")]
            for target in made:
                for _ in range(3):
                    calls += 1
                    some = methods.get(type(target), ())
                    if some:
                        method = some[self.rng.integers(len(some))]
                        if isinstance(target, mild.Batch) and (method == "step" or target.robots > 1000):
                            continue  # below
                        if method != "__setstate__":  # of an object that is made already: not for users
                            self.call(getattr(target, method), ())
                    if type(target) in settable:
                        names = settable[type(target)]
                        try:
                            setattr(target, names[self.rng.integers(len(names))], self.thing())
                        except ALLOWED:
                            pass
            batch, good = made[2], self.good_step(made[2])
            wrong = {name: self.thing() for name in good if self.rng.random() < 0.2}
            try:
                batch.step(**{**good, **wrong})
            except ALLOWED:
                pass
            self.call(task.buffers, ("history", "reward", "done", "timeout", "valid", "critic", "last", "terms"))
            self.call(task.step, ("action", "buffers"))
            self.call(task.statistics, ())
            batch.step(**self.good_step(batch))
        ground = mild.Ground(self.soles[:1], "rubber")
        ground.position[0, 2] = -0.001
        self.assertTrue(ground.solve() and ground.force[0, 2] > 0)
        print(f"{calls} calls, seed {SEED}")


if __name__ == "__main__":
    unittest.main()
