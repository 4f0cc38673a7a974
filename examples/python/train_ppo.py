"""PPO in plain PyTorch for walks on soft ground: everything that learns is in this file, and everything that walks is mild's.

    python train_ppo.py                                # on a GPU where there is one (with mildground_cuda), else on the CPU; 100 s of an H200
    python train_ppo.py --device cpu --envs 256 --steps 200000 --out runs/try       # a minute or two: a try, no walk
    mild eval --policy runs/ppo/policy.safetensors --ground rigid,foam45,sand_loose --speed 0.6      # and play, drive, export

The task is that of `mild train` (docs/task.md). The actor sees six noisy frames, the critic noiseless numbers and the ground's parameters.
PPO (Schulman et al. 2017) with: generalised advantages, a learning rate that follows the KL divergence, a loss for what is not mirror
symmetric, less noise and shorter steps in the last third, and the running mean of the weights as the policy. The numbers are quick.ini's."""
import argparse
import copy
import math
import pathlib
import time

import torch
from torch import nn

from mild import policy_file
from mild.envs import open_envs

GAMMA, LAMBDA, CLIP = 0.994, 0.95, 0.2
EPOCHS, MINIBATCHES = 4, 4
VALUE_WEIGHT, ENTROPY_WEIGHT, MIRROR_WEIGHT, MIRROR_SHARE = 1.0, 0.001, 1.0, 0.25
RATE, RATE_MIN, RATE_MAX, KL_TARGET, GRADIENT_NORM = 1e-3, 1e-5, 2e-3, 0.015, 1.0
STD, STD_MIN, STD_END = 0.6, 0.05, 0.12  # of the action noise: at first, at least, at most in the end
ANNEAL, ANNEAL_FACTOR = 0.7, 0.1  # from this share of the run on; what the KL target and the highest rate become
AVERAGE = 0.95  # decay of the mean of the weights, per iteration


def mlp(*widths):
    layers = []
    for before, width in zip(widths, widths[1:]):
        layers += [nn.Linear(before, width), nn.ELU()]
    return nn.Sequential(*layers[:-1])


class Policy(nn.Module):
    """history (rows, frames * observation) -> mean of the action (rows, actions), whose standard deviation does not depend on it."""

    def __init__(self, history, actions, hidden):
        super().__init__()
        self.net = mlp(history, *hidden, actions)
        self.log_std = nn.Parameter(torch.full((actions,), math.log(STD)))
        with torch.no_grad():
            self.net[-1].weight.mul_(0.1)  # begins near the default pose

    def forward(self, history):
        return torch.distributions.Normal(self.net(history), self.log_std.exp(), validate_args=False)


class Rollout:
    """Tensors of `steps` policy steps, into which the environments write. Row t of history and critic is what is seen before step t."""

    def __init__(self, envs, steps, device):
        n, where = envs.envs, {"device": device}
        self.envs, self.device, self.steps = envs, device, steps
        self.history = torch.zeros(steps + 1, n, envs.frames, envs.observation, **where)
        self.critic = torch.zeros(steps + 1, n, envs.critic, **where)
        self.action = torch.zeros(steps, n, envs.actions, **where)
        self.mean, self.log_prob = torch.zeros_like(self.action), torch.zeros(steps, n, **where)
        self.std = torch.zeros(envs.actions, **where)
        self.reward = torch.zeros(steps, n, **where)
        self.done, self.timeout, self.valid = (torch.zeros(steps, n, dtype=torch.bool, **where) for _ in range(3))
        self.slots = [envs.buffers(history=self.history[t + 1], critic=self.critic[t + 1], reward=self.reward[t], done=self.done[t],
                                   timeout=self.timeout[t], valid=self.valid[t]) for t in range(steps)]
        envs.reset(self.slots[-1], stream=self.stream())

    def stream(self):
        return torch.cuda.current_stream(self.device).cuda_stream if self.device.type == "cuda" else 0

    @torch.no_grad()
    def fill(self, policy):
        self.history[0], self.critic[0] = self.history[-1], self.critic[-1]
        self.std.copy_(policy.log_std.exp())
        for t in range(self.steps):
            distribution = policy(self.history[t].flatten(1))
            self.mean[t], self.action[t] = distribution.mean, distribution.sample()
            self.log_prob[t] = distribution.log_prob(self.action[t]).sum(-1)
            self.envs.step(self.action[t], self.slots[t], stream=self.stream())
        self.reward.masked_fill_(~self.valid, 0)  # a robot whose numbers were not finite has begun anew

    @torch.no_grad()
    def advantages(self, value):
        """Generalised advantages and the returns that the critic should have foreseen, (steps, envs). An episode that only ran out of time
        would have gone on: what was left of it is the critic's guess of one step before, as in `mild train` (the batch engine keeps no end
        of an episode)."""
        values = value(self.critic).squeeze(-1)
        follows = torch.where(self.done, torch.where(self.timeout, values[:-1], 0), values[1:])
        delta, advantage = self.reward + GAMMA * follows - values[:-1], torch.zeros_like(self.reward)
        sum_ahead = torch.zeros_like(self.reward[0])
        for t in reversed(range(self.steps)):
            sum_ahead = delta[t] + GAMMA * LAMBDA * sum_ahead * ~self.done[t]
            advantage[t] = sum_ahead
        advantage.masked_fill_(~self.valid, 0)  # nothing is to be learned there
        return advantage, advantage + values[:-1]


class Ppo:
    def __init__(self, envs, hidden, device):
        (index, sign), (action_index, action_sign) = (tuple(torch.as_tensor(part, device=device) for part in pair) for pair in envs.mirror())
        self.mirror_frame = lambda history: sign * history[..., index]
        self.mirror_action = lambda action: action_sign * action[..., action_index]
        self.policy = Policy(envs.frames * envs.observation, envs.actions, hidden).to(device)
        self.value = mlp(envs.critic, *hidden, 1).to(device)
        self.parameters = [*self.policy.parameters(), *self.value.parameters()]
        self.optimizer = torch.optim.Adam(self.parameters, lr=RATE)
        self.rate, self.rate_max, self.kl_target, self.std_max = RATE, RATE_MAX, KL_TARGET, math.inf
        self.average = copy.deepcopy(self.policy)

    def anneal(self, share):
        """share: of the run that is over."""
        part = max(0, (share - ANNEAL) / (1 - ANNEAL))
        factor = ANNEAL_FACTOR**part
        self.rate_max, self.kl_target = RATE_MAX * factor, KL_TARGET * factor
        self.std_max = math.inf if part == 0 else STD * (STD_END / STD)**part

    def update(self, rollout):
        """Returns the mean KL divergence and loss of the critic."""
        advantage, target = (part.flatten() for part in rollout.advantages(self.value))
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        history, critic = rollout.history[:-1].flatten(0, 1), rollout.critic[:-1].flatten(0, 1)
        action, mean, log_prob = rollout.action.flatten(0, 1), rollout.mean.flatten(0, 1), rollout.log_prob.flatten()
        before = torch.distributions.Normal(mean, rollout.std, validate_args=False)
        said = torch.zeros(2, device=history.device)
        for _ in range(EPOCHS):
            for rows in torch.randperm(len(history), device=history.device).chunk(MINIBATCHES):
                now = self.policy(history[rows].flatten(1))
                old = torch.distributions.Normal(before.mean[rows], rollout.std, validate_args=False)
                kl = torch.distributions.kl_divergence(old, now).sum(-1).mean().detach()
                ratio = (now.log_prob(action[rows]).sum(-1) - log_prob[rows]).exp()
                gain = torch.minimum(ratio * advantage[rows], ratio.clamp(1 - CLIP, 1 + CLIP) * advantage[rows]).mean()
                some = rows[: int(MIRROR_SHARE * len(rows))]
                image = self.mirror_action(self.policy(self.mirror_frame(history[some]).flatten(1)).mean)
                asymmetry = nn.functional.mse_loss(now.mean[: len(some)], image)
                error = nn.functional.mse_loss(self.value(critic[rows]).squeeze(-1), target[rows])
                loss = -gain + VALUE_WEIGHT * error + MIRROR_WEIGHT * asymmetry - ENTROPY_WEIGHT * now.entropy().sum(-1).mean()
                self.follow(float(kl))
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.parameters, GRADIENT_NORM)
                self.optimizer.step()
                said += torch.stack([kl, error.detach()]) / (EPOCHS * MINIBATCHES)
        with torch.no_grad():
            self.policy.log_std.clamp_(math.log(STD_MIN), math.log(self.std_max))
            for mean_weight, weight in zip(self.average.parameters(), self.policy.parameters()):
                mean_weight.lerp_(weight, 1 - AVERAGE)
        return said.tolist()

    def follow(self, kl):
        """A shorter step after a long one, and the other way round."""
        if kl > 2 * self.kl_target:
            self.rate /= 1.2
        elif kl < self.kl_target / 2:
            self.rate *= 1.2
        self.rate = min(max(self.rate, RATE_MIN), self.rate_max)
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate

    def save(self, envs, path):
        """A file of mild (docs/policy.md)."""
        layers = [(layer.weight.detach().cpu().numpy(), layer.bias.detach().cpu().numpy()) for layer in self.average.net if isinstance(layer, nn.Linear)]
        policy_file.write(path, envs, layers, note="examples/python/train_ppo.py")


def train(options):
    torch.manual_seed(options.seed)
    device = torch.device(options.device)
    keys = dict(word.split("=", 1) for word in options.set)
    if options.ground:
        keys |= {"randomize.presets": options.ground, "randomize.preset_share": 1, "randomize.rigid_share": 0}
    envs = open_envs(options.envs, config=options.config, robot=options.robot, device=options.device, seed=options.seed, overrides=keys)
    learner, rollout = Ppo(envs, options.hidden, device), Rollout(envs, options.rollout, device)
    options.out.mkdir(parents=True, exist_ok=True)
    path, block = options.out / "policy.safetensors", options.envs * options.rollout
    iterations, begin, rewards = max(1, round(options.steps / block)), time.monotonic(), []
    for iteration in range(1, iterations + 1):
        rollout.fill(learner.policy)
        learner.anneal(iteration / iterations)
        kl, error = learner.update(rollout)
        rewards.append(float(rollout.reward.mean()) / envs.period)
        if iteration % max(1, iterations // 40) == 0 or iteration == iterations:
            found, seconds = envs.statistics(stream=rollout.stream()), time.monotonic() - begin
            length = f"{found['length']:.1f} s" if found["episodes"] else "-"
            print(f"{iteration}/{iterations}  {iteration * block / 1e6:.2f} M steps  {iteration * block / seconds:.0f} steps/s  reward {rewards[-1]:.2f}/s  "
                  f"episode {length}  kl {kl:.4f}  critic {error:.3f}  rate {learner.rate:.1e}  std {learner.policy.log_std.exp().mean():.2f}", flush=True)
            learner.save(envs, path)
    envs.close()
    print(f"{path}: mild eval --policy {path} --ground rigid,foam45,sand_loose --speed 0.6")
    return rewards


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cuda = torch.cuda.is_available()
    parser.add_argument("--device", default="cuda:0" if cuda else "cpu")
    parser.add_argument("--envs", type=int, default=4096 if cuda else 512)
    parser.add_argument("--rollout", type=int, default=24, help="policy steps between updates (default 24)")
    parser.add_argument("--steps", type=float, default=50e6, help="policy steps of all robots together (default 50 million)")
    parser.add_argument("--config", default="configs/quick.ini", help="a file over configs/default.ini, or one of the package (default configs/quick.ini)")
    parser.add_argument("--robot", help="sa01 (default), g1, go1 or a folder; with its config")
    parser.add_argument("--ground", help="presets and files of soils, separated by commas (default: what the config draws)")
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="of the task, such as task.vx='0 1' (mild info config)")
    parser.add_argument("--hidden", type=int, nargs="+", default=[512, 256, 128])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/ppo"))
    train(parser.parse_args())


if __name__ == "__main__":
    main()
