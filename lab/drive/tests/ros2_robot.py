"""An SA01 in ROS 2, for test_ros2.py: a child of lab/drive/examples/simulated.py, whose lines of numbers become `/imu/data` and `/joint_states` (the
joints in another order, and one more), and `/mild/targets` the lines that it reads. Usage: ros2_robot.py (a folder with ros2.py on PYTHONPATH)"""
import sys
import time

import ros2
from cyclonedds.core import Policy, Qos
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from dds import came, connect

NAMES = [f"leg_{side}{i}_joint" for side in "lr" for i in range(1, 7)]
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))  # ROS 2's default


def main():
    participant = connect("lo", 7)
    joints = DataWriter(participant, Topic(participant, "rt/joint_states", ros2.JointState), RELIABLE)
    imus = DataWriter(participant, Topic(participant, "rt/imu/data", ros2.Imu), RELIABLE)
    wanted = DataReader(participant, Topic(participant, "rt/mild/targets", ros2.Float64MultiArray), RELIABLE)
    target = None
    for count, line in enumerate(sys.stdin):
        n = [float(word) for word in line.split()]
        header = ros2.Header(ros2.Time(count // 100, count % 100 * 10000000), "base")
        imus.write(ros2.Imu(header, ros2.Quaternion(*n[1:4], n[0]), [0.0] * 9, ros2.Vector3(*n[4:7]), [0.0] * 9, ros2.Vector3(0.0, 0.0, 9.81), [0.0] * 9))
        came(wanted)  # what is late is not this state's answer
        time.sleep(0.001)
        joints.write(ros2.JointState(header, NAMES[::-1] + ["neck"], n[18:6:-1] + [0.5], n[30:18:-1] + [0.1], []))
        until = time.monotonic() + (5 if target else 0.02)
        new = None
        while not new and time.monotonic() < until:
            new = came(wanted)
            time.sleep(0.0005)
        if new:
            assert [d.size for d in new[-1].layout.dim] == [4, 12]
            target = list(new[-1].data)
        print(*target or [], flush=True)


main()
