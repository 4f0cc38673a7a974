#!/usr/bin/env python3
"""What would mend a tilted sole on merged cones (docs/grains.md, "Tilted soles"): forms of the law without a new number, summed
over fine squares of the plate, beside the grains. Nothing is fitted to a tilted plate.

    PYTHONPATH=build/python .venv/bin/python scripts/judge_tilt.py
    ... scripts/judge_tilt.py --edge 0,0.25,0.5,0.75,1      means alone, by how much of a grain the soles are wider on each side
    ... scripts/judge_tilt.py --predict                     force and moment of cases of grains/run.py that have no record

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
import importlib.util
import math
import pathlib

import numpy as np

from judge import FITS, Records, mean_rows
from judge_cases import Case, Sole, outline_distance
from judge_entries import GroundEntry

ROOT = pathlib.Path(__file__).resolve().parent.parent
ELEMENT = 0.0195  # [m] the paper's, to which a material's numbers belong
SQUARE = 0.002  # [m]
FORMS = ("as it is", "half tilt", "squared", "normal depth", "water line", "both", "half drag")
MODEL = "mild_merged"


def law(form, material, sole, tilt, depth, free):
    """Force up [N] and moment [N m] of a plate at a depth; free: [m] outline_distance(sole)."""
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


def fitted_law(records, fitted):
    """The numbers of the law that the judge has on a family of beds. Elements divide the plates of sand."""
    entry = GroundEntry(MODEL, pitch=records.ground(fitted)["grain"] / (1 if records.share in (0, 0.5, 1) else 2))
    names = [f"{fitted}/{name}" for name in FITS[fitted][0]]
    entry.fit({name: (records.cases[name][0], mean_rows(records.cases[name][1])) for name in names}, records.ground(fitted))
    return entry.material


def deep(case, depth):
    """Where a press is in the deepest 40 % of its way, of which the judge's numbers are."""
    return depth > case.start + 0.6 * (depth[-1] - case.start)


def predicted(forms, material, case, edge_m, depths):
    """Mean force [N] and moment [N m] of each form over depths of the middle."""
    sole = Sole(case.sole.text, SQUARE, edge_m)
    free = outline_distance(sole)
    return {form: np.mean([law(form, material, sole, case.tilt, depth, free) for depth in depths], 0) for form in forms}


def presses(records, families):
    return {key: row for key, row in records.cases.items() if key.split("/")[0] in families and row[0].kind == "press" and not row[0].plate.radius}


def print_tilted(records):
    errors = {form: ([], []) for form in FORMS}
    print(f"errors of force and moment [%]\n{'':24}{'F_x/F_z':>8}{'half':>7}" + "".join(f"{form:>16}" for form in FORMS))
    for fitted, (_, families) in FITS.items():
        tilted = {key: row for key, row in presses(records, families).items() if row[0].tilt}
        material = fitted_law(records, fitted) if tilted else None
        for key, (case, beds) in tilted.items():
            rows = mean_rows(beds)
            rows = {name: rows[name][deep(case, rows["depth"])] for name in ("depth", "fx", "fz", "my")}
            fx, fz, my = (rows[name].mean() for name in ("fx", "fz", "my"))
            cells = []
            for form, (force, moment) in predicted(FORMS, material, case, records.edge(fitted), rows["depth"]).items():
                for part, error in zip(errors[form], (force / fz - 1, moment / my - 1)):
                    part.append(error)
                cells.append(f"{100 * (force / fz - 1):+8.0f}{100 * (moment / my - 1):+8.0f}")
            print(f"{key:24}{fx / fz:8.3f}{math.tan(case.tilt / 2):7.3f}" + "".join(cells))
    for name, of in (("mean size", np.mean), ("largest", np.max)):
        print(f"{name:39}" + "".join(f"{100 * of(np.abs(force)):8.1f}{100 * of(np.abs(moment)):8.1f}" for force, moment in errors.values()))


def print_scan(folder, shares):
    """Errors of level plates and of tilted ones, by how much of a grain the soles are wider."""
    forms = ("as it is", "water line")
    print(f"mean and largest size of errors [%]\n{'grains wider':14}{'level force':>16}" + "".join(f"{form + part:>24}" for form in forms for part in (", force", ", moment")))
    for share in shares:
        records, level, tilted = Records(folder, share), [], {form: [] for form in forms}
        for fitted in ("sand", "slick", "fine"):
            material = fitted_law(records, fitted)
            for case, beds in presses(records, FITS[fitted][1]).values():
                rows = mean_rows(beds)
                rows = {name: rows[name][deep(case, rows["depth"])] for name in ("depth", "fz", "my")}
                for form, (force, moment) in predicted(forms, material, case, records.edge(fitted), rows["depth"]).items():
                    if case.tilt:
                        tilted[form].append((force / rows["fz"].mean() - 1, moment / rows["my"].mean() - 1))
                    elif form == forms[0]:
                        level.append(force / rows["fz"].mean() - 1)
        columns = [level, *(np.array(tilted[form])[:, part] for form in forms for part in (0, 1))]
        print(f"{share:<14}" + "".join(f"{100 * np.mean(np.abs(column)):{width}.1f}{100 * np.max(np.abs(column)):6.1f}"
                                       for column, width in zip(columns, (10, 18, 18, 18, 18))))


def print_predictions(records):
    """Cases of tilted plates in grains/run.py that have no record: what the forms say."""
    spec = importlib.util.spec_from_file_location("run", ROOT / "grains" / "run.py")
    run = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(run)
    forms = ("as it is", "water line", "normal depth")
    print(f"force up [N] and moment [N m], means over the deepest 40 % of the way\n{'':24}" + "".join(f"{form:>20}" for form in forms))
    for fitted, (_, families) in FITS.items():
        lacking = {f"{family}/{text.split()[0]}": Case(text, records.edge(fitted)) for family, texts in run.BLOCKS for text in texts if family in families}
        lacking = {key: case for key, case in lacking.items() if case.kind == "press" and case.tilt and key not in records.cases}
        material = fitted_law(records, fitted) if lacking else None
        for key, case in lacking.items():
            depth = np.linspace(case.start, case.deepest, 400)
            found = predicted(forms, material, case, records.edge(fitted), depth[deep(case, depth)])
            print(f"{key:24}" + "".join(f"{force:11.1f}{moment:9.3f}" for force, moment in found.values()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    parser.add_argument("--edge", default="", help="shares of a grain, e.g. 0,0.25,0.5")
    parser.add_argument("--predict", action="store_true")
    args = parser.parse_args()
    if args.edge:
        print_scan(args.records, [float(share) for share in args.edge.split(",")])
    elif args.predict:
        print_predictions(Records(args.records))
    else:
        print_tilted(Records(args.records))


if __name__ == "__main__":
    main()
