#!/usr/bin/env python3
"""What scripts/rivals/samples.py compares: V-trace, the symmetric network, the projection of a distribution, returns from the memory, the
bound of the actions, against numbers by hand and plain loops; and that each learner finds the actions of a task made up here.
Exits with 77 where PyTorch is missing. Usage: test_learners.py SOURCE_FOLDER"""
import dataclasses
import math
import pathlib
import sys
import tempfile
import types
import unittest

try:
    import numpy as np
    import torch
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

root = pathlib.Path(sys.argv.pop(1)).resolve()
sys.dont_write_bytecode = True
sys.path[:0] = [str(root / "scripts/rivals"), str(root / "examples/python")]
import offpolicy  # noqa: E402
import ppo  # noqa: E402
import replay  # noqa: E402
import train_walk  # noqa: E402
import walker  # noqa: E402

torch.set_num_threads(1)
torch.manual_seed(1)
CPU = torch.device("cpu")


class Made:
    """Environments whose reward is 0.1 exp(-2 mean (a - a*)^2), a* a mirror-symmetric function of `few` numbers of the
    frame; they end after `length` steps."""

    def __init__(self, envs=32, length=20, few=12):
        self.shape = types.SimpleNamespace(envs=envs, actions=12, observation=47, frames=6, critic=104, estimates=11, rewards=1)
        self.device, self.length, self.time, self.paid, self.steps = CPU, length, torch.arange(envs) % length, 0.0, 0
        order, sign = torch.randperm(46), torch.ones(47)  # pairs of neighbours in a random order change places
        index = torch.arange(47)
        index[order[0::2]], index[order[1::2]] = order[1::2].clone(), order[0::2].clone()
        sign[46] = -1
        self.frame_mirror = (index, sign)
        joint = torch.arange(12)
        self.action_mirror = ((joint + 6) % 12, torch.tensor([-1.0, -1, 1, 1, 1, -1] * 2))
        half = 0.15 * torch.randn(47, 12) * (torch.arange(47) < few)[:, None]
        mirror, turn = walker.Mirror(*self.frame_mirror), walker.Mirror(*self.action_mirror)
        self.wanted = lambda frame: 0.5 * (frame @ half + turn(mirror(frame) @ half))
        self.reward, self.done, self.timeout = torch.zeros(envs), torch.zeros(envs, dtype=torch.uint8), torch.zeros(envs, dtype=torch.uint8)
        self.valid = torch.ones(envs, dtype=torch.uint8)
        self.library = types.SimpleNamespace(mild_envs_robot=lambda _: b"sa01", mild_envs_task=lambda _: b"history_stride = 1")
        self.envs = None
        self.reset()

    def mirror(self):
        return self.frame_mirror, self.action_mirror

    def reset(self):
        self.frame = torch.randn(self.shape.envs, 47)
        self.history = torch.cat([0 * self.frame[:, None].repeat(1, 5, 1), self.frame[:, None]], 1)
        self.critic = torch.cat([self.frame, 0 * self.frame, 0 * self.frame[:, :10]], 1)

    def step(self, action):
        self.reward = 0.1 * torch.exp(-2 * ((action - self.wanted(self.frame)) ** 2).mean(1))
        self.paid, self.steps = self.paid + self.reward.sum().item(), self.steps + len(self.reward)
        self.time = (self.time + 1) % self.length
        self.done = (self.time == 0).to(torch.uint8)
        self.timeout = self.done.clone()
        self.reset()

    def rate(self):
        """Share of the greatest reward since the last call."""
        found = self.paid / (0.1 * self.steps)
        self.paid, self.steps = 0.0, 0
        return found


class Vtrace(unittest.TestCase):
    def rollout(self, steps, envs):
        r = ppo.Rollout(steps, envs, 1, 1, CPU)
        r.reward = torch.rand(steps, envs, dtype=torch.float64)
        r.done = (torch.rand(steps, envs) < 0.2).double()
        r.timeout = r.done * (torch.rand(steps, envs) < 0.5)
        return r, torch.randn(steps + 1, envs, dtype=torch.float64)

    def test_by_hand(self):
        """Two steps, gamma 0.5, lambda 0.8, pi/mu 2 (clipped to 1) and 0.5: the errors are 1 + 0.5 2 - 1 = 1 and 3 + 0.5 4 - 2 = 3, so the
        advantages 0.5 3 = 1.5 and 1 + 0.4 1.5 = 1.6."""
        r = ppo.Rollout(2, 1, 1, 1, CPU)
        r.reward = torch.tensor([[1.0], [3.0]])
        value = torch.tensor([[1.0], [2.0], [4.0]])
        advantage, returns = r.advantages(value, 0.5, 0.8, torch.tensor([[2.0], [0.5]]))
        torch.testing.assert_close(advantage, torch.tensor([[1.6], [1.5]]))
        torch.testing.assert_close(returns, torch.tensor([[2.6], [3.5]]))

    def test_equal_policies(self):
        r, value = self.rollout(12, 50)
        plain, traced = r.advantages(value, 0.99, 0.95), r.advantages(value, 0.99, 0.95, torch.ones(12, 50, dtype=torch.float64))
        self.assertTrue(all(torch.equal(a, b) for a, b in zip(plain, traced)))

    def test_sum(self):
        """Equation 1 of Espeholt et al. as it stands, c_i = lambda min(1, pi/mu), an end as a discount of 0."""
        r, value = self.rollout(9, 7)
        ratio = torch.exp(torch.randn(9, 7, dtype=torch.float64))
        gamma, decay, w = 0.97, 0.9, ratio.clamp(max=1)
        reward = r.reward + gamma * r.timeout * value[:-1]
        wanted = torch.zeros(9, 7, dtype=torch.float64)
        for s in range(9):
            for t in range(s, 9):
                error = reward[t] + gamma * (1 - r.done[t]) * value[t + 1] - value[t]
                through = torch.stack([gamma * (1 - r.done[i]) * decay * w[i] for i in range(s, t)]).prod(0) if t > s else 1
                wanted[s] += through * w[t] * error
        advantage, _ = r.advantages(value, gamma, decay, ratio)
        print(f"V-trace: apart from the sum by at most {(advantage - wanted).abs().max():.1e}")
        torch.testing.assert_close(advantage, wanted)

    def test_priority(self):
        """An environment with the advantages of the other three together is drawn as often as these, and weighs less."""
        learner = ppo.Ppo(torch.nn.Linear(1, 1), torch.nn.Linear(1, 1), 1, ppo.Settings(priority=1.0, minibatches=1), CPU)
        learner.done = 1.0
        r, advantage = ppo.Rollout(2, 4, 1, 1, CPU), torch.tensor([[3.0, 1, 1, 1], [-3, 1, -1, 1]])
        rows, weight = next(learner.minibatches(r, advantage.flatten()))
        self.assertEqual((rows[4:] - rows[:4]).tolist(), [4] * 4)  # the same environments at both times
        for row, w in zip(rows.tolist(), weight.tolist()):
            self.assertAlmostEqual(w, 0.5 if row % 4 == 0 else 1.5, places=4)  # 1/(4 1/2), 1/(4 1/6)
        drawn = torch.cat([next(learner.minibatches(r, advantage.flatten()))[0][:4] for _ in range(1000)])
        self.assertAlmostEqual((drawn == 0).float().mean().item(), 0.5, delta=0.03)

    def test_muon(self):
        """A step has singular values of 0.68 .. 1.20 times 0.2 sqrt(longer side) times the rate."""
        for shape in ((8, 20), (20, 8)):
            weight = torch.nn.Parameter(torch.zeros(shape))
            weight.grad = torch.randn(shape)
            ppo.Muon([weight]).step(0.1)
            size = torch.linalg.svdvals(-weight.detach()) / (0.1 * 0.2 * math.sqrt(20))
            self.assertTrue((size > 0.6).all() and (size < 1.25).all(), size)
            self.assertGreater((weight * weight.grad).sum().item() * -1, 0)


class Symmetry(unittest.TestCase):
    def setUp(self):
        envs = Made()
        frame = walker.Mirror(*envs.frame_mirror)
        self.history, self.action, self.state = frame.repeat(6), walker.Mirror(*envs.action_mirror), walker.critic_mirror(frame, CPU)

    def test_turns(self):
        net = ppo.mlp([282, 32, 24, 12], torch.nn.ELU)
        actor = walker.Symmetric(net, self.history, self.action)
        x = torch.randn(50, 282)
        worst = (actor(self.history(x)) - self.action(actor(x))).abs().max().item()
        apart = (net(self.history(x)) - self.action(net(x))).abs().max().item()
        print(f"a(M o) - M a(o): at most {worst:.1e}, of the plain network {apart:.1e}")
        self.assertLess(worst, 1e-6)
        self.assertGreater(apart, 0.1)
        y = x
        for i, (weight, bias) in enumerate(actor.layers()):
            y = torch.nn.functional.linear(torch.nn.functional.elu(y) if i else y, weight, bias)
        self.assertLess((y - actor(x)).abs().max().item(), 1e-6)

    def test_stays(self):
        critic = walker.Symmetric(ppo.make_critic(104), self.state)
        x = torch.randn(50, 104)
        self.assertLess((critic(self.state(x)) - critic(x)).abs().max().item(), 1e-6)
        self.assertGreater((self.state(x) - x).abs().max().item(), 1)

    def test_critic(self):
        """The image of the image is the thing itself; numbers of docs/task.md, section 6: left foot's force to right, its y turned."""
        x = torch.randn(104)
        self.assertTrue(torch.equal(self.state(self.state(x)), x))
        y = self.state(x)
        self.assertEqual([y[58], y[59], y[63], y[48], y[56], y[103], y[76]], [x[64], -x[65], x[69], -x[48], x[57], -x[103], x[76]])
        self.assertEqual([y[70], y[71], y[73], y[74], y[78], y[102]], [x[70], -x[71], -x[73], x[74], -x[78], -x[102]])


class Returns(unittest.TestCase):
    def test_projection(self):
        atoms = torch.linspace(-1, 3, 9)
        chance, reward = torch.rand(40, 9).softmax(1), 2 * torch.randn(40)
        factor = 0.9 * (torch.rand(40) < 0.8)
        wanted = np.zeros((40, 9))
        for row in range(40):
            for j in range(9):
                place = (min(max(reward[row].item() + factor[row].item() * (-1 + 0.5 * j), -1), 3) + 1) / 0.5
                for i in range(9):
                    wanted[row, i] += chance[row, j].item() * max(0, 1 - abs(place - i))
        found = replay.project(chance, reward, factor, atoms)
        print(f"projection: apart from the loop by at most {np.abs(found.numpy() - wanted).max():.1e}")
        np.testing.assert_allclose(found.numpy(), wanted, atol=1e-6)
        np.testing.assert_allclose(found.sum(1).numpy(), 1, atol=1e-6)
        same = replay.project(chance, torch.zeros(40), torch.ones(40), atoms)  # r = 0, factor 1
        torch.testing.assert_close(same, chance)

    def test_memory(self):
        """Rewards 1, 2, 3 ..; a fall in step 5, the end of time in step 9; three steps, gamma 0.5; after the ring has gone round."""
        envs = Made(1)
        memory = replay.Memory(8, envs, CPU)
        memory.see(envs)
        for step in range(1, 13):
            envs.reward, envs.done = torch.tensor([float(step)]), torch.tensor([step in (5, 9)])
            envs.timeout = torch.tensor([step == 9])
            memory.take(torch.zeros(1, 12), envs)
        places = torch.tensor([(step - 1) % 8 for step in (6, 7, 8, 9, 10)])
        total, after, factor, weight = memory.returns(places, torch.zeros(5, dtype=torch.long), 3, 0.5)
        self.assertEqual(total.tolist(), [6 + 3.5 + 2, 7 + 4 + 2.25, 8 + 4.5, 9, 10 + 5.5 + 3])
        self.assertEqual(factor.tolist(), [0.125, 0.125, 0.25, 0.5, 0.125])  # of step 9's own observation from 7, 8, 9 on
        self.assertEqual(after.tolist(), [0, 0, 0, 0, 4])
        self.assertEqual(weight.tolist(), [1] * 5)
        drawn = {place.item() for place in memory.draw(2000, 3)[0]}  # steps 6 .. 10 alone have three behind them
        self.assertEqual(drawn, set(places.tolist()))
        memory.reward[(5 - 1) % 8], memory.done[(5 - 1) % 8] = 5, 1
        total, _, factor, _ = memory.returns(torch.tensor([4]), torch.tensor([0]), 3, 0.5)
        self.assertEqual((total.item(), factor.item()), (5, 0))  # a fall: nothing follows
        memory.valid[5] = 0
        self.assertEqual(memory.returns(torch.tensor([4, 5, 6]), torch.zeros(3, dtype=torch.long), 3, 0.5)[3].tolist(), [1, 0, 1])

    def test_scale(self):
        rows, scale = 3 + 2 * torch.randn(5, 200, 4, dtype=torch.float64), replay.Scale(4, CPU)
        scale.mean, scale.square = scale.mean.double(), scale.square.double()
        for part in rows:
            scale.take(part)
        torch.testing.assert_close(scale.mean, rows.flatten(0, 1).mean(0))
        torch.testing.assert_close(scale.std() - 0.01, rows.flatten(0, 1).std(0, correction=0))

    def test_bound(self):
        x = torch.linspace(-5, 5, 1001, dtype=torch.float64, requires_grad=True)
        y = offpolicy.bounded(x)
        wanted = torch.where(x.abs() < 1, x, x.sign() * (2 - torch.exp(1 - x.abs())))
        torch.testing.assert_close(y, wanted)
        slope, = torch.autograd.grad(y.sum(), x)
        torch.testing.assert_close(offpolicy.log_slope(x), slope.log())


class Learning(unittest.TestCase):
    def saved(self, save, history):
        """Actions of the written file by examples/python/policy.py, for one history of frames with a stride of 1."""
        import policy
        with tempfile.TemporaryDirectory() as folder:
            save(folder + "/p.safetensors")
            ours = policy.Policy(folder + "/p.safetensors")
        found = []
        for frames in history.numpy():
            ours.frames = frames[:5]
            found.append(ours.act(frames[5]))
        return torch.tensor(np.array(found))

    def test_ppo(self):
        for options, keys in (({}, {}), ({"advantages": "vtrace"}, {}), ({"advantages": "epoch", "optimizer": "adam"}, {}),
                              ({"priority": 0.8}, {}), ({}, {"symmetric": True})):
            torch.manual_seed(2)
            envs = Made()
            settings = dataclasses.replace(train_walk.SETTINGS, gamma=0.5, kl_target=0.03, std_end=0.3, **options)
            walk = train_walk.Walk(envs, settings, 0.25 * (not keys), keys.get("symmetric", False))
            rates = []
            for i in range(12):
                walk.roll_out(i / 12)
                walk.update()
                rates.append(envs.rate())
            print(f"{options} {keys}: {rates[0]:.3f} of the greatest reward, then {rates[-1]:.3f}")
            self.assertGreater(rates[-1], rates[0] + 0.08)
            wanted = walker.with_weights(walk.actor, walk.ppo.mean_weights)(envs.history[:5].flatten(1)).detach()
            self.assertLess((self.saved(walk.save, envs.history[:5]) - wanted).abs().max().item(), 1e-5)

    def test_off_policy(self):
        """One and the same action is best. Critics that watch an actor which stands still see the way there, and the actor then takes it."""
        best = torch.tensor([0.0, 0, 1, 1, 1, 0] * 2)
        for sac in (False, True):
            torch.manual_seed(2)
            envs = Made(64)
            envs.wanted = lambda frame: best.expand(len(frame), 12)
            settings = offpolicy.Settings(sac=sac, gamma=0.3, returns=2, batch=256, updates=1, memory=64, most=0.2, atoms=51, rate=1e-3, noise=(0.02, 0.6),
                                          hidden=(128, 64), warm=10**9, actor=5e-4)
            learner, errors = offpolicy.Learner(envs, settings, True), []
            for i in range(250):
                learner.walk()
                if i > 6:
                    learner.learn()
            known = learner.know(envs.critic)
            action = torch.zeros(64, 12, requires_grad=True)
            value = learner.means(learner.critics[0](torch.cat([known, action], -1)))
            gradient, = torch.autograd.grad(value.sum(), action)
            cosine = torch.nn.functional.cosine_similarity(gradient, best.expand(64, 12)).mean().item()
            seen = learner.see(envs.history.flatten(1))
            for _ in range(2):
                errors.append(((offpolicy.bounded(learner.actor(seen).detach()[:, :12]) * settings.limit / 2 - best) ** 2).mean().item())
                for _ in range(12):
                    learner.run(1)
            print(f"{'SAC' if sac else 'TD3'}: cosine of gradient and way {cosine:.3f}; squared error {errors[0]:.3f}, after 12 steps {errors[1]:.3f}")
            self.assertGreater(cosine, 0.9)
            self.assertLess(errors[1], 0.8 * errors[0])
            out = learner.actor(learner.see(envs.history[:5].flatten(1))).detach()[:, :12]
            self.assertLess((self.saved(learner.save, envs.history[:5]) - settings.limit / 2 * offpolicy.bounded(out)).abs().max().item(), 1e-5)


unittest.main()
