"""mild trial --sweep: the estimator on known curves, the ground that it makes, files that it goes on from, and the command."""
import contextlib
import copy
import io
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import numpy as np

import mild
from mild import sweep
from mild.sweep import Curve
from test_trial import ROOT, Command, biped

PLUGIN = os.environ.get("MILD_PLUGIN", "")


def chance(value, s50, b, e=0.0):
    return e + (1 - 2 * e) / (1 + (s50 / value) ** b)


def judge(curve, truth, random, most=60):
    """A sweep of a known curve; (verdict, S50, interval, trials)."""
    curve, each = copy.copy(curve), 0
    while each < most and (not each or curve.result()[0] == "open"):
        for value in curve.choose(4) if each else curve.values[np.linspace(0, len(curve.values) - 1, 4).round().astype(int)]:
            curve.add(value, random.random() < truth(value))
            each += 1
    return *curve.result(), each


class Estimator(unittest.TestCase):
    def test_coverage(self):
        """Of 90 simulated policies, shallow and steep, some of which fall by accident, the 90 % intervals hold 78 to 89 true values of S50.
        Steep ones are known to within the factor after 30 trials on average."""
        random, curve, held, errors, steep = np.random.default_rng(70), Curve(1, 30), 0, [], []
        for k in range(90):
            s50, b, e = np.exp(random.uniform(np.log(3), np.log(10))), (2, 6, 20)[k % 3], (0, 0.05)[k // 3 % 2]
            _, middle, (low, high), each = judge(curve, lambda value: chance(value, s50, b, e), random)
            held += (low or 0) <= s50 <= (high or np.inf)
            errors.append(np.log(middle / s50))
            if b == 20:
                self.assertLessEqual(high / low, sweep.WITHIN)
                steep.append(each)
        print(f"{held} of 90 held; median error {np.median(np.abs(errors)):.3f}, bias {np.mean(errors):+.3f}; steep: {np.mean(steep):.1f} trials")
        self.assertTrue(78 <= held <= 89, held)
        self.assertLess(abs(np.mean(errors)), 0.04)
        self.assertLess(np.median(np.abs(errors)), 0.12)
        self.assertLess(np.mean(steep), 30)

    def test_ends(self):
        """Who never falls, and who always falls, is known after 20 trials, with one bound; so is who falls beyond the range."""
        random, curve = np.random.default_rng(1), Curve(1, 100)
        for truth, verdict, bounds in ((lambda value: 1.0, "never_falls", (None, 1.0)), (lambda value: 0.0, "always_falls", (100.0, None)),
                                       (lambda value: chance(value, 0.4, 10), "never_falls", (None, 1.0)),
                                       (lambda value: chance(value, 250, 10), "always_falls", (100.0, None))):
            found, s50, interval, each = judge(curve, truth, random)
            self.assertEqual((found, s50, np.round([one or 0 for one in interval], 9).tolist()), (verdict, None, [one or 0 for one in bounds]))
            self.assertLessEqual(each, 20)
        early = copy.copy(curve)
        for value in (1, 5, 20, 100, 1):
            early.add(value, True)
        self.assertEqual(early.result()[:2], ("open", None))  # two at the low end are not enough

    def test_border(self):
        """S50 at the end of the range: no bound beyond it, whatever the estimate."""
        _, _, (low, high), _ = judge(Curve(1, 100), lambda value: chance(value, 1.0, 3), np.random.default_rng(3))
        self.assertIsNone(low)
        self.assertTrue(1 <= high < 4, high)

    def test_direction(self):
        """Where nobody knows which end is hard, both are found; one who never falls has no bound."""
        random, curve = np.random.default_rng(2), Curve(1, 100, rises=0)
        for b in (15, -15):
            verdict, s50, (low, high), _ = judge(curve, lambda value: chance(value, 8.0, b), random)
            self.assertEqual(verdict, "inside")
            self.assertTrue(low <= 8 <= high and abs(np.log(s50 / 8)) < 0.2, (low, s50, high))
        self.assertEqual(judge(curve, lambda value: 1.0, random)[:3], ("never_falls", None, (None, None)))

    def test_fit(self):
        """The chance to stay up at a value, and its interval, are those of the trials there: 24 of 40."""
        curve = Curve(1, 100)
        for k in range(40):
            for value, upright in ((1, False), (10, k < 24), (100, True)):
                curve.add(value, upright)
        mean, low, high = curve.fit()[:, 40]
        self.assertTrue(0.43 < low < 0.53 and 0.67 < high < 0.77 and abs(mean - 0.6) < 0.03, (low, mean, high))


class Ground(unittest.TestCase):
    def test_stiffness(self):
        """Under any pressure a plate sinks by pressure over stiffness; the rest is the tile's."""
        sole = mild.Sole.plate(0.2, 0.1)
        area = sweep.CELL * len(sole.x)
        for value in (0.1, 0.7, 5, 40, 1000):
            for pressure in (2e3, 4e4):
                self.assertAlmostEqual(sole.sinkage(sweep.material("stiffness", "rubber_tile", value), pressure * area), 1e-6 * pressure / value,
                                       delta=2e-3 * 1e-6 * pressure / value)
        made, tile = sweep.material("stiffness", "rubber_tile", 3.0).as_dict(), mild.Material("rubber_tile").as_dict()
        self.assertEqual({key for key in tile if made[key] != tile[key]}, {"k_pen", "sigma_cone", "bed_depth"})

    def test_others(self):
        """Each other sweep sets what it says."""
        self.assertEqual(sweep.material("friction", "rubber_tile", 0.3).mu, 0.3)
        slips = sweep.material("slip", "rubber_tile", 2.0)
        self.assertEqual((round(slips.slip_length, 9), slips.recovery, slips.mu), (0.002, 0, mild.Material("rubber_tile").mu))
        damped = sweep.material("damping", "rubber_tile", 0.7)
        self.assertEqual((damped.model, damped.dissipation, damped.k_pen), ("hunt_crossley", 0.7, mild.Material("rubber_tile").k_pen))

    def test_marks(self):
        """The grounds on the axis have the stiffness and the friction that `mild info grounds` prints."""
        text = subprocess.run([os.environ["MILD_PROGRAM"], "info", "grounds"], capture_output=True, text=True, check=True).stdout
        printed = {row[0]: row[1:] for row in re.findall(r"^  (\w+) +mild\w* +([\d.]+) +[\d.]+ +\d+ +([\d.]+) ", text, re.M)}
        stiffness, friction = sweep.marks("stiffness"), sweep.marks("friction")
        self.assertEqual(set(stiffness), set(sweep.MEASURED))
        for name in sweep.MEASURED:
            self.assertAlmostEqual(stiffness[name], float(printed[name][0]), delta=0.02 * stiffness[name])
            self.assertAlmostEqual(friction[name], float(printed[name][1]), delta=0.005)


def walk(arguments):
    """In the place of a trial: stays up as a curve with S50 3 says."""
    *_, value, seed = arguments
    upright = np.random.default_rng([seed, 7]).random() < chance(value, 3.0, 12)
    return {"value": value, "seed": seed, "time": 1.0, "end": "time" if upright else "tilt", "speed": None, "sideways": None, "cost": None, "torque": 1.0,
            "sinkage": None}


class Stop(Exception):
    pass


@unittest.mock.patch.object(sweep, "_walk", walk)
class Files(unittest.TestCase):
    def run_sweep(self, file, stop=None, **more):
        def report(result):
            if stop is not None and len(result.each) == stop:
                raise Stop

        return sweep.sweep(*self.files, "stiffness", file=file, report=report, **more)

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.files = [self.folder / name for name in ("robot.xml", "policy.onnx", "mine.ini")]
        for file, text in zip(self.files, ('<mujoco><include file="legs.xml"/></mujoco>', "1", "[observation]\ngravity = 1\n")):
            file.write_text(text)
        (self.folder / "legs.xml").write_text("<mujoco/>")

    def test_goes_on(self):
        """Interrupted anywhere, even where a round is not done, a sweep leaves a whole file, and goes on to the very same one."""
        with tempfile.TemporaryDirectory() as folder:
            whole, part = (os.path.join(folder, name) for name in ("whole.json", "part.json"))
            self.run_sweep(whole)
            wanted = pathlib.Path(whole).read_text()
            count = len(json.loads(wanted)["each"])
            for stop in (1, 3, 4, 9, count - 1):
                with self.assertRaises(Stop):
                    self.run_sweep(part, stop)
                self.assertEqual(json.loads(pathlib.Path(part).read_text())["each"], json.loads(wanted)["each"][:stop])
                with unittest.mock.patch.object(sweep, "_walk", side_effect=walk) as walked:
                    self.run_sweep(part)
                self.assertEqual((pathlib.Path(part).read_text(), walked.call_count), (wanted, count - stop))
                pathlib.Path(part).unlink()
            self.run_sweep(whole, most=5)  # fewer than are there: nothing is lost
            self.assertEqual(pathlib.Path(whole).read_text(), wanted)
            self.assertEqual(sorted(os.listdir(folder)), ["whole.json"])

    def test_most(self):
        """A sweep that ended without an answer goes on with more trials, to what it would have found at once."""
        with tempfile.TemporaryDirectory() as folder:
            part, whole = (os.path.join(folder, name) for name in ("part.json", "whole.json"))
            result = self.run_sweep(part, most=10)
            self.assertEqual((result.as_dict()["verdict"], len(result.each)), ("open", 10))
            self.assertIn("wider than a factor 1.3", str(result))
            self.run_sweep(part), self.run_sweep(whole)
            self.assertEqual(pathlib.Path(part).read_text(), pathlib.Path(whole).read_text())

    def test_other(self):
        """The file of another sweep, of none, and one whose trials were changed are refused, and stay."""
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "s50.json"
            self.run_sweep(file, most=8)
            kept = file.read_text()
            with self.assertRaisesRegex(ValueError, "seed 1 instead of 2"):
                self.run_sweep(file, seed=2)
            whole = json.loads(kept)
            for wrong, line in (("{}", "is no sweep"), ('{"each": [', "is no sweep"), (kept.replace('"value": 0.1,', '"value": 0.2,'), "would not choose"),
                                ("[]", "is no sweep"), *((json.dumps({**whole, "each": each}), "s50.json is broken: .*or remove it") for each in (
                                    None, 3, [{}], [None], [{**whole["each"][0], "value": None}],
                                    [{key: value for key, value in whole["each"][0].items() if key != "end"}])),
                                (json.dumps({key: value for key, value in whole.items() if key != "each"}), "s50.json is broken")):
                file.write_text(wrong)
                with self.assertRaisesRegex(ValueError, line):
                    self.run_sweep(file)
                self.assertEqual(file.read_text(), wrong)

    def test_changed(self):
        """Another robot, policy or description in files of the same name is another sweep, and so is another MuJoCo; the last digits of a value
        are not."""
        file, texts = self.folder / "s50.json", {"robot.xml": "<mujoco/>", "legs.xml": "<mujoco></mujoco>", "policy.onnx": "2",
                                                 "policy.onnx.data": "3", "mine.ini": "[observation]\ngravity = 2\n"}
        self.run_sweep(file, most=8)
        for name, text in texts.items():
            before = (self.folder / name).read_text() if (self.folder / name).is_file() else None
            (self.folder / name).write_text(text)
            with self.subTest(name), self.assertRaisesRegex(ValueError, r"another sweep, (model|policy|describe)_sha256 \w{12} instead of \w{12};"):
                self.run_sweep(file, most=8)
            (self.folder / name).write_text(before) if before else (self.folder / name).unlink()
        (self.folder / "mine.ini").write_text("[observation]  # as before\ngravity = 1.0\n")
        file.write_text(file.read_text().replace('"value": 1000.0', '"value": 1000.0000000001'))
        again = self.run_sweep(file, most=8)
        self.assertEqual(sum(row[1] for row in again.points()), 8)
        for files, line in (((self.folder / "no.xml", *self.files[1:]), "model: there is no file"),
                            ((self.files[0], "nobody:x", self.files[2]), "policy: there is no file"), ((self.files[0], self.folder / "no.pt", self.files[2]), "policy: there is no file")):
            with self.assertRaisesRegex(ValueError, line):
                sweep.sweep(*files, "stiffness")
        self.assertEqual(sweep._of_policy("mild.sweep:x"), sweep._of_policy(f"{sweep.__file__}:x"))
        with unittest.mock.patch("mujoco.mj_versionString", lambda: "1.2.3"), self.assertRaisesRegex(ValueError, "mujoco .* instead of 1.2.3"):
            self.run_sweep(file, most=8)

    def test_text(self):
        """Who falls once is not said never to fall."""
        for name, rises, upright, line in (("stiffness", 1, True, r"S50 < 0.1 MPa/m: below all that was tried, 0.1 to 1e\+03; 29 of 30"),
                                           ("friction", 1, False, r"S50 > 1e\+03: above all that was tried, 0.1 to 1e\+03; 1 of 30"),
                                           ("damping", 0, True, r"S50 is outside all that was tried, 0.1 to 1e\+03; 29 of 30")):
            curve, each = Curve(0.1, 1000, rises), []
            for k in range(30):
                value = curve.choose(1)[0]
                each.append({"value": value, "end": "time" if upright == (k > 0) else "tilt"})
                curve.add(value, upright == (k > 0))
            self.assertRegex(str(sweep.Sweep({"sweep": name, "range": [0.1, 1000]}, curve, each)), f"^{name} {line} trials upright$")

    def test_network(self):
        """A sweep loads its network anew."""
        with unittest.mock.patch.object(sweep.networks, "load") as load:
            for _ in range(2):
                self.run_sweep(None, most=1)
                sweep._load(str(self.files[1]), str(self.files[2]), ())
            self.assertEqual(load.call_count, 2)

    def test_seeds(self):
        """Trials have seeds of their own, and another seed finds the same S50 by other trials."""
        first, second = self.run_sweep(None), self.run_sweep(None, seed=1000)
        self.assertEqual([one["seed"] for one in first.each], list(range(1, 1 + len(first.each))))
        self.assertNotEqual([one["value"] for one in first.each], [one["value"] for one in second.each])
        for result in (first, second):
            _, _, (low, high) = result.curve.result()
            self.assertTrue(low <= 3 <= high and high / low <= sweep.WITHIN)


class Script(unittest.TestCase):
    """scripts/public_policies.py, whose trials are made here."""

    def trial(self, arguments, check):
        """In the place of `mild trial`: one policy fails."""
        self.words = arguments
        name, file = pathlib.Path(arguments[arguments.index("--json") + 1]).stem, pathlib.Path(arguments[arguments.index("--json") + 1])
        if name.startswith("unitree_h1"):
            raise subprocess.CalledProcessError(2, "mild trial")
        walk = {"end": "tilt", "time": 2.0, "speed": None, "cost": None, "sinkage": 0.01}
        found = {"rows": [{"ground": "rigid", "trials": 1, "upright": 0, "torque": 1.0, "each": [walk]}]}
        if "--sweep" in arguments:
            found = {"sweep": "slip", "unit": "mm", "verdict": "inside", "s50": 3.0, "interval": [2.9, 3.1], "trials": 1, "range": [0.1, 100], "each": [walk]}
        file.write_text(json.dumps(found))

    def run_main(self, *arguments):
        sys.path.insert(0, str(ROOT / "scripts"))
        import public_policies

        with unittest.mock.patch.object(sys, "argv", ["public_policies", *map(str, arguments)]), contextlib.redirect_stdout(io.StringIO()) as out, \
                contextlib.redirect_stderr(io.StringIO()), unittest.mock.patch.object(public_policies.subprocess, "run", self.trial):
            try:
                return public_policies.main(), out.getvalue()
            except SystemExit as error:
                return error.code, out.getvalue()

    def test_failed(self):
        """One that fails loses nothing of the rest; rows that were not run stay; a folder's name may have blanks."""
        with tempfile.TemporaryDirectory(prefix="with blank ") as folder:
            out, table = pathlib.Path(folder), pathlib.Path(folder) / "rows.csv"
            header = "policy,ground,trials,upright,speed [m/s],cost,largest torque [N m],sinkage [m],median fall [s]"
            table.write_text(header + "\nmild_go1,rigid,10,10,,,,,\nunitree_g1,rigid,9,9,,,,,\nunitree_h1,rigid,8,8,,,,,\n")
            status, text = self.run_main(out, "--out", out, "--only", "unitree_h1,unitree_g1,h1_2_sim2sim", "--csv", table)
            self.assertEqual((status, "| unitree_g1:" in text, "unitree_h1:" in text), (1, True, False))
            self.assertTrue(self.words[-1].startswith(folder + "/"), self.words)
            self.assertEqual([row.split(",")[:3] for row in table.read_text().splitlines()[1:]],
                             [["mild_go1", "rigid", "10"], ["unitree_g1", "rigid", "1"], ["unitree_h1", "rigid", "8"], ["h1_2_sim2sim", "rigid", "1"]])
            table = out / "s50.csv"
            table.write_text("policy,sweep,unit,verdict,S50,low,high,trials,upright,own\nunitree_g1,stiffness,MPa/m,inside,2.6,2.3,2.8,44,21,a\n"
                             "unitree_g1,slip,mm,inside,2,1.9,2.1,44,21,b\n")
            status, text = self.run_main(out, "--out", out, "--only", "unitree_h1,unitree_g1,mild_go1", "--sweep", "slip", "--csv", table)
            self.assertEqual((status, "| unitree_h1 | failed |" in text, "3 (2.9 to 3.1)" in text), (1, True, True))
            self.assertEqual([[row.split(",")[k] for k in (0, 1, 4, 9)] for row in table.read_text().splitlines()[1:]],
                             [["unitree_g1", "stiffness", "2.6", "a"], ["unitree_g1", "slip", "3", "b"], ["mild_go1", "slip", "3", ""]])
            status, _ = self.run_main(out, "--only", "nobody")
            self.assertRegex(status, "^public_policies: --only: no policy is named nobody; there are")

    def test_page(self):
        """The page's table is that of its CSV files."""
        with tempfile.TemporaryDirectory() as folder:
            page, text = pathlib.Path(folder) / "page.md", (ROOT / "docs/public-policies.md").read_text()
            page.write_text(text)
            self.run_main("--list")
            sys.modules["public_policies"].write_page(page)
            self.assertEqual(page.read_text(), text)


class Recipes(unittest.TestCase):
    """scripts/recipes.py: what it makes of shares and seeds."""

    def test_numbers(self):
        """S50 between two places, at the ends; the mean without the outer quarters, in its interval."""
        sys.path.insert(0, str(ROOT / "scripts"))
        import recipes

        places, count = recipes.STIFFNESS, len(recipes.STIFFNESS)
        self.assertAlmostEqual(recipes.s50([0, 0.3, 0.7] + [1] * (count - 3)), math.sqrt(places[1] * places[2]))
        self.assertAlmostEqual(recipes.s50([1, 0.2, 0.6] + [1] * (count - 3)), places[1] * (places[2] / places[1])**0.75)
        self.assertEqual([recipes.s50([share] * count) for share in (1, 0)], [places[0], places[-1]])
        self.assertIn("--ground.k_pen=190.125", recipes.spring(0.5))
        centre, low, high = recipes.middle([100, 1, 2, 3, 4, -100, 2, 3])
        self.assertEqual(centre, 2.5)
        self.assertLess(low, centre)
        self.assertLess(centre, high)


class Arena(unittest.TestCase):
    """scripts/arena.py: the page and the letters."""

    S50 = ("policy,sweep,unit,verdict,S50,low,high,trials,upright\nunitree_h1,stiffness,MPa/m,inside,10,8,12.5,20,10\nmild_g1,stiffness,MPa/m,open,0.2,,1,20,9\n"
           "grove_g1,stiffness,MPa/m,open,,,0.1,8,8\nno<body,stiffness,MPa/m,always_falls,,1000,,8,0\nunitree_h1,slip,mm,inside,3,2.9,3.1,20,9\n")
    TRIALS = ("policy,ground,trials,upright,speed [m/s],cost,largest torque [N m],sinkage [m],median fall [s]\n"
              "unitree_h1,rigid,10,10,0.464,0.3,1.0,0.0,\nunitree_h1,grass,10,0,,,1.0,0.1,1.57\n")

    def setUp(self):
        sys.path.insert(0, str(ROOT / "scripts"))
        import arena

        self.arena, work = arena, tempfile.TemporaryDirectory()
        self.addCleanup(work.cleanup)
        self.folder = pathlib.Path(work.name)
        for name in ("cite.md", "model.md", "LICENSE-DATA.txt"):
            (self.folder / name).write_text((ROOT / "docs" / name).read_text())
        (self.folder / "s50.csv").write_text(self.S50)
        (self.folder / "public-policies.csv").write_text(self.TRIALS)

    def test_marks(self):
        """The measured grounds lie where a sweep draws them."""
        self.assertEqual(set(self.arena.GROUNDS), set(sweep.MEASURED))
        for name, value in sweep.marks("stiffness").items():
            self.assertAlmostEqual(self.arena.marks()[name] / value, 1, delta=0.006)

    def test_page(self):
        """Rows by S50, bars from there to the right end, bounds, other columns, nothing that is taken for HTML."""
        with unittest.mock.patch.object(self.arena, "DOCS", self.folder):
            self.arena.make_page(self.folder / "page")
        page = (self.folder / "page/index.html").read_text()
        rows = re.findall(r"^<tr.*<td class=\"chart\">.*$", page, re.M)
        self.assertEqual([re.search(r'data-v="(.*?)"', row)[1] for row in rows], ["grove_g1", "mild_g1", "unitree_h1", "no&lt;body"])
        self.assertEqual([re.search(r'<b style="left:(.*?)%', row)[1] for row in rows], ["0.0", "7.5", "50.0", "100.0"])
        self.assertEqual(re.search(r'<s style="left:(.*?)%;width:(.*?)%', rows[2]).groups(), ("47.6", "4.8"))
        self.assertEqual([re.search(r'<td class="number" data-v=.*?>(.*?)<', row)[1] for row in rows],
                         ["&lt; 0.1", "0.2 (? to 1)", "10 (8 to 12.5)", "&gt; 1e+03"])
        self.assertEqual([row.startswith("<tr class=ours>") for row in rows], [False, True, False, False])
        self.assertIn("10 of 10, 0.46 m/s", rows[2])
        self.assertIn("At the stiffness of a gym mat (4 MPa/m) 2 of 3 public bipeds fall in most trials, at that of a carpet (20) 1.", page)
        self.assertRegex(page, r"<td>slip<td class=\"number\">3 \(2.9 to 3.1\)")
        self.assertRegex(page, r'data-v="1.0" class=all>10<td data-v="0.0" class=none>0')
        self.assertNotRegex(page, r"no<body|\$[a-z]|(src|href)=\"http[^\"]*\.(js|css)")
        self.assertEqual((self.folder / "page/s50.csv").read_text(), self.S50)

    def test_letters(self):
        """One for each policy of others; it has the commit, the port and what came out."""
        with unittest.mock.patch.object(self.arena, "DOCS", self.folder), contextlib.redirect_stdout(io.StringIO()):
            self.arena.write_letters(self.folder / "letters", None)
            with self.assertRaisesRegex(SystemExit, "^arena: --only: no policy of others is named mild_g1; there are"):
                self.arena.write_letters(self.folder / "letters", ["mild_g1"])
        self.assertEqual({path.name for path in (self.folder / "letters").iterdir()}, {"unitree_h1.txt", "grove_g1.txt"})
        text = (self.folder / "letters/unitree_h1.txt").read_text()
        for words in ("276801e46c5d433564f24658bac64f254b7d2d4b", "S50 of stiffness  10 (8 to 12.5) MPa/m, 20 trials", "10 of 10 upright, 0.46 m/s", "half of the falls by 1.6 s",
                      "mild trial resources/robots/h1/scene.xml", (ROOT / "examples/trial/unitree_h1.ini").read_text().strip()):
            self.assertIn(words, text)
        for name, words in (("playground_g1", "mild trial mujoco_playground/_src/locomotion/g1/xmls/scene_mjx_feetonly_flat_terrain.xml mujoco_playground/experimental/"
                                              "sim2sim/onnx/g1_policy.onnx --describe examples/trial/playground_g1.ini --speed 0.5 --seconds 20 --sweep stiffness"),
                            ("h1_2_sim2sim", "--describe mujoco/model_and_yaml/walk/"), ("run_amp_g1", "policy1.onnx --speed 0.8 --seconds 20")):
            self.assertIn(words, self.arena.letter(self.arena.Policy(name), self.arena.marks()))
        self.assertIn("scene_29dof.xml of unitree_mujoco", (self.folder / "letters/grove_g1.txt").read_text())


class Commands(unittest.TestCase):
    run_main = Command.run_main

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_command(self):
        """One line; JSON that fits its schema and does not depend on processes; CSV; each fault is one line and 2."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "robot.xml").write_text(biped())
            (folder / "mine.py").write_text("import numpy as np\ndef still(o):\n    return np.zeros(4)\n")
            (folder / "mine.ini").write_text("[policy]\ndecimation = 5\n[observation]\ngravity = 1\n[kp]\n.* = 400\n[kd]\n.* = 8\n")
            sweeping = (folder / "robot.xml", f"{folder}/mine.py:still", "--describe", folder / "mine.ini", "--sweep")
            for jobs in (1, 2):
                status, out, error = self.run_main(*sweeping, "stiffness", "--seconds", "0.2", "--jobs", jobs, "--json", folder / f"{jobs}.json", "--csv",
                                                   folder / "curve.csv")
                self.assertEqual(status, 0)
                self.assertRegex(error, r"^(\d+ of at most 60 trials: \S+ upright.*\n)+$")
                self.assertRegex(out, r"^stiffness S50 < 0.1 MPa/m: below all that was tried, 0.1 to 1e\+03; (\d+) of \1 trials upright\n$")
            self.assertEqual((folder / "1.json").read_text(), (folder / "2.json").read_text())
            self.assertEqual(json.loads((folder / "1.json").read_text())["ground"], "rubber_tile")
            subprocess.run([sys.executable, ROOT / "tests/app/schema.py", ROOT / "docs/schema/sweep.json", folder / "1.json"], check=True)
            rows = [line.split(",") for line in (folder / "curve.csv").read_text().splitlines()]
            self.assertEqual((rows[0], len(rows)), (["value", "trials", "upright", "chance", "low", "high"], 162))
            self.assertEqual(sum(int(row[1]) for row in rows[1:]), len(json.loads((folder / "1.json").read_text())["each"]))
            try:
                import matplotlib  # noqa: F401
            except ImportError:
                pass
            else:
                self.run_main(*sweeping, "stiffness", "--seconds", "0.2", "--json", folder / "1.json", "--plot", folder / "curve.png")
                self.assertGreater((folder / "curve.png").stat().st_size, 10000)
            with unittest.mock.patch.dict(sys.modules, {"matplotlib.figure": None}), unittest.mock.patch.object(sweep, "sweep") as walks:
                status, _, error = self.run_main(*sweeping, "stiffness", "--plot", folder / "curve.png")
            self.assertEqual((status, "needs matplotlib" in error, walks.called), (2, True, False))
            for more, line in ((("wind",), "'wind' is none of stiffness, friction"), (("slip", "--range", "3,1"), "0 < low < high"),
                               (("slip", "--range", "3"), "--range LOW,HIGH"), (("friction", "--range", "0.1,9"), "mu"), (("friction", "--trials", 0), "more than 0"),
                               (("friction", "--ground", "rigid"), "one soft ground"), (("friction", "--speed", "0,1"), "one speed"),
                               (("friction", "--ground", "soup"), "soup"), (("friction", "--json", folder / "no/a.json"), "json: there is no folder"),
                               (("friction", "--csv", folder / "no/a.csv"), "csv: there is no folder"), (("friction", "--attach", "ground.mu=1"), "ground.mu is what the sweep sets")):
                status, _, error = self.run_main(*sweeping, *more)
                self.assertEqual((status, error.count("\n"), error.startswith("mild trial: ")), (2, 1, True), error)
                self.assertIn(line, error)


if __name__ == "__main__":
    unittest.main()
