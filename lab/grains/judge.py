#!/usr/bin/env python3
"""Judges ground models by grains (lab/grains/README.md): fits each on two level plates and one drag, predicts all other cases, and
prints the error of each beside one bed's noise.

    PYTHONPATH=build/python .venv/bin/python lab/grains/judge.py
    ... lab/grains/judge.py --entry mine.py:law --table theirs=predictions.csv      models of others (lab/grains/judge_entries.py)
    ... lab/grains/judge.py --rival newton=out/mpm      another simulator's records of the same cases (lab/grains/judge_mpm.py)

The models' soles are what of a body grains touch: half a grain wider on each side (judge_cases.Sole). A --rival has bodies of its own.

An error is model over grains less 1; of a share of the force before (F0) and of lengths it is the difference. The noise is the
standard deviation over beds of the same number. `*` is an error above twice the noise. --out has all numbers as judge.csv and
figures.html with the curves."""
import argparse
import base64
import csv
import importlib.util
import io
import json
import pathlib
import re
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import mild  # noqa: E402
import pack  # noqa: E402
from judge_anchors import print_anchors  # noqa: E402
from judge_cases import COLUMNS, EDGE, MEASURES, Case, measures, scale  # noqa: E402
from judge_entries import (Archimedes, EntryError, FunctionEntry, GroundEntry, TableEntry, c_function, chrono_scm,  # noqa: E402
                           rft_stress, wong_sand)

# Families of beds, what a model is fitted to there, and the families that the same fit predicts.
FITS = {
    "sand": (("disc120", "square100", "square100-drag15"), ("sand", "wide", "deep")),
    "slick": (("disc120", "square100", "square100-drag15"), ("slick",)),
    "fine": (("disc60", "strip", "strip-drag15"), ("fine",)),
    "hertz": (("disc120", "square100", "square100-drag15"), ()),
    "rolling": (("disc120", "square100", "square100-drag15"), ()),
}
FITTED_BY_HAND = ("sand/square100-again", "sand/square100-drop10", "deep/square100-drag40",
        "deep/square100-drag80")  # have constants of mild_merged fitted to them, so they are no predictions of anybody's
FRICTION = {0.5: 0.38, 0.3: 0.33}  # internal friction of spheres by that of grains, for 3D-RFT: critical state, [lit]
CSV_COLUMNS = {"time_s": "time", "stage": "stage", "depth_m": "depth", "path_m": "path", "pitch_rad": "pitch",
               "force_x_n": "fx", "force_z_n": "fz", "moment_y_nm": "my"}


def fail(text):
    print(f"judge.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- records ----

class Records:
    """Cases of a folder of records, or of an archive (pack.py): key FAMILY/NAME: (Case, [rows of each bed]). share: by how much of
    a grain the models' soles are wider on each side."""

    def __init__(self, folder, share=EDGE):
        self.share = share
        file = folder / "manifest.json"
        if not file.exists():
            fail(f"{file} is not there: make records with lab/grains/run.py")
        try:
            self.manifest, self.cases = json.loads(file.read_text()), {}
        except (OSError, ValueError) as error:
            fail(f"{file}: {error}")
        for key, row in self.manifest.items():
            if "case" not in row:
                continue
            family, name = key.split("/")
            beds = [read_record(file) for file in sorted(folder.glob(f"{family}/{name}-*.csv"))
                    if re.fullmatch(re.escape(name) + r"-\d+", file.stem)]
            if beds:
                self.cases[key] = Case(row["case"], self.edge(family)), beds
                self.cases[key][0].key = key

    def edge(self, family):
        """[m] by which a body touches grains beyond its outline."""
        return self.share * self.ground(family)["grain"]

    def ground(self, family):
        """Numbers of the beds of a family."""
        row = self.manifest.get(family, {})
        options = row.get("options", [])
        given = {name.removeprefix("--"): value for name, value in zip(options[::2], options[1::2])}
        return {"solid": row.get("solid", [0.59]), "density": float(given.get("density", 2500)),
                "friction": float(given.get("friction", 0.5)), "grain": float(given.get("grain", 0.005))}


def read_record(file):
    table = np.genfromtxt(file.read_text().splitlines(), delimiter=",", names=True)
    missing = [name for name in CSV_COLUMNS if name not in table.dtype.names]
    if missing:
        fail(f"{file} has no column {missing[0]}: it must be a record of grains")
    return {short: table[name] for name, short in CSV_COLUMNS.items()}


class Rival:
    """Another simulator: a folder of records, each case played as the mean of its beds."""

    def __init__(self, name, folder):
        self.name, self.cases = name, Records(folder).cases

    def fit(self, records, ground):
        pass

    def play(self, case):
        found = self.cases.get(case.key)
        return mean_rows(found[1]) if found and found[0].text == case.text else None


def mean_rows(beds):
    """The mean bed, at the rows of the first."""
    return {name: np.mean([np.interp(beds[0]["time"], rows["time"], rows[name]) for rows in beds], 0) if name != "stage"
            else beds[0]["stage"] for name in COLUMNS}


def grain_values(case, beds):
    """{measure: (mean over beds, standard deviation of one)}."""
    each = [measures(case, rows) for rows in beds]
    return {name: (np.mean([values[name] for values in each]), np.std([values[name] for values in each], ddof=1) if len(each) > 1
                   else np.nan) for name in each[0]}


# ---- models ----

def function_entry(text):
    """FILE.py:FUNCTION or LIB.so:FUNCTION."""
    file, _, name = text.rpartition(":")
    path = pathlib.Path(file).resolve()
    if not file or not path.exists():
        fail(f"--entry {text}: it must be FILE.py:FUNCTION or LIB.so:FUNCTION")
    try:
        if path.suffix != ".py":
            return FunctionEntry(name, c_function(str(path), name))
        spec = importlib.util.spec_from_file_location("entry", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return FunctionEntry(name, getattr(module, name))
    except (OSError, AttributeError) as error:
        fail(f"--entry {text}: {error}")


def entries(args, ground):
    friction, pitch = FRICTION.get(ground["friction"], 0.38), args.pitch or ground["grain"]
    stress = rft_stress(ground, friction)
    rft = GroundEntry("ecc_quasi_3d", mild.Material("sand_loose", model="ecc_quasi_3d", zeta=stress / 1e6, mu=0, k_drift=0,
                                                    b_drift=0), pitch)
    rft.name, rft.fit = "3d_rft", lambda records, ground: None
    models = [name for name in args.models.split(",") if name] or [name for name in mild.models() if name != "rigid"]
    yield from (GroundEntry(model, None, pitch) for model in models)
    if "mild" in models:  # what slip and refill alone do
        slips = GroundEntry("mild", None, pitch, slips=True)
        slips.name = "mild_slips"
        yield slips
    yield rft
    yield FunctionEntry("chrono_scm", chrono_scm)
    yield FunctionEntry("wong_sand", wong_sand)
    yield FunctionEntry("archimedes", Archimedes())
    yield from (function_entry(text) for text in args.entry)
    for text in args.table:
        name, _, file = text.partition("=")
        if not file or not pathlib.Path(file).exists():
            fail(f"--table {text}: it must be NAME=FILE.csv")
        yield TableEntry(name, file)
    for text in args.rival:
        name, _, folder = text.partition("=")
        if not folder or not pack.opened(folder).is_dir():
            fail(f"--rival {text}: it must be NAME=FOLDER of records")
        yield Rival(name, pack.opened(folder))


# ---- rows of the judgement ----

def judge_family(args, records, fitted, results):
    """Fits every model on a family and predicts; adds (fit, case, measure, grains, noise, {model: value}) to results."""
    names, families = FITS[fitted]
    keys = [f"{fitted}/{name}" for name in names]
    lacking = [key for key in keys if key not in records.cases]
    if lacking:
        print(f"{fitted}: no record of {lacking[0]}, so nothing is fitted there")
        return
    given = {key: (records.cases[key][0], mean_rows(records.cases[key][1])) for key in keys}
    ground, models = records.ground(fitted), []
    for entry in entries(args, ground):
        try:
            entry.fit(given, ground)
            models.append(entry)
        except (ValueError, RuntimeError) as error:
            print(f"{fitted}: {entry.name} is not fitted: {error}")
    args.fitted[fitted] = models
    for key, (case, beds) in sorted(records.cases.items(), key=lambda row: (row[0] not in keys, row[0])):
        if key.split("/")[0] not in (*families, fitted):
            continue
        played = {entry.name: entry.play(case) for entry in models}
        found = {name: measures(case, rows) for name, rows in played.items() if rows is not None}
        for measure, (value, noise) in grain_values(case, beds).items():
            values = {name: numbers.get(measure, np.nan) for name, numbers in found.items()}
            results.append((fitted, key, key in keys or key in FITTED_BY_HAND, measure, value, noise, values))
        args.curves.setdefault(key, (beds, played))


# ---- what is printed ----

def text_of(value, noise, measure):
    unit = MEASURES[measure][1]
    if not np.isfinite(value):
        return "-"
    star = "*" if np.isfinite(noise) and abs(value) > 2 * noise else " "
    return f"{value:+.1f}{star}" if unit == "mm" else f"{100 * value:+.0f}{star}"


def print_results(results):
    for fitted in dict.fromkeys(row[0] for row in results):
        rows = [row for row in results if row[0] == fitted]
        names = list(dict.fromkeys(name for row in rows for name in row[6]))
        used = list(dict.fromkeys(row[1] for row in rows if row[2]))
        hand = [key for key in used if key in FITTED_BY_HAND]
        print(f"\nfitted on {', '.join(key for key in used if key not in hand)}" + (
              f"\nout of the score, too, because constants of mild_merged are from them: {', '.join(hand)}" if hand else "") + "\n"
              "errors [%; % of the force before; mm], one bed's noise in the same unit")
        print(f"{'':41}{'grains':>8}{'noise':>6}" + "".join(f"{name[:12]:>13}" for name in names))
        for _, key, used, measure, value, noise, values in rows:
            by, size = scale(measure, value), abs(scale(measure, value))
            unit = 1 if MEASURES[measure][1] == "mm" else 100
            errors = [text_of((values.get(name, np.nan) - value) / by, noise / size, measure) for name in names]
            mark = " out" if key in FITTED_BY_HAND else " fit" * used
            print(f"{key + mark:29.29}{measure:12.12}{value:8.3g}{unit * noise / size:6.1f}" +
                  "".join(f"{error:>13}" for error in errors))


def print_score(results):
    """Median and largest size of the errors that were predicted, and how many the noise explains."""
    print("\npredicted cases only: errors [%], median and largest; lengths [mm], the same; share of all within twice the noise")
    names = list(dict.fromkeys(name for row in results for name in row[6]))
    for name in names:
        errors, lengths, within = [], [], []
        for _, _, used, measure, value, noise, values in results:
            got = values.get(name, np.nan)
            if used or not np.isfinite(got):
                continue
            if MEASURES[measure][1] == "mm":
                lengths.append(abs(got - value))
            else:
                errors.append(100 * abs((got - value) / scale(measure, value)))
            within.append(abs(got - value) <= 2 * noise)
        parts = [f"{np.median(part):8.1f}{np.max(part):7.0f}" if part else f"{'-':>8}{'-':>7}" for part in (errors, lengths)]
        if within:
            print(f"  {name:14}{parts[0]}{parts[1]}   {np.mean(within):.2f} of {len(within)}")


def write_csv(results, file):
    with open(file, "w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["fitted_on", "case", "used_in_fit", "measure", "unit", "grains", "noise", "model", "value", "error"])
        for fitted, key, used, measure, value, noise, values in results:
            for name, got in values.items():
                writer.writerow([fitted, key, int(used), measure, MEASURES[measure][1], f"{value:.5g}", f"{noise:.3g}", name,
                                 f"{got:.5g}", f"{(got - value) / scale(measure, value):.4g}"])


# ---- figures ----

def curve_axes(case):
    """What a case is drawn over, and what: columns, labels, factors."""
    if case.kind in ("press", "again"):
        return ("depth", "depth [mm]", 1e3), ("my" if case.tilt else "fz", "moment [N m]" if case.tilt else "force [N]", 1.0)
    if case.kind == "load":
        return ("path", "path [mm]", 1e3), ("depth", "depth [mm]", 1e3)
    if case.kind == "drag":
        return ("path", "path [mm]", 1e3), ("fz", "force [N]", 1.0)
    if case.kind == "swipe":
        return ("pitch", "turn [deg]", 57.2958), ("my", "moment [N m]", 1.0)
    return ("time", "time [ms]", 1e3), ("depth", "depth [mm]", 1e3)


def write_figures(args, records, file):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    parts = ["<!doctype html><meta charset=utf-8><title>Ground models and grains</title><body style='font-family:sans-serif'>"
             "<h1>Ground models and grains</h1><p>Grey: each bed. Lines: models, fitted on two level plates and one drag.</p>"]
    for key, (beds, played) in sorted(args.curves.items()):
        case = records.cases[key][0]
        (x, xlabel, xf), (y, ylabel, yf) = curve_axes(case)
        figure, axes = plt.subplots(figsize=(5.2, 3.4))
        for rows in beds:
            axes.plot(xf * rows[x], yf * rows[y], color="0.75", lw=0.8)
        for name, rows in played.items():
            if rows is not None:
                axes.plot(xf * rows[x], yf * rows[y], lw=2 if name.startswith("mild") else 1, label=name)
        high = 2 * max(float(np.abs(yf * rows[y]).max()) for rows in beds)
        axes.set(title=key, xlabel=xlabel, ylabel=ylabel)
        axes.set_ylim(max(axes.get_ylim()[0], -high), min(axes.get_ylim()[1], high))
        axes.legend(fontsize=6)
        data = io.BytesIO()
        figure.tight_layout()
        figure.savefig(data, format="svg")
        plt.close(figure)
        parts.append(f"<img alt='{key}' src='data:image/svg+xml;base64,{base64.b64encode(data.getvalue()).decode()}'>")
    file.write_text("\n".join(parts) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=f"{ROOT}/lab/grains/records.tar.xz", type=pack.opened, help="of grains: a folder, or an archive's")
    parser.add_argument("--pitch", default=0, type=float, help="[m] elements of mild's soles; default: a grain")
    parser.add_argument("--edge", default=EDGE, type=float, help="[grains] by which the models' soles are wider on each side")
    parser.add_argument("--families", default=",".join(FITS), help="beds to fit on, of " + ", ".join(FITS))
    parser.add_argument("--models", default="", help="of mild; default: all that yield")
    parser.add_argument("--entry", action="append", default=[], help="FILE.py:FUNCTION or LIB.so:FUNCTION, a model of your own")
    parser.add_argument("--table", action="append", default=[], help="NAME=FILE.csv, predictions of your own")
    parser.add_argument("--rival", action="append", default=[], help="NAME=FOLDER, records of another simulator")
    parser.add_argument("--out", type=pathlib.Path, help="folder for judge.csv and figures.html, which matplotlib draws")
    args = parser.parse_args()
    if args.out:
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            fail("--out draws figures.html with matplotlib, which is not here: pip install matplotlib")
    args.curves, args.fitted, results, begin = {}, {}, [], time.time()
    records = Records(args.records, args.edge)
    for fitted in args.families.split(","):
        if fitted not in FITS:
            fail(f"--families: {fitted} is not one of {', '.join(FITS)}")
        try:
            judge_family(args, records, fitted, results)
        except EntryError as error:
            fail(str(error))
    if not results:
        fail("nothing to judge")
    print_results(results)
    print_score(results)
    print_anchors(args.fitted.get("sand", []), records, results)
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        write_csv(results, args.out / "judge.csv")
        write_figures(args, records, args.out / "figures.html")
        print(f"\n{args.out / 'judge.csv'}, {args.out / 'figures.html'}")
    print(f"{time.time() - begin:.0f} s")


if __name__ == "__main__":
    main()
