"""Slowing before a seen border: with made-up feet, and under `mild eval --led`, where who is blind walks as unled."""
import json
import pathlib
import sys
import types
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "lab/see"))
import slow  # noqa: E402

GIVEN = types.SimpleNamespace(threshold=slow.THRESHOLD, steps=4, mean={}, seconds=3.5)


def said(kind, names, seed, told=0.9, stride=0.3):
    """[(place of the base, speed)] of a walker whose feet step in turn, as fast as it says."""
    walker, base, found = slow.Walker(kind, told, names, np.random.default_rng(seed), GIVEN), 0.0, []
    while base < 6.5:
        step, feet = base // stride, []
        for f in (0, 1):
            last = (step - (step + f) % 2) * stride + 0.1  # of this foot; it swings over two strides to the next, in the second half
            swings = (step + f) % 2 == 1
            feet.append([last + 2 * (base - step * stride) * swings, 0.1 - 0.2 * f, 0, 0 if swings else 300])
        found.append((base, walker.speed(0.01 * (len(found) + 1), np.array(feet))))
        base += 0.01 * found[-1][1]
    return np.array(found).T, walker


class Slow(unittest.TestCase):
    def test_sees(self):
        """Slow from before each border until so many steps beyond it; never where all looks alike."""
        for seed in range(4):
            (base, speed), walker = said("sees", ["rigid", "rubber", "rubber", "rigid"], seed)
            for border in walker.true:
                self.assertTrue((speed[abs(base - border) < 0.3] == slow.SLOW).all())
                self.assertTrue((speed[(base > border + 1.21) & (base < border + 1.3)] == 0.9).all())
            self.assertEqual((walker.log["met"], walker.log["alarms"]), ([True, True], 2))
            self.assertGreater(said("sees", ["sand_loose"] * 3, seed)[0][1].min(), 0.8)
            self.assertEqual(said("alike", ["alike", "sand_loose", "alike"], seed)[1].log["met"], [False, False])

    def test_led(self):
        words = ["eval", "--ground", "rigid+grass", "--speed=0.6", "--trials", "2", "--threads", "1", "--patch", "1.5", "--json", "-"]
        led, knows = (json.loads(slow.lead(kind, GIVEN, *words, "--seconds", "9"))["rows"][0]["each"] for kind in ("blind", "knows"))
        for one, alone, late in zip(led, json.loads(slow.exam.measure.mild(*words, "--seconds", "3.5"))["rows"][0]["each"], knows):
            self.assertEqual({key: one[key] for key in alone}, alone)
            self.assertAlmostEqual(one["way"], one["x"], delta=0.25)
            self.assertLess(late["x"], one["x"] - 0.2)


if __name__ == "__main__":
    unittest.main()
