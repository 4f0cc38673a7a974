"""Leads the feet of a walk on grains through a fitted ground model, and compares forces, for lab/grains/walk.py."""
import math

import numpy as np

STEP = 1e-3  # [s]
PITCH = 0.0195  # [m] of robots that do not say (docs/robots.md)
WINDOWS = ((0, 0.02), (0.02, 0.05), (0.05, 0.1), (0.1, 0.2))  # [s] after touchdown
CONTACT, SHORTEST, PAUSE = 30.0, 0.12, 0.02  # [N], [s] of a stance, [s] without load within it and led before it


def rotation(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


def material(numbers, model):
    """Of lab/grains/walk/grounds.json."""
    import mild
    given = {name: text == "true" if name == "passive" else float(text) for name, text in numbers.items()}
    return mild.Material("sand_loose", model=model, **given)


def stances(table):
    """(foot, rows) of each stance: from PAUSE before the load comes to where it goes."""
    for foot in (0, 1):
        rows = table[table["foot"] == foot]
        time, loaded = rows["time_s"], np.flatnonzero(rows["force_z_n"] > CONTACT)
        for own in np.split(loaded, np.flatnonzero(np.diff(time[loaded]) > PAUSE + 0.011) + 1):  # a row lasts 10 ms at most
            if len(own) and time[own[-1]] - time[own[0]] > SHORTEST and time[own[0]] - time[0] > PAUSE:
                yield foot, rows[np.searchsorted(time, time[own[0]] - PAUSE - 1e-9):own[-1] + 2]


def smooth(time, values, at):
    """A cubic through the rows, with the slopes of their neighbours."""
    slope, i = np.gradient(values, time), np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    width = time[i + 1] - time[i]
    s = (at - time[i]) / width
    return ((1 + 2 * s) * (1 - s)**2 * values[i] + s * (1 - s)**2 * width * slope[i] + s * s * (3 - 2 * s) * values[i + 1] +
            s * s * (s - 1) * width * slope[i + 1])


def lead(sole, height, ground_material, rows):
    """Columns time since the load came, force up and forward of grains, the same of the model, deepest point, speeds forward and up."""
    import mild
    ground = mild.Ground([sole], ground_material, dt=STEP)
    ground.inverse_inertia[:] = 0
    at = np.arange(rows["time_s"][0], rows["time_s"][-1], STEP)
    x, y, z, roll, pitch, yaw = (smooth(rows["time_s"], rows[name], at) for name in
                                 ("ankle_x_m", "ankle_y_m", "ankle_z_m", "roll_rad", "pitch_rad", "yaw_rad"))
    up, forward, deep = (np.interp(at, rows["time_s"], rows[name]) for name in ("force_z_n", "force_x_n", "depth_m"))
    turns, table = [rotation(*angles) for angles in zip(roll, pitch, yaw)], []
    touched = at[np.argmax(up > CONTACT)]
    for k in range(len(at) - 1):
        change = turns[k + 1] @ turns[k].T
        spin = np.array([change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]]) / (2 * STEP)
        speed = np.array([x[k + 1] - x[k], y[k + 1] - y[k], z[k + 1] - z[k]]) / STEP
        off = turns[k] @ np.array([0, 0, height])
        ground.position[0], ground.rotation[0] = np.array([x[k], y[k], z[k]]) + off, turns[k]
        ground.velocity[0] = ground.free_velocity[0] = np.concatenate([speed + np.cross(spin, off), spin])
        ground.solve()
        ground.advance()
        table.append((at[k] - touched, up[k], forward[k], ground.force[0, 2], ground.force[0, 0], deep[k], speed[0], speed[2]))
    return np.array(table)


def pitch_of(foot):
    """[m] of the ground elements of a foot's section of robot.ini."""
    return float(foot.get("pitch", PITCH))


def sole_of(foot):
    """The same foot's sole, with as many elements as fit."""
    import mild
    return mild.Sole(np.array([float(word) for word in foot["outline"].split()]).reshape(-1, 2), pitch_of(foot))


def compare(folder, feet, numbers, model):
    """Prints medians over the stances of a walk."""
    soles = [sole_of(foot) for foot in feet]
    table = np.genfromtxt(folder / "grains" / "feet.csv", delimiter=",", names=True, dtype=None, encoding=None)
    found = []
    for foot, rows in stances(table):
        led = lead(soles[foot], float(feet[foot]["z"]), material(numbers, model), rows)
        found.append([led[(led[:, 0] >= low) & (led[:, 0] < high), 1:].mean(0) for low, high in WINDOWS])
    if not found:
        return
    print(f"{folder}: {model}, {len(found)} stances, medians\n{'after touchdown':>18}  {'force up: grains':>17} {'model':>6}  {'forward: grains':>16} {'model':>6}"
          f"  {'deepest [mm]':>12}  forward, up [m/s]")
    for (low, high), v in zip(WINDOWS, np.nanmedian(found, 0)):
        print(f"{1e3 * low:10.0f} to {1e3 * high:.0f} ms  {v[0]:17.0f} {v[2]:6.0f}  {v[1]:16.0f} {v[3]:6.0f}  {1e3 * v[4]:12.0f}  {v[5]:.2f}, {v[6]:.2f}")


def tilt_slopes(folder, height):
    """Prints for soles that slide back and sink, and for soles that rest, by how much the share of horizontal force grows with the tangent of half
    the tilt, over the means of the stances: 1 would be traction at half the tilt."""
    table = np.genfromtxt(folder / "grains" / "feet.csv", delimiter=",", names=True, dtype=None, encoding=None)
    means = {"slides back and sinks": [], "rests": []}
    for _, rows in stances(table):
        time, half = rows["time_s"], np.tan(rows["pitch_rad"] / 2)
        along = np.gradient(rows["ankle_x_m"], time) + height * np.gradient(rows["pitch_rad"], time)
        up, share = np.gradient(rows["ankle_z_m"], time), rows["force_x_n"] / np.maximum(rows["force_z_n"], 1)
        landed = (rows["force_z_n"] > 2 * CONTACT) & (time > time[np.argmax(rows["force_z_n"] > CONTACT)] + WINDOWS[1][0])
        for name, here in (("slides back and sinks", (along < -0.05) & (up < -0.08)), ("rests", (np.abs(along) < 0.04) & (np.abs(up) < 0.03))):
            if (here & landed).any():
                means[name].append((half[here & landed].mean(), share[here & landed].mean()))
    for name, rows in means.items():
        if len(rows) < 5:
            continue
        x, y = np.array(rows).T
        slope, begin = np.polyfit(x, y, 1)
        error = np.sqrt(np.sum((y - begin - slope * x)**2) / (len(x) - 2) / np.sum((x - x.mean())**2))
        print(f"{folder}: {name}, {len(x)} stances: share {y.mean():+.3f}, tangent of half the tilt {x.mean():+.3f}, slope {slope:+.2f} +- {error:.2f}")
