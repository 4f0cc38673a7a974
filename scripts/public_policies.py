#!/usr/bin/env python3
"""Public policies on the nine grounds (docs/public-policies.md).

    scripts/public_policies.py --list                  # what to clone, and where
    scripts/public_policies.py CLONES --out out/public # CLONES/REPOSITORY for each; a table and a JSON for each policy
    scripts/public_policies.py CLONES --out out/public --sweep stiffness,friction # S50 of each

Needs the package mild with onnxruntime and torch. A policy whose JSON is there already is not run again; a sweep goes on from it."""
import argparse
import csv
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
PLAYGROUND = "mujoco_playground/_src/locomotion/{}/xmls/scene_mjx_feetonly_flat_terrain.xml"
REPOSITORIES = {  # folder of CLONES: place, commit, licence
    "unitree_rl_gym": ("unitreerobotics/unitree_rl_gym", "276801e46c5d433564f24658bac64f254b7d2d4b", "BSD-3-Clause"),
    "unitree_rl_lab": ("unitreerobotics/unitree_rl_lab", "e72a072c4db68b79a816b3b89bf3b6a0525d113e", "Apache-2.0"),
    "unitree_mujoco": ("unitreerobotics/unitree_mujoco", "c598f103acb87a5fd3de7c9037f4dab6aa7f232b", "BSD-3-Clause"),
    "mujoco_playground": ("google-deepmind/mujoco_playground", "d5e6b47531328468da1eec33b8b304a00bb0873c", "Apache-2.0"),
    "booster_gym": ("BoosterRobotics/booster_gym", "da396a06d6eed99e2de72d7749c48ee8748950f9", "Apache-2.0"),
    "humanoid-gym": ("roboterax/humanoid-gym", "ae46e201c85a2b17e7f2cea59a441dae7ea88a8f", "BSD-3-Clause"),
    "rl_sar": ("fan-ziqi/rl_sar", "e384912fb4b24cb09bfe190686b113b7348019c9", "Apache-2.0"),
    "pnd_rl_mjlab": ("pndbotics/pnd_rl_mjlab", "6c724bf11823c9b9d50f78d86662b721dc1a8bfe", "Apache-2.0"),
}
GYM, SIM2SIM = "unitree_rl_gym/deploy/pre_train/{}/motion.pt", "mujoco_playground/mujoco_playground/experimental/sim2sim/onnx/{}_policy.onnx"
OWN = str(ROOT / "examples/trial/policies.py")
POLICIES = {  # description in examples/trial: robot, model, policy
    "unitree_g1": ("Unitree G1, 12 joints", "unitree_rl_gym/resources/robots/g1_description/scene.xml", GYM.format("g1")),
    "unitree_g1_sole": ("Unitree G1, 12 joints, sole of its mesh", "unitree_rl_gym/resources/robots/g1_description/scene.xml", GYM.format("g1")),
    "unitree_h1": ("Unitree H1", "unitree_rl_gym/resources/robots/h1/scene.xml", GYM.format("h1")),
    "unitree_h1_2": ("Unitree H1-2", "unitree_rl_gym/resources/robots/h1_2/scene.xml", GYM.format("h1_2")),
    "unitree_g1_29": ("Unitree G1, 29 joints", "unitree_mujoco/unitree_robots/g1/scene_29dof.xml",
                      "unitree_rl_lab/deploy/robots/g1/config/policy/velocity/v0/exported/policy.onnx"),
    "playground_g1": ("Unitree G1, 29 joints", "mujoco_playground/" + PLAYGROUND.format("g1"), SIM2SIM.format("g1")),
    "playground_t1": ("Booster T1", "mujoco_playground/" + PLAYGROUND.format("t1"), SIM2SIM.format("t1")),
    "booster_t1": ("Booster T1, 12 joints", "booster_gym/resources/T1/T1_locomotion.xml", "booster_gym/deploy/models/T1.pt"),
    "playground_bh": ("Berkeley Humanoid", "mujoco_playground/" + PLAYGROUND.format("berkeley_humanoid"), SIM2SIM.format("bh")),
    "playground_apollo": ("Apptronik Apollo", "mujoco_playground/" + PLAYGROUND.format("apollo"), SIM2SIM.format("apollo")),
    "robotera_xbot": ("RobotEra XBot-L", "humanoid-gym/resources/robots/XBot/mjcf/XBot-L.xml",
                      "humanoid-gym/logs/XBot_ppo/exported/policies/policy_example.pt"),
    "pnd_adam": ("PNDbotics Adam SP", "pnd_rl_mjlab/deploy/adam_despription/scene.xml", "pnd_rl_mjlab/deploy/models/adam_sp_velocity_flat/policy.onnx"),
    "playground_go1": ("Unitree Go1", "mujoco_playground/" + PLAYGROUND.format("go1"), SIM2SIM.format("go1")),
    "himloco_go2": ("Unitree Go2, HIMLoco", "unitree_mujoco/unitree_robots/go2/scene.xml", "rl_sar/policy/go2/himloco/himloco.pt"),
    "robot_lab_go2": ("Unitree Go2, robot_lab", "unitree_mujoco/unitree_robots/go2/scene.xml", "rl_sar/policy/go2/robot_lab/policy.pt"),
    "robot_lab_b2": ("Unitree B2, robot_lab", "unitree_mujoco/unitree_robots/b2/scene.xml", "rl_sar/policy/b2/robot_lab/policy.pt"),
    "mild_g1": ("Unitree G1, 12 joints: ours", "unitree_rl_gym/resources/robots/g1_description/scene.xml", OWN + ":G1"),
    "mild_go1": ("Unitree Go1: ours", "mujoco_playground/" + PLAYGROUND.format("go1"), OWN + ":Go1"),
}


def show():
    for folder, (place, commit, licence) in REPOSITORIES.items():
        print(f"git clone https://github.com/{place} {folder} && git -C {folder} checkout -q {commit}    # {licence}")


def run(clones, out, name, options, sweep=None):
    """The JSON of one policy."""
    target = out / (f"{name}-{sweep}.json" if sweep else f"{name}.json")
    if sweep or not target.is_file():
        _, model, policy = POLICIES[name]
        policy = policy if policy.startswith("/") else str(clones / policy)
        subprocess.run([sys.executable, "-m", "mild", "trial", str(clones / model), policy, "--describe", str(ROOT / f"examples/trial/{name}.ini"),
                        "--json", str(target), *(["--sweep", sweep] if sweep else []), *options], check=True)
    return json.loads(target.read_text())


def cell(row):
    """How many were upright, their speed, and the median time of the falls."""
    speeds = [walk["speed"] for walk in row["each"] if walk["end"] == "time" and walk["speed"] is not None]
    times = sorted(walk["time"] for walk in row["each"] if walk["end"] != "time")
    count = f"**{row['upright']}**" if row["upright"] == row["trials"] else str(row["upright"])
    return count + (f" {sum(speeds) / len(speeds):.2f}".replace("-0.00", "0.00") if speeds else "") + (f" ({times[len(times) // 2]:.1f} s)" if times else "")


def write_csv(path, tables):
    """Every cell of the table with cost, torque and sinkage; empty where nothing was measured."""
    def mean(row, key, upright):
        values = [walk[key] for walk in row["each"] if walk[key] is not None and (walk["end"] == "time" or not upright)]
        return f"{sum(values) / len(values):.3f}" if values else ""

    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["policy", "ground", "trials", "upright", "speed [m/s]", "cost", "largest torque [N m]", "sinkage [m]", "median fall [s]"])
        for name, table in tables.items():
            for row in table["rows"]:
                times = sorted(walk["time"] for walk in row["each"] if walk["end"] != "time")
                writer.writerow([name, row["ground"], row["trials"], row["upright"], mean(row, "speed", True), mean(row, "cost", True),
                                 f"{row['torque']:.1f}", mean(row, "sinkage", False), f"{times[len(times) // 2]:.2f}" if times else ""])


def s50(found):
    """S50 of a sweep with its interval."""
    first, last = (f"{value:.3g}" for value in found["range"])
    low, high = ("" if value is None else f"{value:.3g}" for value in found["interval"])
    if found["verdict"] in ("never_falls", "always_falls"):
        return f"< {high}" if high else f"> {low}" if low else found["verdict"].replace("_", " ")
    middle = "-" if found["s50"] is None else f"{found['s50']:.3g}"
    return f"{middle} ({low or 'below ' + first} to {high or 'above ' + last})"


def run_sweeps(clones, arguments, options):
    """A table of S50, and its CSV."""
    sweeps, rows = arguments.sweep.split(","), []
    print("| policy | " + " | ".join(sweeps) + " |", "|---" * (len(sweeps) + 1) + "|", sep="\n")
    for name in arguments.only.split(","):
        found = [run(clones, arguments.out, name, options, sweep) for sweep in sweeps]
        rows += [[name, one["sweep"], one["unit"], one["verdict"], one["s50"], *one["interval"], one["trials"],
                  sum(walk["end"] == "time" for walk in one["each"])] for one in found]
        print(f"| {name} | " + " | ".join(map(s50, found)) + " |", flush=True)
    if arguments.csv:
        with open(arguments.csv, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["policy", "sweep", "unit", "verdict", "S50", "low", "high", "trials", "upright"])
            writer.writerows([[f"{value:.4g}" if isinstance(value, float) else value for value in row] for row in rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clones", nargs="?", type=pathlib.Path)
    parser.add_argument("--list", action="store_true", help="print what to clone")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/public"))
    parser.add_argument("--only", default=",".join(POLICIES), help="names, separated by commas")
    parser.add_argument("--sweep", help="of mild trial, separated by commas: S50 in the place of the nine grounds")
    parser.add_argument("--options", help="of mild trial (default --seconds 20 --speed 0.5, and --trials 10 without a sweep)")
    parser.add_argument("--csv", type=pathlib.Path, help="also write every cell, with cost, torque and sinkage")
    arguments = parser.parse_args()
    if arguments.list or not arguments.clones:
        show()
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    options = (arguments.options or f"--seconds 20 --speed 0.5{'' if arguments.sweep else ' --trials 10'}").split()
    if arguments.sweep:
        return run_sweeps(arguments.clones, arguments, options)
    tables = {name: run(arguments.clones, arguments.out, name, options) for name in arguments.only.split(",")}
    if arguments.csv:
        write_csv(arguments.csv, tables)
    lines = []
    for name, table in tables.items():
        rows = table["rows"]
        if not lines:
            lines = ["| policy | " + " | ".join(row["ground"] for row in rows) + " |", "|---" * (len(rows) + 1) + "|"]
        lines.append(f"| {name}: {POLICIES[name][0]} | " + " | ".join(map(cell, rows)) + " |")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
