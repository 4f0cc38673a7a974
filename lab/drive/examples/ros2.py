"""A bridge between `mild drive` and a robot in ROS 2, over the same DDS and without ROS 2 here (lab/drive/README.md): `/joint_states`
(sensor_msgs/JointState, joints by name) with the newest `/imu/data` (sensor_msgs/Imu) goes to the runner, its targets to `/mild/targets`
(std_msgs/Float64MultiArray: angles, kp, kd, torque limits of all joints in a row). Needs client.py and dds.py beside it and `pip install cyclonedds`.

    python ros2.py HOST PORT --robot ROBOT.ini [--interface NAME] [--domain N] [--lockstep]

ROS 2 must use Cyclone DDS or another DDS of the network, and a node of yours applies the targets (lab/drive/README.md, section 3)."""
import argparse
import configparser
import os
import sys
import time
from dataclasses import dataclass

from client import END, Client
from cyclonedds.core import Policy, Qos
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from dds import FIRST, SILENT, came, connect
from cyclonedds.util import duration

IMU_AGE = 0.02  # [s] at most, of the IMU's message beside the joints'


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Imu(IdlStruct, typename="sensor_msgs.msg.dds_.Imu_"):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class Dimension(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
class Layout(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayLayout_"):
    dim: sequence[Dimension]
    data_offset: uint32


@dataclass
class Float64MultiArray(IdlStruct, typename="std_msgs.msg.dds_.Float64MultiArray_"):
    layout: Layout
    data: sequence[float64]


SENSORS = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(4))  # hears writers of either kind
TARGETS = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(1))


def targets(target):
    n = len(target) // 4
    rows = [Dimension("angle kp kd limit", 4, 4 * n), Dimension("joint", n, n)]
    return Float64MultiArray(Layout(rows, 0), target)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("host")
    parser.add_argument("port", type=int)
    parser.add_argument("--robot", required=True, help="robot.ini, whose joints are asked for by name")
    parser.add_argument("--interface", default="lo", help="network interface of the robot, such as eth0")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    parser.add_argument("--lockstep", action="store_true", help="for a simulated robot whose time stands still until each state is answered")
    given = parser.parse_args()
    ini = configparser.ConfigParser(inline_comment_prefixes=";")
    ini.read(given.robot)
    joints = ini["joints"]["names"].split()
    participant = connect(given.interface, given.domain)
    states = DataReader(participant, Topic(participant, "rt/joint_states", JointState), SENSORS)
    imus = DataReader(participant, Topic(participant, "rt/imu/data", Imu), SENSORS)
    writer = DataWriter(participant, Topic(participant, "rt/mild/targets", Float64MultiArray), TARGETS)
    client, heard, sent, left_out = Client(given.host, given.port, joints), time.monotonic() + FIRST - SILENT, 0, 0
    numbers = imu = imu_time = None
    while client.mode != END and time.monotonic() - heard < SILENT:
        for imu in came(imus):
            imu_time = time.monotonic()
        good = False
        for state in came(states)[-1:]:
            at = {name: i for i, name in enumerate(state.name)}
            good = set(joints) <= set(at) and len(state.velocity) == len(state.position) == len(state.name) and imu is not None
            good = good and (given.lockstep or time.monotonic() - imu_time < IMU_AGE)
            left_out += not good
        if good:
            heard, q, w = time.monotonic(), imu.orientation, imu.angular_velocity
            numbers = [q.w, q.x, q.y, q.z, w.x, w.y, w.z, *(state.position[at[name]] for name in joints), *(state.velocity[at[name]] for name in joints)]
            client.send(numbers)
        else:
            time.sleep(0.0005)
        client.listen(given.lockstep and good)
        target = client.wanted(patient=given.lockstep)
        if target and (good or client.newest != sent and not given.lockstep):
            sent = client.newest
            writer.write(targets(target))
    for _ in range(3):
        if numbers:
            client.send(numbers, END)
    print(f"ros2: {client.sequence} states, {left_out} without an IMU or a joint", file=sys.stderr)
    sys.exit(0 if client.runner else 2)


if __name__ == "__main__":
    main()
