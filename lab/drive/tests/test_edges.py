"""What enters `mild drive` and leaves it, as tests/python/test_edges.py has it of the other commands."""
import contextlib
import json
import pathlib
import sys
import tempfile
import unittest

import numpy as np
from robot import Robot, Runner

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "tests/python"))
from edges import MILD, rows, run  # noqa: E402

COMMAND = 0.43, -0.07, 0.19


class Drive(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def test_drive(self):
        """The ground that the runner knows is that of its log; targets ask for the share of the torque; the simulated robot went as it was told."""
        log, command = self.folder / "log.csv", ",".join(map(str, COMMAND))
        with contextlib.chdir(self.folder):
            runner = Runner(MILD, "--task.speed_hold=0", "--command", command, "--torque-share", "0.87", "--log", str(log), patience=("--damp-after", "20", "--late", "10", "--stall-after", "20"))
            there = json.loads(run("drive", "--simulate", "--lockstep", "--connect", f"127.0.0.1:{runner.port}", "--ground", "grass", "--seconds", 6.3, "--json", "-"))
            code, found, said = runner.end()
            self.assertEqual((code, found["end"], found["damps"], there["end"], there["fallen"], there["seconds"]), (0, "robot", 0, "time", False, 6.3), said)
            limits = {}
            for share in "1", "0.37":
                runner = Runner(MILD, "--torque-share", share)
                robot = Robot(runner.port)
                limits[share] = np.array(robot.start().targets[-1]["limit"])
                robot.socket.close()
                runner.process.terminate()
                runner.end()
        table, judged = rows(log), json.loads(run("fit", log, "--json", "-"))
        np.testing.assert_allclose(np.diff(table["time_s"]), 0.01, atol=1e-6)
        self.assertEqual((len(table["time_s"]), found["ground"]["footsteps"], found["ground"]["changes"]), (found["steps"], judged["footsteps_on_this_ground"], judged["alarms"]))
        for name, interval in judged["parameters"].items():
            np.testing.assert_allclose([found["ground"][name][key] for key in ("low", "median", "high")], [interval[key] for key in ("low", "median", "high")], rtol=1e-4)
        np.testing.assert_allclose([table[f"observation{k}"][-1] for k in (3, 4, 5)], np.array(COMMAND) * [2, 2, 1], rtol=1e-6)
        angle = 0.19 * 6.3  # an arc
        wanted = np.array([[np.sin(angle), np.cos(angle) - 1], [1 - np.cos(angle), np.sin(angle)]]) @ [0.43, -0.07] / 0.19
        np.testing.assert_allclose([there["way_x_m"], there["way_y_m"]], wanted, atol=0.35)
        np.testing.assert_allclose(limits["0.37"], 0.37 * limits["1"], rtol=1e-6)
        for share in ("0", "0.0099", "1.001", "-0.3"):
            self.assertRegex(run("drive", "--torque-share", share, "--listen", "x", code=2), rf"^mild drive: --torque-share: {share} is outside 0\.01 \.\. 1$")


if __name__ == "__main__":
    unittest.main()
