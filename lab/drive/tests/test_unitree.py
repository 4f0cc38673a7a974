#!/usr/bin/env python3
"""lab/drive/examples/unitree.py and unitree_go.py: four processes, mild drive, the bridge, the messages of Unitree's SDK2 over DDS, and a G1 or
Go1 in MuJoCo on soft ground; in lockstep. Needs cyclonedds (`make dds-check`). UNITREE_SDK names a folder with Unitree's own package unitree_sdk2py (and fastcrc, if it asks for
that), whose bytes and CRCs are then compared. Usage: test_unitree.py PATH_TO_MILD"""
import os
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
DRIVE = ROOT / "lab/drive/examples"
MILD = str(pathlib.Path(sys.argv.pop(1)).resolve())
sys.path.insert(0, str(DRIVE))
import unitree  # noqa: E402
import unitree_go  # noqa: E402


def walk(seconds, ground, name="g1", bridge="unitree.py", kind=(), **environment):
    environment = dict(os.environ, PYTHONPATH=f"{DRIVE}:{os.environ.get('PYTHONPATH', '')}", **environment)
    runner = subprocess.Popen([MILD, "drive", "--robot", name, "--config", f"configs/{name}.ini", "--command", "0.4,0,0", "--no-keys", "--listen", "127.0.0.1:0",
                               "--late", "10", "--damp-after", "20", "--stall-after", "20"], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
    port = re.search(r"at 127\.0\.0\.1:(\d+);", runner.stderr.readline()).group(1)
    bridge = subprocess.Popen([sys.executable, str(DRIVE / bridge), "127.0.0.1", port, "--lockstep"], env=environment, stderr=subprocess.PIPE, text=True)
    robot = subprocess.run([sys.executable, str(DRIVE / "simulated.py"), "--robot", name, "--lockstep", "--ground", ground, "--seconds", str(seconds), "--",
                            sys.executable, str(ROOT / "lab/drive/tests/unitree_robot.py"), *kind], env=environment, capture_output=True, text=True, timeout=200, check=False)
    said = bridge.communicate(timeout=60)[1]
    report = runner.communicate(timeout=60)[0]
    return robot, bridge.returncode, said, runner.returncode, report


class Bridge(unittest.TestCase):
    def test_crc(self):
        """The check of CRC-32/MPEG-2, whose words are read from their highest byte."""
        text = b"12345678"
        crc = 0xFFFFFFFF
        for byte in text:
            crc ^= byte << 24
            for _ in range(8):
                crc = (crc << 1 ^ 0x04C11DB7 if crc & 0x80000000 else crc << 1) & 0xFFFFFFFF
        self.assertEqual(unitree.crc_of(text[3::-1] + text[:3:-1]), crc)

    @unittest.skipUnless(os.environ.get("UNITREE_SDK"), "UNITREE_SDK names no folder")
    def test_sdk(self):
        """The same bytes on the wire as by Unitree's own classes, and the same CRCs."""
        sys.path.insert(0, os.environ["UNITREE_SDK"])
        from unitree_sdk2py.idl.default import unitree_hg_msg_dds__LowCmd_, unitree_hg_msg_dds__LowState_
        from unitree_sdk2py.utils.crc import CRC
        theirs = unitree_hg_msg_dds__LowCmd_()
        theirs.mode_machine, theirs.reserve = 5, [1, 2, 3, 4]
        for i, m in enumerate(theirs.motor_cmd):
            m.mode, m.q, m.dq, m.tau, m.kp, m.kd, m.reserve = 1, 0.01 * i, 0.5, 0.1, 20.0, 1.5, 7
        ours = unitree.LowCmd(0, 5, [unitree.MotorCmd(**vars(m)) for m in theirs.motor_cmd], theirs.reserve, 0)
        self.assertEqual(theirs.serialize(), ours.serialize())
        self.assertEqual(CRC().Crc(theirs), unitree.command_crc(ours))
        theirs = unitree_hg_msg_dds__LowState_()
        theirs.tick, theirs.version, theirs.wireless_remote, theirs.reserve = 99, [3, 4], list(range(40)), [9, 8, 7, 6]
        theirs.imu_state.quaternion, theirs.imu_state.temperature = [1, 0.1, 0.2, 0.3], -7
        for i, m in enumerate(theirs.motor_state):
            m.q, m.tau_est, m.temperature, m.vol, m.sensor, m.motorstate, m.reserve = 0.01 * i, 2.5, [30, -31], 48.5, [1, 2], 9, [5, 6, 7, 8]
        ours = unitree.LowState(**{**vars(theirs), "imu_state": unitree.Imu(**vars(theirs.imu_state)),
                                   "motor_state": [unitree.MotorState(**vars(m)) for m in theirs.motor_state]})
        self.assertEqual(theirs.serialize(), ours.serialize())
        self.assertEqual(CRC().Crc(theirs), unitree.state_crc(ours))

    @unittest.skipUnless(os.environ.get("UNITREE_SDK"), "UNITREE_SDK names no folder")
    def test_sdk_go(self):
        """The same for the quadrupeds' messages."""
        sys.path.insert(0, os.environ["UNITREE_SDK"])
        from unitree_sdk2py.idl.default import unitree_go_msg_dds__LowCmd_, unitree_go_msg_dds__LowState_
        from unitree_sdk2py.utils.crc import CRC
        theirs = unitree_go_msg_dds__LowCmd_()
        theirs.head, theirs.level_flag, theirs.sn, theirs.version, theirs.bandwidth = [254, 239], 255, [1, 2], [3, 4], 5
        theirs.wireless_remote, theirs.led, theirs.fan, theirs.gpio, theirs.reserve = list(range(40)), list(range(12)), [1, 2], 3, 9
        theirs.bms_cmd.off, theirs.bms_cmd.reserve = 7, [1, 2, 3]
        for i, m in enumerate(theirs.motor_cmd):
            m.mode, m.q, m.dq, m.tau, m.kp, m.kd, m.reserve = 1, 0.01 * i, 0.5, 0.1, 20.0, 1.5, [7, 8, 9]
        ours = unitree_go.LowCmd(**{**vars(theirs), "bms_cmd": unitree_go.BmsCmd(**vars(theirs.bms_cmd)),
                                    "motor_cmd": [unitree_go.MotorCmd(**vars(m)) for m in theirs.motor_cmd]})
        self.assertEqual(theirs.serialize(), ours.serialize())
        self.assertEqual(CRC().Crc(theirs), unitree_go.command_crc(ours))
        theirs = unitree_go_msg_dds__LowState_()
        theirs.tick, theirs.sn, theirs.bandwidth, theirs.wireless_remote, theirs.reserve = 99, [3, 4], 6, list(range(40)), 8
        theirs.foot_force, theirs.foot_force_est, theirs.fan_frequency = [1, -2, 3, -4], [5, 6, 7, 8], [9, 10, 11, 12]
        theirs.bit_flag, theirs.adc_reel, theirs.temperature_ntc1, theirs.temperature_ntc2, theirs.power_v, theirs.power_a = 1, 3.3, 41, 42, 28.5, 1.5
        theirs.imu_state.quaternion, theirs.imu_state.temperature = [1, 0.1, 0.2, 0.3], 77
        power = theirs.bms_state
        power.soc, power.current, power.cycle, power.bq_ntc, power.mcu_ntc, power.cell_vol = 90, -1500, 7, [28, 29], [30, 31], list(range(3900, 3915))
        for i, m in enumerate(theirs.motor_state):
            m.q, m.tau_est, m.q_raw, m.temperature, m.lost, m.reserve = 0.01 * i, 2.5, 0.3, 31, 4, [5, 6]
        ours = unitree_go.LowState(**{**vars(theirs), "imu_state": unitree_go.Imu(**vars(theirs.imu_state)), "bms_state": unitree_go.BmsState(**vars(power)),
                                      "motor_state": [unitree_go.MotorState(**vars(m)) for m in theirs.motor_state]})
        self.assertEqual(theirs.serialize(), ours.serialize())
        self.assertEqual(CRC().Crc(theirs), unitree_go.state_crc(ours))

    def test_walk(self):
        """A G1, and a Go1 behind the messages of a Go2, whose legs are in another order."""
        for given in ((), ("go1", "unitree_go.py", ["go"])):
            robot, code, said, runner, report = walk(4, "rubber", *given)
            self.assertEqual((robot.returncode, code, runner), (0, 0, 0), robot.stderr + said)
            way, how = re.search(r"^rubber: ([-\d.]+) m in 4\.\d+ s, (\w+)", robot.stdout).groups()
            self.assertEqual(how, "upright")
            self.assertGreater(float(way), 0.8)
            self.assertLess(float(way), 2.0)
            self.assertIn("refused 0", report)
            self.assertIn(" 0 damped", report)
            print(robot.stdout.strip(), said.strip())

    def test_wrong_crc(self):
        """States with a wrong CRC are counted and not used."""
        robot, code, said, _, report = walk(1, "rubber", BAD="1")
        self.assertIn("refused 0", report)  # what says that the robot stands on its head is implausible
        self.assertIn("upright", robot.stdout)
        self.assertEqual(code, 2)
        self.assertGreater(int(re.search(r"(\d+) with a wrong CRC", said).group(1)), 5)


if __name__ == "__main__":
    unittest.main(verbosity=2)
