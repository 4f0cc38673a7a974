#!/usr/bin/env python3
"""The paper's experiments: measures them with build/mild, draws them, and writes one page, OUT/index.html, that opens anywhere.

  scripts/paper/paper.py [EXPERIMENT ...] [--models FOLDER] [--policy FILE] [--out out/paper] [--trials N]

The policies of --models, MODEL-SEED.safetensors, are those of scripts/paper/train.sh. What the paper measured on hardware is
measured in simulation here. Each experiment leaves its numbers as CSV in OUT. Without names: all."""
import argparse
import csv
import json
import math
import pathlib
import random
import subprocess
import sys

import figures
import page

ROOT = pathlib.Path(__file__).resolve().parents[2]
MILD = ROOT / "build/mild"
SEVEN = ["rigid", "rubber", "foam60", "foam45", "foam28", "grass", "sand_loose"]  # the paper's six and the rigid plane
TRAINED = ["mild", "con_cone", "con_spring", "ecc_spring", "ecc_quasi", "ecc_quasi_3d", "rigid"]
JUDGES = TRAINED[:-1] + ["bekker", "hunt_crossley", "rigid"]
SPEEDS = [0.3, 0.6, 0.9, 1.2]
TABLE_2 = {  # the paper's: cost of transport and largest torque on hardware, speed in simulation
    "cost of transport": {"MILD": [0.82, 0.75, 0.78, 0.83], "HT-2": [1.05, 0.96, 1.20, 1.08], "Clock": [1.38, 1.30, 1.35, 1.42]},
    "largest torque": {"MILD": [58.2, 63.2, 73.3, 88.4], "HT-2": [62.9, 75.8, 96.0, 91.6], "Clock": [67.6, 82.5, 102.8, 115.2]},
    "measured speed": {"MILD": [0.28, 0.57, 0.84, 1.15], "HT-2": [0.28, 0.61, 0.98, 1.28], "Clock": [0.23, 0.54, 0.81, 1.09]},
}


def mild(*arguments):
    """Runs build/mild; what it prints."""
    done = subprocess.run([MILD, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        sys.exit(f"mild {' '.join(map(str, arguments))}:\n{done.stderr}")
    return done.stdout


def evaluate(given, policy, grounds, speeds, *more):
    """Rows of `mild eval`."""
    return json.loads(mild("eval", "--policy", policy, "--ground", ",".join(grounds),
                           "--speed=" + ",".join(map(str, speeds)), "--trials", given.trials, "--json", "-", *more))["rows"]


def save(given, name, rows):
    """rows: [{column: value}] to OUT/NAME.csv."""
    with open(given.out / f"{name}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: round(v, 6) if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else float("nan")


def models_of(given):
    """{model: [policy of each seed]} of those that are there."""
    found = {model: sorted(given.models.glob(f"{model}-[0-9]*.safetensors")) for model in TRAINED}
    return {model: files for model, files in found.items() if files}


# ---- experiments: each returns a page.Section ----

def grounds(given):
    """Force against depth of the robot's sole on every preset."""
    curves = {}
    for name in SEVEN[1:] + ["foam25", "sand_dense"]:
        path = given.out / f"press_{name}.csv"
        mild("press", "--ground", name, "--plate", "sole", "--depth", 0.05, "--csv", path)
        curves[name] = [(1e3 * float(row["depth_m"]), float(row["force_n"])) for row in read(path)]
    return page.Section("Grounds", figures.lines(curves, "depth [mm]", "force on one sole [N]"),
                        "The sole of the robot pressed 50 mm deep at 10 mm/s and drawn out again.")


def speeds(given):
    """Table II, and ten walks forward and backward at 1.2 m/s on seven grounds."""
    rows = evaluate(given, given.policy, SEVEN, SPEEDS + [-1.2], "--config", given.config)
    save(given, "speeds", rows)
    keys = {"cost of transport": "cot", "largest torque": "torque_max", "measured speed": "velocity"}
    table, worse = [], []
    for what, paper in TABLE_2.items():
        for name, values in paper.items():
            table.append([what, f"{name}, paper", *values])
        for ground in SEVEN:
            ours = [next(r for r in rows if r["ground"] == ground and r["speed"] == v)[keys[what]] for v in SPEEDS]
            table.append([what, f"ours, {ground}", *(round(x, 2) for x in ours)])
            limit = paper["MILD"]
            if what != "measured speed":
                worse += [f"{what} on {ground} at {v}: {x:.2f}, paper {y}" for v, x, y in zip(SPEEDS, ours, limit) if x > y]
            else:
                worse += [f"speed on {ground} at {v}: {x:.2f}" for v, x in zip(SPEEDS, ours) if abs(x / v - 1) > 0.04]
    fast = [r for r in rows if abs(r["speed"]) == 1.2]
    upright = sum(r["success"] for r in fast), sum(r["trials"] for r in fast)
    text = (f"Walks at 1.2 and -1.2 m/s on seven grounds: {upright[0]} of {upright[1]} without a fall (paper: all). "
            "The paper's cost of transport and torque are of hardware, on a ground that it does not name; ours of simulation. ")
    text += "Outside of the paper's number, or of 4 % of the speed: " + ("; ".join(worse) if worse else "none") + "."
    return page.Section("Speed, cost of transport, torque (Table II)", None, text,
                        page.Table(["", "", *(f"{v} m/s" for v in SPEEDS)], table),
                        page.Claim("walks at +-1.2 m/s on seven grounds", "70 of 70 each way", f"{upright[0]} of {upright[1]}",
                                   upright[0] == upright[1]))


def clearance(given):
    """Foot clearance by ground; the paper: higher on softer ground."""
    order = ["rigid", "rubber", "foam60", "foam45", "foam28", "foam25"]
    rows = evaluate(given, given.policy, order + ["grass", "sand_loose", "sand_dense"], [0.6], "--config", given.config)
    save(given, "clearance", rows)
    high = {r["ground"]: 1e3 * r["clearance"] for r in rows}
    rises = high["foam28"] > high["rubber"] and high["foam28"] > high["rigid"]
    text = "Apex of the lowest sole point above the undisturbed ground, 0.6 m/s."
    return page.Section("Foot clearance by ground", figures.bars(high, "clearance [mm]"), text, None,
                        page.Claim("clearance is higher on softer ground", "rises (figure)",
                                   f"rigid {high['rigid']:.0f}, rubber {high['rubber']:.0f}, foam28 {high['foam28']:.0f} mm", rises))


def models(given):
    """Penetration against slip of policies on the model that they were trained on, foam25."""
    rows, points = [], {}
    for model, files in models_of(given).items():
        if model == "rigid":
            continue
        for seed, policy in enumerate(files, 1):
            path = given.out / f"stances_{model}_{seed}.csv"
            evaluate(given, policy, ["foam25"], [0.6], "--config", given.models_config, "--model", model, "--stances", path)
            for s in read(path):
                points.setdefault(model, []).append((1e3 * float(s["depth_m"]), 1e3 * float(s["forward_m"]), 1e3 * float(s["left_m"])))
    for model, stances in points.items():
        depth, x, y = zip(*stances)
        rows.append({"model": model, "stances": len(depth), "depth_mm": mean(depth), "forward_mm": mean(map(abs, x)),
                     "left_mm": mean(map(abs, y))})
    save(given, "models", rows)
    by = {r["model"]: r for r in rows}
    claim = None
    if "mild" in by and "ecc_spring" in by:
        more = by["mild"]["depth_mm"] / by["ecc_spring"]["depth_mm"] - 1
        slip = by["mild"]["forward_mm"] / by["ecc_spring"]["forward_mm"] - 1
        claim = page.Claim("deeper penetration and longer slip than Ecc-Spring", "+38 %, longer",
                           f"depth {100 * more:+.0f} %, slip {100 * slip:+.0f} %", more > 0.2 and slip > 0)
    text = ("Each policy walks at 0.6 m/s on foam25 as its own model has it. All models are matched to one static sinkage "
            "(docs/model.md), so the depth differs by what the walk makes of it.")
    return page.Section("Penetration and slip by ground model", figures.clouds(points), text,
                        page.Table(list(rows[0]), [list(r.values()) for r in rows]), claim)


def transfer(given):
    """Trained on one model, walked on every other."""
    rows, tested = [], ["foam25", "foam45", "sand_loose"]
    for trained, files in models_of(given).items():
        for seed, policy in enumerate(files, 1):
            for judge in JUDGES:
                for r in evaluate(given, policy, tested, [0.6], "--config", given.models_config, "--model", judge):
                    rows.append({"trained": trained, "seed": seed, "judge": judge, "ground": r["ground"], "trials": r["trials"],
                                 "upright": r["success"], "speed_error": abs(r["velocity"] - r["speed"]), "cot": r["cot"],
                                 "clearance": r["clearance"], "penetration": r["penetration"],
                                 "slip_forward": r["drift_forward"], "slip_left": r["drift_left"]})
    save(given, "transfer", rows)
    trained = list(models_of(given))

    def cell(a, b, value, stood=False):
        return mean(value(r) for r in rows if r["trained"] == a and r["judge"] == b and (r["upright"] or not stood))

    upright = [[100 * cell(a, b, lambda r: r["upright"] / r["trials"]) for b in JUDGES] for a in trained]
    errors = [[cell(a, b, lambda r: r["speed_error"], True) for b in JUDGES] for a in trained]
    cost = [[cell(a, b, lambda r: r["cot"], True) for b in JUDGES] for a in trained]
    others = {a: mean(u for b, u in zip(JUDGES, row) if b != a) for a, row in zip(trained, upright)}
    outside = {a: mean(u for b, u in zip(JUDGES, row) if b in ("bekker", "hunt_crossley")) for a, row in zip(trained, upright)}
    best = max(others, key=others.get)
    seeds = max(len(files) for files in models_of(given).values())
    text = (f"Upright of all trials on {', '.join(tested)} at 0.6 m/s, {seeds} seeds; speed and cost of the trials that stayed up. "
            "On all models but its own: " + ", ".join(f"{a} {u:.0f} %" for a, u in others.items()) +
            ". On bekker and hunt_crossley, with which nobody was trained: " + ", ".join(f"{a} {u:.0f} %" for a, u in outside.items()) +
            ". Con-Cone and Con-Spring have one element a foot, which carries no moment: who has learnt to lean on the edge of "
            "a sole falls there.")
    claim = page.Claim("trained on the fine model, a policy does better than on the simpler ones", "highest success rate",
                       f"best on models never seen: {best} ({others[best]:.0f} %), mild {others.get('mild', float('nan')):.0f} %",
                       best == "mild")
    picture = figures.matrices({"upright [%]": upright, "speed error [m/s]": errors, "cost of transport": cost}, trained, JUDGES)
    return page.Section("Who survives where", picture, text, None, claim)


def latent(given):
    """t-SNE of z~, what names the ground, and the two controls: phase and command."""
    path = given.out / "latent.csv"
    mild("eval", "--policy", given.policy, "--config", given.config, "--ground", ",".join(SEVEN), "--speed", "0.4,0.8",
         "--trials", max(6, given.trials), "--seconds", 15, "--latent", path)
    picture, found = figures.latent(path)
    text = (f"Means over one gait period of 15 s walks at 0.4 and 0.8 m/s. A linear discriminant on z~ names the ground in "
            f"{100 * found['ground']:.0f} % of the periods of held-out trials, and the command in {100 * found['command']:.0f} %; on the "
            f"estimates alone, {100 * found['estimates']:.0f} % of the grounds. Control: on z~ at one phase of the gait (the clock "
            f"between 0 and 0.1), {100 * found['phase']:.0f} %.")
    return page.Section("What the latent knows", picture, text, None,
                        page.Claim("z~ forms clusters by the ground's stiffness", "clusters (figure)",
                                   f"{100 * found['ground']:.0f} % named from one gait period", found["ground"] > 0.9))


def parameters(given):
    """Penetration stiffness and conical stress from z~, on grounds drawn between and beyond the presets."""
    draw = random.Random(1)
    tables, known = [], []
    for i in range(90):
        k_pen, stress = math.exp(draw.uniform(math.log(150), math.log(1400))), math.exp(draw.uniform(math.log(8e4), math.log(2.4e5)))
        path = given.out / "parameters_latent.csv"
        mild("eval", "--policy", given.policy, "--config", given.config, "--ground", draw.choice(["foam45", "grass", "sand_loose"]),
             f"--ground.k_pen={k_pen}", f"--ground.sigma_cone={stress}", "--speed", 0.6, "--trials", 1, "--seed", i, "--seconds", 8,
             "--latent", path)
        tables.append(path.read_text())
        known.append((math.log(k_pen), math.log(stress)))
    picture, found = figures.regression(tables, known, ("log k_pen", "log sigma_cone"))
    save(given, "parameters", [{"quantity": name, "r2": value} for name, value in found.items()])
    text = ("Means of z~ over 6 s of a walk on each of 90 grounds: foam45, grass or sand_loose with other k_pen and sigma_cone, which "
            "nobody trained on; ridge regression, every third ground held out. R2: " +
            ", ".join(f"{name} {value:.2f}" for name, value in found.items()) + ".")
    return page.Section("Ground parameters from the latent", picture, text, None,
                        page.Claim("z~ is a continuous measure of stiffness, also on grounds never seen", "stated",
                                   ", ".join(f"R2 of {n} {v:.2f}" for n, v in found.items()), min(found.values()) > 0.8))


def course(given):
    """rubber - foam - rubber, forward and backward, with the latent along the way."""
    tracks = {}
    for speed in (0.6, -0.6):
        path = given.out / f"course_{'forward' if speed > 0 else 'backward'}.csv"
        mild("eval", "--policy", given.policy, "--config", given.config, "--ground", "rubber,foam28,rubber+foam28+rubber",
             f"--speed={speed}", "--trials", 4, "--seconds", 14, "--patch", 2.5, "--latent", path)
        tracks["forward" if speed > 0 else "backward"] = path
    return page.Section("Rubber, foam, rubber", figures.course(tracks),
                        "z~ on the axis that tells rubber from foam28 best (walks on either alone), means over one gait period, along "
                        "a course of both, coloured by the ground under the base.")


def ablations(given):
    """The policy without a part."""
    rows, table = [], []
    for part in (None, "z", "modulation", "estimates", "history"):
        for r in evaluate(given, given.policy, ["rigid", "foam45", "sand_loose"], [0.6, 1.0], "--config", given.config,
                          *(["--ablate", part] if part else [])):
            rows.append({"without": part or "nothing", **{k: r[k] for k in ("ground", "speed", "trials", "success", "velocity", "cot")}})
    save(given, "ablations", rows)
    for part in dict.fromkeys(r["without"] for r in rows):
        own = [r for r in rows if r["without"] == part]
        table.append([part, f"{sum(r['success'] for r in own)} of {sum(r['trials'] for r in own)}",
                      round(mean(abs(r["velocity"] - r["speed"]) for r in own), 3), round(mean(r["cot"] for r in own), 2)])
    return page.Section("Without a part", None, "On rigid, foam45 and sand_loose at 0.6 and 1.0 m/s; z: its mean in its place.",
                        page.Table(["without", "upright", "speed error [m/s]", "cost of transport"], table))


EXPERIMENTS = {f.__name__: f for f in (speeds, transfer, models, latent, parameters, course, clearance, ablations, grounds)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=" ".join(EXPERIMENTS))
    parser.add_argument("--models", type=pathlib.Path, default=ROOT / "runs/paper")
    parser.add_argument("--policy", type=pathlib.Path, default=ROOT / "policies/mild.safetensors")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/paper")
    parser.add_argument("--trials", type=int, default=10)
    given = parser.parse_args()
    unknown = [name for name in given.experiments if name not in EXPERIMENTS]
    if unknown:
        parser.exit(2, f"{parser.prog}: unknown experiment {unknown[0]}; there are {' '.join(EXPERIMENTS)}\n")
    given.config, given.models_config = ROOT / "configs/walk.ini", ROOT / "configs/models.ini"
    given.out.mkdir(parents=True, exist_ok=True)
    names = given.experiments or list(EXPERIMENTS)
    if not models_of(given):
        left = [name for name in names if name in ("models", "transfer")]
        names = [name for name in names if name not in left]
        if left:
            print(f"{given.models} has no MODEL-SEED.safetensors (scripts/paper/train.sh): without {' and '.join(left)}",
                  file=sys.stderr)
    sections = []
    for name in names:
        print(name, flush=True)
        sections.append(EXPERIMENTS[name](given))
    page.write(given.out / "index.html", sections, mild("--version").strip())
    print(given.out / "index.html")


if __name__ == "__main__":
    main()
