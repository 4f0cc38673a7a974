"""Real numbers for judge.py, each with its source, what grains and models have there, or what the source leaves out that a
prediction needs."""
import functools
import math

import numpy as np

import mild
import real_sand
from judge_cases import Case
from judge_entries import GroundEntry, TableEntry, rft_stress

# Fourier coefficients of the stress over depth [N/cm^3] in poppy seeds: Li, Zhang, Goldman, Science 339 (2013) 1408, supplement,
# table S2 and eq. S8, as Isaac Lab's contributed soft contact (material.py) and others have them; the paper: arXiv 1303.7065.
POPPY = {"loose": {"A00": 0.051, "A10": 0.047, "B11": 0.053, "B01": 0.083, "B_11": 0.020, "C11": -0.026, "C01": 0.057, "C_11": 0.0, "D10": 0.025},
         "close": {"A00": 0.094, "A10": 0.092, "B11": 0.092, "B01": 0.151, "B_11": 0.035, "C11": -0.039, "C01": 0.086, "C_11": 0.018, "D10": 0.046}}
POPPY_DENSITY = 638  # [kg/m^3] of the loose bed, the same file of Isaac Lab
LI = "Li, Zhang, Goldman 2013, table S2"
PLATE, DEPTH = "rect:0.04,0.03", 0.05  # the published law has no size; [m] of the plate's middle, where tilted ones are all in


def poppy_stress(packing, tilt, way):
    """Stress over depth [MPa/m] up and against the way, of a plate tilted by `tilt` [rad] that moves at `way` [rad] below level."""
    c, a = POPPY[packing], 2 * tilt
    up = c["A00"] + c["A10"] * math.cos(a) + c["B11"] * math.sin(a + way) + c["B01"] * math.sin(way) + c["B_11"] * math.sin(way - a)
    along = c["C11"] * math.cos(a + way) + c["C01"] * math.cos(way) + c["C_11"] * math.cos(way - a) + c["D10"] * math.sin(a)
    return up, along


def poppy_case(degrees):
    return Case(f"poppy {PLATE} {degrees} press:{DEPTH}@0.05")


def refitted(entries, cases, force, pitch, deepest=DEPTH):
    """The models, those of mild fitted to presses of level plates: cases, and force(width, depth) [N/m^2] under each."""
    depth = np.linspace(1e-3, deepest, 60)
    for entry in entries:
        if isinstance(entry, TableEntry) or not hasattr(entry, "play") or entry.name in ("mild_slips", "archimedes"):
            continue
        if isinstance(entry, GroundEntry) and entry.name != "3d_rft":
            soles = [mild.Sole(case.sole.outline, pitch) for case in cases]
            soles = [sole.concentric() for sole in soles] if entry.model.startswith("con_") else soles
            hold = {"alpha": 0.3} if entry.model in ("mild", "mild_merged", "con_cone") else None
            forces = [force(case.sole.width, depth) * case.sole.area.sum() for case in cases]
            found = mild.GroundFit(soles, entry.model, hold=hold).fit([depth[:, None]] * len(soles), forces).material_
            numbers = {"mu": 0, "k_drift": 0, "b_drift": 0} if entry.model.startswith("ecc_quasi") else {"mu": 0.5}
            entry = GroundEntry(entry.model, mild.Material(found, **numbers), pitch)
        yield entry


def poppy_entries(entries):
    """Fitted to the level plate's line in loose poppy seeds."""
    line = 1e6 * poppy_stress("loose", 0.0, math.pi / 2)[0]
    return refitted(entries, [poppy_case(0)], lambda width, depth: line * depth, 0.005)


def tilted(entries, degrees):
    """{model: force up of a tilted plate over that of a level one}, and the force along over the force up."""
    up, along = {}, {}
    for entry in poppy_entries(entries):
        rows, level = entry.play(poppy_case(degrees)), entry.play(poppy_case(0))
        if rows is None or level is None:
            continue
        up[entry.name] = rows["fz"][-1] / level["fz"][-1]
        along[entry.name] = abs(rows["fx"][-1]) / rows["fz"][-1]
    return up, along


def rft_friction(stress):
    """The internal friction with which 3D-RFT has the stress over depth [MPa/m] of a level plate in poppy seeds."""
    material = mild.Material("sand_loose", model="ecc_quasi_3d", zeta=1.0, mu=0, k_drift=0, b_drift=0)
    rows = GroundEntry("ecc_quasi_3d", material, 0.005).play(poppy_case(0))
    level = rows["fz"][-1] / (0.04 * 0.03 * rows["depth"][-1]) / 1e6  # of zeta 1
    ground = {"density": POPPY_DENSITY, "solid": [1.0]}
    low, high = 0.2, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rft_stress(ground, middle) / 1e6 * level < stress else (low, middle)
    return low


# k_phi [N/m^(n+2)], k_c [N/m^(n+1)], n of Wong, Theory of Ground Vehicles (2008), table 2.3, as Chrono's examples have two of its sands
# (its vehicle demos with SCM); the pressure of a strip. The table has no scatter, no plates' widths and no depths.
WONG = {"dry sand": (1528.43e3, 0.99e3, 1.1), "LETE sand": (5301e3, 102e3, 0.793)}
WIDTHS, WIDE = (0.03, 0.05, 0.3), 0.15  # [m]; whole elements of 5 mm


def strip_case(width, edge=0.0):
    return Case(f"strip rect:{4 * width},{width} 0 press:0.015@0.05", edge)


def strip_ratio(entry, narrow=0.05, edge=0.0):
    """Pressure under a strip over that under one of 150 mm, 15 mm deep, both four times as long, on grains of the radius `edge` [m]."""
    rows = [entry.play(strip_case(width, edge)) for width in (narrow, WIDE)]
    return np.nan if rows[0] is None else rows[0]["fz"][-1] / rows[1]["fz"][-1] * (WIDE / narrow)**2


def wong_pressure(sand, width, depth):
    k_phi, k_c, exponent = WONG[sand]
    return (k_c / width + k_phi) * depth**exponent


def wong_ratio(sand, narrow):
    return wong_pressure(sand, narrow, 0.015) / wong_pressure(sand, WIDE, 0.015)


# Discs that Pavlov and Johnson pressed into a loose sand: real_sand.py, which judges by more than one ratio of them.
DISCS = ("disc60", "disc80", "disc100")
AT, END = 0.01, 0.027  # [m] where the ratio is taken; where the way of the disc ends that is fitted


def disc_case(name):
    return Case(f"{name} disc:{real_sand.DISCS[name]} 0 press:0.02@0.05")


def disc_pressure(data, name, depth):
    """Of the mean trial [N/m^2], and one trial's scatter of it at the last depth [-]."""
    each = np.array([np.interp(depth, *trial) for trial in data[name]])
    return each.mean(0) / (math.pi * real_sand.DISCS[name]**2 / 4), each[:, -1].std(ddof=1) / each[:, -1].mean()


def disc_rows(entries):
    """The row of the discs: the pressure under the large one over that under the small one, models fitted to that between."""
    data = real_sand.presses()
    small, middle, large = DISCS
    (low, below), (high, above) = (disc_pressure(data, name, np.array([AT])) for name in (small, large))
    models = refitted(entries, [disc_case(middle)], lambda width, depth: disc_pressure(data, middle, depth)[0], 0.005, END)
    found = {}
    for entry in models:
        rows = [entry.play(disc_case(name)) for name in (small, large)]
        force = [np.interp(AT, part["depth"], part["fz"]) if part else math.nan for part in rows]
        found[entry.name] = force[1] / force[0] * (real_sand.DISCS[small] / real_sand.DISCS[large])**2
    ratio = high[0] / low[0]
    return f"{ratio:.3f} +- {ratio * math.hypot(below, above):.3f}", found


def pressure_ratio(records, narrow, wide, depth, what):
    """Pressure in grains under one plate over that under another, at a depth: text with the scatter of one bed; None: no records."""
    each = []
    for key in (narrow, wide):
        if key not in records.cases:
            return None
        case, beds = records.cases[key]
        each.append([np.interp(depth, rows["depth"], rows["fz"]) / case.plate.area.sum() for rows in beds])
    noise = math.hypot(*(np.std(part, ddof=1) / np.mean(part) for part in each)) if min(map(len, each)) > 1 else math.nan
    ratio = np.mean(each[0]) / np.mean(each[1])
    return f"{ratio:.3f} +- {ratio * noise:.3f}{what}"


def anchors(entries, records, results):
    """Rows: what, number, source, what the grains have or None, {model: value}, what the source leaves out or None."""
    def row(measure, case):
        found = next((r for r in results if r[3] == measure and r[1] == case), None)
        return (None, {}) if found is None else (f"{found[4]:.3f} +- {found[5]:.3f}", found[6])
    yield ("largest H/V0 of a foundation dragged at constant depth", "0.123", "swipe tests of Gottardi, Govoni, Butterfield",
           *row("grip", "sand/square100-drag15"), None)
    yield ("largest M/(B V0) of one that is turned", "0.09", "the same", *row("swipe", "sand/square100-swipe15"), None)
    wong = "k_c, k_phi of Wong 2008, Theory of Ground Vehicles, table 2.3"
    yield ("pressure of a strip 50 mm wide over one of 150 mm, dry sand", f"{wong_ratio('dry sand', 0.05):.3f}", wong,
           pressure_ratio(records, "sand/strip", "wide/slab", 0.015, ", 120 x 60 over 200 x 120 mm, 15 mm deep"),
           {entry.name: strip_ratio(entry, edge=records.edge("sand")) for entry in entries if not isinstance(entry, TableEntry)}, None)
    for sand in WONG:
        strips = list(refitted(entries, [strip_case(0.05), strip_case(0.1)], functools.partial(wong_pressure, sand), 0.01))
        for narrow in WIDTHS:
            yield (f"strip of {1e3 * narrow:.0f} mm over one of 150 mm, {sand}, models fitted to strips 50 and 100 mm wide on it",
                   f"{wong_ratio(sand, narrow):.3f}", wong, None, {entry.name: strip_ratio(entry, narrow) for entry in strips}, None)
    real, found = disc_rows(entries)
    yield (f"pressure under a disc of 100 mm over that under one of 60 mm, {1e3 * AT:.0f} mm deep, loose sand, models fitted to the disc of 80 mm", real,
           "Pavlov and Johnson; more of it: lab/grains/real_sand.py, lab/grains/real-sand.md", None, found, None)
    half = math.pi / 2
    level = {packing: poppy_stress(packing, 0.0, half)[0] for packing in POPPY}
    for degrees in (15, 30):
        up, along = tilted(entries, degrees)
        real = [poppy_stress(packing, math.radians(degrees), half) for packing in POPPY]
        yield (f"force up of a plate tilted by {degrees} degrees, pressed straight down, over that of a level one, loose and close poppy seeds",
               ", ".join(f"{z / level[packing]:.3f}" for (z, _), packing in zip(real, POPPY)), LI, None, up, None)
        yield ("its force along over its force up, the same", ", ".join(f"{abs(x) / z:.3f}" for z, x in real), LI, None, along, None)
    steady = [poppy_stress(packing, 0.0, 0.0) for packing in POPPY]
    yield ("load left of a level plate that is dragged, loose and close poppy seeds; grains and models: 80 mm deep after 22 to 30 mm",
           ", ".join(f"{z / level[packing]:.3f}" for (z, _), packing in zip(steady, POPPY)), LI, *row("load_end", "deep/square100-drag80"), None)
    yield ("horizontal force of one over its load before", ", ".join(f"{x / level[packing]:.3f}" for (_, x), packing in zip(steady, POPPY)), LI,
           *row("grip", "deep/square100-drag80"), None)
    yield ("stress over depth of a level plate, loose and close poppy seeds [MPa/m]", ", ".join(f"{z:.3f}" for z in level.values()), LI, None, {},
           f"it is what a model is fitted to; 3D-RFT alone predicts it, from density and internal friction: {POPPY_DENSITY} kg/m^3 want "
           f"{rft_friction(level['loose']):.2f} and {rft_friction(level['close']):.2f}, and no source at hand states the friction of either packing")
    yield ("feet of four shapes on three quartz sands", "-", "Han 2020, Energies 13:1867", None, {},
           "only the abstract could be read: no foot's size, no force at a depth, no sand's stiffness")
    yield ("apex of jumps planned with added mass off loose poppy seeds, distance from the target", "within 6 %", "Hubicki 2016", None, {},
           "only the abstract could be read: no mass, no foot's size, no motor's path, no target")


def print_anchors(entries, records, results):
    print("\nreal numbers")
    for text, real, source, grains, values, missing in anchors(entries, records, results):
        print(f"  {text}: {real} ({source})")
        here = [f"grains {grains}"] if grains else []
        here += [f"{name} {value:.3f}" for name, value in values.items() if np.isfinite(value)]
        if here:
            print("    " + ", ".join(here))
        if missing:
            print(f"    no prediction: {missing}")
