"""Figures of the experiments."""
import csv

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLORS = dict(zip(("rigid", "rubber", "foam60", "foam45", "foam28", "foam25", "grass", "sand_loose", "sand_dense"),
                  ("#777777", "#3b3b3b", "#0b4f8a", "#2a86c8", "#59b3d9", "#8fd0e0", "#3d8c40", "#d9972e", "#a8551c")))


def panels(count, width=9, height=4.5, rows=1):
    figure, axes = plt.subplots(rows, count, figsize=(width, height), layout="constrained", squeeze=False)
    for each in axes.flat:
        each.spines[["top", "right"]].set_visible(False)
    return figure, list(axes.flat)


def lines(curves, x, y):
    figure, (axes,) = panels(1)
    for name, points in curves.items():
        axes.plot(*zip(*points), label=name, color=COLORS.get(name))
    axes.set(xlabel=x, ylabel=y)
    axes.legend(frameon=False)
    return figure


def bars(values, y):
    figure, (axes,) = panels(1, height=3.2)
    axes.bar(list(values), list(values.values()), color=[COLORS.get(name, "#888888") for name in values])
    axes.set(ylabel=y)
    return figure


def grouped(values, names, y):
    """{what: [value of each name]} as groups of bars, one group per what."""
    figure, (axes,) = panels(1, 11, 3.2)
    shades = plt.get_cmap("Blues")(np.linspace(0.35, 0.95, len(names)))
    for i, name in enumerate(names):
        place = np.arange(len(values)) + (i - (len(names) - 1) / 2) * 0.8 / len(names)
        axes.bar(place, [v[i] for v in values.values()], 0.8 / len(names), label=name, color=shades[i])
    axes.set_xticks(range(len(values)), list(values))
    axes.set(ylabel=y)
    axes.legend(frameon=False, ncols=len(names), loc="lower center", bbox_to_anchor=(0.5, 1))
    return figure


def clouds(points):
    """Depth against slip forward and to the left: [(depth, forward, left)] by model, means with standard deviations."""
    figure, axes = panels(2, 11)
    for side, name in ((0, "slip along the heading [mm]"), (1, "slip to the left [mm]")):
        for model, stances in points.items():
            values = np.array(stances)
            slip, depth = values[:, 1 + side], values[:, 0]
            dots = axes[side].plot(slip, depth, ".", alpha=0.1, markersize=3, rasterized=True)
            axes[side].errorbar(slip.mean(), depth.mean(), depth.std(), slip.std(), fmt="o", color=dots[0].get_color(), label=model)
        low, high = np.quantile(np.concatenate([np.array(s)[:, 1 + side] for s in points.values()]), [0.005, 0.995])
        axes[side].set(xlabel=name, xlim=(low, high))
    axes[0].set(ylabel="penetration of a stance [mm]")
    axes[1].legend(frameon=False, fontsize=8)
    return figure


def matrices(values, rows, columns, low=True):
    """One coloured table for each {title: matrix}; dark is good in shares, and else what is low (or high) is."""
    figure, axes = panels(len(values), 16, 4.6)
    for each, (title, matrix) in zip(axes, values.items()):
        data = np.array(matrix, float)
        share = "%" in title
        rising = share or not low
        shown = each.imshow(data, cmap="Blues" if rising else "Blues_r", aspect="auto", vmin=0 if share else None,
                            vmax=100 if share else np.nanquantile(data, 0.9))
        each.set_xticks(range(len(columns)), columns, rotation=60, ha="right")
        each.set_yticks(range(len(rows)), rows)
        each.set(title=title, xlabel="walked on")
        for (i, j), value in np.ndenumerate(data):
            text = "-" if np.isnan(value) else f"{value:.0f}" if share or "mm" in title else f"{value:.2f}"
            dark = not np.isnan(value) and (shown.norm(value) > 0.55) == rising
            each.text(j, i, text, ha="center", va="center", color="white" if dark else "black", fontsize=8)
    axes[0].set(ylabel="trained on")
    return figure


def tracks(paths, grounds):
    """Centre of mass of the first trial on each ground: height and lateral place against time, of each {name: CSV of --track}."""
    figure, axes = panels(len(grounds), 13, 5.5, rows=2)
    for name, path in paths.items():
        with open(path, newline="", encoding="utf-8") as file:
            rows = [r for r in csv.DictReader(file) if r["trial"] == "0" and 8 <= float(r["time_s"]) <= 13]
        for column, ground in enumerate(grounds):
            own = [r for r in rows if r["ground"] == ground]
            time = [float(r["time_s"]) for r in own]
            for row, key in enumerate(("com_z_m", "com_y_m")):
                value = 1e3 * np.array([float(r[key]) for r in own])
                value = value - value.mean() if row else value
                axes[row * len(grounds) + column].plot(time, value, label=name, linewidth=1.2)
            axes[column].set(title=ground)
            axes[len(grounds) + column].set(xlabel="time [s]")
    axes[0].set(ylabel="height of the centre of mass [mm]")
    axes[len(grounds)].set(ylabel="to the left, less its mean [mm]")
    axes[0].legend(frameon=False, fontsize=8)
    return figure


# ---- the latent ----

def scatter(axes, rows, key, title, colors=None):
    """Points of an embedding, coloured by a name, or by a number on a circle."""
    if colors == "phase":
        dots = axes.scatter([r["x"] for r in rows], [r["y"] for r in rows], 4, [r[key] for r in rows], cmap="twilight", vmin=0, vmax=1)
        axes.figure.colorbar(dots, ax=axes, shrink=0.6)
    else:
        for name in dict.fromkeys(r[key] for r in rows):
            own = [r for r in rows if r[key] == name]
            label = name if isinstance(name, str) else f"{name:g} m/s"
            axes.plot([r["x"] for r in own], [r["y"] for r in own], ".", markersize=3, color=COLORS.get(name), label=label)
        axes.legend(frameon=False, fontsize=7, markerscale=3)
    axes.set(title=title, xticks=[], yticks=[])


def embeddings(periods, moments):
    """One embedding of single decisions three times, one of means over a gait period twice."""
    first, axes = panels(3, 15, 4.8)
    scatter(axes[0], moments, "ground", "single decisions, by ground")
    scatter(axes[1], moments, "phase", "the same points, by phase of the gait", "phase")
    scatter(axes[2], moments, "speed", "the same points, by command")
    second, axes = panels(2, 10, 4.8)
    scatter(axes[0], periods, "ground", "means over a gait period, by ground")
    scatter(axes[1], periods, "speed", "the same points, by command")
    return [first, second]


def regression(rows, found):
    figure, axes = panels(len(found), 12, 4)
    for each, (name, r2) in zip(axes, found.items()):
        truth = [r[name] for r in rows]
        each.plot(truth, [r[f"{name} from z~"] for r in rows], "o")
        each.axline((truth[0], truth[0]), slope=1, color="#999999", linewidth=0.8)
        each.set(xlabel=f"{name} of the ground", ylabel="from z~", title=f"R2 {r2:.2f}")
    return figure


def course(found):
    """{way: rows of latent_stats.course}"""
    figure, axes = panels(len(found), 11, 4)
    for each, (way, rows) in zip(axes, found.items()):
        for trial in sorted({r["trial"] for r in rows}):
            own = [r for r in rows if r["trial"] == trial]
            each.plot([r["time"] for r in own], [r["place"] for r in own], "-", color="#999999", linewidth=0.8)
        for ground in ("rubber", "foam28"):
            on = [r for r in rows if r["ground"] == ground]
            each.plot([r["time"] for r in on], [r["place"] for r in on], ".", color=COLORS[ground], label=ground)
        each.axhline(0, color=COLORS["rubber"], linewidth=0.5)
        each.axhline(1, color=COLORS["foam28"], linewidth=0.5)
        each.set(title=way, xlabel="time [s]", ylabel="z~: 0 as on rubber, 1 as on foam28")
        each.legend(frameon=False)
    return figure


# ---- a transition ----

def strides(axes, rows, patch, quantity, scale):
    """One quantity of every stride against the place where it ends; each trial a line, each foot's steps in turn."""
    for trial in sorted({r["trial"] for r in rows}):
        own = sorted((r for r in rows if r["trial"] == trial), key=lambda r: r["time"])
        value = [1 / r["duration"] if quantity == "cadence" else r[quantity] for r in own]
        axes.plot([r["place"] for r in own], [np.nan if v is None else scale * v for v in value], ".-", color="#555555", linewidth=0.6,
                  markersize=3)
    axes.axvspan(patch, 2 * patch, color="#8fd0e0", alpha=0.35, linewidth=0)


def transition(walked, latent, grounds, patch, quantities):
    """The paper's figure of a transition: strides forward (A) and backward (B), below each the t-SNE of z~ (C, D). walked: {way: strides},
    latent: {way: rows of --latent}."""
    from latent_stats import embed
    figure = plt.figure(figsize=(12, 10), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    first, second = grounds
    plots = upper.subplots(len(quantities), len(walked), sharex="col", sharey="row", squeeze=False)
    for column, (way, rows) in enumerate(walked.items()):
        for row, (name, (label, scale)) in enumerate(quantities.items()):
            strides(plots[row][column], rows, patch, name, scale)
            plots[row][column].spines[["top", "right"]].set_visible(False)
            if not column:
                plots[row][column].set_ylabel(label, fontsize=8)
        plots[0][column].set_title(f"{'AB'[column]}  {way}: {first}, {second}, {first}")
        plots[-1][column].set(xlabel="place where the stride ends, along the walk [m]")
    for column, (axes, (way, rows)) in enumerate(zip(lower.subplots(1, len(walked), squeeze=False)[0], latent.items())):
        own = [r for r in rows if r["trial"] == rows[0]["trial"] and float(r["time_s"]) >= 1]
        place = embed(np.array([[float(v) for name, v in r.items() if name.startswith("modulated")] for r in own]))
        border = next((i for i, r in enumerate(own) if r["ground"] == second), len(own))
        names = [first if r["ground"] == first and i < border else f"{first} again" if r["ground"] == first else second
                 for i, r in enumerate(own)]
        axes.plot(*place.T, "-", color="#bbbbbb", linewidth=0.4)
        for name, color in ((first, COLORS[first]), (second, COLORS[second]), (f"{first} again", "#c0392b")):
            at = [i for i, n in enumerate(names) if n == name]
            axes.plot(*place[at].T, ".", color=color, markersize=4, label=name)
        axes.set(title=f"{'CD'[column]}  t-SNE of z~, single decisions, {way}", xlabel="t-SNE 1", ylabel="t-SNE 2", xticks=[], yticks=[])
        axes.legend(frameon=False)
    return figure


# ---- the net or the ground ----

def factorial(values, answer, controllers, grounds):
    """values: {part: {(controller, ground, seed): skill}}; answer: {part: shares of the variance}, or None."""
    figure, axes = panels(len(values), 14, 4.6)
    shades = dict(zip(controllers, ("#9a9a9a", "#d9972e", "#3d8c40", "#59b3d9", "#0b4f8a")))
    for each, (part, own) in zip(axes, values.items()):
        for i, name in enumerate(controllers):
            seeds = [[v for (n, g, _), v in own.items() if (n, g) == (name, ground)] for ground in grounds]
            place = np.arange(len(grounds)) + 0.06 * (i - (len(controllers) - 1) / 2)
            known = [k for k, v in enumerate(seeds) if v]
            if not known:
                continue
            each.plot(place[known], [np.mean(seeds[k]) for k in known], "-o", color=shades[name], label=controllers[name])
            for k in known:
                each.plot([place[k]] * len(seeds[k]), seeds[k], "_", color=shades[name], markersize=8)
        title = part
        if answer:
            title += "\nvariance: " + ", ".join(f"{name} {share:.0%}" for name, share in answer[part].items())
        each.set(title=title, xlabel="trained on", ylim=(-0.02, 1.02))
        each.title.set_fontsize(10)
        each.set_xticks(range(len(grounds)), grounds)
    axes[0].set(ylabel="skill: upright share times 1 - |speed error| / speed")
    axes[-1].legend(frameon=False, fontsize=8)
    return figure


# ---- the search of intended.py

def choices(names, tests):
    """A row for each training, most of our choices first; a cell for each sentence that was ours, dark where it walked."""
    figure, (axes,) = panels(1, 10, 9)
    tests = sorted(tests, key=lambda t: (-len(t["ours"]), not t["walks"], -t["upright"]))
    least = min((t["ours"] for t in tests if t["walks"]), key=len, default=[])
    names = sorted(names, key=lambda name: name not in least)
    for row, test in enumerate(tests):
        columns = [names.index(name) for name in test["ours"]]
        axes.plot(columns, [row] * len(columns), "s", markersize=7, color="#0b4f8a" if test["walks"] else "#e3b78f")
        gap = "-" if test["gap"] is None else f"{test['gap']:.2f}"
        axes.text(len(names) + 1.3, row, f"{100 * test['upright']:.0f} %", ha="right", va="center", fontsize=8)
        axes.text(len(names) + 3, row, gap, ha="right", va="center", fontsize=8)
    axes.text(len(names) + 0.7, -0.8, "upright", ha="left", fontsize=8, rotation=60)
    axes.text(len(names) + 2.3, -0.8, "off [m/s]", ha="left", fontsize=8, rotation=60)
    axes.plot([], [], "s", color="#0b4f8a", label="walks")
    axes.plot([], [], "s", color="#e3b78f", label="does not")
    axes.legend(frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0, -0.06))
    axes.set_xticks(range(len(names)), names, rotation=60, ha="left", fontsize=8)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.set(xlim=(-0.7, len(names) + 3), ylim=(len(tests) - 0.4, -0.6), yticks=[])
    axes.axvspan(-0.5, len(least) - 0.5, color="#0b4f8a", alpha=0.08, linewidth=0)
    axes.spines[["top", "left", "bottom"]].set_visible(False)
    return figure
