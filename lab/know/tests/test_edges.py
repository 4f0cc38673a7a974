"""What enters `mild know` and leaves it, as tests/python/test_edges.py has it of the other commands."""
import json
import pathlib
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "lab/know"), str(ROOT / "tests/python")]
import know  # noqa: E402
from edges import rows, run  # noqa: E402


class Know(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def test_know(self):
        """What is judged, from the frames of the same walks and `mild fit`, which reads them one by one."""
        keys = ("--grounds", 9, "--seconds", 7, "--changes", 0.3, "--speed", "0.37,0.91", "--robots", 0, "--quiet", 0.3, "--seed", 23)
        found = json.loads(run("know", *keys, "--json", "-"))
        run("know", *keys, "--walks", self.folder / "w.npy")
        walks, truth = np.load(self.folder / "w.npy"), rows(self.folder / "w.csv")
        said, minutes, alarms, borders = {}, 0, 0, []
        for i, walk in enumerate(walks):
            lasted = int(truth["lasted"][i])
            frames, second = walk[:lasted, : know.FRAME], np.flatnonzero((walk[:lasted, -2:] == 1).any(1))
            touched = second[0] if len(second) else lasted
            minutes += touched / 6000
            self.assertEqual((found["walks"][i]["fell"], round(100 * found["walks"][i]["seconds"])), (lasted < 700, max(lasted - 200, 0)))
            with open(self.folder / "w1.csv", "w", encoding="utf-8") as file:
                file.write(",".join(["time_s", *(f"observation{k}" for k in range(know.FRAME))]) + "\n")
                file.writelines(",".join([f"{t / 100:.2f}", *(f"{x:.9g}" for x in row)]) + "\n" for t, row in enumerate(frames))
            judged = json.loads(run("fit", self.folder / "w1.csv", "--json", "-"))
            if touched == lasted:
                said[i] = judged["parameters"]
            alarms += sum(step["alarm"] for step in judged["footsteps"] if step["time_s"] < touched / 100 and lasted == 700)
            borders.append(self.border(judged["footsteps"], touched, len(second)))
            for name, column in (("sinkage", "sinkage0"), ("mu", "mu0"), ("slip_length", "slip_length0"), ("asked", "vx")):
                self.assertAlmostEqual(found["walks"][i][name] / truth[column][i], 1, delta=1e-5)
            if lasted == 700:
                self.assertAlmostEqual(found["walks"][i]["speed"], walk[200:lasted, 2 * know.FRAME].mean() / 4, delta=0.02)  # task.velocity_scale
        cells = {row["parameter"]: row for row in found["rows"] if row["footsteps"] == 0}
        self.assertGreater(len(said), 2)
        for name in know.NAMES:
            value = np.array([truth[f"{name}0"][i] for i in said])
            middle, low, high = (np.array([said[i][name][key] for i in said]) for key in ("median", "low", "high"))
            r2 = 1 - np.mean(np.log(middle / value)**2) / np.var(np.log(value))
            self.assertEqual((cells[name]["walks"], cells[name]["coverage"]), (len(said), np.mean((low <= value) & (value <= high))))
            self.assertAlmostEqual(cells[name]["r2"], r2, delta=0.15 * max(1, abs(r2)))  # of the mean, not the median
            self.assertAlmostEqual(cells[name]["factor"] / np.sort(high / low)[len(said) // 2], 1, delta=1e-3)
        self.assertAlmostEqual(found["minutes"], minutes, delta=1e-9)
        self.assertEqual((found["fell"], found["false_alarms"] + found["before_falls"], found["grounds"]), (int((truth["lasted"] < 700).sum()), alarms, 9))
        crossed = [border for border in borders if border]
        flagged = [flag for _, flag in crossed if flag]
        self.assertEqual(found["borders"][0], {"borders": len(crossed), "in_two": sum(flag <= 2 for flag in flagged),
                                               "in_four": sum(flag <= 4 for flag in flagged), "delay": np.mean(flagged) if flagged else None})

    @staticmethod
    def border(steps, touched, crossed_at_all):
        """Footsteps on the second ground, and which of them said so; None: fewer than four, or none at all."""
        count = flagged = began = 0
        for step in steps:
            end = round(100 * step["time_s"])
            if crossed_at_all and end >= touched:
                count += 2 * (end - touched) >= end - began
                flagged = flagged or (max(count, 1) if step["alarm"] else 0)
            began = end
        return (count, flagged) if crossed_at_all and count >= 4 else None


if __name__ == "__main__":
    unittest.main()
