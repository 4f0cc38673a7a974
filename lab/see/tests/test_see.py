"""Sinkage ahead: the gradient beside differences, learning and intervals on made-up footsteps, what a scan makes of a known print, and
short walks, the second ones over prints of the first."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "lab/see"))
import see  # noqa: E402


def rows_of(rng, count):
    """Evidence and queries at random; the truth is the mean of the evidence, with noise."""
    evidence = rng.normal(size=(count, see.STEPS + see.PRINTS, see.ELEMENT))
    evidence[..., 0] = rng.random(evidence.shape[:2]) < 0.4
    evidence *= evidence[..., :1]
    truth = evidence[..., 2].sum(1) / np.maximum(evidence[..., 0].sum(1), 1) + rng.normal(0, 0.1, count)
    return {"evidence": evidence, "query": rng.normal(size=(count, see.QUERY)), "truth": truth, "case": rng.integers(5, size=count)}


class See(unittest.TestCase):
    def test_gradient(self):
        rng = np.random.default_rng(3)
        network, rows = see.Network(rng), rows_of(rng, 6)
        network.parameters = [p + 0.1 * rng.standard_normal(p.shape) for p in network.parameters]
        evidence, query, truth = rows["evidence"], rows["query"], rows["truth"]
        mean, log_variance = network.forward(evidence, query)
        given = network.gradients(mean, log_variance, truth)

        def loss():
            mean, log_variance = network.forward(evidence, query)
            return 0.5 * np.mean((truth - mean)**2 * np.exp(-log_variance) + log_variance)
        for parameter, gradient in zip(network.parameters, given):
            for _ in range(4):
                at = tuple(rng.integers(size) for size in parameter.shape)
                kept, sides = parameter[at], []
                for step in (1e-5, -1e-5):
                    parameter[at] = kept + step
                    sides.append(loss())
                parameter[at] = kept
                self.assertAlmostEqual(gradient[at], (sides[0] - sides[1]) / 2e-5, delta=1e-5)

    def test_learns_and_covers(self):
        rng = np.random.default_rng(5)
        network = see.Network(rng).learn(rows_of(rng, 4000), 300, rng)
        factors, test = see.widths(network, rows_of(rng, 3000)), rows_of(rng, 3000)
        mean, deviation = network.said(test)
        self.assertGreater(see.r2(test["truth"], mean), 0.7)
        self.assertGreater(see.r2(test["truth"], mean), see.r2(test["truth"], network.said(test, (0, 0, 1))[0]) + 0.2)
        inside = abs(test["truth"] - mean) <= factors[see.group(test)] * deviation
        for case in range(5):  # 600 footsteps here and 600 for the factors: 3 deviations
            self.assertAlmostEqual(inside[test["case"] == case].mean(), 0.9, delta=0.06)

    def test_scan(self):
        """A print of 30 mm beside the way, seen to 3 mm and found where it is; ground without prints has none."""
        time = np.arange(0, 4, see.SEEN)
        frames = np.zeros((len(time), 7))
        frames[:, 0], frames[:, 1], frames[:, 4], frames[:, 2], frames[:, 5] = time, 0.6 * time, 0.6 * time, 0.1, -0.1
        x, y = np.arange(see.BACK, see.FRONT, see.GRID), np.arange(-see.SIDE, see.SIDE, see.GRID)
        visible = 0.03 * (abs(x - 3) < 0.13) * (abs(y - 0.3) < 0.06)[:, None]
        scan = see.Scan({"frames": frames, "visible": visible}, 0, np.random.default_rng(1))
        depth, count, near = scan.until(3.5)
        self.assertAlmostEqual(scan.under(depth, count, 3, 0.3), 0.03, delta=0.006)
        self.assertAlmostEqual(scan.under(depth, count, 2.5, 0.3), 0, delta=0.003)
        (deep, px, py), *more = scan.prints(depth, count, near)
        self.assertLess(abs(deep - 0.03) / 0.006 + abs(px - 3) / 0.08 + abs(py - 0.3) / 0.06, 3)
        self.assertEqual(more, [])
        scan = see.Scan({"frames": frames, "visible": 0 * visible}, 0, np.random.default_rng(1))
        self.assertEqual(scan.prints(*scan.until(3.5)), [])

    def test_walks(self):
        """A batch of short walks, the second over prints of the first."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            subprocess.run([sys.executable, ROOT / "lab/see/see.py", "walk", folder, "--strips", "8", "--seconds", "4"], check=True)
            sole, deep = see.soles_of("sa01")[0], []
            for number in range(8):
                first, second = (dict(np.load(folder / f"{number}-{turn}.npz")) for turn in (0, 1))
                strip = see.Strip(number, sole)
                left = np.searchsorted(strip.stretch, first["place"][:, 0]) % 2 == 0
                self.assertTrue(np.array_equal(second["old_place"], first["place"][left]))
                middle = second["old"][see.grid_at(second, *first["place"].T)]
                deep += list(zip(middle[left], first["depth"][left]))
                rows = see.sights(folder, number, 1, sole)
                self.assertTrue(all(np.isfinite(row["evidence"]).all() and np.isfinite(row["query"]).all() for row in rows))
            printed, trodden = np.array(deep).T  # the greatest of all walks on that place, beside that of one foot
            self.assertGreater(len(deep), 20)
            self.assertGreater(np.corrcoef(printed, trodden)[0, 1], 0.9)


if __name__ == "__main__":
    unittest.main()
