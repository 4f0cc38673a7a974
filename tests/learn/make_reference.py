#!/usr/bin/env python3
"""Writes reference.safetensors: weights, inputs, losses and gradients of the learner's joint loss as PyTorch computes them
in double precision by automatic differentiation. Needs torch; run by hand when the loss changes:

    python3 tests/learn/make_reference.py tests/learn/reference.safetensors
"""
import json
import struct
import sys
import zlib

import torch

OBSERVATION, FRAMES, CRITIC, ACTIONS, ESTIMATES, FEET, LATENT = 5, 3, 7, 2, 6, (1, 3), 4
SHAPES = {  # as small_def() in check.h
    "encoder": [OBSERVATION * FRAMES, 12, 8, ESTIMATES + 2 * LATENT],
    "decoder": [LATENT + ESTIMATES, 6, 9, OBSERVATION],
    "modulation": [FEET[1], 5, 2],
    "actor": [OBSERVATION + ESTIMATES + LATENT, 16, 10, 8, ACTIONS],
    "critic": [CRITIC, 11, 7, 6, 1],
}
ROWS, MIRRORED = 40, 20
CLIP, ENTROPY, VALUE, EPSILON, PHI, MIRROR = 0.2, 0.01, 0.7, 0.3, 0.05, 0.9
MIRROR_O, SIGN_O = [0, 2, 1, 4, 3], [-1.0, 1.0, 1.0, -1.0, -1.0]
MIRROR_A, SIGN_A = [1, 0], [-1.0, -1.0]


class Net(torch.nn.Module):
    def __init__(self):
        super().__init__()
        for name, widths in SHAPES.items():
            layers = []
            for i in range(len(widths) - 1):
                layers.append(torch.nn.Linear(widths[i], widths[i + 1]))
                if i < len(widths) - 2:
                    layers.append(torch.nn.ELU())
            setattr(self, name, torch.nn.Sequential(*layers))
        self.log_std = torch.nn.Parameter(torch.zeros(ACTIONS))

    def act(self, history):
        heads = self.encoder(history)
        estimates, mu, logvar = heads.split([ESTIMATES, LATENT, LATENT], dim=1)
        theta = self.modulation(estimates[:, FEET[0]:FEET[0] + FEET[1]])
        latent = theta[:, :1] * mu + theta[:, 1:]
        mean = self.actor(torch.cat([history[:, -OBSERVATION:], estimates, latent], dim=1))
        return mean, estimates, mu, logvar


def losses(net, x):
    mean, estimates, mu, logvar = net.act(x["history"])
    policy = torch.distributions.Normal(mean, net.log_std.exp())
    old = torch.distributions.Normal(x["old_mean"], x["old_std"])
    ratio = (policy.log_prob(x["action"]).sum(1) - x["old_log_prob"]).exp()
    advantage = x["advantage"]
    surrogate = torch.max(-ratio * advantage, -ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
    kl = torch.distributions.kl_divergence(old, policy).sum(1).mean()
    clipped = ((ratio - 1).abs() > CLIP).double().mean()
    entropy = policy.entropy().sum(1).mean()

    value = net.critic(x["critic"])[:, 0]
    held = x["old_value"] + (value - x["old_value"]).clamp(-CLIP, CLIP)
    value_loss = torch.max((value - x["returns"]) ** 2, (held - x["returns"]) ** 2).mean()

    z = mu + (0.5 * logvar).exp() * x["noise"]
    decoded = net.decoder(torch.cat([z, estimates], dim=1))
    reconstruction = torch.nn.functional.mse_loss(decoded, x["clean"])
    vae_kl = (-0.5 * (1 + logvar - mu ** 2 - logvar.exp())).sum(1).mean()
    ends = [0, FEET[0], FEET[0] + FEET[1], ESTIMATES]
    groups = [torch.nn.functional.mse_loss(estimates[:, a:b], x["estimate"][:, a:b]) for a, b in zip(ends, ends[1:])]

    history = x["history"][:MIRRORED].reshape(MIRRORED, FRAMES, OBSERVATION)
    image = (history[:, :, MIRROR_O] * torch.tensor(SIGN_O, dtype=torch.float64)).reshape(MIRRORED, -1)
    turned = net.act(image)[0][:, MIRROR_A] * torch.tensor(SIGN_A, dtype=torch.float64)
    mirror = torch.nn.functional.mse_loss(mean[:MIRRORED], turned)

    total = EPSILON * (reconstruction + PHI * vae_kl + sum(groups))
    total = total + (1 - EPSILON) * (surrogate - ENTROPY * entropy + VALUE * value_loss) + MIRROR * mirror
    return total, [surrogate, kl, clipped, reconstruction, vae_kl, *groups, mirror, value_loss, total]


def write(path, tensors, texts):
    header, data = {"__metadata__": {"crc32": "00000000", **texts}}, b""
    for name, tensor in tensors.items():
        raw = tensor.detach().float().contiguous().numpy().tobytes()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [len(data), len(data) + len(raw)]}
        data += raw
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    whole = struct.pack("<Q", len(text)) + text + data
    crc = b'"crc32":"%08x"' % zlib.crc32(whole)
    with open(path, "wb") as file:
        file.write(whole.replace(b'"crc32":"00000000"', crc, 1))


def main():
    torch.manual_seed(3)
    net = Net()
    for parameter in net.parameters():
        parameter.data = (0.35 * torch.randn_like(parameter)).float()
    net.log_std.data = torch.tensor([-0.3, 0.2])
    net = net.double()
    widths = {"history": OBSERVATION * FRAMES, "estimate": ESTIMATES, "clean": OBSERVATION, "noise": LATENT, "critic": CRITIC}
    x = {name: torch.randn(ROWS, width).double() for name, width in widths.items()}
    x["old_std"] = torch.tensor([0.8, 1.1]).double()
    with torch.no_grad():
        mean = net.act(x["history"])[0]
        value = net.critic(x["critic"])[:, 0]
    x["old_mean"] = (mean + 0.2 * torch.randn(ROWS, ACTIONS)).float().double()
    x["action"] = (x["old_mean"] + x["old_std"] * torch.randn(ROWS, ACTIONS)).float().double()
    x["old_log_prob"] = torch.distributions.Normal(x["old_mean"], x["old_std"]).log_prob(x["action"]).sum(1).float().double()
    x["advantage"] = torch.randn(ROWS).double()
    x["old_value"] = (value + 0.3 * torch.randn(ROWS)).float().double()
    x["returns"] = (value + 0.5 * torch.randn(ROWS)).float().double()
    total, terms = losses(net, x)
    total.backward()
    tensors = dict(net.state_dict())
    tensors.update({"train.input." + name: tensor for name, tensor in x.items()})
    tensors.update({"train.gradient." + name: parameter.grad for name, parameter in net.named_parameters()})
    tensors["train.losses"] = torch.stack(terms)
    write(sys.argv[1], tensors, {"torch": torch.__version__})


if __name__ == "__main__":
    main()
