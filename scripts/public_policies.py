#!/usr/bin/env python3
"""Public policies on the nine grounds (docs/public-policies.md).

    scripts/public_policies.py --list                  # what to clone, and where
    scripts/public_policies.py CLONES --out out/public # CLONES/REPOSITORY for each; a table and a JSON for each policy
    scripts/public_policies.py CLONES --out out/public --sweep stiffness,friction # S50 of each
    scripts/public_policies.py --page                  # the table of docs/public-policies.md from its two CSV files

Needs the package mild with onnxruntime and torch. A policy whose JSON is there already is not run again; a sweep goes on from it. One that
fails is left out, and the exit status is 1; a CSV keeps the rows of what was not run."""
import argparse
import csv
import json
import pathlib
import re
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
    "unitree_g1_deploy": ("22371347/unitree_g1_deploy", "38310fa3f4732ede22d338946dc0eedd4caf7f0a", "Apache-2.0"),
    "unitree_rl_mjlab": ("unitreerobotics/unitree_rl_mjlab", "5b7e39658e33ec63b9283688ef23b38434c9d5c5", "Apache-2.0"),
    "legged_rl_deploy": ("Renkunzhao/legged_rl_deploy", "0783dbc3f99b79a42f09988c659cd5e5113c0c4d", "none"),
    "RUN_DEPLOY": ("PMY9527/RUN_DEPLOY", "94027bfbf178c7b7a499b3aa2b32d40f53bc18ba", "none"),
    "G1-15DoF-Sim2Sim": ("lgkimjy/G1-15DoF-Sim2Sim", "2d6adf992dc5d2af219d5f50af6dea886533ba81", "MIT"),
    "holosoma": ("amazon-far/holosoma", "fc600e7db2de580509eedaa656ca6c601bd3af9b", "Apache-2.0"),
    "legged_rl_lab": ("zihanwang0422/legged_rl_lab", "a0b2c98c20ffd6e9b5a6488dbece3675e4685b85", "none"),
    "OpenHomie": ("InternRobotics/OpenHomie", "cefcd85fcf81f529e8be065795fb2a7273e69435", "CC-BY-NC-4.0"),
    "OpenWBT": ("GalaxyGeneralRobotics/OpenWBT", "2962100aad3afa921daf151d30f5c4c049640358", "Apache-2.0"),
    "FALCON": ("LeCAR-Lab/FALCON", "25ad085bcb6052b6a192712bb5fd6c149f360787", "MIT"),
    "grove-g1": ("Adyansh04/grove-g1", "97bfb9ba13569a593b5e3ecfc5ed1d4208b2b681", "Apache-2.0"),
    "roboto_origin": ("Roboparty/roboto_origin", "e7a7b662c3c3b3a0153402266859bdbb69291b17", "GPL-3.0"),
    "unitree_h12_sim2sim": ("correlllab/unitree_h12_sim2sim", "a915b1ed8040caa931d14ba806f346f439db98a4", "none"),
    "engineai_humanoid": ("engineai-robotics/engineai_humanoid", "5c0cb92a99819744abe0511291533fc37e556903", "none"),
    "engineai_legged_gym": ("engineai-robotics/engineai_legged_gym", "1a659aa0aa77445766ecea6d95708a5812e9f290", "none"),
    "PMY9527": ("PMY9527/unitree_rl_lab", "25d7e9fb240a92e983fa472c23858948b1ab897a", "Apache-2.0"),
    "liamlate": ("liamlate/unitree_rl_mjlab", "7407c941261d21d94b78a08d35938f98d1a375c7", "Apache-2.0"),
    "TR-ROBOTICS": ("TR-ROBOTICS/unitree_rl_lab", "9722ebb53e4b6e0a0f799da4cd1d770f90717ec1", "Apache-2.0"),
    "tuffi3000": ("tuffi3000/unitree_rl_mjlab", "e7e3065b8bce3388ecd95f8fa405997b4f4717e1", "Apache-2.0"),
    "G1DWAQ_Lab": ("liuyufei-nubot/G1DWAQ_Lab", "a3afa5ca6837c14e4300198c19e6a6431bbafc81", "BSD-3-Clause"),
    "LeggedLabDeploy": ("Hellod035/LeggedLabDeploy", "93736b4466b9de2a75cb9b0099cbce6cbacdd86a", "BSD-3-Clause"),
    "TienKung-Lab": ("Open-X-Humanoid/TienKung-Lab", "7ce828b22139378d7a032ee4eeb52151bd322cf3", "BSD-3-Clause"),
    "booster_deploy": ("BoosterRobotics/booster_deploy", "563e7c37e7468b3b96ad9f84f9e61becea3b7fb8", "Apache-2.0"),
    "booster_assets": ("BoosterRobotics/booster_assets", "486da0f864016676de6dab724fd60a8a551655d1", "BSD-3-Clause"),
    "Lite3_rl_deploy": ("DeepRoboticsLab/Lite3_rl_deploy", "7871b47020b615812612192534b966ea23ba4d2e", "BSD-3-Clause"),
    "weihan_lite3": ("weihanhuang-1196/p3_modified_Lite3_rl_deploy", "a6dbdd62494f594f50c1469ace5dbe0a498dbd9c", "BSD-3-Clause"),
    "deep_robotics_model": ("DeepRoboticsLab/deep_robotics_model", "b452a1f404d37155400242f18e454fed8bcc51b8", "BSD-3-Clause"),
    "pnd_rl_mjlab": ("pndbotics/pnd_rl_mjlab", "6c724bf11823c9b9d50f78d86662b721dc1a8bfe", "Apache-2.0"),
}
GYM, SIM2SIM = "unitree_rl_gym/deploy/pre_train/{}/motion.pt", "mujoco_playground/mujoco_playground/experimental/sim2sim/onnx/{}_policy.onnx"
OWN = str(ROOT / "examples/trial/policies.py")
G1 = "unitree_mujoco/unitree_robots/g1/scene_29dof.xml"
HOLOSOMA = "holosoma/src/holosoma/holosoma/data/robots/{}"
LOCO = "holosoma/src/holosoma_inference/holosoma_inference/models/loco/{}"
LAB = "legged_rl_lab/deploy/g1_deploy/{}"
DEPLOY = "unitree_g1_deploy/deploy/robots/g1/config/policy/{}"
VELOCITY = "{}/deploy/robots/{}/config/policy/velocity/v0/exported/{}"
GO2, GO2_POLICIES = "unitree_mujoco/unitree_robots/go2/scene.xml", "legged_rl_deploy/policies/go2/{}"
LITE3, DWAQ = "deep_robotics_model/Lite3/Lite3_mjcf/mjcf/Lite3.xml", "G1DWAQ_Lab/LeggedLabDeploy/{}"
POLICIES = {  # name: robot, model, policy, options. Described by its ini in examples/trial, else by what comes with it or the options name
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
    "rl_mjlab_g1": ("Unitree G1, 29 joints", G1, DEPLOY.format("velocity/v0/exported/policy.onnx")),
    "amp_mjlab_g1": ("Unitree G1, 29 joints", G1, DEPLOY.format("AMP/exported/policy_28k.onnx")),
    "unitree_rl_mjlab_g1": ("Unitree G1, 29 joints", G1, "unitree_rl_mjlab/deploy/robots/g1/config/policy/velocity/v0/exported/policy.onnx"),
    "legged_rl_deploy_g1": ("Unitree G1, 29 joints", G1, "legged_rl_deploy/policies/g1/velocity/mjlab/policy.onnx"),
    "run_amp_g1": ("Unitree G1, 29 joints, at 0.8 m/s", G1, "RUN_DEPLOY/robots/g1_29dof/config/policy/velocity/amp/exported/policy1.onnx", "--speed 0.8"),
    "g1_15dof_april": ("Unitree G1, 15 joints", "G1-15DoF-Sim2Sim/model/G1/g1_15dof_fake_torso.xml",
                       "G1-15DoF-Sim2Sim/onnx/2026-04-10_00-36-11_rsl_rl/exported/policy.onnx"),
    "g1_15dof_may": ("Unitree G1, 15 joints", "G1-15DoF-Sim2Sim/model/G1/g1_15dof_fake_torso.xml",
                     "G1-15DoF-Sim2Sim/onnx/2026-05-12_10-42-26_rsl_rl_upright_torso/exported/policy.onnx"),
    "engineai_sa01": ("EngineAI SA01", "engineai_legged_gym/resources/robots/zq_humanoid/urdf/zq_sa01.xml",
                      "engineai_humanoid/EngineAI_Controller/user/EngineAI_Humanoid_Controller/Controllers/RL_Controller/policy/zqsa01/zqsa01_policy.onnx"),
    "holosoma_g1": ("Unitree G1, 29 joints", HOLOSOMA.format("g1/scenes/scene_g1_29dof_wbt_plane.xml"), LOCO.format("g1_29dof/fastsac_g1_29dof.onnx")),
    "holosoma_g1_ppo": ("Unitree G1, 29 joints", HOLOSOMA.format("g1/scenes/scene_g1_29dof_wbt_plane.xml"), LOCO.format("g1_29dof/ppo_g1_29dof.onnx"),
                        "--describe {trial}/holosoma_g1.ini"),
    "holosoma_t1": ("Booster T1, 29 joints", HOLOSOMA.format("t1/t1_29dof.xml"), LOCO.format("t1_29dof/fastsac_t1_29dof.onnx")),
    "holosoma_t1_ppo": ("Booster T1, 29 joints", HOLOSOMA.format("t1/t1_29dof.xml"), LOCO.format("t1_29dof/ppo_t1_29dof.onnx"),
                        "--describe {trial}/holosoma_t1.ini"),
    "legged_rl_lab_g1": ("Unitree G1, 29 joints", LAB.format("assets/scene_29dof.xml"), LAB.format("exported_policy/g1_flat_1.onnx")),
    "legged_rl_lab_g1_amp": ("Unitree G1, 29 joints", LAB.format("assets/scene_29dof.xml"), LAB.format("exported_policy/g1_walk.onnx")),
    "homie_g1": ("Unitree G1, 12 joints", "OpenHomie/HomieRL/legged_gym/resources/robots/g1_description/g1.xml", "OpenHomie/HomieDeploy/deploy.onnx"),
    "grove_g1": ("Unitree G1, 14 joints", G1, "grove-g1/workspace/src/g1_controllers/policy/unitree_g1_velocity_e2e.onnx"),
    "openwbt_g1": ("Unitree G1, 12 joints", G1, "OpenWBT/ckpts/loco.onnx"),
    "falcon_g1": ("Unitree G1, 15 joints", G1, "FALCON/sim2real/models/dec_loco/g1_29dof.onnx"),
    "atom01": ("RoboParty Atom01", "roboto_origin/modules/atom01_train/robolab/data/robots/roboparty/atom01/mjcf/atom01.xml",
               "roboto_origin/modules/atom01_deploy/src/inference/models/policy.onnx"),
    "h1_2_sim2sim": ("Unitree H1-2, 27 joints", "unitree_h12_sim2sim/mujoco/h1_2/h1_2_handless.xml",
                     "unitree_h12_sim2sim/wbc_agile_utils/logs/rsl_rl/unitree_h12_walk/2026-01-21_11-22-09/exported/policy.onnx",
                     "--describe {clones}/unitree_h12_sim2sim/mujoco/model_and_yaml/walk/unitree_h12_walk_v0_IO_descriptors.yaml"),
    "tr_robotics_g1": ("Unitree G1, 29 joints", G1, VELOCITY.format("TR-ROBOTICS", "g1_29dof", "policy.onnx")),
    "tuffi3000_g1": ("Unitree G1, 29 joints", G1, VELOCITY.format("tuffi3000", "g1", "policy-promising.onnx")),
    "robomimic_g1": ("Unitree G1, 29 joints", G1, "rl_sar/policy/g1/robomimic/locomotion/policy_29dof.pt",
                     "--describe {clones}/rl_sar/policy/g1/robomimic/locomotion/config.yaml"),
    "geoloco_g1": ("Unitree G1, 29 joints", G1, DWAQ.format("policy/g1/exported/policy.onnx"), "--describe {clones}/" + DWAQ.format("configs/g1.yaml")),
    "dwaq_g1": ("Unitree G1, 29 joints", G1, DWAQ.format("policy/g1_dwaq/policy.pt"), "--describe {clones}/" + DWAQ.format("configs/g1_dwaq_jit.yaml")),
    "dwaq_phase_g1": ("Unitree G1, 29 joints", G1, DWAQ.format("policy/g1_dwaq_phase/policy.pt"),
                      "--describe {clones}/" + DWAQ.format("configs/g1_dwaq_phase.yaml")),
    "legged_lab_h1": ("Unitree H1, 19 joints", "unitree_mujoco/unitree_robots/h1/scene.xml", "LeggedLabDeploy/policy/h1/policy.pt"),
    "liamlate_h1_2": ("Unitree H1-2, 27 joints", "unitree_mujoco/unitree_robots/h1_2/scene.xml", VELOCITY.format("liamlate", "h1_2", "policy.onnx")),
    "liamlate_h1_2_final": ("Unitree H1-2, 27 joints", "unitree_mujoco/unitree_robots/h1_2/scene.xml",
                            VELOCITY.format("liamlate", "h1_2", "final_policy.onnx")),
    "tienkung_lite": ("TienKung 2 Lite", "TienKung-Lab/legged_lab/assets/tienkung2_lite/mjcf/tienkung.xml", "TienKung-Lab/Exported_policy/walk.pt"),
    "booster_t1_23": ("Booster T1, 21 joints", "booster_assets/robots/T1/T1_23dof.xml", "booster_deploy/tasks/locomotion/models/t1_walk.pt"),
    "pmy9527_go2": ("Unitree Go2, unitree_rl_lab, at 1 m/s", GO2, VELOCITY.format("PMY9527", "go2", "policy.onnx"), "--speed 1"),
    "legged_rl_deploy_go2_mjlab": ("Unitree Go2, mjlab", GO2, GO2_POLICIES.format("velocity/mjlab/polity.onnx"),
                                   "--describe {clones}/" + GO2_POLICIES.format("velocity/mjlab/config.yaml")),
    "legged_rl_deploy_go2_lab": ("Unitree Go2, unitree_rl_lab", GO2, GO2_POLICIES.format("velocity/unitree_rl_lab/policy.onnx"),
                                 "--describe {clones}/" + GO2_POLICIES.format("velocity/unitree_rl_lab/config.yaml")),
    "legged_rl_deploy_go2_trot": ("Unitree Go2, legged_gym", GO2, GO2_POLICIES.format("trot/policy.onnx"),
                                  "--describe {clones}/" + GO2_POLICIES.format("trot/config.yaml")),
    "deeprobotics_lite3": ("DEEP Robotics Lite3", LITE3, "Lite3_rl_deploy/policy/ppo/policy.onnx"),
    "weihan_lite3": ("DEEP Robotics Lite3", LITE3, "weihan_lite3/policy/ppo/policy.onnx",
                     "--describe {trial}/deeprobotics_lite3.ini --set default..*HipY_joint=-0.8 --set default..*Knee_joint=1.6"),
    "himloco_lite3": ("DEEP Robotics Lite3, HIMLoco", LITE3, "rl_sar/policy/lite3/himloco/policy_6_11.pt",
                      "--describe {clones}/rl_sar/policy/lite3/himloco/config.yaml"),
    "mild_g1": ("Unitree G1, 12 joints: ours", "unitree_rl_gym/resources/robots/g1_description/scene.xml", OWN + ":G1"),
    "mild_g1_29": ("Unitree G1, 29 joints: ours", "unitree_mujoco/unitree_robots/g1/scene_29dof.xml", OWN + ":G1_29"),
    "mild_go1": ("Unitree Go1: ours", "mujoco_playground/" + PLAYGROUND.format("go1"), OWN + ":Go1"),
}


def show():
    for folder, (place, commit, licence) in REPOSITORIES.items():
        print(f"git clone https://github.com/{place} {folder} && git -C {folder} checkout -q {commit}    # {licence}")


def run(clones, out, name, options, sweep=None):
    """The JSON of one policy."""
    target = out / (f"{name}-{sweep}.json" if sweep else f"{name}-tour.json" if "--tour" in options else f"{name}.json")
    if sweep or not target.is_file():
        _, model, policy, *own = POLICIES[name]
        policy = policy if policy.startswith("/") else str(clones / policy)
        own = [re.sub(r"--speed \S+", "", words) for words in own] if "--tour" in options else own  # a tour has speeds of its own
        describe = ROOT / f"examples/trial/{name}.ini"
        subprocess.run([sys.executable, "-m", "mild", "trial", str(clones / model), policy, *(["--describe", str(describe)] if describe.is_file() else []),
                        "--json", str(target), *(["--sweep", sweep] if sweep else []), *options,
                        *(word.format(clones=clones, trial=ROOT / "examples/trial") for words in own for word in words.split())], check=True)
    return json.loads(target.read_text())


def attempt(failed, *arguments):
    """The JSON of one policy, or None, its name among those that failed."""
    try:
        return run(*arguments)
    except (subprocess.CalledProcessError, OSError, ValueError) as error:
        print(f"public_policies: {arguments[2]}: {error}", file=sys.stderr)
        failed.append(arguments[2])
        return None


def merge(path, header, rows):
    """Writes a CSV whose rows are named by their first two cells: these, and those of the file that are not among them. Columns that the
    file has beyond the header's stay as they are."""
    first, before, width = header, [], len(header)
    if path.is_file():
        with open(path, encoding="utf-8", newline="") as file:
            first, *before = [row for row in csv.reader(file) if row] or [header]
        if first[:width] != header:
            sys.exit(f"public_policies: {path} has other columns; name another file or remove it")
    whole = {tuple(row[:2]): row for row in before}
    for row in rows:
        whole[tuple(row[:2])] = row + whole.get(tuple(row[:2]), [""] * len(first))[width:]
    part = path.with_name(path.name + ".part")
    with open(part, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([first, *whole.values()])
    part.replace(path)


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

    rows = []
    for name, table in tables.items():
        for row in table["rows"]:
            times = sorted(walk["time"] for walk in row["each"] if walk["end"] != "time")
            rows.append([name, row["ground"], row["trials"], row["upright"], mean(row, "speed", True), mean(row, "cost", True),
                         f"{row['torque']:.1f}", mean(row, "sinkage", False), f"{times[len(times) // 2]:.2f}" if times else ""])
    merge(path, ["policy", "ground", "trials", "upright", "speed [m/s]", "cost", "largest torque [N m]", "sinkage [m]", "median fall [s]"], rows)


def s50(found):
    """S50 of a sweep with its interval."""
    first, last = (f"{value:.3g}" for value in found["range"])
    low, high = ("" if value is None else f"{value:.3g}" for value in found["interval"])
    if found["verdict"] in ("never_falls", "always_falls"):
        return f"< {high}" if high else f"> {low}" if low else f"not from {first} to {last}"
    middle = "-" if found["s50"] is None else f"{found['s50']:.3g}"
    return f"{middle} ({low or 'below ' + first} to {high or 'above ' + last})"


def run_sweeps(clones, arguments, options):
    """A table of S50, and its CSV."""
    sweeps, rows, failed = arguments.sweep.split(","), [], []
    print("| policy | " + " | ".join(sweeps) + " |", "|---" * (len(sweeps) + 1) + "|", sep="\n")
    for name in arguments.only.split(","):
        found = [attempt(failed, clones, arguments.out, name, options, sweep) for sweep in sweeps]
        rows += [[name, one["sweep"], one["unit"], one["verdict"], one["s50"], *one["interval"], one["trials"],
                  sum(walk["end"] == "time" for walk in one["each"])] for one in found if one]
        print(f"| {name} | " + " | ".join(s50(one) if one else "failed" for one in found) + " |", flush=True)
    if arguments.csv:
        merge(arguments.csv, ["policy", "sweep", "unit", "verdict", "S50", "low", "high", "trials", "upright"],
              [[f"{value:.4g}" if isinstance(value, float) else value for value in row] for row in rows])
    return bool(failed)


FOUR_LEGS = ("Go1", "Go2", "B2", "Lite3")


def page_table():
    """The page's table: bipeds, quadrupeds and ours, each by S50, those without one last."""
    def rows(name):
        with open(ROOT / "docs" / name, encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    sweeps = {row["policy"]: row for row in rows("s50.csv") if row["sweep"] == "stiffness"}
    grounds = {}
    for row in rows("public-policies.csv"):
        grounds.setdefault(row["policy"], {})[row["ground"]] = row

    def short(text):
        return f"{float(text):.3g}" if text else "?"

    def stiffness(name):
        row = sweeps.get(name)
        if not row:
            return 1e9, ""
        if not row["S50"]:
            return float(row["high"] or row["low"]), f"**<{short(row['high'])}**" if row["high"] else f"**>{short(row['low'])}**"
        return float(row["S50"]), f"**{short(row['S50'])}** ({short(row['low'])}..{short(row['high'])})"

    def upright(row):
        return "" if not row else row["upright"] if row["trials"] == "10" else f"{row['upright']}/{row['trials']}"

    def group(name):
        return 2 if name.startswith("mild_") else int(any(robot in POLICIES[name][0] for robot in FOUR_LEGS))

    lines = ["|policy|S50 [MPa/m]|rigid|m/s|soft|sand_loose|", "|---|---|---|---|---|---|"]
    for name in sorted((name for name in grounds if name in POLICIES and name != "unitree_g1_sole"), key=lambda name: (group(name), stiffness(name)[0], name)):
        cells = grounds[name]
        soft = [row for ground, row in cells.items() if ground != "rigid"]
        whole = len(soft) == 8 and all(row["trials"] == "10" for row in soft)
        speed = cells["rigid"]["speed [m/s]"]
        lines.append("|".join(["", name, stiffness(name)[1], upright(cells["rigid"]), f"{float(speed):.2f}" if speed else "",
                               str(sum(int(row["upright"]) for row in soft)) if whole else "", upright(cells.get("sand_loose")), ""]))
    return lines


def write_page(path=ROOT / "docs/public-policies.md"):
    """Puts the table where the page has one that begins alike."""
    lines, table = path.read_text(encoding="utf-8").splitlines(), page_table()
    begin = next(k for k, line in enumerate(lines) if line.replace(" ", "").startswith("|policy|"))
    end = next(k for k in range(begin, len(lines)) if not lines[k].startswith("|"))
    path.write_text("\n".join([*lines[:begin], *table, *lines[end:]]) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clones", nargs="?", type=pathlib.Path)
    parser.add_argument("--list", action="store_true", help="print what to clone")
    parser.add_argument("--page", action="store_true", help="write the table of docs/public-policies.md from its CSV files")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/public"))
    parser.add_argument("--only", default=",".join(POLICIES), help="names, separated by commas")
    parser.add_argument("--sweep", help="of mild trial, separated by commas: S50 in the place of the nine grounds")
    parser.add_argument("--options", help="of mild trial (default --seconds 20 --speed 0.5, and --trials 10 without a sweep)")
    parser.add_argument("--csv", type=pathlib.Path, help="also write every cell, with cost, torque and sinkage")
    arguments = parser.parse_args()
    if arguments.page:
        write_page()
        return 0
    if arguments.list or not arguments.clones:
        show()
        return 0
    names = arguments.only.split(",")
    unknown = [name for name in names if name not in POLICIES]
    if unknown:
        sys.exit(f"public_policies: --only: no policy is named {', '.join(unknown)}; there are {', '.join(POLICIES)}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    options = (arguments.options or f"--seconds 20 --speed 0.5{'' if arguments.sweep else ' --trials 10'}").split()
    if "--tour" in options and arguments.csv:
        parser.error("--csv has no columns for a tour; --out keeps its JSON")
    if arguments.sweep:
        return run_sweeps(arguments.clones, arguments, options)
    failed = []
    found = {name: attempt(failed, arguments.clones, arguments.out, name, options) for name in names}
    tables = {name: table for name, table in found.items() if table}
    if arguments.csv:
        write_csv(arguments.csv, tables)
    lines = []
    for name, table in tables.items():
        rows = table["rows"]
        if not lines:
            lines = ["| policy | " + " | ".join(row["ground"] for row in rows) + " |", "|---" * (len(rows) + 1) + "|"]
        lines.append(f"| {name}: {POLICIES[name][0]} | " + " | ".join(map(cell, rows)) + " |")
    print("\n".join(lines))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
