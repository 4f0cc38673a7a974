"""The batch ground on tensors of a CUDA device, over DLPack, beside the one on the CPU. Needs PyTorch; without a device it runs
what the CPU can do. check_cuda.py [--time 4096,16384] [tests]: --time measures steps instead."""
import importlib.util
import sys
import time
import unittest

import torch

import mild

CUDA = torch.cuda.is_available()
DEVICE = "cuda:0" if CUDA else "cpu"
SOLES = [mild.Sole.plate(0.2, 0.1), mild.Sole.plate(0.15, 0.1)]
MATERIALS = ["grass", "sand_loose", "foam45"]
DT = 0.005
STRIPES = {"slope": 0.1, "patches": "checker", "patch_size": 0.5, "patch_count": 2}


def make_batch(robots, device=DEVICE):
    batch = mild.Batch(robots, SOLES, DT, device=device)
    batch.set_materials(MATERIALS)
    return batch


def random_inputs(robots, seed, labels=1):
    """Two feet of every robot in the ground, above it or at its surface, moving; on the CPU."""
    random = torch.Generator().manual_seed(seed)

    def normal(*shape):
        return torch.randn(shape, generator=random)

    half = normal(robots, 12, 12) / 7
    turn = 0.1 * normal(robots, 2, 3)
    skew = torch.stack([torch.linalg.cross(turn, axis.expand_as(turn)) for axis in torch.eye(3)], -1)
    low, high = torch.tensor([-0.3, -0.3, -0.03]), torch.tensor([0.3, 0.3, 0.005])
    velocity = 0.1 * normal(robots, 2, 6)
    return {"position": low + (high - low) * torch.rand(robots, 2, 3, generator=random),
            "rotation": torch.linalg.matrix_exp(skew), "velocity": velocity,
            "inverse_inertia": half @ half.transpose(1, 2), "free_velocity": velocity - torch.tensor([0, 0, 0.02, 0, 0, 0]),
            "material": torch.randint(len(MATERIALS), (robots, labels) if labels > 1 else (robots,), generator=random, dtype=torch.int32),
            "height": 0.01 * torch.rand(robots, generator=random), "map_origin": normal(robots, 2)}


def new_outputs(batch, device=DEVICE):
    n, feet = batch.robots, batch.feet
    shapes = {"wrench": (n, feet, 6), "new_velocity": (n, feet, 6), "foot": (n, feet, 6), "elements": (n, 4, feet, batch.stride),
              "residual": (n,)}
    reals = {name: torch.full(shape, float("nan"), device=device) for name, shape in shapes.items()}
    return {**reals, "iterations": torch.full((n,), -1, dtype=torch.int32, device=device)}


def there(inputs):
    return {name: tensor.to(DEVICE) for name, tensor in inputs.items()}


def stream():
    return torch.cuda.current_stream().cuda_stream if CUDA else 0


def apart(found, wanted):
    """Distance of each robot's numbers, relative to their size plus one; worst last."""
    found, wanted = found.cpu().flatten(1), wanted.cpu().flatten(1)
    return ((found - wanted).norm(dim=1) / (wanted.norm(dim=1) + 1)).sort().values


class Numbers(unittest.TestCase):
    def test_map_of_labels(self):
        """Robots in their random ways over steps that are kept and steps that are not, on a map of two grounds each."""
        robots, labels = 512, 2
        batch, host = make_batch(robots), make_batch(robots, "cpu")
        batch.set_map(mild.Map("slope", **STRIPES))
        host.set_map(mild.Map("slope", **STRIPES))
        wrenches, velocities, touching = [], [], 0
        for step in range(8):
            inputs, advance = random_inputs(robots, step, labels), step % 3 != 2
            wanted, found = new_outputs(host, "cpu"), new_outputs(batch)
            host.step(**inputs, **wanted, advance=advance)
            batch.step(**there(inputs), **found, advance=advance, stream=stream())
            for name, tensor in found.items():
                self.assertFalse(tensor.isnan().any().item(), name)
            wrenches.append(apart(found["wrench"], wanted["wrench"]))
            velocities.append(apart(found["new_velocity"], wanted["new_velocity"]))
            touching += int((found["foot"][..., 5] > 0).sum())
            self.assertLess(apart(found["foot"], wanted["foot"])[robots * 98 // 100].item(), 1e-4)
        self.assertGreater(touching, robots)
        for name, errors in (("wrench", wrenches), ("velocity", velocities)):
            errors = torch.cat(errors).sort().values
            middle, high, worst = (errors[int(share * (len(errors) - 1))].item() for share in (0.5, 0.99, 1))
            print(f"{DEVICE}, {name}: median {middle:.1e}, 99 % {high:.1e}, worst {worst:.1e}")
            self.assertLess(middle, 1e-5)
            self.assertLess(high, 1e-2)

    def test_solve_and_advance(self):
        """A step that is not kept may be repeated: the same bits. One that is kept leaves prints."""
        batch, inputs = make_batch(64), there(random_inputs(64, 1))
        once, again, after = new_outputs(batch), new_outputs(batch), new_outputs(batch)
        batch.step(**inputs, **once, advance=False, stream=stream())
        batch.step(**inputs, **again, advance=True, stream=stream())
        batch.step(**inputs, **after, advance=False, stream=stream())
        self.assertTrue(all(torch.equal(once[name], again[name]) for name in once))
        self.assertFalse(torch.equal(once["wrench"], after["wrench"]))
        half = torch.arange(64, device=DEVICE) < 32
        batch.reset(half, stream=stream())
        batch.step(**inputs, **after, advance=False, stream=stream())
        self.assertTrue(torch.equal(once["wrench"][:32], after["wrench"][:32]))
        self.assertFalse(torch.equal(once["wrench"][32:], after["wrench"][32:]))


class Tensors(unittest.TestCase):
    def test_no_copies(self):
        """Parts of larger tensors: results lie in the part that was given, all else is as it was."""
        batch, inputs = make_batch(16), there(random_inputs(16, 4))
        plain = new_outputs(batch)
        batch.step(**inputs, **plain, advance=False, stream=stream())
        wide = {name: torch.zeros(18, *tensor.shape[1:], dtype=tensor.dtype, device=DEVICE) for name, tensor in (inputs | plain).items()}
        part = {name: tensor[1:17] for name, tensor in wide.items()}
        for name, tensor in inputs.items():
            part[name].copy_(tensor)
        places = {name: tensor.data_ptr() for name, tensor in part.items()}
        batch.step(**part, advance=False, stream=stream())
        for name, tensor in (inputs | plain).items():
            self.assertEqual(part[name].data_ptr(), places[name])
            self.assertTrue(torch.equal(part[name], tensor), name)
            self.assertEqual(int(wide[name][[0, 17]].count_nonzero()), 0, name)

    def test_tensors_that_do_not_fit(self):
        """Each wrong in one way: one line that begins with the name of the array; the batch goes on."""
        batch = make_batch(6)
        inputs, outputs = there(random_inputs(6, 5)), new_outputs(batch)
        batch.step(**inputs, **outputs, advance=False, stream=stream())
        before = outputs["wrench"].clone()
        for name, tensor in (inputs | outputs).items():
            other = torch.int64 if tensor.dtype == torch.int32 else torch.float64
            wrong = [tensor[:-1], tensor[..., None], tensor.to(other), tensor.to(torch.float16), tensor.to(torch.bfloat16),
                     tensor.repeat_interleave(2, 0)[::2], tensor[:1].expand_as(tensor), tensor.to("meta"), tensor.to_sparse(), "text", 3,
                     [1.0]]
            wrong += [tensor.cpu()] if CUDA else []
            wrong += [tensor.transpose(0, 1).contiguous().transpose(0, 1)] if tensor.dim() > 1 else []
            for bad in wrong:
                with self.assertRaisesRegex((ValueError, TypeError), f"^{name}: [^\n]*$"):
                    batch.step(**{**inputs, **outputs, name: bad}, stream=stream())
        if CUDA:
            with self.assertRaisesRegex(ValueError, "^wrench: it is on cuda:0, but it must be on the CPU"):
                make_batch(6, "cpu").step(**{name: tensor.cpu() for name, tensor in inputs.items()}, **outputs)
        with self.assertRaisesRegex(ValueError, "device 99"):
            make_batch(6, "cuda:99")
        outputs["wrench"].zero_()
        batch.step(**inputs, **outputs, advance=False, stream=stream())
        self.assertTrue(torch.equal(outputs["wrench"], before))


@unittest.skipUnless(CUDA, "no CUDA device")
class Device(unittest.TestCase):
    def setUp(self):
        self.batch, self.inputs = make_batch(256), there(random_inputs(256, 6))
        self.wanted = new_outputs(self.batch)
        self.batch.step(**self.inputs, **self.wanted, advance=False, stream=stream())
        torch.cuda.synchronize()

    def test_stream(self):
        """The step takes its place in the stream: after the work before it, before the work after it; the call does not wait."""
        side = torch.cuda.Stream()
        late, found = {name: torch.zeros_like(tensor) for name, tensor in self.inputs.items()}, new_outputs(self.batch)
        torch.cuda.synchronize()
        with torch.cuda.stream(side):
            torch.cuda._sleep(200_000_000)  # a tenth of a second
            for name, tensor in self.inputs.items():
                late[name].copy_(tensor)
            self.batch.step(**late, **found, advance=False, stream=stream())
            kept, done = found["wrench"].clone(), torch.cuda.Event()
            found["wrench"].zero_()
            done.record()
        self.assertFalse(done.query())
        side.synchronize()
        self.assertTrue(torch.equal(kept, self.wanted["wrench"]))
        self.assertEqual(int(found["wrench"].count_nonzero()), 0)

    def test_graph(self):
        """A captured step runs again on what its tensors hold then, and remembers."""
        other, graph = make_batch(256), torch.cuda.CUDAGraph()
        held, found = {name: tensor.clone() for name, tensor in self.inputs.items()}, new_outputs(self.batch)
        with torch.cuda.graph(graph):
            self.batch.step(**held, **found, stream=stream())
        for seed in range(7, 10):
            inputs = there(random_inputs(256, seed))
            wanted = new_outputs(other)
            other.step(**inputs, **wanted, stream=stream())
            for name, tensor in inputs.items():
                held[name].copy_(tensor)
            graph.replay()
            self.assertTrue(all(torch.equal(found[name], wanted[name]) for name in wanted))

    @unittest.skipUnless(importlib.util.find_spec("cupy"), "no CuPy")
    def test_cupy(self):
        import cupy
        found = {name: cupy.asarray(tensor) for name, tensor in new_outputs(self.batch).items()}
        self.batch.step(**{name: cupy.asarray(tensor) for name, tensor in self.inputs.items()}, **found, advance=False)
        cupy.cuda.get_current_stream().synchronize()
        self.assertTrue(torch.equal(torch.from_dlpack(found["wrench"]), self.wanted["wrench"]))


def measure(robots):
    """Time of a kept step of standing robots: of the call alone, on the device, and in a graph."""
    batch, inputs = make_batch(robots), random_inputs(robots, 1)
    inputs["position"][..., 2], inputs["height"][:] = -0.015, 0  # all feet touch
    inputs["rotation"][:] = torch.eye(3)
    inputs["velocity"] *= 0.1
    inputs["free_velocity"] = inputs["velocity"] - torch.tensor([0, 0, 0.02, 0, 0, 0])
    inputs, outputs = there(inputs), new_outputs(batch)
    iterations, steps = outputs["iterations"], 200 if CUDA else 3
    needed = {name: outputs[name] for name in ("wrench", "new_velocity")}
    del inputs["map_origin"]

    def run():
        batch.step(**inputs, **needed, stream=stream())

    def wait():
        if CUDA:
            torch.cuda.synchronize()

    def clock(function):
        function()
        wait()
        begin = time.perf_counter()
        for _ in range(steps):
            function()
        called = time.perf_counter() - begin
        wait()
        return 1e6 * called / steps, 1e6 * (time.perf_counter() - begin) / steps

    batch.step(**inputs, **needed, iterations=iterations, advance=False, stream=stream())
    print(f"{robots} robots, {batch.robot_bytes} B each, {iterations.float().mean().item():.1f} Newton steps: ", end="")
    print("call {:.0f} us, step {:.0f} us".format(*clock(run)), end="")
    if CUDA:
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            run()
        print(", in a graph {1:.0f} us".format(*clock(graph.replay)), end="")
    print(flush=True)


if __name__ == "__main__":
    print("torch", torch.__version__, "on", torch.cuda.get_device_name(0) if CUDA else "the CPU")
    if "--time" in sys.argv:
        for count in sys.argv[sys.argv.index("--time") + 1].split(","):
            measure(int(count))
    else:
        unittest.main(verbosity=2)
