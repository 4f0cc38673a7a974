"""Proximal policy optimisation (Schulman et al. 2017) of a network of PyTorch in the environments of mild, with what src/learn/ppo.h
has: generalised advantages, a learning rate that follows the KL divergence, a critic with its own observation."""
import math
from dataclasses import dataclass

import torch
from torch import nn


@dataclass
class Settings:
    steps: int = 24  # decisions of a rollout
    epochs: int = 4
    minibatches: int = 4
    gamma: float = 0.99  # per decision
    decay: float = 0.95  # lambda of the advantages
    clip: float = 0.2
    entropy: float = 0.001
    learning_rate: float = 1e-3
    rate_min: float = 1e-5
    rate_max: float = 1e-2
    critic_rate: float = 0.0  # of the critic; 0: the actor's
    kl_target: float = 0.01  # [nat]
    gradient_norm: float = 1.0
    std: float = 0.5  # of the action noise at the start
    std_min: float = 0.1
    std_end: float = 0.12  # greatest at the end of the run
    end: float = 0.15  # share of the run in which KL target and noise fall
    average: float = 0.95  # decay per iteration of the running mean of the weights, which is saved


def mlp(widths, activation):
    layers = []
    for a, b in zip(widths, widths[1:]):
        layers += [nn.Linear(a, b), activation()]
    return nn.Sequential(*layers[:-1])


def make_critic(width):
    return mlp([width, 768, 256, 128, 1], nn.ELU)


def log_density(action, mean, log_std):
    """Of a diagonal Gaussian, summed over the actions."""
    x = (action - mean) * torch.exp(-log_std)
    return (-0.5 * x * x - log_std - 0.5 * math.log(2 * math.pi)).sum(-1)


def divergence(mean_a, log_a, mean_b, log_b):
    """KL(a | b) of diagonal Gaussians."""
    ratio = torch.exp(2 * (log_a - log_b)) + (mean_a - mean_b) ** 2 * torch.exp(-2 * log_b)
    return (log_b - log_a + 0.5 * (ratio - 1)).sum(-1)


class Rollout:
    """[steps][envs] of what a learner keeps of its decisions."""

    def __init__(self, steps, envs, actions, critic, device):
        def zeros(*shape):
            return torch.zeros(*shape, device=device)
        self.critic = zeros(steps + 1, envs, critic)
        self.action, self.mean = zeros(steps, envs, actions), zeros(steps, envs, actions)
        self.log_prob, self.reward = zeros(steps, envs), zeros(steps, envs)
        self.done, self.timeout = zeros(steps, envs), zeros(steps, envs)
        self.valid = torch.ones(steps, envs, device=device)

    def advantages(self, value, gamma, decay):
        """Generalised advantages and returns (Schulman et al. 2016). An episode that ended by time goes on with the value before."""
        reward = self.reward + gamma * self.timeout * value[:-1]
        advantage = torch.zeros_like(reward)
        after = torch.zeros_like(reward[0])
        for t in reversed(range(len(reward))):
            goes_on = 1 - self.done[t]
            error = reward[t] + gamma * goes_on * value[t + 1] - value[t]
            after = error + gamma * decay * goes_on * after
            advantage[t] = after
        return advantage, advantage + value[:-1]


class Ppo:
    """actor: a module; its forward pass is what `evaluate` of update does."""

    def __init__(self, actor, critic, actions, settings, device):
        self.actor, self.critic, self.settings, self.device = actor, critic, settings, device
        self.log_std = nn.Parameter(torch.full((actions,), math.log(settings.std), device=device))
        self.mean_weights = None  # running mean of the actor's
        self.rate, self.kl_target, self.std_max = settings.learning_rate, settings.kl_target, 10.0
        groups = [{"params": [*actor.parameters(), self.log_std]},
                  {"params": [*critic.parameters()], "lr": settings.critic_rate or self.rate}]
        self.parameters = [*actor.parameters(), self.log_std, *critic.parameters()]
        self.optimizer = torch.optim.Adam(groups, lr=self.rate, fused=device.type == "cuda")

    def sample(self, mean):
        action = mean + torch.exp(self.log_std) * torch.randn_like(mean)
        return action, log_density(action, mean, self.log_std)

    def values(self, critic):
        return self.critic(critic).squeeze(-1).float()

    def anneal(self, done):
        """done: share of the run, 0 .. 1."""
        s = self.settings
        share = min(max((done - 1 + s.end) / s.end, 0), 1) if s.end > 0 else 0
        self.kl_target = s.kl_target * 0.1**share
        if share > 0:
            self.std_max = s.std * (s.std_end / s.std) ** share

    def follow(self, kl):
        """Moves the learning rate toward the KL target, as step_learning_rate of src/learn/ppo_step.h."""
        s = self.settings
        if kl > 2 * self.kl_target:
            self.rate /= 1.5
        elif 1e-6 * self.kl_target < kl < self.kl_target / 2:
            self.rate *= 1.5
        most = max(s.rate_max * self.kl_target / s.kl_target, s.rate_min)
        self.rate = min(max(self.rate, s.rate_min), most)
        for group in self.optimizer.param_groups[: 1 if s.critic_rate else 2]:
            group["lr"] = self.rate

    def step(self, loss):
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.parameters, self.settings.gradient_norm)
        if torch.isfinite(norm):
            self.optimizer.step()
            with torch.no_grad():
                self.log_std.clamp_(math.log(self.settings.std_min), math.log(self.std_max))

    @torch.no_grad()
    def targets(self, rollout):
        """Advantages, scaled to mean 0 and spread 1, and returns, flattened."""
        s, r = self.settings, rollout
        advantage, returns = r.advantages(torch.stack([self.values(row) for row in r.critic]), s.gamma, s.decay)
        good = r.valid > 0
        centre, spread = advantage[good].mean(), advantage[good].std() + 1e-8
        return ((advantage - centre) / spread).flatten(), returns.flatten()

    def update(self, rollout, evaluate, extra=None, actor=True):
        """evaluate(rows): means of the actions of these flattened rows; extra(rows, means): a loss to add. actor: bool, off trains
        the critic alone. Returns numbers for the log."""
        s, r = self.settings, rollout
        with torch.no_grad():
            advantage, returns = self.targets(r)
            weight = r.valid.flatten()
            critic = r.critic[:-1].flatten(0, 1)
            action, mean = r.action.flatten(0, 1), r.mean.flatten(0, 1)
            log_prob, log_std = r.log_prob.flatten(), self.log_std.clone()
        kls, surrogates, values, extras = [], [], [], []
        for _ in range(s.epochs):
            for rows in torch.randperm(r.reward.numel(), device=self.device).chunk(s.minibatches):
                w = weight[rows]
                value_loss = (w * (self.values(critic[rows]) - returns[rows]) ** 2).mean()
                values.append(value_loss.detach())
                if not actor:
                    self.step(value_loss)
                    continue
                now = evaluate(rows).float()
                with torch.no_grad():
                    kl = divergence(mean[rows], log_std, now, self.log_std).mean()
                    self.follow(kl.item())
                ratio = torch.exp(log_density(action[rows], now, self.log_std) - log_prob[rows])
                a = advantage[rows]
                surrogate = (w * torch.max(-ratio * a, -ratio.clamp(1 - s.clip, 1 + s.clip) * a)).mean()
                other = extra(rows, now) if extra else torch.zeros((), device=self.device)
                self.step(surrogate + value_loss - s.entropy * self.log_std.sum() + other)
                kls.append(kl)
                surrogates.append(surrogate.detach())
                extras.append(other.detach())
        self.remember()
        means = {"value_loss": values, "kl": kls, "surrogate": surrogates, "extra": extras}
        report = {name: torch.stack(numbers).mean().item() for name, numbers in means.items() if numbers}
        return {**report, "rate": self.rate, "std": torch.exp(self.log_std).mean().item()}

    def save(self, path):
        """What a later run goes on from: the moments of Adam begin anew."""
        torch.save({"actor": self.actor.state_dict(), "critic": self.critic.state_dict(), "log_std": self.log_std.detach(),
                    "rate": self.rate}, path)

    def load(self, path):
        state = torch.load(path, map_location=self.device, weights_only=True)
        self.actor.load_state_dict(state["actor"])
        self.critic.load_state_dict(state["critic"])
        with torch.no_grad():
            self.log_std.copy_(state["log_std"])
        self.rate = state["rate"]

    @torch.no_grad()
    def remember(self):
        now = self.actor.state_dict()
        if self.mean_weights is None:
            self.mean_weights = {name: weight.clone() for name, weight in now.items()}
        for name, weight in self.mean_weights.items():
            weight.lerp_(now[name], 1 - self.settings.average)
