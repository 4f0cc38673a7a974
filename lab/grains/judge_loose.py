"""The heap of mild_merged that is never complete, as an entry of judge.py and real_sand.py. Loose grains have it above a near floor alone
(lab/grains/real-sand.md, "Loose grains").

    build/mild judge --entry lab/grains/judge_loose.py:loose_heap

    p = b u^n e      u: depth of a point [m], e: its level distance to the free edge [m], n [-], b [Pa/m^(1 + n)]

The free edge is the sole's outline; where a rounded body or a tilted plate comes out of the ground, it is that line. e has a mean of D/6
under a disc. Two numbers, fitted to level presses (lab/grains/real-sand.md, "Loose sand")."""
import math

import numpy as np

from judge_cases import outline_distance
from judge_entries import stress_wrench

POWERS = np.arange(0.5, 2.5, 0.005)  # of u, among which the fit looks


def free_edge(sole, depth, tilt):
    """e of each square [m]; 0 of those in the air."""
    if not hasattr(sole, "outline_distance"):
        sole.outline_distance = outline_distance(sole)
    under, e = sole.depths(depth, tilt), sole.outline_distance
    if sole.z.any():  # a ball, or a wheel whose axis is along y: as far as the half of what is wet
        from_middle = np.hypot(sole.x, sole.y) if sole.radius else np.abs(sole.x)
        order = np.argsort(sole.z)
        e = np.minimum(e, np.interp(depth, sole.z[order], from_middle[order]) - from_middle)
    if tilt:
        e = np.minimum(e, under / abs(math.sin(tilt)))
    return np.where(under > 0, np.maximum(e, 0), 0)


class LooseHeap:
    """power: n, or None where it is fitted. mean: e of every square is the mean over those in the ground."""

    def __init__(self, power=None, mean=False):
        self.given, self.mean, self.power, self.bears = power, mean, power, 0.0

    def reach(self, power, depth, tilt, sole):
        """u^n e of each square."""
        e = free_edge(sole, depth, tilt)
        if self.mean and e.any():
            e = np.where(e > 0, e[e > 0].mean(), 0)
        return np.maximum(sole.depths(depth, tilt), 0) ** power * e

    def fit_presses(self, soles, depths, forces):
        """Least squares of the force of level plates: soles, and of each an array of depths and of forces."""
        force, best = np.concatenate(forces), math.inf
        volume = [(sole.area * free_edge(sole, 1.0, 0)).sum() for sole in soles]
        for power in POWERS if self.given is None else [self.given]:
            heap = np.concatenate([v * np.maximum(depth, 0) ** power for v, depth in zip(volume, depths)])
            bears = heap @ force / (heap @ heap)
            if ((bears * heap - force) ** 2).sum() < best:
                best, self.power, self.bears = ((bears * heap - force) ** 2).sum(), float(power), float(bears)
        return self

    def fit(self, records, ground):
        level = [(case.sole, rows["depth"], rows["fz"]) for case, rows in records.values() if case.kind == "press"]
        self.fit_presses(*zip(*level))

    def __call__(self, depth, tilt, slip, sole):
        return stress_wrench(sole, depth, tilt, self.bears * self.reach(self.power, depth, tilt, sole), np.zeros(len(sole.x)))


loose_heap, loose_heap_linear = LooseHeap(), LooseHeap(1.0)
