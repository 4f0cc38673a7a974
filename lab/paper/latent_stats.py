"""Statistics of what `mild eval --latent` writes."""
import csv

import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import RidgeCV
from sklearn.manifold import TSNE
from sklearn.metrics import r2_score
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR
from threadpoolctl import threadpool_limits

START = 2.0    # [s] of a trial that are left out
MOMENTS = 2100  # decisions in an embedding
PHASES = 8


def read(paths):
    """Columns of CSVs of --latent or --actions, one after the other: {name: array}; file: which of them."""
    rows = []
    for place, path in enumerate(paths):
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.reader(file)
            names = [*next(reader), "file"]
            rows += [[*row, place] for row in reader if float(row[3]) >= START]
    columns = list(zip(*rows))
    return {name: np.array(column) if name == "ground" else np.array(column, float) for name, column in zip(names, columns)}


def wide(data, prefix):
    return np.stack([column for name, column in data.items() if name.startswith(prefix)], axis=1)


def clock(data):
    """Number of the gait period that each row is in, and how many rows a whole one of its walk has."""
    number, rows = np.zeros(len(data["phase"])), np.zeros(len(data["phase"]))
    walks = np.unique(np.stack([data["file"], data["trial"], data["speed_m_s"]]), axis=1, return_inverse=True)[1].reshape(-1)
    for walk in range(walks.max() + 1):
        own = np.flatnonzero(walks == walk)
        own = own[np.argsort(data["time_s"][own], kind="stable")]
        number[own] = np.cumsum(np.diff(data["phase"][own], prepend=0) < 0)
        rows[own] = 1 / np.median(np.diff(data["phase"][own]) % 1)
    return number, rows


def periods(data, values):
    """Means over one gait period: values, ground, speed, trial, time, of each."""
    number, rows = clock(data)
    key = np.stack([data["file"], data["trial"], data["speed_m_s"], number], axis=1)
    _, index, inverse = np.unique(np.column_stack([key, np.unique(data["ground"], return_inverse=True)[1]]), axis=0,
                                  return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    sums = np.zeros((len(index), values.shape[1]))
    np.add.at(sums, inverse, values)
    count = np.bincount(inverse)
    whole = count > 0.9 * rows[index]  # the first and the last of a trial, or one across a border, is a piece
    index, means = index[whole], (sums / count[:, None])[whole]
    return means, data["ground"][index], data["speed_m_s"][index], data["trial"][index], data["time_s"][index]


def named(values, labels, trials):
    """Share of held-out rows that a linear discriminant names; every third trial is held out."""
    held = trials % 3 == 0
    model = LinearDiscriminantAnalysis(solver="lsqr").fit(values[~held], labels[~held])
    return model.score(values[held], labels[held])


def shuffled(values, labels, walks, trials):
    """The same with the labels shuffled among whole walks, mean of 20 times: what a discriminant finds where there is nothing."""
    draw, found = np.random.default_rng(1), []
    names, first, inverse = np.unique(walks, axis=0, return_index=True, return_inverse=True)
    for _ in range(20):
        other = labels[first][draw.permutation(len(names))]
        found.append(named(values, other[inverse.reshape(-1)], trials))
    return float(np.mean(found))


def explained(values, labels):
    """Share of the variance of the values that the means of the groups have."""
    middle = values.mean(0)
    between = sum((labels == g).sum() * ((values[labels == g].mean(0) - middle) ** 2).sum() for g in np.unique(labels))
    return between / ((values - middle) ** 2).sum()


def neighbours(place, labels, walks, count=10):
    """Share of the `count` nearest points of other walks, in an embedding, that have the label of a point: its mean over the points; and
    what it would be if places said nothing of labels."""
    found, chance = [], []
    for point, label, walk in zip(place, labels, walks):
        other = np.flatnonzero(walks != walk)
        near = other[np.argsort(((place[other] - point) ** 2).sum(1))[:count]]
        found.append(np.mean(labels[near] == label))
        chance.append(np.mean(labels[other] == label))
    return float(np.mean(found)), float(np.mean(chance))


def embed(values):
    with threadpool_limits(1):  # on busy cores its threads wait for each other
        return TSNE(random_state=1, perplexity=30).fit_transform((values - values.mean(0)) / (values.std(0) + 1e-9))


def latent(data):
    """({(from, what): share}, rows of periods, rows of moments), each row with its place in the embedding."""
    z = wide(data, "modulated")
    means, ground, speed, trial, time = periods(data, z)
    eleven = np.hstack([wide(data, "velocity"), wide(data, "foot")])
    estimates = periods(data, eleven)[0]
    both = periods(data, wide(data, "z"))[0]  # mu
    walks = np.column_stack([np.unique(ground, return_inverse=True)[1], speed, trial])
    some = np.linspace(0, len(z) - 1, min(len(z), 40 * MOMENTS)).astype(int)  # enough for a discriminant
    at = {"ground": data["ground"][some], "phase": np.floor(data["phase"][some] % 1 * PHASES).astype(int).astype(str),
          "command": data["speed_m_s"][some].astype(str)}
    one, instant = "z~, one gait period", "z~, one instant"
    found = {(one, "ground"): named(means, ground, trial), (one, "ground, shuffled"): shuffled(means, ground, walks, trial),
             (one, "command"): named(means, speed.astype(str), trial),
             (one, "variance: ground"): explained(means, ground), (one, "variance: command"): explained(means, speed),
             ("mu, one gait period", "ground"): named(both, ground, trial),
             ("the estimates, one gait period", "ground"): named(estimates, ground, trial)}
    for what, labels in at.items():
        found[instant, what] = named(z[some], labels, data["trial"][some])
    found["the estimates, one instant", "ground"] = named(eleven[some], at["ground"], data["trial"][some])
    for what, labels in at.items():
        found[instant, f"variance: {what}"] = explained(z[some], labels)
    place = embed(means)
    near, chance = neighbours(place, ground, np.unique(walks, axis=0, return_inverse=True)[1].reshape(-1))
    found["t-SNE of means over a period", "ground of the 10 nearest points of other walks"] = near
    found["t-SNE of means over a period", "the same by chance"] = chance
    few = np.linspace(0, len(z) - 1, min(len(z), MOMENTS)).astype(int)
    where = embed(z[few])
    of_walk = np.column_stack([np.unique(data["ground"][few], return_inverse=True)[1], data["speed_m_s"][few], data["trial"][few]])
    near, chance = neighbours(where, data["ground"][few], np.unique(of_walk, axis=0, return_inverse=True)[1].reshape(-1))
    found["t-SNE of single instants", "ground of the 10 nearest points of other walks"] = near
    found["t-SNE of single instants", "the same by chance"] = chance
    rows = [{"ground": str(g), "speed": float(s), "trial": int(t), "time": float(c), "x": float(x), "y": float(y),
             **{f"z{i}": float(v) for i, v in enumerate(m)}}
            for g, s, t, c, (x, y), m in zip(ground, speed, trial, time, place, means)]
    moments = [{"ground": str(data["ground"][i]), "speed": float(data["speed_m_s"][i]), "phase": float(data["phase"][i] % 1),
                "x": float(x), "y": float(y)} for i, (x, y) in zip(few, where)]
    return found, rows, moments


def by_phase(values, phase):
    """Mean and deviation in each tenth of the gait, one after the other."""
    tenth = np.floor(phase % 1 * 10).astype(int)
    return np.concatenate([of(values[tenth == i], 0) for i in range(10) for of in (np.mean, np.std)])


def walk(latent, actions, stances):
    """{what is known of one walk: numbers}, or None for a walk that fell: z~, the sensors' readings, and the true state with each depth."""
    seen = read([actions])
    if not seen or seen["time_s"].max() < 2 * START:
        return None
    state = np.hstack([wide(seen, prefix) for prefix in ("quaternion", "omega", "angle", "speed_leg", "action")])
    with open(stances, newline="", encoding="utf-8") as file:
        steps = [[float(row[name]) for name in ("depth_m", "duration_s", "forward_m", "left_m", "apex_m")]
                 for row in csv.DictReader(file) if float(row["start_s"]) >= START]
    return {"z~": wide(read([latent]), "modulated").mean(0), "the sensors": by_phase(wide(seen, "observation"), seen["phase"]),
            "the true state, and the depth of every stance":
                np.concatenate([by_phase(state, seen["phase"]), np.mean(steps, 0), np.std(steps, 0)])}


def determined(values, known, held):
    """The held-out numbers from the values, by that of three regressions which does best among the others (five folds)."""
    best = max((make_pipeline(StandardScaler(), RidgeCV(np.logspace(-3, 4, 15))), make_pipeline(StandardScaler(), SVR(C=10, epsilon=0.05)),
                ExtraTreesRegressor(100, min_samples_leaf=2, max_features=min(1.0, 60 / values.shape[1]), random_state=0)),
               key=lambda model: cross_val_score(model, values[~held], known[~held], cv=5).mean())
    return best.fit(values[~held], known[~held]).predict(values[held])


def regression(seen, known, names):
    """What is known of walks (walk) against numbers of their grounds: rows of z~, and {(from, name): R2}; every third ground is held out."""
    known = np.array([numbers for numbers, one in zip(known, seen) if one])
    seen = [one for one in seen if one]
    held, found, rows = np.arange(len(seen)) % 3 == 0, {}, []
    with threadpool_limits(1):
        for source in seen[0]:
            values = np.array([one[source] for one in seen])
            guess = np.column_stack([determined(values, known[:, i], held) for i in range(len(names))])
            found.update({(source, name): float(r2_score(known[held][:, i], guess[:, i])) for i, name in enumerate(names)})
            rows = rows or [{**dict(zip(names, map(float, numbers))), **{f"{name} from z~": float(g) for name, g in zip(names, guesses)}}
                            for numbers, guesses in zip(known[held], guess)]
    return rows, found


def course(path):
    """Walks on rubber, on foam28, and on a course of both: rows of the course, place 0 as on rubber, 1 as on foam28."""
    data = read([path])
    scene = np.cumsum(np.r_[False, np.diff(data["time_s"]) < -1])  # rubber, foam28, the course
    means, ground, _, trial, time = periods({**data, "trial": 1000 * scene + data["trial"]}, wide(data, "modulated"))
    mixed = trial >= 2000
    axis = LinearDiscriminantAnalysis().fit(means[~mixed], ground[~mixed])
    place = means @ axis.coef_[0]
    middle = [place[~mixed & (ground == g)].mean() for g in ("rubber", "foam28")]
    place = (place - middle[0]) / (middle[1] - middle[0])
    rows = [{"trial": int(t) - 2000, "time": float(s), "ground": str(g), "place": float(p)}
            for t, s, g, p in zip(trial[mixed], time[mixed], ground[mixed], place[mixed])]
    return sorted(rows, key=lambda r: (r["trial"], r["time"]))


def delays(found):
    """{way: mean number of whole gait periods on a new ground until z~ is on its side of the middle}."""
    late = {}
    for way, rows in found.items():
        waits = []
        for i in range(1, len(rows)):
            if rows[i]["trial"] != rows[i - 1]["trial"] or rows[i]["ground"] == rows[i - 1]["ground"]:
                continue
            new, count = rows[i]["ground"], 0
            for row in rows[i:]:
                count += 1
                if row["trial"] != rows[i]["trial"] or (row["place"] > 0.5) == (new == "foam28"):
                    break
            waits.append(count)
        late[way] = float(np.mean(waits)) if waits else float("nan")
    return late
