"""A bridge between `mild drive` and a robot that speaks the messages of Unitree's SDK2 over DDS: states of `rt/lowstate` go to the
runner, its targets to `rt/lowcmd` (lab/drive/README.md). Needs client.py and dds.py beside it and `pip install cyclonedds`. For the G1, whose legs
are the first twelve of its motors; waist and arms are held where they are at the start.

    python unitree.py HOST PORT [--interface NAME] [--lockstep]

Fields and topics are those of Unitree's public message definitions, unitree_hg (BSD-3-Clause); the text is ours. No robot has walked by it."""
import argparse
import struct
import sys
import time
import zlib
from dataclasses import dataclass

from client import END, Client
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import autoid, final
from cyclonedds.idl.types import array, float32, int16, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from dds import FIRST, SILENT, came, connect

JOINTS = [f"{side}_{name}_joint" for side in ("left", "right") for name in ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")]
LEGS, MOVED, MOTORS = 12, 29, 35
HOLD_KP, HOLD_KD = 60.0, 1.5  # [N m/rad, N m s/rad] of waist and arms


@dataclass
@final
@autoid("sequential")
class Imu(IdlStruct, typename="unitree_hg.msg.dds_.IMUState_"):
    quaternion: array[float32, 4]  # w x y z, base to world
    gyroscope: array[float32, 3]  # in the base's own axes [rad/s]
    accelerometer: array[float32, 3]
    rpy: array[float32, 3]
    temperature: int16


@dataclass
@final
@autoid("sequential")
class MotorState(IdlStruct, typename="unitree_hg.msg.dds_.MotorState_"):
    mode: uint8
    q: float32
    dq: float32
    ddq: float32
    tau_est: float32
    temperature: array[int16, 2]
    vol: float32
    sensor: array[uint32, 2]
    motorstate: uint32
    reserve: array[uint32, 4]


@dataclass
@final
@autoid("sequential")
class LowState(IdlStruct, typename="unitree_hg.msg.dds_.LowState_"):
    version: array[uint32, 2]
    mode_pr: uint8
    mode_machine: uint8
    tick: uint32
    imu_state: Imu
    motor_state: array[MotorState, MOTORS]
    wireless_remote: array[uint8, 40]
    reserve: array[uint32, 4]
    crc: uint32


@dataclass
@final
@autoid("sequential")
class MotorCmd(IdlStruct, typename="unitree_hg.msg.dds_.MotorCmd_"):
    mode: uint8
    q: float32
    dq: float32
    tau: float32
    kp: float32
    kd: float32
    reserve: uint32


@dataclass
@final
@autoid("sequential")
class LowCmd(IdlStruct, typename="unitree_hg.msg.dds_.LowCmd_"):
    mode_pr: uint8
    mode_machine: uint8
    motor_cmd: array[MotorCmd, MOTORS]
    reserve: array[uint32, 4]
    crc: uint32


MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def crc_of(packed):
    """The CRC of the robot's firmware: polynomial 0x04c11db7, over 32-bit words from their highest bit; zlib's is from the lowest."""
    swapped = b"".join(packed[i : i + 4][::-1] for i in range(0, len(packed), 4)).translate(MIRRORED)
    return int(f"{zlib.crc32(swapped) ^ 0xFFFFFFFF:032b}"[::-1], 2)


def command_crc(c):
    """Over the message as C lays it out, without the CRC itself."""
    motors = b"".join(struct.pack("<B3x5fI", m.mode, m.q, m.dq, m.tau, m.kp, m.kd, m.reserve) for m in c.motor_cmd)
    return crc_of(struct.pack("<2B2x", c.mode_pr, c.mode_machine) + motors + struct.pack("<4I", *c.reserve))


def state_crc(s):
    imu = s.imu_state
    head = struct.pack("<2I2B2xI", *s.version, s.mode_pr, s.mode_machine, s.tick)
    head += struct.pack("<13fh2x", *imu.quaternion, *imu.gyroscope, *imu.accelerometer, *imu.rpy, imu.temperature)
    motors = b"".join(struct.pack("<B3x4f2hf2II4I", m.mode, m.q, m.dq, m.ddq, m.tau_est, *m.temperature, m.vol, *m.sensor, m.motorstate, *m.reserve)
                      for m in s.motor_state)
    return crc_of(head + motors + bytes(s.wireless_remote) + struct.pack("<4I", *s.reserve))


def command(state, target, held, answers):
    """The message that asks for what the runner wants, of the machine whose state it was."""
    n = len(target) // 4
    angle, kp, kd = target[:n], target[n : 2 * n], target[2 * n : 3 * n]  # the limits are in the angles already (lab/drive/README.md, section 1)
    damped = not any(kp)
    motors = []
    for i in range(MOTORS):
        if i < LEGS:
            motors.append(MotorCmd(1, angle[i], 0.0, 0.0, kp[i], kd[i], 0))
        else:
            moved = i < MOVED
            motors.append(MotorCmd(int(moved), held[i] if moved else 0.0, 0.0, 0.0, HOLD_KP if moved and not damped else 0.0, HOLD_KD if moved else 0.0, 0))
    made = LowCmd(0, state.mode_machine, motors, [answers, 0, 0, 0], 0)
    made.crc = command_crc(made)
    return made


def numbers_of(state):
    imu, motors = state.imu_state, state.motor_state[:LEGS]
    return [*imu.quaternion, *imu.gyroscope, *(m.q for m in motors), *(m.dq for m in motors)]


def bridge(given, joints, kinds, crc, numbers_of, command):
    """Runs between the messages `kinds` (of states, of commands) and the runner, until one of them ends. crc: of a state. numbers_of: what the
    runner wants of a state. command: see above."""
    participant = connect(given.interface, 0)
    states = DataReader(participant, Topic(participant, "rt/lowstate", kinds[0]))
    commands = DataWriter(participant, Topic(participant, "rt/lowcmd", kinds[1]))
    client, heard, sent, refused = Client(given.host, given.port, joints), time.monotonic() + FIRST - SILENT, 0, 0
    state = held = numbers = None
    while client.mode != END and time.monotonic() - heard < SILENT:
        new = came(states)
        good = [sample for sample in new if sample.crc == crc(sample)]
        refused += len(new) - len(good)
        if good:
            heard, state = time.monotonic(), good[-1]
            held = held or [motor.q for motor in state.motor_state]
            numbers = numbers_of(state)
            client.send(numbers)
        else:
            time.sleep(0.0005)
        client.listen(given.lockstep and bool(good))
        target = client.wanted(patient=given.lockstep)
        if target and (good or client.newest != sent and not given.lockstep):
            sent = client.newest
            commands.write(command(state, target, held, state.tick if given.lockstep else 0))
    for _ in range(3):
        if numbers:
            client.send(numbers, END)
    print(f"unitree: {client.sequence} states, {refused} with a wrong CRC", file=sys.stderr)
    return 0 if client.runner and not refused else 2


def arguments(said):
    parser = argparse.ArgumentParser(description=said, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("host")
    parser.add_argument("port", type=int)
    parser.add_argument("--interface", default="lo", help="network interface of the robot, such as eth0")
    parser.add_argument("--lockstep", action="store_true", help="for a simulated robot whose time stands still until each state is answered")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(bridge(arguments(__doc__), JOINTS, (LowState, LowCmd), state_crc, numbers_of, command))
