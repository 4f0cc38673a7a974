"""A G1, or with the argument `go` a quadruped, that speaks Unitree's messages over DDS, for test_unitree.py: a child of lab/drive/examples/simulated.py, whose lines of numbers become
`rt/lowstate`, and `rt/lowcmd` the lines that it reads. CRCs are computed bit by bit, as the firmware does. BAD=1: before every tenth state
comes another with a wrong one. Usage: unitree_robot.py [go] (a folder with unitree.py on PYTHONPATH)"""
import os
import struct
import sys
import time

import unitree
import unitree_go as go
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


# The quadruped's legs in the order of its motors, by the names of robots/go1/robot.ini.
NAMES = [f"{leg}_{name}_joint" for leg in ("FR", "FL", "RR", "RL") for name in ("hip", "thigh", "calf")]


def go_command_bytes(c):
    packed = struct.pack("<BBBBIIIIHxx", *c.head, c.level_flag, c.frame_reserve, *c.sn, *c.version, c.bandwidth)
    for m in c.motor_cmd:
        packed += struct.pack("<BxxxfffffIII", m.mode, m.q, m.dq, m.tau, m.kp, m.kd, *m.reserve)
    return packed + struct.pack("<BBBB40B12B2BBxI", c.bms_cmd.off, *c.bms_cmd.reserve, *c.wireless_remote, *c.led, *c.fan, c.gpio, c.reserve)


def go_state_bytes(s):
    i, b = s.imu_state, s.bms_state
    packed = struct.pack("<BBBBIIIIHxx", *s.head, s.level_flag, s.frame_reserve, *s.sn, *s.version, s.bandwidth)
    packed += struct.pack("<4f3f3f3fBxxx", *i.quaternion, *i.gyroscope, *i.accelerometer, *i.rpy, i.temperature)
    for m in s.motor_state:
        packed += struct.pack("<BxxxfffffffBxxxIII", m.mode, m.q, m.dq, m.ddq, m.tau_est, m.q_raw, m.dq_raw, m.ddq_raw, m.temperature, m.lost, *m.reserve)
    packed += struct.pack("<BBBBiHBBBB15H", b.version_high, b.version_low, b.status, b.soc, b.current, b.cycle, *b.bq_ntc, *b.mcu_ntc, *b.cell_vol)
    packed += struct.pack("<4h4hI40BBxxx", *s.foot_force, *s.foot_force_est, s.tick, *s.wireless_remote, s.bit_flag)
    return packed + struct.pack("<fBBxxff4HI", s.adc_reel, s.temperature_ntc1, s.temperature_ntc2, s.power_v, s.power_a, *s.fan_frequency, s.reserve)


def go_state_of(numbers, tick):
    order = [go.JOINTS.index(name) for name in NAMES]
    motors = [go.MotorState(1, numbers[7 + i], numbers[19 + i], *[0.0] * 5, 30, 0, [0, 0]) for i in order]
    motors += [go.MotorState(0, *[0.0] * 7, 0, 0, [0, 0]) for _ in range(8)]
    made = go.LowState([254, 239], 255, 0, [0, 0], [0, 0], 0, go.Imu(numbers[:4], numbers[4:7], [0.0] * 3, [0.0] * 3, 40), motors,
                       go.BmsState(1, 2, 3, 90, -1500, 7, [28, 29], [30, 31], [3900] * 15), [20, 21, 22, 23], [0] * 4, tick, [0] * 40, 1, 3.3, 41, 42, 28.5, 1.5,
                       [0] * 4, 0, 0)
    made.crc = firmware_crc(go_state_bytes(made))
    return made


def legs_of(c):
    """The commands of the G1's legs; what they must say is checked."""
    assert c.crc == firmware_crc(command_bytes(c)), "a command with a wrong CRC"
    assert (c.mode_pr, c.mode_machine) == (0, MACHINE)
    assert [m.mode for m in c.motor_cmd] == [1] * 29 + [0] * 6
    assert all(abs(m.q - q) < 1e-6 for m, q in zip(c.motor_cmd[12:29], UPPER, strict=True)), "the arms are not held"
    return c.motor_cmd[:12]


def go_legs_of(c):
    assert c.crc == firmware_crc(go_command_bytes(c)), "a command with a wrong CRC"
    assert (list(c.head), c.level_flag) == ([254, 239], 255)
    assert all((m.kp, m.kd, m.tau) == (0, 0, 0) for m in c.motor_cmd[12:]), "a motor that is not there is commanded"
    return [c.motor_cmd[NAMES.index(name)] for name in go.JOINTS]


def main():
    is_go = sys.argv[1:] == ["go"]
    kinds, state_at, legs_at, effort = ((go, go_state_of, go_legs_of, 23.7) if is_go else (unitree, state_of, legs_of, 139.0))
    participant = connect("lo", 0)
    states = DataWriter(participant, Topic(participant, "rt/lowstate", kinds.LowState))
    commands = DataReader(participant, Topic(participant, "rt/lowcmd", kinds.LowCmd))
    tick, target = 0, None
    for line in sys.stdin:
        tick += 1
        state = state_at([float(word) for word in line.split()], tick)
        if os.environ.get("BAD") and tick % 10 == 0:
            bad = state_at([0.0, 1.0, 0.0, 0.0, *map(float, line.split()[4:])], tick)  # on its head
            bad.crc ^= 1
            states.write(bad)
            time.sleep(0.01)  # a reader keeps the newest one alone
        states.write(state)
        until = time.monotonic() + (5 if target else 0.02)
        while time.monotonic() < until:
            new = came(commands)
            for c in new:
                legs = legs_at(c)
                target = [m.q for m in legs] + [m.kp for m in legs] + [m.kd for m in legs] + [effort] * 12
            if any((c.reserve if is_go else c.reserve[0]) == tick for c in new):
                break
            time.sleep(0.0005)
        print(*target or [], flush=True)


main()
