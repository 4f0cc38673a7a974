"""mild.gradients: derivatives of a contact step beside differences of solves, in NumPy, and in PyTorch and JAX where they are installed."""
import importlib.util
import unittest

import numpy as np

import mild
from mild import gradients

BY = "position", "rotation", "velocity", "free_velocity", "inverse_inertia", "k_pen", "mu"


def made():
    """Two feet that strike foam, one of them tilted, and the numbers of BY."""
    sole = mild.Sole.plate(0.2, 0.1)
    ground = mild.Ground([sole, sole], "foam45", dt=0.002)
    rng = np.random.default_rng(5)
    square = rng.uniform(-0.3, 0.3, (12, 12))
    ground.inverse_inertia[:] = square @ square.T + np.diag(([0.1] * 3 + [10.0] * 3) * 2)
    ground.position[:] = [[0, 0.1, -0.004], [0, -0.1, -0.006]]
    ground.rotation[0] = turn(np.array([0.01, -0.02, 0.3]))
    ground.velocity[:] = ground.free_velocity[:] = rng.uniform(-0.1, 0.1, (2, 6))
    ground.free_velocity[:, 2] -= 0.1
    soil = ground.terrain.materials[0]
    return ground, [np.array(getattr(ground if name in gradients.INPUTS else soil, name)) for name in BY]


def turn(vector):
    """The rotation about a vector."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def directions(inputs):
    """For each input how a number h moves it: rotations stay rotations, A symmetric."""
    rng = np.random.default_rng(6)
    for k, (name, value) in enumerate(zip(BY, inputs)):
        way = rng.uniform(-1, 1, value.shape)
        size = {"position": 1e-7, "rotation": 1e-7, "velocity": 1e-5, "free_velocity": 1e-6}.get(name, 1e-5)
        if name == "inverse_inertia":
            way = (way + way.T) / 2
        scale = abs(float(value)) if value.shape == () else 1.0
        if name == "rotation":
            yield k, lambda h, value=value, way=way: np.stack([turn(h * way[f, 0]) @ value[f] for f in range(2)]), size
        else:
            yield k, lambda h, value=value, way=way, scale=scale: value + h * scale * way, size


def moved(inputs, k, value):
    return [value if i == k else other for i, other in enumerate(inputs)]


class Steps(unittest.TestCase):
    def test_differences(self):
        ground, inputs = made()
        step = gradients.Step(ground, BY)
        wrench, velocity, slopes = step.solve(inputs)
        for k, along, h in directions(inputs):
            sides = [step.solve(moved(inputs, k, along(side))) for side in (-h, h)]
            way = (along(h) - along(-h)) / (2 * h)
            for which in (0, 1):
                difference = (sides[1][which] - sides[0][which]) / (2 * h)
                got = np.tensordot(slopes[k][which], way, way.ndim)
                np.testing.assert_allclose(got, difference, atol=3e-6 * abs(difference).max(), err_msg=BY[k])
                self.assertGreater(abs(difference).max(), 1e-9 if which else 1e-3)
        again = step.solve(inputs)
        np.testing.assert_array_equal(again[0], wrench)
        np.testing.assert_array_equal(again[1], velocity)

    def test_memory(self):
        """It is that of the call, on other material too, and stays."""
        ground, inputs = made()
        ground.solve()
        ground.advance()
        state, step = ground.state, gradients.Step(ground, ["k_pen"])
        first = step.solve([inputs[5]])
        self.assertGreater(abs(step.solve([2 * inputs[5]])[0] - first[0]).max(), 0.3)
        self.assertEqual(state, ground.state)
        np.testing.assert_array_equal(step.solve([inputs[5]])[0], first[0])

    def test_height(self):
        """A level terrain keeps its height when a number of its material changes."""
        ground, inputs = made()
        ground.terrain = mild.Terrain(["foam45"], height=-0.02)
        ground.position[:] -= [0, 0, 0.02]
        wanted = gradients.Step(ground, ["free_velocity"]).solve([inputs[3]])[0]
        got = gradients.Step(ground, ["k_pen"]).solve([inputs[5]])[0]
        self.assertEqual(ground.terrain.height, -0.02)
        np.testing.assert_array_equal(got, wanted)
        with self.assertRaises(ValueError):
            gradients.Step(ground, ["k_pen", "mu"]).solve([inputs[5]])

    def test_refused(self):
        ground, _ = made()
        ground.terrain = mild.Terrain(["foam45", "sand_loose"])
        with self.assertRaisesRegex(ValueError, "'mu'.*one material"):
            gradients.Step(ground, ["mu"])
        with self.assertRaisesRegex(ValueError, "k_pan"):
            gradients.Step(made()[0], ["k_pan"])
        with self.assertRaisesRegex(RuntimeError, "converged"):
            gradients.Step(made()[0], ["velocity"]).solve([np.full((2, 6), np.nan)])


def loss(wrench, velocity):
    """A number of both outputs that no symmetry hides."""
    weight = 1.0 + np.arange(12).reshape(2, 6)
    return ((wrench * weight) ** 2).sum() * 1e-4 + (velocity * weight[::-1].copy()).sum()


def by_hand(ground, inputs):
    """Gradient of the loss by the derivatives of Step, which test_differences compares."""
    wrench, velocity, slopes = gradients.Step(ground, BY).solve(inputs)
    weight = 1.0 + np.arange(12).reshape(2, 6)
    given = np.stack([2e-4 * wrench * weight ** 2, weight[::-1]])
    return [np.tensordot(given, slope, 3) for slope in slopes]


@unittest.skipUnless(importlib.util.find_spec("torch"), "needs torch")
class Torch(unittest.TestCase):
    def test_backward(self):
        import torch

        ground, inputs = made()
        wanted = by_hand(ground, inputs)
        tensors = [torch.tensor(value, requires_grad=True) for value in inputs]
        weight = 1.0 + torch.arange(12, dtype=torch.float64).reshape(2, 6)
        wrench, velocity = gradients.torch(ground, BY)(*tensors)
        np.testing.assert_array_equal(wrench[:, :3].detach(), ground.force)
        (((wrench * weight) ** 2).sum() * 1e-4 + (velocity * weight.flip(0)).sum()).backward()
        for name, tensor, gradient in zip(BY, tensors, wanted):
            np.testing.assert_allclose(tensor.grad, gradient, rtol=1e-12, err_msg=name)

    def test_gradcheck(self):
        import torch

        ground, inputs = made()
        solve = gradients.torch(ground, ["free_velocity", "mu"])
        tensors = [torch.tensor(inputs[BY.index(name)], requires_grad=True) for name in ("free_velocity", "mu")]
        self.assertTrue(torch.autograd.gradcheck(solve, tensors, eps=1e-6, rtol=1e-5, atol=1e-3))

    def test_second(self):
        """There are first derivatives only, and a second one is refused."""
        import torch

        ground, inputs = made()
        solve = gradients.torch(ground, ["free_velocity"])
        free = torch.tensor(inputs[3], requires_grad=True)
        slope, = torch.autograd.grad((solve(free)[0] ** 2).sum(), free, create_graph=True)
        with self.assertRaisesRegex(RuntimeError, "first derivatives only"):
            slope.sum().backward()
        twice = torch.func.grad(lambda one: torch.func.grad(lambda one: (solve(one)[0] ** 2).sum())(one).sum())
        with self.assertRaisesRegex(RuntimeError, "first derivatives only"):
            twice(free.detach())

    def test_vmap(self):
        import torch

        ground, inputs = made()
        solve = gradients.torch(ground, ["free_velocity"])
        several = torch.tensor(inputs[3]) + torch.linspace(-0.05, 0, 3, dtype=torch.float64)[:, None, None]
        slope = torch.func.grad(lambda free: solve(free)[0][0, 2])
        together = torch.func.vmap(slope)(several)
        self.assertEqual(together.shape, (3, 2, 6))
        for one, free in zip(together, several):
            torch.testing.assert_close(one, slope(free), rtol=0, atol=0)


@unittest.skipUnless(importlib.util.find_spec("jax"), "needs jax")
class Jax(unittest.TestCase):
    def setUp(self):
        import jax

        jax.config.update("jax_enable_x64", True)

    def test_grad(self):
        import jax

        ground, inputs = made()
        wanted = by_hand(ground, inputs)
        solve = gradients.jax(ground, BY)
        got = jax.jit(jax.grad(lambda *numbers: loss(*solve(*numbers)), argnums=range(len(BY))))(*inputs)
        for name, gradient, hand in zip(BY, got, wanted):
            np.testing.assert_allclose(gradient, hand, rtol=1e-12, err_msg=name)

    def test_vmap(self):
        import jax

        ground, inputs = made()
        solve = gradients.jax(ground, ["free_velocity"])
        several = inputs[3] + np.linspace(-0.05, 0, 3)[:, None, None]
        slope = jax.grad(lambda free: solve(free)[0][0, 2])
        together = jax.vmap(slope)(several)
        for one, free in zip(together, several):
            np.testing.assert_array_equal(one, slope(free))


if __name__ == "__main__":
    unittest.main()
