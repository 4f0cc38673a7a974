#!/usr/bin/env python3
"""What would mend a tilted sole on merged cones (docs/grains.md, "Tilted soles"): forms of the law without a new number, summed
over fine squares of the plate, beside the grains. Nothing is fitted to a tilted plate.

    PYTHONPATH=build/python .venv/bin/python scripts/judge_tilt.py

With theta the tilt, e the distance to the sole's edge, T = tan(alpha)/nu, u the depth of a square:

    as it is       q (kappa u + (k0 - kappa) min(u, e T)),  q = cos(theta): the projected area
    half tilt      the same, and F_x = F_z tan(theta/2), which turns the plate too
    squared        q = cos(theta)^2, as in the pressure of a stream on a tilted plate
    normal depth   u cos(theta) in the place of u: the way of the plate along its normal
    water line     e no more than u/sin(theta), the distance to the line where the plate enters the ground
    both           water line and half tilt
    half drag      water line, and half of the pressure along the normal and half against the way: q = (1 + cos(theta))/2,
                   F_x = F_z tan(theta/2)"""
import argparse
import math
import pathlib

import numpy as np

from judge import FITS, Records, mean_rows
from judge_cases import Sole
from judge_entries import GroundEntry

ROOT = pathlib.Path(__file__).resolve().parent.parent
ELEMENT = 0.0195  # [m] the paper's, to which a material's numbers belong
SQUARE = 0.002  # [m]
FORMS = ("as it is", "half tilt", "squared", "normal depth", "water line", "both", "half drag")
MODEL = "mild_merged"


def edge(sole):
    """[m] Distance of each square to the outline."""
    distance, points = np.full(len(sole.x), np.inf), np.column_stack([sole.x, sole.y])
    for a, b in zip(sole.outline, np.roll(sole.outline, -1, 0)):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        distance = np.minimum(distance, np.hypot(*(points - a - along[:, None] * (b - a)).T))
    return distance


def law(form, material, sole, tilt, depth, free):
    """Force up [N] and moment [N m] of a plate at a depth; free: [m] edge(sole)."""
    k0, kappa = material.k_pen / ELEMENT**2, material.sigma_cone / math.cos(material.alpha)
    cosine, u = math.cos(tilt), np.maximum(sole.depths(depth, tilt), 0)
    if form in ("water line", "both", "half drag"):
        free = np.minimum(free, u / max(math.sin(tilt), 1e-9))
    if form == "normal depth":
        u = u * cosine
    q = {"squared": cosine**2, "half drag": (1 + cosine) / 2}.get(form, cosine)
    force = q * sole.area * (kappa * u + (k0 - kappa) * np.minimum(u, free * math.tan(material.alpha) / material.nu))
    normal = 1.0 if form in ("half tilt", "both", "half drag") else cosine  # cos + sin tan(theta/2) = 1
    return force.sum(), -normal * (sole.x * force).sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    records, errors = Records(parser.parse_args().records), {form: ([], []) for form in FORMS}
    print(f"errors of force and moment [%]\n{'':24}{'F_x/F_z':>8}{'half':>7}" + "".join(f"{form:>16}" for form in FORMS))
    for fitted, (names, families) in FITS.items():
        tilted = {key: row for key, row in records.cases.items() if key.split("/")[0] in families and row[0].kind == "press" and row[0].tilt}
        if not tilted:
            continue
        entry = GroundEntry(MODEL)
        entry.fit({f"{fitted}/{name}": (records.cases[f"{fitted}/{name}"][0], mean_rows(records.cases[f"{fitted}/{name}"][1])) for name in names},
                  records.ground(fitted))
        for key, (case, beds) in tilted.items():
            rows, sole = mean_rows(beds), Sole(case.sole.text, SQUARE)
            deep = rows["depth"] > case.start + 0.6 * (rows["depth"][-1] - case.start)
            fx, fz, my = (rows[name][deep].mean() for name in ("fx", "fz", "my"))
            cells, free = [], edge(sole)
            for form in FORMS:
                force, moment = np.mean([law(form, entry.material, sole, case.tilt, depth, free) for depth in rows["depth"][deep]], 0)
                for part, error in zip(errors[form], (force / fz - 1, moment / my - 1)):
                    part.append(error)
                cells.append(f"{100 * (force / fz - 1):+8.0f}{100 * (moment / my - 1):+8.0f}")
            print(f"{key:24}{fx / fz:8.3f}{math.tan(case.tilt / 2):7.3f}" + "".join(cells))
    print(f"{'mean size':39}" + "".join(f"{100 * np.abs(force).mean():8.1f}{100 * np.abs(moment).mean():8.1f}" for force, moment in errors.values()))
    print(f"{'largest':39}" + "".join(f"{100 * np.abs(force).max():8.1f}{100 * np.abs(moment).max():8.1f}" for force, moment in errors.values()))


if __name__ == "__main__":
    main()
