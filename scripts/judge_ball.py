#!/usr/bin/env python3
"""Where mild_merged is wrong under a ball (docs/grains.md, "Balls"): forms of its rim without a new number, summed over fine squares of
the ball, beside the grains. Nothing is fitted to a ball.

    PYTHONPATH=build/python .venv/bin/python scripts/judge_ball.py        # 5 s
    ... scripts/judge_ball.py --elements 6,12,24      the law itself, by how many elements a radius has; the judge has 6

u: depth of a square, d: of the rim's plane, b: the rim's radius, e: distance to the rim (docs/model.md, section 23), T = tan(alpha)/nu:

    as it was    p = kappa d + (k0 - kappa) T e, until 2026-11-26
    as it is     p = kappa max(d, T e) + (k0 - kappa) T e: what a plate has when its heap is just complete, k0 T e, where d is less
    no walls     as it is, and squares steeper than 60 degrees are ground inside the rim like all others"""
import argparse
import math
import pathlib

import mild
import numpy as np

from judge import FITS, Records, mean_rows
from judge_cases import Sole, measures
from judge_entries import GroundEntry
from judge_tilt import ELEMENT, ROOT, deep, fitted_law

SQUARE = 0.001  # [m]
FORMS = ("as it was", "as it is", "no walls")
WALL, LEAST = 0.5, 0.02  # [-] cosine of a wall; share of its load that it keeps
SHALLOW = 0.4  # [-] of the radius: as deep as no wall is in the ground


def rim(ball, depth, walls):
    """u, d, e [m] of the squares in the ground, which of them are inside the rim, and b [m]."""
    u = np.maximum(depth - ball.z, 0)
    inside = (u > 0) & ((1 - ball.z / ball.radius >= WALL) | (not walls))
    mean, squared = u[inside].mean(), (ball.x[inside] ** 2).mean()  # squares are equal, and the ball is level
    high, b = math.sqrt(12 * u[inside].var()), 2 * math.sqrt(squared)
    d = mean - high / 2
    return u, max(d, 0), b * (1 - np.sqrt(1 - np.clip((u - d) / high, 0, 1))), inside, b


def force(form, numbers, ball, depth):
    """[N] Up; numbers: k0, kappa, T."""
    k0, kappa, slope = numbers
    u, d, e, inside, _ = rim(ball, depth, form != "no walls")
    whole = ball.radius * slope  # u_f in the middle of a disc as wide as the ball
    t = np.minimum(u / whole, 1)
    alone = kappa * u + (k0 - kappa) * whole * (t - t**2 + t**3 / 3)
    edge = np.maximum(d, slope * e) if form != "as it was" else d
    bears = np.minimum(kappa * edge + (k0 - kappa) * slope * e, alone)
    return (ball.area * np.where(inside, np.maximum(bears, LEAST * alone), LEAST * alone)).sum()


def balls(records, fitted):
    for key, (case, beds) in records.cases.items():
        if key.split("/")[0] in FITS[fitted][1] and case.kind == "press" and case.plate.radius:
            yield key, case, mean_rows(beds), Sole(case.plate.text, SQUARE, records.edge(fitted))


def print_balls(records):
    print(f"errors of the force [%], deepest 40 % of the way and before {SHALLOW} of the radius; force over b^3 there [MPa/m], of grains and of the heap, "
          f"pi/3 (k0 - kappa) T\n{'':16}" + "".join(f"{form:>18}" for form in FORMS) + f"{'grains':>12}{'heap':>8}")
    for fitted in FITS:
        if not any(True for _ in balls(records, fitted)):
            continue
        material = fitted_law(records, fitted)
        numbers = material.k_pen / ELEMENT**2, material.sigma_cone / math.cos(material.alpha), math.tan(material.alpha) / material.nu
        for key, case, rows, ball in balls(records, fitted):
            depth, up = rows["depth"], rows["fz"]
            parts = deep(case, depth), (depth > 0.1 * depth[-1]) & (depth < SHALLOW * ball.radius)
            cells = []
            for form in FORMS:
                errors = [100 * (np.mean([force(form, numbers, ball, z) for z in depth[part]]) / up[part].mean() - 1) for part in parts]
                cells.append("{:+10.0f}{:+8.0f}".format(*errors))
            cube = np.array([rim(ball, z, True)[4] ** 3 for z in depth[parts[1]]])
            heap = math.pi / 3 * (numbers[0] - numbers[1]) * numbers[2]
            print(f"{key:16}" + "".join(cells) + f"{1e-6 * np.median(up[parts[1]] / cube):12.3f}{1e-6 * heap:8.3f}", flush=True)


class Fine(GroundEntry):
    """mild_merged with other elements under a ball."""

    def __init__(self, material, elements):
        super().__init__("mild_merged", material)
        self.elements = elements

    def sole(self, case):
        radius = case.sole.radius
        return mild.Sole.surface([{"type": "sphere", "size": [radius], "pos": [0, 0, radius]}], 0.001, radius / self.elements)


def print_elements(records, counts):
    print(f"error of the force [%], deepest 40 % of the way, by elements in a radius\n{'':16}" + "".join(f"{count:>8}" for count in counts))
    for fitted in FITS:
        material = fitted_law(records, fitted) if any(True for _ in balls(records, fitted)) else None
        for key, case, rows, _ in balls(records, fitted):
            found = [measures(case, Fine(material, count).play(case))["force"] for count in counts]
            print(f"{key:16}" + "".join(f"{100 * (force / measures(case, rows)['force'] - 1):+8.0f}" for force in found), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    parser.add_argument("--elements", default="", help="in a radius, e.g. 6,12,24")
    args = parser.parse_args()
    if args.elements:
        print_elements(Records(args.records), [int(count) for count in args.elements.split(",")])
    else:
        print_balls(Records(args.records))


if __name__ == "__main__":
    main()
