"""A G1 that speaks Unitree's messages over DDS, for test_unitree.py: a child of examples/drive/simulated.py, whose lines of numbers become
`rt/lowstate`, and `rt/lowcmd` the lines that it reads. CRCs are computed bit by bit, as the firmware does. BAD=1: before every tenth state
comes another with a wrong one. Usage: unitree_robot.py (a folder with unitree.py on PYTHONPATH)"""
import os
import struct
import sys
import time

import unitree
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from dds import came, connect

MACHINE = 5  # what mode_machine says of this robot
UPPER = [0.01 * i for i in range(17)]  # angles of waist and arms


def firmware_crc(packed):
    crc = 0xFFFFFFFF
    for (word,) in struct.iter_unpack("<I", packed):
        bit = 1 << 31
        for _ in range(32):
            crc = (crc << 1 ^ 0x04C11DB7 if crc & 0x80000000 else crc << 1) & 0xFFFFFFFF
            if word & bit:
                crc ^= 0x04C11DB7
            bit >>= 1
    return crc


def command_bytes(c):
    packed = struct.pack("<BBxx", c.mode_pr, c.mode_machine)
    for m in c.motor_cmd:
        packed += struct.pack("<BxxxfffffI", m.mode, m.q, m.dq, m.tau, m.kp, m.kd, m.reserve)
    return packed + struct.pack("<IIII", *c.reserve)


def state_bytes(s):
    i = s.imu_state
    packed = struct.pack("<IIBBxxI", *s.version, s.mode_pr, s.mode_machine, s.tick) + struct.pack("<4f3f3f3fhxx", *i.quaternion, *i.gyroscope, *i.accelerometer,
                                                                                              *i.rpy, i.temperature)
    for m in s.motor_state:
        packed += struct.pack("<BxxxffffhhfIIIIIII", m.mode, m.q, m.dq, m.ddq, m.tau_est, *m.temperature, m.vol, *m.sensor, m.motorstate, *m.reserve)
    return packed + bytes(s.wireless_remote) + struct.pack("<IIII", *s.reserve)


def state_of(numbers, tick):
    motors = [unitree.MotorState(1, *numbers[7 + i : 8 + i], *numbers[19 + i : 20 + i], 0.0, 0.0, [0, 0], 0.0, [0, 0], 0, [0] * 4) for i in range(12)]
    motors += [unitree.MotorState(1, q, 0.0, 0.0, 0.0, [0, 0], 0.0, [0, 0], 0, [0] * 4) for q in UPPER + [0.0] * 6]
    made = unitree.LowState([1, 2], 0, MACHINE, tick, unitree.Imu(numbers[:4], numbers[4:7], [0.0] * 3, [0.0] * 3, 30), motors, [0] * 40, [0] * 4, 0)
    made.crc = firmware_crc(state_bytes(made))
    return made


def main():
    participant = connect("lo", 0)
    states = DataWriter(participant, Topic(participant, "rt/lowstate", unitree.LowState))
    commands = DataReader(participant, Topic(participant, "rt/lowcmd", unitree.LowCmd))
    tick, target = 0, None
    for line in sys.stdin:
        tick += 1
        state = state_of([float(word) for word in line.split()], tick)
        if os.environ.get("BAD") and tick % 10 == 0:
            bad = state_of([0.0, 1.0, 0.0, 0.0, *map(float, line.split()[4:])], tick)  # on its head
            bad.crc ^= 1
            states.write(bad)
            time.sleep(0.01)  # a reader keeps the newest one alone
        states.write(state)
        until = time.monotonic() + (5 if target else 0.02)
        while time.monotonic() < until:
            new = came(commands)
            for c in new:
                assert c.crc == firmware_crc(command_bytes(c)), "a command with a wrong CRC"
                assert (c.mode_pr, c.mode_machine) == (0, MACHINE)
                assert [m.mode for m in c.motor_cmd] == [1] * 29 + [0] * 6
                assert all(abs(m.q - q) < 1e-6 for m, q in zip(c.motor_cmd[12:29], UPPER, strict=True)), "the arms are not held"
                legs = c.motor_cmd[:12]
                target = [m.q for m in legs] + [m.kp for m in legs] + [m.kd for m in legs] + [139.0] * 12
            if any(c.reserve[0] == tick for c in new):
                break
            time.sleep(0.0005)
        print(*target or [], flush=True)


main()
