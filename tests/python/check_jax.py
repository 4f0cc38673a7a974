"""mild.jax beside mild.Batch, and mild.mjx beside the engine plugin; needs jax and mujoco-mjx. `make jax-check` runs it on the CPU. On a GPU:
check_jax.py --device gpu (JAX and this build, or mild_cuda, must have CUDA). --kinds box,sphere: feet of these kinds alone under MJX."""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu")
parser.add_argument("--kinds")
given, rest = parser.parse_known_args()
os.environ["JAX_PLATFORMS"] = "cuda,cpu" if given.device == "gpu" else "cpu"  # before JAX is imported

import jax
import jax.numpy as jnp
import jaxlib
import mujoco
import numpy as np

import mild
import mild.jax
import mild.mjx
from soft_robot import APPLIED, KINDS, SOILS, reference, robot, start

N, DT = 6, 0.005
SOLE = mild.Sole.plate(0.2, 0.1)
DEVICE = {"cpu": "cpu", "gpu": "cuda"}[given.device]
MASS = 5.0
A = np.diag([1 / MASS] * 3 + [1 / 0.02] * 3).astype(np.float32)


def made():
    batch = mild.Batch(N, [SOLE], DT, device=DEVICE)
    batch.set_materials(["sand_loose", "foam45"])
    return batch


def state():
    """Plates above and in the ground, moving."""
    position = np.zeros((N, 1, 3), np.float32)
    position[:, 0, 2] = np.linspace(-0.02, 0.01, N)
    velocity = np.zeros((N, 1, 6), np.float32)
    velocity[:, 0, 2], velocity[:, 0, 0] = -0.2, np.linspace(0, 0.3, N)
    return position, velocity


ROTATION = np.tile(np.eye(3, dtype=np.float32), (N, 1, 1, 1))
MATERIAL = (np.arange(N) % 2).astype(np.int32)


def fall(position, velocity, contact):
    """A step of bodies that do not turn, by `contact` (position, velocity, free velocity) -> new velocity."""
    free = velocity.at[..., 2].add(-9.81 * DT) if hasattr(velocity, "at") else velocity - np.array([0, 0, 9.81 * DT, 0, 0, 0], np.float32)
    new = contact(position, velocity, free)
    return position + DT * new[..., :3], new


class Jit(unittest.TestCase):
    def test_walk_of_steps(self):
        """200 steps in one compiled scan are those of Batch.step."""
        batch, other = made(), mild.Batch(N, [SOLE], DT, device="cpu")
        other.set_materials(["sand_loose", "foam45"])
        inertia = np.tile(A, (N, 1, 1))

        def one(carry, _):
            def contact(position, velocity, free):
                return mild.jax.step(batch, position, ROTATION, velocity, inertia, free, material=MATERIAL)[1]
            after = fall(*carry, contact)
            return after, after[0]

        position, velocity = state()
        run = jax.jit(lambda p, v: jax.lax.scan(one, (p, v), None, length=200))
        seen = np.array(run(jnp.asarray(position), jnp.asarray(velocity))[1])
        wrench, new = np.empty((N, 1, 6), np.float32), np.empty((N, 1, 6), np.float32)

        def contact(position, velocity, free):
            other.step(position, ROTATION, velocity, inertia, free, wrench=wrench, new_velocity=new, material=MATERIAL)
            return new.copy()

        worst = 0
        for step in range(200):
            position, velocity = fall(position, velocity, contact)
            worst = max(worst, np.abs(seen[step] - position).max())
        print(f"200 steps in jit: positions differ from those of Batch.step on the CPU by at most {worst:.1e} m")
        self.assertLess(worst, 2e-6)
        self.assertTrue((seen[-1, :, 0, 2] < 0).all())
        self.assertFalse(np.allclose(seen[-1, 0], seen[-1, 1], atol=1e-4))

    @unittest.skipUnless(DEVICE == "cpu" and (os.cpu_count() or 1) > 1, "one step at a time")
    def test_two_at_once(self):
        """While a large batch is in its step, a small one makes many."""
        many = 40000
        large, small = mild.Batch(many, [SOLE], DT, device="cpu"), made()
        large.set_materials(["sand_loose"])

        def stepper(batch, count):
            one = (np.zeros((count, 1, 3), np.float32), np.tile(np.eye(3, dtype=np.float32), (count, 1, 1, 1)),
                   np.zeros((count, 1, 6), np.float32), np.tile(A, (count, 1, 1)), np.zeros((count, 1, 6), np.float32))
            one[0][:, 0, 2] = -0.02
            one = [jnp.asarray(array) for array in one]  # the step alone is timed, and no copies
            run = jax.jit(lambda *arrays: mild.jax.step(batch, *arrays)[0])
            run(*one).block_until_ready()
            return lambda: run(*one).block_until_ready()

        runs, done, made_of = (stepper(large, many), stepper(small, N)), threading.Event(), 0
        thread = threading.Thread(target=lambda: (runs[0](), done.set()))
        thread.start()
        while not done.is_set():
            runs[1]()
            made_of += not done.is_set()
        thread.join()
        print(f"{made_of} steps of the small batch in one of the large")
        self.assertGreater(made_of, 100)  # under one lock 6 to 10

    def test_outputs(self):
        """Wrench, new velocity and foot of a step, with heights; without `advance` nothing is remembered; `begin` forgets."""
        batch, other = made(), mild.Batch(N, [SOLE], DT, device="cpu")
        other.set_materials(["sand_loose", "foam45"])
        position, velocity = state()
        inertia, height = np.tile(A, (N, 1, 1)), np.linspace(0, 0.01, N).astype(np.float32)
        out = [np.empty((N, 1, 6), np.float32) for _ in range(3)]

        def both(advance, begin=None):
            if begin is not None:
                other.reset(begin)
            other.step(position, ROTATION, velocity, inertia, velocity, wrench=out[0], new_velocity=out[1], foot=out[2], material=MATERIAL, height=height,
                       advance=advance)
            seen = jax.jit(lambda p: mild.jax.step(batch, p, ROTATION, velocity, inertia, velocity, material=MATERIAL, height=height, begin=begin,
                                                   advance=advance))(position)
            for ours, theirs in zip(out, seen):
                np.testing.assert_allclose(np.array(theirs), ours, rtol=1e-4, atol=1e-4 * np.abs(ours).max())
            return out[0].copy()

        first = both(False)
        np.testing.assert_array_equal(both(False), first)
        both(True)
        position[..., 2] += 0.004
        lifted = both(False)
        some = np.arange(N) < 3
        fresh = both(False, some)
        self.assertTrue((np.abs(fresh[some] - lifted[some]).max(axis=(1, 2)) > 1).any())
        np.testing.assert_array_equal(fresh[~some], lifted[~some])

    def test_misuse(self):
        batch = made()
        position, velocity = state()
        inertia = np.tile(A, (N, 1, 1))

        def step(position=position, inertia=inertia, **keys):
            return [np.array(x) for x in mild.jax.step(batch, position, ROTATION, velocity, inertia, velocity, **keys)]

        for wrong, said in (({"position": position[:3]}, "position"), ({"inertia": inertia[:, :3]}, "inverse_inertia"),
                            ({"height": np.zeros(2)}, "height"), ({"begin": np.zeros(2, bool)}, "begin")):
            with self.assertRaisesRegex(Exception, f"mild: {said} is not what this batch takes"):
                step(**wrong)
        if DEVICE == "cpu":
            with self.assertRaisesRegex(Exception, "material: 2 is outside 0 .. 1"):
                step(material=MATERIAL + 1)
        step()
        batch.close()
        with self.assertRaisesRegex(Exception, "the batch is closed"):
            step()


class Mjx(unittest.TestCase):
    def compare(self, kind, integrator, steps, change=lambda text: text):
        """Worst difference of a force from the engine plugin's over the largest one, in a first step and in all; and of the positions at the end."""
        text, feet = robot(kind, integrator)
        text = change(text)
        ground = mild.mjx.Ground(mujoco.MjSpec.from_string(text), feet, SOILS, worlds=len(SOILS))
        states = [mujoco.MjData(ground.model) for _ in SOILS]
        for seed, data in enumerate(states):
            start(data, seed)
        d = ground.data().replace(**{name: jnp.asarray(np.array([getattr(data, name) for data in states]), jnp.float32)
                                     for name in ("qpos", "qvel", "ctrl", "qfrc_applied", "xfrc_applied")})

        def one(d, _):
            d, wrench, foot = ground.step(d)
            return d, (wrench, foot)

        d, (forces, depths) = jax.jit(lambda d: jax.lax.scan(one, d, None, length=steps))(d)
        np.testing.assert_array_equal(np.array(d.qfrc_applied), np.tile(np.float32(APPLIED), (len(SOILS), 1)))
        self.assertTrue((np.array(depths)[0, ..., 4] > 0).all())
        first, worst, apart = 0, 0, 0
        for world, soil in enumerate(SOILS):
            wanted, data = reference(mujoco.MjSpec.from_string(text), feet, soil, world, steps)
            self.assertGreater(wanted[:, :, 2].max(), 20)
            parts = 3 if kind == "sphere" else 6  # whose torque the plugin gives about another point, none here
            for k in range(0, parts, 3):
                off = np.abs(np.array(forces)[:, world, :, k : k + 3] - wanted[:, :, k : k + 3]).max((1, 2))
                first, worst = max(first, off[0] / np.abs(wanted[0, :, k : k + 3]).max()), max(worst, off.max() / np.abs(wanted[..., k : k + 3]).max())
            apart = max(apart, np.abs(np.array(d.qpos)[world] - data.qpos).max())
        return first, worst, apart

    def test_forces(self):
        wanted = given.kinds.split(",") if given.kinds else KINDS
        for integrator, kinds in (("implicitfast", wanted), ("Euler", [kind for kind in ("site", "sphere") if kind in wanted])):
            for kind in kinds:
                with self.subTest(kind=kind, integrator=integrator):
                    first, worst, apart = self.compare(kind, integrator, 25)
                    print(f"MJX, {kind:>9s} {integrator}: forces of a first step differ by {first:.1e}, in 25 steps by {worst:.1e}; then {apart:.1e} apart")
                    self.assertLess(first, 1e-3)
                    self.assertLess(worst, 0.02)
                    self.assertLess(apart, 2e-5)

    def test_limits(self):
        """Ankles that rest on their limits, which the plugin solves with the ground and this in turn."""
        apart = self.compare("cylinder", "implicitfast", 300, lambda text: text.replace('range="-1.5 1.5"', 'range="-.005 .005"'))[2]
        print(f"MJX, joints at their limits: after 300 steps the robots are {apart:.1e} apart")
        self.assertLess(apart, 3e-3)

    def test_begin(self):
        """Worlds that begin anew stand on fresh ground; materials are those that are given; a body that is named passes the floor."""
        text, feet = robot("box")
        ground = mild.mjx.Ground(mujoco.MjSpec.from_string(text), feet, SOILS, worlds=3)
        d = ground.data()
        d = d.replace(qpos=d.qpos.at[:, 2].set(0.38))
        step = jax.jit(ground.step)
        first = step(d, material=jnp.zeros(3, jnp.int32))[1]
        np.testing.assert_allclose(first[1:], first[:1].repeat(2, 0), rtol=1e-5, atol=1e-4)
        higher = d.replace(qpos=d.qpos.at[:, 2].set(0.385))
        begun = step(higher, material=jnp.zeros(3, jnp.int32), begin=jnp.array([True, False, False]))[1]
        self.assertGreater(float(begun[0, :, 2].min()), 1.2 * float(begun[1, :, 2].max()))
        for through, some in (((), True), (("trunk",), False)):
            other = mild.mjx.Ground(mujoco.MjSpec.from_string(text), feet, worlds=1, through=through)
            pairs = np.array(jax.jit(other.step)(other.data())[0]._impl.contact.geom[0])
            names = [{other.model.body(other.model.geom_bodyid[geom]).name for geom in pair} for pair in pairs]
            self.assertEqual({"world", "trunk"} in names, some)
            self.assertNotIn({"world", "left"}, names)

    def test_wrong(self):
        text, feet = robot("box")
        for keys, said in (({"feet": ["left", "nose"]}, "no body or site 'nose'"), ({"ground": "mud"}, "mud"), ({"soles": [SOLE]}, "soles: 1 for 2 feet"),
                           ({"through": ["nose"]}, "no body 'nose'")):
            with self.assertRaisesRegex(ValueError, said):
                mild.mjx.Ground(mujoco.MjSpec.from_string(text), **{"feet": feet, "worlds": 1, **keys})
        with self.assertRaisesRegex(ValueError, "integrator"):
            mild.mjx.Ground(mujoco.MjSpec.from_string(text.replace("implicitfast", "RK4")), feet, worlds=1)


class Interface(unittest.TestCase):
    @unittest.skipUnless(shutil.which("g++"), "there is no g++")
    def test_layout(self):
        """python/src/xla_abi.h has every member where jaxlib's header has it."""
        header = pathlib.Path(jaxlib.__file__).parent / "include"
        ours = pathlib.Path(__file__).resolve().parents[2] / "python/src"
        pairs = {"Extension": ("XLA_FFI_Extension_Base", {"size": "struct_size", "type": "type", "next": "next"}),
                 "Version": ("XLA_FFI_Api_Version", {"major": "major_version", "minor": "minor_version"}),
                 "Metadata": ("XLA_FFI_Metadata", {"version": "api_version", "traits": "traits"}),
                 "MetadataExtension": ("XLA_FFI_Metadata_Extension", {"metadata": "metadata"}),
                 "ErrorArgs": ("XLA_FFI_Error_Create_Args", {"message": "message", "code": "errc"}),
                 "StreamArgs": ("XLA_FFI_Stream_Get_Args", {"context": "ctx", "stream": "stream"}),
                 "Buffer": ("XLA_FFI_Buffer", {"type": "dtype", "data": "data", "rank": "rank", "dims": "dims"}),
                 "Span": ("XLA_FFI_ByteSpan", {"text": "ptr", "length": "len"}),
                 "Scalar": ("XLA_FFI_Scalar", {"type": "dtype", "value": "value"}),
                 "List": ("XLA_FFI_Args", {"count": "size", "types": "types", "items": "args"}),
                 "Attributes": ("XLA_FFI_Attrs", {"count": "size", "types": "types", "names": "names", "values": "attrs"}),
                 "Api": ("XLA_FFI_Api", {"make_error": "XLA_FFI_Error_Create", "get_stream": "XLA_FFI_Stream_Get"}),
                 "Frame": ("XLA_FFI_CallFrame", {"api": "api", "context": "ctx", "stage": "stage", "arguments": "args", "results": "rets",
                                                 "attributes": "attrs"})}
        lines = ['#include "xla/ffi/api/c_api.h"', '#include "xla_abi.h"',
                 "#if XLA_FFI_API_MINOR >= 4", "#define XLA_FFI_Extension_Base XLA_FFI_InternalExtension", "#endif"]  # its name from jaxlib 0.11 on
        for mine, (theirs, members) in pairs.items():
            lines += [f"static_assert(offsetof(xla_abi::{mine}, {a}) == offsetof({theirs}, {b}));" for a, b in members.items()]
        for name, value in (("PRED", "DataType_PRED"), ("S32", "DataType_S32"), ("S64", "DataType_S64"), ("F32", "DataType_F32"),
                            ("STAGE_EXECUTE", "ExecutionStage_EXECUTE"), ("EXTENSION_METADATA", "Extension_Metadata"), ("MAJOR", "API_MAJOR"),
                            ("INVALID_ARGUMENT", "Error_Code_INVALID_ARGUMENT")):
            lines.append(f"static_assert((int)xla_abi::{name} == (int)XLA_FFI_{value});")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "layout.cpp")
            file.write_text("\n".join(lines) + "\n")
            subprocess.run(["g++", "-std=c++17", "-fsyntax-only", "-Wno-invalid-offsetof", f"-I{header}", f"-I{ours}", file], check=True)


class Place(unittest.TestCase):
    def test_device(self):
        """What this file says that it runs on."""
        self.assertEqual((jax.default_backend(), jnp.zeros(1).devices().pop().platform), (given.device,) * 2)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *rest])
