"""Figures of the experiments, and the statistics that they show."""
import csv

import matplotlib
import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.linear_model import RidgeCV
from sklearn.manifold import TSNE
from sklearn.metrics import r2_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PERIOD = 0.8  # [s] of the gait
START = 2.0   # [s] of a trial that are left out
COLORS = dict(zip(("rigid", "rubber", "foam60", "foam45", "foam28", "foam25", "grass", "sand_loose", "sand_dense"),
                  ("#777777", "#3b3b3b", "#0b4f8a", "#2a86c8", "#59b3d9", "#8fd0e0", "#3d8c40", "#d9972e", "#a8551c")))


def panels(count, width=9, height=4.5):
    figure, axes = plt.subplots(1, count, figsize=(width, height), layout="constrained", squeeze=False)
    for each in axes[0]:
        each.spines[["top", "right"]].set_visible(False)
    return figure, list(axes[0])


def lines(curves, x, y):
    figure, (axes,) = panels(1)
    for name, points in curves.items():
        axes.plot(*zip(*points), label=name, color=COLORS.get(name))
    axes.set(xlabel=x, ylabel=y)
    axes.legend(frameon=False)
    return figure


def bars(values, y):
    figure, (axes,) = panels(1, height=3.5)
    axes.bar(list(values), list(values.values()), color=[COLORS.get(name, "#888888") for name in values])
    axes.set(ylabel=y)
    return figure


def clouds(points):
    """Depth against slip forward and to the left: [(depth, forward, left)] by model, means with standard deviations."""
    figure, axes = panels(2)
    for side, name in ((0, "slip along the heading [mm]"), (1, "slip to the left [mm]")):
        for model, stances in points.items():
            values = np.array(stances)
            slip, depth = values[:, 1 + side], values[:, 0]
            dots = axes[side].plot(slip, depth, ".", alpha=0.15, markersize=3)
            axes[side].errorbar(slip.mean(), depth.mean(), depth.std(), slip.std(), fmt="o", color=dots[0].get_color(), label=model)
        axes[side].set(xlabel=name)
    axes[0].set(ylabel="penetration of a stance [mm]")
    axes[1].legend(frameon=False, fontsize=8)
    return figure


def matrices(values, rows, columns):
    figure, axes = panels(len(values), 15, 4.6)
    for each, (title, matrix) in zip(axes, values.items()):
        data = np.array(matrix, float)
        share = "%" in title
        shown = each.imshow(data, cmap="Blues" if share else "Blues_r", aspect="auto", vmin=0 if share else None,
                            vmax=100 if share else np.nanquantile(data, 0.9))
        each.set_xticks(range(len(columns)), columns, rotation=60, ha="right")
        each.set_yticks(range(len(rows)), rows)
        each.set(title=title, xlabel="walked on")
        for (i, j), value in np.ndenumerate(data):
            text = "-" if np.isnan(value) else f"{value:.0f}" if share else f"{value:.2f}"
            dark = not np.isnan(value) and (shown.norm(value) > 0.55) == share
            each.text(j, i, text, ha="center", va="center", color="white" if dark else "black", fontsize=8)
    axes[0].set(ylabel="trained on")
    return figure


# ---- the latent ----

def read(path):
    """Columns of a CSV of --latent: {name: array}."""
    with open(path, newline="") as file:
        reader = csv.reader(file)
        names = next(reader)
        rows = [row for row in reader if float(row[3]) >= START]
    columns = list(zip(*rows))
    return {name: np.array(column) if name == "ground" else np.array(column, float) for name, column in zip(names, columns)}


def wide(data, prefix):
    return np.stack([column for name, column in data.items() if name.startswith(prefix)], axis=1)


def periods(data, values):
    """Means over one gait period: values, ground, speed, trial, time, of each."""
    key = np.stack([data["trial"], data["speed_m_s"], np.floor((data["time_s"] - START) / PERIOD)], axis=1)
    _, index, inverse = np.unique(np.column_stack([key, np.unique(data["ground"], return_inverse=True)[1]]), axis=0,
                                  return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    sums = np.zeros((len(index), values.shape[1]))
    np.add.at(sums, inverse, values)
    count = np.bincount(inverse)
    whole = count > 0.9 * count.max()  # the last of a trial, or one across a border, is a piece
    index, means = index[whole], (sums / count[:, None])[whole]
    return means, data["ground"][index], data["speed_m_s"][index], data["trial"][index], data["time_s"][index]


def named(values, labels, trials):
    """Share of held-out windows that a linear discriminant names; every third trial is held out."""
    held = trials % 3 == 0
    model = LinearDiscriminantAnalysis(solver="lsqr").fit(values[~held], labels[~held])
    return model.score(values[held], labels[held])


def latent(path):
    data = read(path)
    z = wide(data, "modulated")
    means, ground, speed, trial, _ = periods(data, z)
    estimates = periods(data, np.hstack([wide(data, "velocity"), wide(data, "foot")]))[0]
    phase = data["phase"] < 0.1
    found = {"ground": named(means, ground, trial), "command": named(means, speed.astype(str), trial),
             "estimates": named(estimates, ground, trial), "phase": named(z[phase], data["ground"][phase], data["trial"][phase])}
    flat = TSNE(random_state=1, perplexity=30).fit_transform((means - means.mean(0)) / (means.std(0) + 1e-9))
    figure, axes = panels(2, 11, 5)
    for name in dict.fromkeys(ground):
        axes[0].plot(*flat[ground == name].T, ".", color=COLORS.get(name), label=name)
    for value in sorted(set(speed)):
        axes[1].plot(*flat[speed == value].T, ".", label=f"{value:g} m/s")
    for each, title in zip(axes, ("t-SNE of z~, by ground", "the same, by command")):
        each.set(title=title, xticks=[], yticks=[])
        each.legend(frameon=False, fontsize=8)
    return figure, found


def regression(tables, known, names):
    """z~ of a walk in each table, text of --latent, against the numbers that are known of its ground."""
    values, kept = [], []
    for table, truth in zip(tables, known):
        names_of, *rows = csv.reader(table.splitlines())
        use = [i for i, name in enumerate(names_of) if name.startswith("modulated")]
        late = [[float(row[i]) for i in use] for row in rows if float(row[3]) >= START]
        if late:  # it has not fallen at once
            values.append(np.mean(late, axis=0))
            kept.append(truth)
    values, known = np.array(values), np.array(kept)
    held = np.arange(len(values)) % 3 == 0
    model = make_pipeline(StandardScaler(), RidgeCV(np.logspace(-3, 3, 13))).fit(values[~held], known[~held])
    told = model.predict(values[held])
    figure, axes = panels(len(names), 9, 4)
    found = {}
    for i, (each, name) in enumerate(zip(axes, names)):
        found[name] = r2_score(known[held][:, i], told[:, i])
        each.plot(known[held][:, i], told[:, i], "o")
        each.axline((known[0, i], known[0, i]), slope=1, color="#999999", linewidth=0.8)
        each.set(xlabel=f"{name} of the ground", ylabel="from z~", title=f"R2 {found[name]:.2f}")
    return figure, found


def course(tracks):
    """{way: CSV of walks on rubber, on foam28, and on a course of both}."""
    figure, axes = panels(len(tracks), 11, 4)
    for each, (way, path) in zip(axes, tracks.items()):
        data = read(path)
        scene = np.cumsum(np.r_[False, np.diff(data["time_s"]) < -1])  # rubber, foam28, the course of both
        means, ground, _, trial, time = periods({**data, "trial": 1000 * scene + data["trial"]}, wide(data, "modulated"))
        mixed = trial >= 2000
        axis = LinearDiscriminantAnalysis().fit(means[~mixed], ground[~mixed])
        place = means @ axis.coef_[0] + axis.intercept_[0]
        middle = [place[~mixed & (ground == g)].mean() for g in ("foam28", "rubber")]
        place = (place - middle[1]) / (middle[0] - middle[1])
        for t in sorted(set(trial[mixed])):
            own = mixed & (trial == t)
            sort = np.argsort(time[own])
            each.plot(time[own][sort], place[own][sort], "-", color="#999999", linewidth=0.8)
            for g in ("rubber", "foam28"):
                on = own & (ground == g)
                each.plot(time[on], place[on], ".", color=COLORS[g], label=g if t == min(trial[mixed]) else None)
        each.axhline(0, color=COLORS["rubber"], linewidth=0.5)
        each.axhline(1, color=COLORS["foam28"], linewidth=0.5)
        each.set(title=way, xlabel="time [s]", ylabel="z~: 0 as on rubber, 1 as on foam28")
        each.legend(frameon=False)
    return figure
