"""What offpolicy.py keeps of its environments and how it reads returns from that."""
import torch


def project(chance, reward, factor, atoms):
    """Of the distribution reward + factor * return on the same atoms (C51). chance: [rows][atoms]; reward, factor: [rows]."""
    gap, count = atoms[1] - atoms[0], len(atoms)
    place = ((reward[:, None] + factor[:, None] * atoms).clamp(atoms[0], atoms[-1]) - atoms[0]) / gap
    place = place.clamp(0, count - 1)
    below = place.floor()
    upper = (place - below) * chance
    found = torch.zeros_like(chance).scatter_add_(1, below.long(), chance - upper)
    return found.scatter_add_(1, (below.long() + 1).clamp(max=count - 1), upper)


class Scale:
    """Running mean and standard deviation of rows."""

    def __init__(self, width, device):
        self.count = torch.zeros((), device=device)
        self.mean, self.square = torch.zeros(width, device=device), torch.ones(width, device=device)

    def take(self, rows):
        self.count += len(rows)
        share, step = len(rows) / self.count, rows.mean(0) - self.mean
        spread = rows.var(0, correction=0) + (1 - share) * step * step
        self.square.copy_(torch.lerp(self.square, spread, share))
        self.mean.add_(share * step)

    def std(self):
        return self.square.sqrt() + 0.01

    def __call__(self, rows):
        return (rows - self.mean) / self.std()


class Memory:
    """The last steps of all environments, a ring; row `head` has the present observation alone."""

    def __init__(self, steps, envs, device):
        shape, self.steps, self.device = envs.shape, steps, device
        half = torch.float16 if device.type == "cuda" else torch.float32
        self.history = torch.zeros(steps, shape.envs, shape.frames * shape.observation, dtype=half, device=device)
        self.critic = torch.zeros(steps, shape.envs, shape.critic, dtype=half, device=device)
        self.action = torch.zeros(steps, shape.envs, shape.actions, device=device)
        self.reward, self.done, self.timeout, self.valid = (torch.zeros(steps, shape.envs, device=device) for _ in range(4))
        self.row, self.head, self.count = 0, *(torch.zeros((), dtype=torch.long, device=device) for _ in range(2))  # row: head as int

    def see(self, envs):
        self.history[self.row], self.critic[self.row] = envs.history.flatten(1), envs.critic

    def take(self, action, envs):
        """What the step has done; then the next observation."""
        self.action[self.row], self.reward[self.row] = action, torch.where(envs.valid > 0, envs.reward, 0)
        self.done[self.row], self.timeout[self.row], self.valid[self.row] = envs.done, envs.timeout, envs.valid
        self.row = (self.row + 1) % self.steps
        self.head.fill_(self.row)
        self.count.add_(1).clamp_(max=self.steps - 1)
        self.see(envs)

    def draw(self, rows, n):
        """Random places of whole returns."""
        back = n + (torch.rand(rows, device=self.device) * (self.count - n + 1)).long()
        return (self.head - back) % self.steps, torch.randint(self.action.shape[1], (rows,), device=self.device)

    def returns(self, t, env, n, gamma):
        """(sum of the rewards, place of the observation whose value follows, its factor, weight of the sample)"""
        total, alive, weight = (torch.zeros(len(t), device=self.device) + number for number in (0, 1, 1))
        after, factor = (t + n) % self.steps, torch.full_like(total, gamma**n)
        for k in range(n):
            at = (t + k) % self.steps
            total += alive * gamma**k * self.reward[at, env]
            weight *= 1 - alive * (1 - self.valid[at, env])
            ends = alive * self.done[at, env] > 0
            after = torch.where(ends, at, after)
            factor = torch.where(ends, gamma ** (k + 1) * self.timeout[at, env], factor)
            alive = alive * (1 - self.done[at, env])
        return total, after, factor, weight
