#!/usr/bin/env python3
"""lab/drive/examples/ros2.py: four processes, mild drive, the bridge, ROS 2's messages over DDS, and an SA01 in MuJoCo on loose sand, in lockstep;
and the messages by another codec of ROS 2's, that of rosbags. Needs both packages (`make dds-check`). Usage: test_ros2.py PATH_TO_MILD"""
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
import ros2  # noqa: E402


class Bridge(unittest.TestCase):
    def test_messages(self):
        """Their bytes say the same to rosbags, and the names are those of ROS 2's on the wire."""
        from rosbags.typesys import Stores, get_typestore
        store = get_typestore(Stores.ROS2_HUMBLE)
        header = ros2.Header(ros2.Time(3, 4), "base")
        state = ros2.JointState(header, ["a", "bc"], [1.5, 2.5], [3.5, 4.5], [])
        theirs = store.deserialize_cdr(state.serialize(), "sensor_msgs/msg/JointState")
        self.assertEqual((theirs.header.stamp.sec, theirs.header.stamp.nanosec, theirs.header.frame_id), (3, 4, "base"))
        self.assertEqual((theirs.name, list(theirs.position), list(theirs.velocity), list(theirs.effort)), (["a", "bc"], [1.5, 2.5], [3.5, 4.5], []))
        back = ros2.JointState.deserialize(bytes(store.serialize_cdr(theirs, "sensor_msgs/msg/JointState")))
        self.assertEqual(back, state)
        imu = ros2.Imu(header, ros2.Quaternion(0.1, 0.2, 0.3, 0.9), [float(i) for i in range(9)], ros2.Vector3(1.0, 2.0, 3.0), [0.0] * 9,
                       ros2.Vector3(4.0, 5.0, 6.0), [7.0] * 9)
        theirs = store.deserialize_cdr(imu.serialize(), "sensor_msgs/msg/Imu")
        self.assertEqual((theirs.orientation.w, theirs.orientation.x, theirs.angular_velocity.z, theirs.linear_acceleration.y), (0.9, 0.1, 3.0, 5.0))
        self.assertEqual((list(theirs.orientation_covariance), list(theirs.linear_acceleration_covariance)), (list(map(float, range(9))), [7.0] * 9))
        made = ros2.targets([float(i) for i in range(48)])
        theirs = store.deserialize_cdr(made.serialize(), "std_msgs/msg/Float64MultiArray")
        self.assertEqual(list(theirs.data), [float(i) for i in range(48)])
        self.assertEqual([(d.label, d.size, d.stride) for d in theirs.layout.dim], [("angle kp kd limit", 4, 48), ("joint", 12, 12)])
        for kind in (ros2.JointState, ros2.Imu, ros2.Float64MultiArray):
            self.assertRegex(kind.__idl_typename__.replace(".", "::"), r"^(sensor|std)_msgs::msg::dds_::\w+_$")

    def test_walk(self):
        environment = dict(os.environ, PYTHONPATH=f"{DRIVE}:{os.environ.get('PYTHONPATH', '')}")
        runner = subprocess.Popen([MILD, "drive", "--config", "configs/walk.ini", "--command", "0.5,0,0", "--no-keys", "--listen", "127.0.0.1:0",
                                   "--late", "10", "--damp-after", "20", "--stall-after", "20"], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True)
        port = re.search(r"at 127\.0\.0\.1:(\d+);", runner.stderr.readline()).group(1)
        bridge = subprocess.Popen([sys.executable, str(DRIVE / "ros2.py"), "127.0.0.1", port, "--robot", str(ROOT / "robots/sa01/robot.ini"), "--domain", "7",
                                   "--lockstep"], env=environment, stderr=subprocess.PIPE, text=True)
        robot = subprocess.run([sys.executable, str(DRIVE / "simulated.py"), "--lockstep", "--seconds", "4", "--", sys.executable,
                                str(ROOT / "lab/drive/tests/ros2_robot.py")], env=environment, capture_output=True, text=True, timeout=200, check=False)
        said, report = bridge.communicate(timeout=60)[1], runner.communicate(timeout=60)[0]
        self.assertEqual((robot.returncode, bridge.returncode, runner.returncode), (0, 0, 0), robot.stderr + said)
        way, how = re.search(r"^sand_loose: ([-\d.]+) m in 4\.\d+ s, (\w+)", robot.stdout).groups()
        self.assertEqual(how, "upright", robot.stdout + said + report)
        self.assertGreater(float(way), 1.4)
        self.assertLess(float(way), 2.4)
        self.assertIn("refused 0", report)
        print(robot.stdout.strip(), said.strip())


if __name__ == "__main__":
    unittest.main(verbosity=2)
