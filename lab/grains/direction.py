#!/usr/bin/env python3
"""Plates that are led in any direction, and landings: what models predict, and what grains say (lab/grains/README.md).

    PYTHONPATH=build/python .venv/bin/python lab/grains/direction.py predict --out out/predicted.csv     no record is read but those of the fit
    lab/grains/run.py --only '^(led|landing/)' --out out/records                                           the records, 12 minutes of a GPU
    PYTHONPATH=build/python .venv/bin/python lab/grains/direction.py table [--rows] [--predicted out/predicted.csv]               errors of each model

Numbers of a case: the force along and up [N], mean over the deepest 40 % of a way down or the second half of a way along; of a landing
the largest force up within 15 ms of contact [N], the impulses up of 10 and of 30 ms and along of 30 ms [N s], the depth [m]; of a
stance the mean forces of each stage."""
import argparse
import csv
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import pack  # noqa: E402
import run  # noqa: E402

RECORDS = ROOT / "lab/grains" / "records.tar.xz"
PREDICTED = ROOT / "lab/grains" / "predicted.csv"
FAMILIES = "led", "landing", "led_wide", "led_deep", "led_fine"
STIFF = "landing_stiff"  # the landings on grains 16 times as stiff: the same predictions


def numbers(case, rows):
    """{name: value} of a case."""
    stage, out = rows["stage"], {}
    last = len(case.ways) - 1

    def mean(name, some):
        out[f"{name}along"], out[f"{name}up"] = rows["fx"][some].mean(), rows["fz"][some].mean()

    if case.name.startswith("way"):
        depth = rows["depth"]
        mean("", depth > case.start + 0.6 * (depth[-1] - case.start))
    elif case.ways[0][5]:
        time, up = rows["time"], rows["fz"]
        begin = int(np.argmax(up > 2))
        step = np.diff(time, prepend=0.0)
        for end in (0.01, 0.03):
            some = (time > time[begin] - step[begin]) & (time <= time[begin] - step[begin] + end)
            out[f"impulse up {1e3 * end:.0f} ms"] = (up * step)[some].sum()
        out["impulse along 30 ms"] = (rows["fx"] * step)[some].sum()
        out["peak"] = up[(time >= time[begin]) & (time <= time[begin] + 0.015)].max()
        out["depth"] = rows["depth"].max()
    elif case.name.startswith(("along", "roll", "onto")):
        for k in range(1, last + 1):
            some = np.flatnonzero(stage == k)
            mean(f"{k} ", some[len(some) // 2:])
    else:
        for k in range(last + 1):
            mean(f"{k} ", stage == k)
    return out


def cases(family, edge):
    from judge_cases import Case
    for name, lines in run.BLOCKS:
        if name == family:
            yield from (Case(line, edge) for line in lines)


def predict(args):
    import judge
    records = judge.Records(pack.opened(RECORDS))
    words = argparse.Namespace(pitch=0, models=args.models, entry=[], table=[], rival=[])
    out = []
    for fitted, families in (("sand", FAMILIES[:-1]), ("fine", FAMILIES[-1:])):
        keys = [f"{fitted}/{name}" for name in judge.FITS[fitted][0]]
        given = {key: (records.cases[key][0], judge.mean_rows(records.cases[key][1])) for key in keys}
        ground = records.ground(fitted)
        for entry in judge.entries(words, ground):
            entry.fit(given, ground)
            for family in families:
                for case in cases(family, records.edge(fitted)):
                    rows = entry.play(case)
                    for name, value in (numbers(case, rows) if rows is not None else {}).items():
                        out.append([f"{family}/{case.name}", entry.name + args.suffix, name, f"{value:.5g}"])
            print(fitted, entry.name, flush=True)
    with open(args.out, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([["case", "model", "number", "value"], *out])


def measured(folder, stiff):
    """{case: {number: (mean over beds, standard deviation of one)}}"""
    import judge
    found = {}
    for family in FAMILIES:
        for case in cases(family, 0.0):
            where = STIFF if stiff and family == "landing" else family
            beds = [judge.read_record(file) for file in sorted(folder.glob(f"{where}/{case.name}-[0-9]*.csv"))]
            if beds:
                each = [numbers(case, rows) for rows in beds]
                found[f"{family}/{case.name}"] = {name: (np.mean([one[name] for one in each]), np.std([one[name] for one in each], ddof=1))
                                                  for name in each[0]}
    return found


def vectors(values):
    """Pairs of along and up: {prefix: complex}."""
    return {name[:-5]: complex(value, values[name[:-5] + "up"]) for name, value in values.items()
            if name.endswith("along")}


def table(args):
    grains = measured(pack.opened(args.records), args.stiff)
    models = {}
    for file in args.predicted:
        with open(file, newline="", encoding="utf-8") as lines:
            for row in csv.DictReader(lines):
                models.setdefault(row["model"], {}).setdefault(row["case"], {})[row["number"]] = float(row["value"])
    print(f"{'':22}{'ways':>22}{'led stages':>20}{'landings: peak':>18}{'10 ms':>7}{'30 ms':>7}{'along':>7}{'depth':>7}")
    print(f"{'':22}{'median  mean   angle':>22}{'median  mean':>20}{'median errors [%; % of up; mm]':>46}")
    for model, predicted in models.items():
        way, led, fall = [], [], {}
        for case, values in grains.items():
            got, means = predicted.get(case, {}), {name: value[0] for name, value in values.items()}
            if not got:
                continue
            for name, force in vectors(means).items():
                if abs(force) < 1:  # [N] in the air
                    continue
                other = vectors(got)[name]
                error = abs(other - force) / abs(force)
                (way if "/way" in case else led).append((error, abs(np.degrees(np.angle(other / force))) if other else 90))
                if args.rows:
                    print(f"  {model:16} {case:24} {name:3} grains {force.real:8.2f} {force.imag:8.2f} model {other.real:8.2f} {other.imag:8.2f}"
                          f"  {100 * error:5.0f} %  {way[-1][1] if '/way' in case else led[-1][1]:4.0f} deg")
            if "peak" in means:
                for name, value in means.items():
                    by = {"depth": 1e-3}.get(name, means["impulse up 30 ms"] if "along" in name else value) / (1 if name == "depth" else 100)
                    fall.setdefault(name, []).append(abs((got[name] - value) / by))
                    if args.rows:
                        print(f"  {model:16} {case:24} {name:20} grains {value:8.3f} model {got[name]:8.3f}")
        if way:
            w, other = np.array(way), np.array(led)
            falls = "".join(f"{np.median(fall.get(name, [np.nan])):7.1f}" for name in
                            ("impulse up 10 ms", "impulse up 30 ms", "impulse along 30 ms", "depth"))
            print(f"{model:22}{100 * np.median(w[:, 0]):7.1f}{100 * w[:, 0].mean():7.1f}{np.median(w[:, 1]):7.1f}"
                  f"{100 * np.median(other[:, 0]):13.1f}{100 * other[:, 0].mean():7.1f}{np.median(fall.get('peak', [np.nan])):18.1f}{falls}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("predict", "table"))
    parser.add_argument("--out", default="out/predicted.csv", type=pathlib.Path)
    parser.add_argument("--models", default="", help="names with commas; without it all")
    parser.add_argument("--suffix", default="", help="added to their names")
    parser.add_argument("--records", default=RECORDS, type=pathlib.Path, help="a folder or an archive")
    parser.add_argument("--predicted", default=[PREDICTED], type=pathlib.Path, nargs="+")
    parser.add_argument("--rows", action="store_true", help="every number")
    parser.add_argument("--stiff", action="store_true", help=f"landings on {STIFF}")
    args = parser.parse_args()
    predict(args) if args.what == "predict" else table(args)


if __name__ == "__main__":
    main()
