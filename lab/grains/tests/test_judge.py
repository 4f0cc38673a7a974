"""judge.py on made-up records: cases of lab/grains/run.py played by `mild` with a known material, with noise from bed to bed. The
judge must then find mild right in everything, and others wrong where they are known to differ.
test_judge.py SOURCE MILD"""
import csv
import importlib.util
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

SOURCE, MILD = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(SOURCE / "lab/grains"))
import judge as judge_module  # noqa: E402
import judge_anchors  # noqa: E402
import judge_entries  # noqa: E402
import judge_loose  # noqa: E402
import mild  # noqa: E402
import pack  # noqa: E402
from judge_cases import Case, Sole, measures  # noqa: E402
from judge_entries import GroundEntry  # noqa: E402

TRUTH = mild.Material("sand_loose", model="mild", k_pen=380, sigma_cone=0.15e6, mu=0.4, recovery=0.0,
                      slip_length=0, slip_growth=0, grip=0)  # slip costs nothing
NOISE, BEDS = 0.03, 4
RECORDS = SOURCE / "lab/grains/records.tar.xz"
EDGE = 0.0025  # [m] half of a grain of sand
KEEP = ("sand/disc120", "sand/square100", "sand/square100-drag15", "sand/disc100", "sand/square100-tilt15",
        "sand/square100-load10", "sand/square100-swipe15", "sand/square100-again", "sand/square100-drop05", "wide/sa01")


def cases():
    """{FAMILY/NAME: text} of lab/grains/run.py."""
    spec = importlib.util.spec_from_file_location("run", SOURCE / "lab/grains" / "run.py")
    run = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(run)
    return {f"{family}/{case.split()[0]}": case for family, block in run.BLOCKS for case in block}


def make(folder):
    """Records as grains writes them."""
    random, every, manifest = np.random.default_rng(1), cases(), {"sand": {"solid": [0.59], "options": ["--friction", "0.5"]}}
    for key in KEEP:
        family, name = key.split("/")
        (folder / family).mkdir(exist_ok=True)
        case = Case(every[key], EDGE)  # as grains touch it
        rows = GroundEntry("mild", TRUTH, 0.0195).play(case)
        for seed in range(1, BEDS + 1):
            factor = 1 + NOISE * random.standard_normal() * np.ones(3)
            with open(folder / family / f"{name}-{seed}.csv", "w", encoding="utf-8") as file:
                file.write("time_s,stage,depth_m,path_m,pitch_rad,sinkage_m,force_x_n,force_y_n,force_z_n,moment_x_nm,"
                           "moment_y_nm,moment_z_nm,cop_x_m,cop_y_m\n")
                for k in range(len(rows["time"])):
                    row = [rows[name][k] for name in ("time", "stage", "depth", "path", "pitch")]
                    fx, fz, my = factor * [rows["fx"][k], rows["fz"][k], rows["my"][k]]
                    file.write(",".join(f"{v:.6g}" for v in (*row, 0, fx, 0, fz, 0, my, 0, 0, 0)) + "\n")
        manifest[key] = {"case": every[key], "seeds": f"1-{BEDS}"}
    (folder / "manifest.json").write_text(json.dumps(manifest))


def judge(*args, path=""):
    """path: where Python looks first."""
    return subprocess.run([sys.executable, SOURCE / "lab/grains" / "judge.py", *map(str, args)], capture_output=True, text=True,
                          env=dict(os.environ, PYTHONPATH=f"{path}:{os.environ['PYTHONPATH']}"))


def a_sole_has_its_area():
    for text, area in (("rect:0.1,0.06", 0.006), ("disc:0.12", np.pi / 4 * 0.12**2), ("sphere:0.023", np.pi * 0.023**2)):
        got = Sole(text).area.sum()
        print(f"{text}: area {got:.6f}, by hand {area:.6f} (2 %)")
        assert abs(got / area - 1) < 0.02
    r, u = 0.0025, 0.01
    for text, area in (("rect:0.1,0.06", 0.105 * 0.065), ("disc:0.12", np.pi / 4 * 0.125**2), ("sphere:0.05", np.pi * 0.0525**2),
                       ("polygon:0.05,0,0,0.05,-0.05,0,0,-0.05", 2 * (0.05 + 2**0.5 * r)**2)):
        got = Sole(text, 0.001, r).area.sum()
        print(f"{text}: with half a grain of 5 mm around it {got:.6f}, by hand {area:.6f} (1 %)")
        assert abs(got / area - 1) < 0.01
    # a ball whose centre is at R - u meets a grain whose centre is at -r, where both centres are R + r apart
    ball, apart = Sole("sphere:0.05", 0.001, r), ((0.05 + r)**2 - (0.05 - u + r)**2)**0.5
    wet = ball.x[ball.depths(u, 0.0) > 0].max()
    print(f"a ball of 100 mm, 10 mm deep, touches grains within {1e3 * apart:.1f} mm; its squares {1e3 * wet:.1f} mm")
    assert abs(wet - apart) < 0.001
    case = Case("x rect:0.1,0.1 15 press:0.02@0.05", r)
    assert abs(case.plate.length - 0.1) < 1e-12 and abs(case.sole.length - 0.105) < 1e-12
    assert case.start == Case("x rect:0.1,0.1 15 press:0.02@0.05").start, "the grains' plate begins where it did"
    turned = Sole("rect:0.1,0.06")
    assert abs(turned.depths(0.01, 0.3).max() - (0.01 + 0.048 * np.sin(0.3))) < 1e-9


def measures_by_hand():
    """A spring: force 1000 N/m times depth, half of it after a drag."""
    case = Case("x rect:0.1,0.1 0 press:0.02@0.05 drag:0.02@0.05")
    time = np.linspace(0.01, 0.81, 81)
    stage = (time > 0.41).astype(int)
    depth = np.where(stage == 0, 0.05 * time - 0.0005, 0.02)
    rows = {"time": time, "stage": stage, "depth": depth, "path": np.where(stage, 0.05 * (time - 0.41), 0), "pitch": 0 * time,
            "fx": -3.0 * stage, "fz": np.where(stage, 10.0, 1000 * depth), "my": 0 * time}
    got = measures(case, rows)
    print({name: round(float(value), 4) for name, value in got.items()})
    assert abs(got["load_10mm"] - 0.5) < 0.03 and abs(got["grip"] - 3.0 / 19.5) < 0.01
    tilted = measures(Case("x rect:0.1,0.1 15 press:0.02@0.05"), {**rows, "stage": 0 * stage, "fx": 0 * time + 2, "fz": 0 * time + 10, "my": 0 * time - 1})
    assert abs(tilted["traction"] - 0.2) < 1e-12 and abs(tilted["moment"] + 1) < 1e-12


def the_truth_is_found_and_others_are_not(folder):
    mine = folder / "mine.py"
    mine.write_text("def half(depth, tilt, slip, sole):\n    return 0, 0, 0.5 * 1e6 * max(depth, 0) * sole.area.sum(), 0, 0, 0\n")
    (folder / "c.c").write_text("void twice(double d, double t, double s, const double *x, const double *y, const double *a,"
                                "int n, double *w) { (void)t, (void)s, (void)x, (void)y; for (int i = 0; i < n; i++)"
                                "w[2] += 1e6 * (d > 0 ? d : 0) * a[i]; }")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", folder / "c.so", folder / "c.c"], check=True)
    table = folder / "table.csv"
    table.write_text("case,time_s,depth_m,force_x_n,force_z_n,moment_y_nm\ndisc100,0,0,0,0,0\ndisc100,1,0.05,0,100,0\n")
    run = judge("--records", folder, "--families", "sand", "--models", "mild,con_spring,hunt_crossley", "--pitch", "0.0195",
                "--entry", f"{mine}:half", "--entry", f"{folder / 'c.so'}:twice", "--table", f"theirs={table}",
                "--rival", f"same={folder}", "--out", folder / "out")
    print(run.stdout, run.stderr)
    assert run.returncode == 0, run.stderr
    with open(folder / "out" / "judge.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    error = {(row["case"], row["measure"], row["model"]): float(row["error"]) for row in rows}
    noise = 3 * NOISE / BEDS**0.5 + 0.02
    for (case, measure, model), value in error.items():
        if model == "mild":  # lengths in mm
            assert abs(value) < (0.5 if measure in ("pressure_center", "sinkage") else noise), (case, measure, value)
    assert abs(error["sand/square100-tilt15", "moment", "con_spring"] + 1) < 0.1, "one spring in the middle rights nothing: a moment of 0, an error of -1"
    assert error["sand/square100-again", "again", "hunt_crossley"] > 0.8, "a spring without memory gives all of the work again"
    used = {row["case"] for row in rows if row["used_in_fit"] == "1"}
    assert used == {"sand/disc120", "sand/square100", "sand/square100-drag15", "sand/square100-again"}, used
    share = re.search(r"^  mild .* of (\d+)$", run.stdout, re.M)
    assert int(share[1]) == sum(row["model"] == "mild" and row["case"] not in used for row in rows), "what was used is scored"
    forces = [{row["model"]: float(row["value"]) for row in rows if row["case"] == "sand/disc100" and row["measure"] == "force"}]
    assert abs(forces[0]["twice"] / forces[0]["half"] - 2) < 1e-4
    same = {key: value for key, value in error.items() if key[2] == "same"}
    print(f"the records themselves as a rival: {len(same)} numbers, largest error {max(map(abs, same.values())):.1e}")
    assert len(same) == sum(key[2] == "mild" for key in error) and max(map(abs, same.values())) < 1e-3
    assert {model for _, _, model in error} >= {"half", "theirs", "chrono_scm", "archimedes", "3d_rft"}
    assert "figures.html" in run.stdout and (folder / "out" / "figures.html").stat().st_size > 10000


def a_command(folder):
    """`python -m mild judge` from anywhere; app/package has `mild judge`."""
    run = subprocess.run([sys.executable, "-m", "mild", "judge", "--records", folder / "none"], capture_output=True, text=True, cwd=folder)
    assert run.returncode == 2 and run.stderr.startswith("judge.py: ") and "manifest.json" in run.stderr, run.stderr


def directed(tilt, mu):
    """Of a plate pressed straight down: its projection, times a yield force along e (0.6 of the tilt) and the friction across e."""
    e = math.atan2(0.6 * math.sin(tilt), 1 + 0.6 * (math.cos(tilt) - 1))
    return math.cos(tilt) * (math.cos(e) + mu * math.sin(e))


def real_numbers():
    """Poppy seeds by hand; and resistive force theory (ecc_quasi), whose own table is of all their media, is near them."""
    up, along = judge_anchors.poppy_stress("loose", math.radians(30), math.pi / 2)
    assert abs(up - (0.134 + 0.5 * 0.120)) < 1e-12 and abs(along - math.sqrt(0.75) * 0.051) < 1e-12
    assert [round(judge_anchors.poppy_stress(packing, 0, math.pi / 2)[0], 3) for packing in ("loose", "close")] == [0.254, 0.464]
    entries = [GroundEntry(name) for name in ("ecc_quasi", "mild", "mild_merged")]
    for degrees in (15, 30):
        force, _ = judge_anchors.tilted(entries, degrees)
        print(f"tilted by {degrees} degrees:", {name: round(value, 3) for name, value in force.items()})
        level, tilted = (judge_anchors.poppy_stress("loose", math.radians(angle), math.pi / 2)[0] for angle in (0, degrees))
        assert abs(force["ecc_quasi"] / (tilted / level) - 1) < 0.03
        assert abs(force["mild"] - 1) < 1e-3
        assert abs(force["mild_merged"] - directed(math.radians(degrees), 0.55)) < 1e-2
    loose = judge_loose.LooseHeap(1.0)
    loose.bears = 1e8
    real, found = judge_anchors.disc_rows([GroundEntry("mild"), judge_entries.FunctionEntry("loose", loose)])
    assert real == "1.767 +- 0.116" and abs(found["mild"] - 1) < 0.02 and abs(found["loose"] - 5 / 3) < 0.02, (real, found)
    records = judge_module.Records(pack.opened(RECORDS))
    rows = {text: (real, source) for text, real, source, *_ in judge_anchors.anchors([], records, [])}
    assert any("lab/grains/real_sand.py" in source and real.startswith("1.767") for real, source in rows.values()), rows


def mild_fit_says_the_same(folder):
    """The judge's numbers of sand, from the mean of eight beds and elements of a grain, are within the intervals that `mild fit` gives
    five beds of the same records and the paper's elements, of plates that are half a grain wider on each side."""
    records = judge_module.Records(pack.opened(RECORDS))
    names, ground = judge_module.FITS["sand"][0], records.ground("sand")
    entry = GroundEntry("mild_merged")
    entry.fit({f"sand/{name}": (records.cases[f"sand/{name}"][0], judge_module.mean_rows(records.cases[f"sand/{name}"][1])) for name in names}, ground)
    words = []
    for name, plate in zip(names, ("0.125", "0.105,0.105", "0.105,0.105")):
        for bed, rows in enumerate(records.cases[f"sand/{name}"][1][:5]):
            file = folder / f"{name}-{bed}.csv"
            columns = np.column_stack([rows[column] for column in ("time", "depth", "fz", "path", "fx")])
            np.savetxt(file, columns, delimiter=",", header="time_s,depth_m,force_n,slip_m,force_x_n", comments="")
            words += [str(file), "--plate", plate]
    hold = {"alpha": 0.3, "phi": np.mean(ground["solid"]), "rho": ground["density"], "mu": ground["friction"],
            "slip_growth": judge_entries.GROWTH}
    subprocess.run([MILD, "fit", *words, "--model", "mild_merged", "--hold", ",".join(f"{key}={value}" for key, value in hold.items()),
                    "--json", folder / "fit.json"], check=True, capture_output=True)
    found = json.loads((folder / "fit.json").read_text())["parameters"]
    for name in ("slip_length", "grip"):
        number, interval = getattr(entry.material, name), found[name]
        print(f"{name}: the judge {number:.4g}, mild fit {interval['value']:.4g} ({interval['low']:.4g} to {interval['high']:.4g})")
        there = judge_entries.GROWTH * 0.015 if name == "slip_length" else 0  # of the length at the drag's depth
        assert interval["low"] < number < interval["high"] and abs((number + there) / (interval["value"] + there) - 1) < 0.1


def mistakes_are_one_line(folder):
    (folder / "bare").mkdir()
    (folder / "bare/matplotlib.py").write_text("raise ImportError\n")  # before anything is judged
    run = judge("--records", folder / "none", "--out", folder / "out", path=folder / "bare")
    assert run.returncode == 2 and run.stderr == "judge.py: --out draws figures.html with matplotlib, which is not here: pip install matplotlib\n", run.stderr
    for args in (("--records", folder / "none"), ("--records", folder, "--families", "mud"),
                 ("--records", folder, "--entry", "none.py"),
                 ("--records", folder, "--entry", f"{folder / 'mine.py'}:none"),
                 ("--records", folder, "--entry", f"{folder / 'c.so'}:none"), ("--records", folder, "--table", "x"),
                 ("--records", folder, "--rival", "x=/none")):
        run = judge(*args)
        print(args[-1], "->", run.stderr.strip())
        assert run.returncode == 2 and run.stderr.startswith("judge.py: ") and run.stderr.count("\n") == 1


if __name__ == "__main__":
    a_sole_has_its_area()
    measures_by_hand()
    real_numbers()
    with tempfile.TemporaryDirectory() as name:
        make(pathlib.Path(name))
        the_truth_is_found_and_others_are_not(pathlib.Path(name))
        mistakes_are_one_line(pathlib.Path(name))
        mild_fit_says_the_same(pathlib.Path(name))
        a_command(pathlib.Path(name))
