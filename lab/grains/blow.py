#!/usr/bin/env python3
"""What a blow of a plate is worth, by the stiffness of the grains and the depth of the bed (lab/grains/README.md, "A blow").

    lab/grains/blow.py list                    the commands of the runs, minutes of a GPU each; any of them may be left out
    lab/grains/blow.py table out/blow/*        a row for each folder: 5 kg on a square of 100 mm fall
    lab/grains/blow.py sole out/blow/*         a sole that is led down fast, beyond the same led slowly
    lab/grains/blow.py law                     the same sole on mild_merged, fitted to the records of sand as the judge does
    lab/grains/blow.py table                   of the records in lab/grains/records.tar.xz/sand alone"""
import argparse
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import pack  # noqa: E402

RECORDS = ROOT / "lab/grains" / "records.tar.xz"
SHARE, TIME = 0.75, 0.010  # [N s], [s]
WINDOWS = ((-10, 0), (0, 5), (5, 10), (10, 15), (15, 20), (20, 30), (30, 40))  # [mm]
# folder: stiffness [Pa], depth of the bed [m], settling [s]; the deep bed settles to a denser one
BEDS = {f"{stiffness // 1000000}mpa-{round(1e3 * depth)}mm": (stiffness, depth, settle)
        for depth, settle in ((0.12, 0.5), (0.24, 0.8)) for stiffness in (1000000, 4000000, 16000000)}
SOLES = "4mpa-sole", (4000000, 0.2, 0.7)


def fail(text):
    print(f"blow.py: {text}", file=sys.stderr)
    sys.exit(2)


def command(folder, stiffness, depth, settle, box, cases):
    words = ["build/grains/grains", "--stiffness", f"{stiffness:g}", "--box", f"{box},{depth:g}", "--settle", f"{settle:g}", "--rows", "300",
             "--out", f"out/blow/{folder}"]
    return " ".join(words) + "".join(f" \\\n    --case '{case}'" for case in cases)


def print_list():
    import walk
    falls = ["press rect:0.1,0.1 0 press:0.06@0.1", "drop10 rect:0.1,0.1 0 drop:5@1.0,0.12", "drop05 rect:0.1,0.1 0 drop:5@0.5,0.12"]
    for folder, (stiffness, depth, settle) in BEDS.items():
        print(command(folder, stiffness, depth, settle, "0.45,0.35", falls))
    sole, _ = walk.outline("sa01")
    led = [f"{tilt}-{name} {sole} {degrees} press:0.05@{speed}" for tilt, degrees in (("level", 0), ("tilted", 8))
           for name, speed in (("fast", 0.8), ("slow", 0.2))]
    print(command(SOLES[0], *SOLES[1], "0.72,0.44", led))


def records(folder, *names):
    """Rows of all beds of the first name that is there."""
    for name in names:
        found = [np.genfromtxt(file.read_text().splitlines(), delimiter=",", names=True) for file in sorted(folder.glob(f"{name}-[0-9]*.csv"))]
        if found:
            return found
    return []


def beyond(slow, fast):
    """[N] of each row of `fast`: force up beyond that of a slow press at the same depth; 0 before contact. Deeper than the slow one
    went its last force counts."""
    return fast["force_z_n"] - np.interp(fast["depth_m"], slow["depth_m"], slow["force_z_n"], left=0)


def blow(slow, fall):
    """Largest force [N], when the momentum beyond a slow press is SHARE [s, NaN: never], and what it is after TIME [N s]."""
    time = fall["time_s"]
    momentum = np.cumsum(beyond(slow, fall) * np.diff(time, prepend=0))
    reached = momentum > SHARE
    return fall["force_z_n"].max(), time[np.argmax(reached)] if reached.any() else np.nan, float(np.interp(TIME, time, momentum))


def table(folders):
    print(f"{'folder':24}{'beds':>5}{'force [N]':>11}{f'{SHARE} N s [ms]':>14}{'10 ms [N s]':>13}{'1 m/s [mm]':>12}{'0.5 m/s [mm]':>14}")
    for folder in folders:
        presses, falls, slower = records(folder, "press", "square100"), records(folder, "drop10", "square100-drop10"), \
            records(folder, "drop05", "square100-drop05")
        if not presses or not falls:
            continue
        force, when, momentum = np.mean([blow(*pair) for pair in zip(presses, falls)], 0)
        deepest = [1e3 * np.mean([rows["depth_m"].max() for rows in part]) if part else np.nan for part in (falls, slower)]
        print(f"{folder.name:24}{len(falls):5}{force:11.0f}{1e3 * when:14.1f}{momentum:13.2f}{deepest[0]:12.1f}{deepest[1]:14.1f}")


def print_windows():
    print(f"{'force beyond a slow one [N], depth [mm]':40}" + "".join(f"{f'{low} to {high}':>10}" for low, high in WINDOWS))


def print_row(name, pairs):
    """Of slow and fast rows of each bed; a window without rows has no number."""
    text = ""
    for low, high in WINDOWS:
        there = [beyond(slow, fast)[(1e3 * fast["depth_m"] >= low) & (1e3 * fast["depth_m"] < high)] for slow, fast in pairs]
        text += f"{np.mean([part.mean() for part in there]):10.0f}" if all(len(part) for part in there) else f"{'-':>10}"
    print(f"{name:40}{text}")


def soles(folders):
    print_windows()
    for folder in folders:
        for name in ("level", "tilted"):
            pairs = list(zip(records(folder, f"{name}-slow"), records(folder, f"{name}-fast")))
            if pairs:
                print_row(f"{folder.name} {name}", pairs)


def law():
    """The row of `sole` that mild_merged has."""
    import judge
    import walk
    from judge_cases import Case
    from judge_entries import GroundEntry
    found, entry = judge.Records(pack.opened(RECORDS)), GroundEntry("mild_merged")
    names, (sole, _) = judge.FITS["sand"][0], walk.outline("sa01")
    entry.fit({name: (found.cases[f"sand/{name}"][0], judge.mean_rows(found.cases[f"sand/{name}"][1])) for name in names}, found.ground("sand"))
    print_windows()
    for name, degrees in (("level", 0), ("tilted", 8)):
        slow, fast = ({"depth_m": rows["depth"], "force_z_n": rows["fz"]} for rows in
                      (entry.play(Case(f"{name} {sole} {degrees} press:0.05@{speed}", found.edge("sand"))) for speed in (0.2, 0.8)))
        print_row(f"mild_merged {name}", [(slow, fast)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("list", "table", "sole", "law"))
    parser.add_argument("folders", nargs="*", type=pack.opened)
    args = parser.parse_args()
    missing = [folder for folder in args.folders if not folder.is_dir()]
    if missing:
        fail(f"{missing[0]} is no folder of records: lab/grains/blow.py list")
    if args.what in ("list", "law"):
        {"list": print_list, "law": law}[args.what]()
    else:
        {"table": table, "sole": soles}[args.what](args.folders or [pack.opened(RECORDS / "sand")])


if __name__ == "__main__":
    main()
