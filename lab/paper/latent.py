#!/usr/bin/env python3
"""Says how well a policy's modulated latent names the ground: linear discriminant analysis on means over a window.

  build/mild eval --config configs/walk.ini --ground rigid,foam45,sand_loose --trials 12 --latent latent.csv
  lab/paper/latent.py latent.csv

Trials whose number is a multiple of three are held out; the others train. A class is a ground; its mean and the covariance of all
classes together decide: the largest of mu^T S^-1 x - mu^T S^-1 mu / 2. The first two seconds of a trial are left out.
"""
import argparse
import csv

START = 2.0  # [s]


class Parser(argparse.ArgumentParser):
    """One line for a mistake."""

    def error(self, message):
        self.exit(2, f"{self.prog}: {message}\n")


def windows(path, seconds):
    """[(ground, trial, mean of modulated z)] over windows of this length [s]."""
    trials = {}
    with open(path, newline="") as file:
        reader = csv.DictReader(file)
        columns = [name for name in reader.fieldnames or () if name.startswith("modulated")]
        if not columns or not {"ground", "trial", "speed_m_s", "time_s"} <= set(reader.fieldnames):
            raise ValueError("has not the columns ground, trial, time_s, modulated0 and so on")
        for row in reader:
            if float(row["time_s"]) >= START:
                key = row["ground"], row["speed_m_s"], int(row["trial"])
                trials.setdefault(key, []).append([float(row[name]) for name in columns])
    found = []
    length = round(seconds / 0.01)
    for (ground, _, trial), rows in trials.items():
        for at in range(0, len(rows) - length + 1, length):
            found.append((ground, trial, mean(rows[at : at + length])))
    return found


def mean(rows):
    return [sum(column) / len(rows) for column in zip(*rows)]


def covariance(rows, means):
    """Of each row about the mean of its class, with a little on the diagonal so that it has an inverse."""
    n = len(rows[0][2])
    total = [[1e-9 * (i == j) for j in range(n)] for i in range(n)]
    for ground, _, x in rows:
        apart = [a - b for a, b in zip(x, means[ground])]
        for i, a in enumerate(apart):
            for j, b in enumerate(apart):
                total[i][j] += a * b / len(rows)
    return total


def solve(matrix, right):
    """matrix^-1 right by elimination; the matrix is positive definite."""
    rows = [row[:] + [value] for row, value in zip(matrix, right)]
    for k, pivot in enumerate(rows):
        pivot[:] = [value / pivot[k] for value in pivot]
        for other in rows:
            if other is not pivot:
                factor = other[k]
                other[:] = [a - factor * b for a, b in zip(other, pivot)]
    return [row[-1] for row in rows]


def dot(x, y):
    return sum(a * b for a, b in zip(x, y))


def classify(train, test):
    """{(ground, named): count} over the windows of `test`."""
    grounds = list(dict.fromkeys(ground for ground, _, _ in train))
    means = {g: mean([x for ground, _, x in train if ground == g]) for g in grounds}
    spread = covariance(train, means)
    weight = {g: solve(spread, means[g]) for g in grounds}
    offset = {g: dot(weight[g], means[g]) / 2 for g in grounds}
    counts = {}
    for ground, _, x in test:
        named = max(grounds, key=lambda g: dot(weight[g], x) - offset[g])
        counts[ground, named] = counts.get((ground, named), 0) + 1
    return counts


def main():
    parser = Parser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", help="what mild eval --latent wrote")
    parser.add_argument("--window", type=float, nargs="+", default=[1.0, 12.0],
                        help="[s] lengths; the shipped policy's gait at 0.6 m/s takes 1 s (default 1 12)")
    arguments = parser.parse_args()
    for seconds in arguments.window:
        try:
            found = windows(arguments.csv, seconds)
        except OSError as error:
            parser.error(f"{arguments.csv}: cannot read: {error.strerror}")
        except (ValueError, TypeError, csv.Error) as error:
            parser.error(f"{arguments.csv}: {error}; give what mild eval --latent wrote")
        train = [row for row in found if row[1] % 3]
        test = [row for row in found if row[1] % 3 == 0]
        if not train or not test:
            parser.error(f"{arguments.csv}: trials are shorter than {START + seconds:g} s or fewer than 2")
        counts = classify(train, test)
        right = sum(count for (ground, named), count in counts.items() if ground == named)
        print(f"{seconds:g} s: {100 * right / len(test):.1f} % of {len(test)} windows")
        for (ground, named), count in sorted(counts.items()):
            if ground != named:
                print(f"    {ground} taken for {named}: {count}")


if __name__ == "__main__":
    main()
