#!/usr/bin/env python3
"""What training by 1 .. 256 GPUs should cost, from what one and two took (docs/ranks.md). scripts/gpus.py prints it with what it
measured; with numbers from elsewhere:

  scripts/ranks_model.py --iteration 1:0.1829 2:0.1837 --sum 2:80:12 2:2600000:40

Each GPU has the same number of robots whatever the number G of GPUs. An iteration takes T(G) = T(1) + S(G) + W(G):

S  Sums: each minibatch the gradient (--gradient bytes) and 80 bytes, and twice an update 64 bytes. A sum of n bytes is NCCL's
   all-gather on a ring, G - 1 hops, each of which brings every GPU the n bytes of another one:
     start + (G - 1) (hop + n / bandwidth)
   Two numbers of bytes on two GPUs give hop and bandwidth, with start = 0; four GPUs give start, too. From one host to the
   next a hop takes no less than --network-hop, and n bytes no less than n / --network: these two are assumed, not measured.
   In pairs (not built): log2 G rounds, in each of which two GPUs add up the n bytes of the other, in the order of today, so with
   the same bits: start + log2 G (hop + n / bandwidth); between hosts all GPUs of a host share --network.
W  Waiting for the slowest rollout: the largest of G numbers with the same normal distribution is on the mean `spread` times that of
   a standard one (0.56 of 2, 1.42 of 8, 2.83 of 256) above their mean. Spread is what the largest number of GPUs took beyond T(1) + S."""
import argparse
import math
import statistics
import sys

COUNTS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
SMALL = 80, 64  # [B] each minibatch; twice an update
BUILT = 64  # the most that ppo.shards allows


def fail(text):
    print(f"ranks_model.py: {text}", file=sys.stderr)
    sys.exit(2)


def largest(count):
    """Mean of the largest of so many standard normal numbers."""
    step, below = 1e-3, statistics.NormalDist().cdf
    places = [step * (i + 0.5) for i in range(8000)]
    return step * sum((1 - below(x) ** count) - below(-x) ** count for x in places)


class Model:
    """iterations: {GPUs: [s]}, 1 among them. sums: {(GPUs, bytes): [s]}. Units: s, B."""

    def __init__(self, iterations, sums, gradient=2.6e6, minibatches=16, host=8, network=50e9, network_hop=20e-6):
        self.gradient, self.minibatches, self.host, self.network, self.network_hop = gradient, minibatches, host, network, network_hop
        few, many = min(g for g, _ in sums), max(g for g, _ in sums)
        small, big = min(n for g, n in sums if g == many), max(n for g, n in sums if g == many)
        self.per_byte = (sums[many, big] - sums[many, small]) / ((many - 1) * (big - small))
        each = (sums[many, small] - sums[few, small]) / (many - few) if many > few else sums[few, small] / (few - 1)  # a hop of `small`
        self.hop, self.start = each - small * self.per_byte, sums[few, small] - (few - 1) * each
        self.alone, most = iterations[1], max(iterations)
        self.spread = max(0, iterations[most] - self.alone - self.sums(most)) / largest(most) if most > 1 else 0.0

    def ring(self, count, size):
        beyond = count > self.host
        hop, per_byte = (max(self.hop, self.network_hop), max(self.per_byte, 1 / self.network)) if beyond else (self.hop, self.per_byte)
        return self.start + (count - 1) * (hop + size * per_byte)

    def pairs(self, count, size):
        inside = round(math.log2(min(count, self.host)))
        outside = round(math.log2(count)) - inside
        return self.start + inside * (self.hop + size * self.per_byte) + outside * (self.network_hop + size * self.host / self.network)

    def sums(self, count, one=None):
        """S, with a sum by `one`: ring or pairs."""
        one = one or self.ring
        return 0.0 if count == 1 else self.minibatches * (one(count, self.gradient) + one(count, SMALL[0])) + 2 * one(count, SMALL[1])

    def waiting(self, count):
        return self.spread * largest(count) if count > 1 else 0.0

    def times_one(self, count, one=None):
        return count * self.alone / (self.alone + self.sums(count, one) + self.waiting(count))

    def table(self):
        lines = [f"start {1e6 * self.start:.1f} us, hop {1e6 * self.hop:.1f} us, {1e-9 / self.per_byte:.0f} GB/s, spread of a rollout "
                 f"{1e3 * self.spread:.2f} ms; assumed: {self.host} GPUs a host, {1e-9 * self.network:.0f} GB/s and "
                 f"{1e6 * self.network_hop:.0f} us from host to host", "",
                 "| GPUs | sums [ms] | waiting [ms] | times one | share | in pairs: sums [ms] | times one | share |", "|---|---|---|---|---|---|---|---|"]
        for count in COUNTS:
            ring, pairs = (self.times_one(count, one) for one in (self.ring, self.pairs))
            lines.append(f"| {count}{' (not built)' if count > BUILT else ''} | {1e3 * self.sums(count):.2f} | {1e3 * self.waiting(count):.2f} | "
                         f"{ring:.4g} | {ring / count:.2f} | {1e3 * self.sums(count, self.pairs):.2f} | {pairs:.4g} | {pairs / count:.2f} |")
        return "\n".join(lines)


def measured(option, texts, numbers):
    """{numbers before the last: last} of texts such as 2:80:12."""
    found = {}
    for text in texts:
        try:
            *key, value = map(float, text.split(":"))
            key = tuple(int(k) for k in key)
            if len(key) != numbers or not 0 < value < math.inf or key[0] not in COUNTS:
                raise ValueError
        except (ValueError, OverflowError):
            fail(f"{option} {text}: it must be {':'.join(['GPUS', 'BYTES'][:numbers])}:{'US' if numbers == 2 else 'SECONDS'}, GPUS one of 1, 2, 4 .. 256")
        found[key if numbers > 1 else key[0]] = value
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iteration", nargs="+", default=[], metavar="GPUS:SECONDS")
    parser.add_argument("--sum", nargs="+", default=[], metavar="GPUS:BYTES:US", help="two numbers of bytes on 2 GPUs, and on 4 where they were")
    parser.add_argument("--gradient", type=float, default=2.6e6, help="[B] (default 2.6e6, that of the default networks)")
    parser.add_argument("--minibatches", type=int, default=16, help="of an iteration, all epochs (default 16)")
    parser.add_argument("--host", type=int, default=8, choices=COUNTS, help="GPUs of a host (default 8)")
    parser.add_argument("--network", type=float, default=50, help="[GB/s] between hosts (default 50: 400 Gb/s)")
    parser.add_argument("--network-hop", type=float, default=20, help="[us] from host to host (default 20)")
    given = parser.parse_args()
    iterations, sums = measured("--iteration", given.iteration, 1), measured("--sum", given.sum, 2)
    if 1 not in iterations:
        fail("--iteration 1:SECONDS is missing: what one GPU takes for an iteration")
    if any(g == 1 for g, _ in sums) or not sums or any(len({n for h, n in sums if h == g}) < 2 for g, _ in sums):
        fail("--sum: two numbers of BYTES are needed for each number of GPUS from 2 on (scripts/gpus.py --only sums)")
    if min(given.gradient, given.minibatches, given.network, given.network_hop) <= 0:
        fail("--gradient, --minibatches, --network and --network-hop must be more than 0")
    model = Model(iterations, {key: 1e-6 * us for key, us in sums.items()}, given.gradient, given.minibatches, given.host, 1e9 * given.network,
                  1e-6 * given.network_hop)
    if model.per_byte <= 0 or model.hop <= 0:
        fail("--sum: more bytes or more GPUs took no longer; measure again on idle GPUs")
    print(model.table())


if __name__ == "__main__":
    main()
