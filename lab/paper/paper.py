#!/usr/bin/env python3
"""The paper's experiments: measures them with build/mild, draws them, and writes one page, OUT/index.html, that opens anywhere.

  lab/paper/paper.py [EXPERIMENT ...] [--models FOLDER] [--policy FILE] [--out out/paper] [--trials N] [--seed N]

The policies of --models are MODEL-SEED.safetensors, ht2*.safetensors and clock*.safetensors: those of lab/paper/train.sh in
runs/paper if there are any, else the shipped ones. What the paper measured on hardware is measured in simulation here. Each
experiment leaves its numbers as CSV in OUT. Without names: all."""
import argparse
import os
import pathlib
import resource
import sys
import tempfile
import time

try:
    import controllers
    import latents
    import measure
    import models
    import page
    import walks
    from measure import ROOT, SHIPPED, mild, models_of, rivals_of
except ModuleNotFoundError as missing:
    print(f"paper.py: no module {missing.name}; `make paper` installs it, or .venv/bin/pip install --require-hashes -r "
          "lab/paper/requirements.txt; start this with .venv/bin/python", file=sys.stderr)
    sys.exit(2)

EXPERIMENTS = {f.__name__: f for f in (controllers.table2, models.transfer, models.penetration, models.foam, controllers.passivity,
                                       walks.terrains, latents.latent, latents.parameters, latents.course, latents.ablations,
                                       walks.unseen, walks.grounds, walks.repeat)}
TRAINED = ("transfer", "penetration", "foam")  # those that need a policy of each model


def processor_seconds():
    """[s] of this program and of all that it started and waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def shown(path):
    return path.resolve().relative_to(ROOT) if path.resolve().is_relative_to(ROOT) else path


def main():
    trained = ROOT / "runs/paper"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=" ".join(EXPERIMENTS))
    parser.add_argument("--models", type=pathlib.Path, default=trained if list(trained.glob("*.safetensors")) else SHIPPED)
    parser.add_argument("--policy", type=pathlib.Path, default=ROOT / "policies/mild.safetensors")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/paper")
    parser.add_argument("--trials", type=int, default=10, help="per row (default 10)")
    parser.add_argument("--seed", type=int, default=1, help="of the trials (default 1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="programs at a time (default: one per core)")
    given = parser.parse_args()
    unknown = [name for name in given.experiments if name not in EXPERIMENTS]
    if unknown:
        parser.exit(2, f"{parser.prog}: unknown experiment {unknown[0]}; there are {' '.join(EXPERIMENTS)}\n")
    given.config, given.models_config = ROOT / "configs/walk.ini", ROOT / "configs/models.ini"
    given.out.mkdir(parents=True, exist_ok=True)
    names = given.experiments or list(EXPERIMENTS)
    if not models_of(given, measure.TRAINED + measure.SLIPS) and set(names) & set(TRAINED):
        print(f"{given.models} has no MODEL-SEED.safetensors (lab/paper/train.sh): without {', '.join(TRAINED)}", file=sys.stderr)
        names = [name for name in names if name not in TRAINED]
    sections = []
    with tempfile.TemporaryDirectory() as raw:  # large tables that the experiments summarise
        given.raw = pathlib.Path(raw)
        for name in names:
            begin, worked = time.time(), processor_seconds()
            sections.append(EXPERIMENTS[name](given))
            print(f"{name}: {time.time() - begin:.0f} s, {processor_seconds() - worked:.0f} s of processor time", flush=True)
    seeds = max((len(files) for files in models_of(given).values()), default=0)
    rivals = ", ".join(f"{name} {len(files)}" for name, (_, files) in rivals_of(given).items()) or "none"
    how = (f"{given.trials} trials a row, seed {given.seed}; weights of {shown(given.models)}; seeds of each training by ground model: {seeds}, of the rivals: "
           f"{rivals}. The policy of a section is the shipped one unless it says another.")
    page.write(given.out / "index.html", sections, mild("--version").strip(), how)
    print(given.out / "index.html")


if __name__ == "__main__":
    main()
