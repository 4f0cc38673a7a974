"""What no user writes but a file or another program may: states that no object gave, objects that were never made, sequences that
change while they are read. An exception that says so, or an object that works; never a crash. Seeded; FUZZ_STATES, FUZZ_SEED."""
import copy
import os
import pickle
import struct
import unittest
import warnings

import numpy as np

import mild
from mild import _envs, _ground, envs

COUNT = int(os.environ.get("FUZZ_STATES", "3000"))
SEED = int(os.environ.get("FUZZ_SEED", "1"))
ALLOWED = (ValueError, TypeError, RuntimeError, OverflowError, MemoryError, IndexError, AttributeError)
OUTLINE = [[0, 0], [0.1, 0], [0.1, 0.05], [0, 0.05]]


def made():
    """An object of every class that has a state."""
    waves = mild.Map("waves", amplitude=0.01, patches="checker", patch_size=0.1, patch_count=2)
    terrain = mild.Terrain(["grass", "snow"], map=waves, height=0.01)
    patched = mild.Terrain(["grass", "snow"])
    patched.add_patch(0, 1, 0, 1, 1)
    ground = mild.Ground([mild.Sole(OUTLINE), mild.Sole.plate(0.06, 0.04)], patched, tiles=8)
    ground.position[:, 2] = -0.01
    ground.inverse_inertia[:] = np.eye(12)
    ground.solve()
    ground.advance()
    return [mild.Material("snow"), terrain, patched, ground]


def use(thing):
    """Calls what reads all of an object."""
    if isinstance(thing, mild.Ground):
        thing.solve()
        thing.advance()
        thing.solve()
        return [thing.elements(foot)["depth"].sum() for foot in range(thing.feet)], thing.terrain.height_at(0, 0), thing.state
    if isinstance(thing, mild.Terrain):
        return [thing.height_at(x, 0.3) + thing.material_at(x, 0.3) for x in (-1e9, 0, 0.5)], thing.slope_at(0.1, 0.1), thing.materials
    return thing.as_dict()


class States(unittest.TestCase):
    def setUp(self):
        self.rng = np.random.default_rng(SEED)
        self.good = made()
        warnings.simplefilter("ignore", RuntimeWarning)

    def value(self):
        values = (0, 1, -1, 3, 2**31, -(2**31), 2**63, 10**30, 0.5, -0.01, 1e-300, 1e300, float("nan"), float("inf"), True, None, "",
                  "grass", "newton", "x" * 3000, "\0", "\ud800", b"", bytes(8), bytes(40000), (), [], {}, {"mu": "1"}, {1: 2}, [1, 2], object(),
                  mild.Sole(OUTLINE), [mild.Sole.plate(0.1, 0.1)] * 2, mild.Map("waves"), mild.Sole, mild.Ground.__new__(mild.Ground),
                  mild.Terrain.__new__(mild.Terrain), [mild.Sole.__new__(mild.Sole)], mild.Map.__new__(mild.Map),
                  mild.Material.__new__(mild.Material), *self.good)
        return values[self.rng.integers(len(values))]

    def bent_bytes(self, kept):
        """Some bytes set, some numbers set, cut off, or longer."""
        bent = bytearray(kept)
        change = self.rng.integers(5)
        if change == 0:
            return bytes(bent[: self.rng.integers(len(bent) + 1)])
        if change == 1:
            return bytes(bent) + bytes(int(self.rng.integers(1, 99)))
        for _ in range(self.rng.integers(1, 5)):
            if change == 2 and len(bent) >= 8:
                number = (float("nan"), 1e300, -1e300, 1e-300, 0.0)[self.rng.integers(5)]
                struct.pack_into("d", bent, 8 * int(self.rng.integers(len(bent) // 8)), number)
            elif bent:
                bent[self.rng.integers(len(bent))] = self.rng.integers(256)
        return bytes(bent)

    def bent(self, state, deep=0):
        """A state with something else in some place."""
        pick = self.rng.integers(8)
        if pick == 0 and deep:
            return self.value()
        if isinstance(state, (tuple, list)) and len(state):
            parts = list(state)
            place = int(self.rng.integers(len(parts)))
            if pick == 1:
                parts = parts[:place]
            elif pick == 2:
                parts.append(self.value())
            else:
                parts[place] = self.bent(parts[place], deep + 1)
            return type(state)(parts)
        if isinstance(state, bytes):
            return self.bent_bytes(state)
        if isinstance(state, dict) and state:
            parts = dict(state)
            key = list(parts)[self.rng.integers(len(parts))]
            if pick == 1:
                del parts[key]
            elif pick == 2:
                parts[("nothing", 5, None, "\ud800")[self.rng.integers(4)]] = "1"
            else:
                parts[key] = ("nan", "", "1e300", "-1", 3, None, "x" * 3000)[self.rng.integers(7)]
            return parts
        return self.value()

    def test_bad_states(self):
        """Every state is refused, or makes an object that can be used and kept."""
        refused = 0
        for _ in range(COUNT):
            kind = self.good[self.rng.integers(len(self.good))]
            state = self.bent(kind.__getstate__()) if self.rng.random() < 0.9 else self.value()
            thing = type(kind).__new__(type(kind))
            try:
                thing.__setstate__(state)
            except ALLOWED as error:
                refused += 1
                self.assertGreater(len(str(error)), 5)
                with self.assertRaises(ALLOWED):
                    use(thing)
                continue
            again = pickle.loads(pickle.dumps(thing))
            self.assertEqual(str(use(again)), str(use(thing)))
        self.assertTrue(COUNT / 3 < refused < COUNT)
        print(f"{COUNT} states, {refused} refused, seed {SEED}")

    def test_bad_recipes(self):
        """Sole and Map are made again by calls, with whatever arguments."""
        from mild import _again
        for _ in range(COUNT // 10):
            for call in (lambda: _again.plate(self.value(), self.value()), lambda: _again.concentric(self.value()),
                         lambda: _again.make_map(self.value())):
                try:
                    pickle.dumps(call())
                except (*ALLOWED, OSError):
                    pass

    def test_shapes_of_states(self):
        """What issue 22 named, and its neighbours: too few, too many, and other types."""
        for kind in self.good:
            state = kind.__getstate__()
            short = [state[:n] for n in range(len(state))] + [(*state, 0)] if isinstance(state, tuple) else [{"mu": "nan"}]
            for wrong in (*short, (), None, 5, b"", [], "text", object(), (None,) * 9, ((),) * 9):
                with self.assertRaises((TypeError, ValueError)):
                    type(kind).__new__(type(kind)).__setstate__(wrong)
        kept = list(self.good[3].__getstate__())
        kept[8] = kept[8][:-1]
        with self.assertRaisesRegex(ValueError, "input"):
            mild.Ground.__new__(mild.Ground).__setstate__(tuple(kept))

    def test_twice(self):
        """An object that is made is not made again."""
        for kind in self.good:
            before = use(copy.deepcopy(kind))
            with self.assertRaises(TypeError):
                kind.__setstate__(kind.__getstate__())
            self.assertEqual(str(use(copy.deepcopy(kind))), str(before))

    def test_never_made(self):
        """__new__ without __init__: every method, every attribute, and as an argument of every function."""
        classes = [value for module in (_ground, _envs) for value in vars(module).values() if isinstance(value, type)]
        self.assertGreater(len(classes), 7)
        sole = mild.Sole.plate(0.1, 0.1)
        takers = (lambda x: mild.Ground([x]), lambda x: mild.Ground([sole], x), lambda x: mild.Batch(1, [x], 0.01),
                  lambda x: mild.Terrain(x), lambda x: mild.Terrain("grass", map=x), lambda x: mild.Material(x),
                  lambda x: mild.press(x, sole), lambda x: mild.press("grass", x), lambda x: mild.press("grass", sole, map=x),
                  lambda x: mild.Batch(1, [sole], 0.01).load(0, x), lambda x: mild.Batch(1, [sole], 0.01).store(0, x),
                  lambda x: mild.Batch(1, [sole], 0.01).set_map(x), lambda x: mild.Batch(1, [sole], 0.01).set_materials([x]),
                  lambda x: envs.open_envs(1, threads=1).reset(x), lambda x: mild.Material("grass").match("mild", x, 10),
                  lambda x: sole.sinkage(x, 10), pickle.dumps)
        for kind in classes:
            empty = kind.__new__(kind)
            for name in dir(kind):
                if name.startswith("__") and (name not in vars(kind) or name in ("__doc__", "__module__", "__init__", "__setstate__",
                                                                                "__new__", "__hash__")):
                    continue  # object's own, and what makes it
                if isinstance(vars(kind).get(name), staticmethod):
                    continue
                with self.assertRaises(ALLOWED, msg=f"{kind.__name__}.{name}"):
                    member = getattr(empty, name)
                    member(*((empty,) if name == "__eq__" else ()))
                    self.fail(f"{name} of an empty object gave {member!r}")
            for taker in takers:
                with self.assertRaises(ALLOWED):
                    taker(empty)

    def test_changing_sequences(self):
        """Soles from a sequence that gives others each time, and keeps none."""
        class Changing:
            def __init__(self):
                self.sizes = iter((0.04, 0.04, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6))

            def __len__(self):
                return 2

            def __getitem__(self, index):
                if index >= 2:
                    raise IndexError
                return mild.Sole.plate(next(self.sizes), 0.04)

        ground = mild.Ground(Changing())
        ground.solve()
        self.assertEqual([len(ground.elements(foot)["depth"]) for foot in (0, 1)], [mild.Sole.plate(0.04, 0.04).elements] * 2)
        batch = mild.Batch(2, Changing(), 0.01)
        self.assertLess(batch.stride, 32)


if __name__ == "__main__":
    unittest.main()
