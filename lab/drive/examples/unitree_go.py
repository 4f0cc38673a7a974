"""As unitree.py, for Unitree's quadrupeds that speak SDK2: Go2, B2. Their messages, unitree_go, are others than the G1's; their legs are in
another order (FR FL RR RL) than the policy's (FL FR RL RR). Needs unitree.py, client.py and dds.py beside it and `pip install cyclonedds`.

    python unitree_go.py HOST PORT [--interface NAME] [--lockstep]

The policy must be of the robot: the shipped one is of the Go1, which is smaller than the Go2 and itself speaks no DDS. Fields and topics are
those of Unitree's public message definitions, unitree_go (BSD-3-Clause); the text is ours. No robot has walked by it."""
import struct
import sys
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import autoid, final
from cyclonedds.idl.types import array, float32, int16, int32, uint8, uint16, uint32
from unitree import arguments, bridge, crc_of

JOINTS = [f"{leg}_{name}_joint" for leg in ("FL", "FR", "RL", "RR") for name in ("hip", "thigh", "calf")]
MOTOR = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]  # of each of JOINTS
MOTORS = 20  # of a message
NO_ANGLE, NO_SPEED = 2.146e9, 16000.0  # what commands have that ask for neither


@dataclass
@final
@autoid("sequential")
class Imu(IdlStruct, typename="unitree_go.msg.dds_.IMUState_"):
    quaternion: array[float32, 4]  # w x y z, base to world
    gyroscope: array[float32, 3]  # in the base's own axes [rad/s]
    accelerometer: array[float32, 3]
    rpy: array[float32, 3]
    temperature: uint8


@dataclass
@final
@autoid("sequential")
class MotorState(IdlStruct, typename="unitree_go.msg.dds_.MotorState_"):
    mode: uint8
    q: float32
    dq: float32
    ddq: float32
    tau_est: float32
    q_raw: float32
    dq_raw: float32
    ddq_raw: float32
    temperature: uint8
    lost: uint32
    reserve: array[uint32, 2]


@dataclass
@final
@autoid("sequential")
class BmsState(IdlStruct, typename="unitree_go.msg.dds_.BmsState_"):
    version_high: uint8
    version_low: uint8
    status: uint8
    soc: uint8
    current: int32
    cycle: uint16
    bq_ntc: array[uint8, 2]
    mcu_ntc: array[uint8, 2]
    cell_vol: array[uint16, 15]


@dataclass
@final
@autoid("sequential")
class LowState(IdlStruct, typename="unitree_go.msg.dds_.LowState_"):
    head: array[uint8, 2]
    level_flag: uint8
    frame_reserve: uint8
    sn: array[uint32, 2]
    version: array[uint32, 2]
    bandwidth: uint16
    imu_state: Imu
    motor_state: array[MotorState, MOTORS]
    bms_state: BmsState
    foot_force: array[int16, 4]
    foot_force_est: array[int16, 4]
    tick: uint32
    wireless_remote: array[uint8, 40]
    bit_flag: uint8
    adc_reel: float32
    temperature_ntc1: uint8
    temperature_ntc2: uint8
    power_v: float32
    power_a: float32
    fan_frequency: array[uint16, 4]
    reserve: uint32
    crc: uint32


@dataclass
@final
@autoid("sequential")
class MotorCmd(IdlStruct, typename="unitree_go.msg.dds_.MotorCmd_"):
    mode: uint8
    q: float32
    dq: float32
    tau: float32
    kp: float32
    kd: float32
    reserve: array[uint32, 3]


@dataclass
@final
@autoid("sequential")
class BmsCmd(IdlStruct, typename="unitree_go.msg.dds_.BmsCmd_"):
    off: uint8
    reserve: array[uint8, 3]


@dataclass
@final
@autoid("sequential")
class LowCmd(IdlStruct, typename="unitree_go.msg.dds_.LowCmd_"):
    head: array[uint8, 2]
    level_flag: uint8
    frame_reserve: uint8
    sn: array[uint32, 2]
    version: array[uint32, 2]
    bandwidth: uint16
    motor_cmd: array[MotorCmd, MOTORS]
    bms_cmd: BmsCmd
    wireless_remote: array[uint8, 40]
    led: array[uint8, 12]
    fan: array[uint8, 2]
    gpio: uint8
    reserve: uint32
    crc: uint32


def head_of(m):
    return struct.pack("<4B4IH2x", *m.head, m.level_flag, m.frame_reserve, *m.sn, *m.version, m.bandwidth)


def command_crc(c):
    """Over the message as C lays it out, without the CRC itself."""
    motors = b"".join(struct.pack("<B3x5f3I", m.mode, m.q, m.dq, m.tau, m.kp, m.kd, *m.reserve) for m in c.motor_cmd)
    tail = struct.pack("<4B", c.bms_cmd.off, *c.bms_cmd.reserve) + bytes([*c.wireless_remote, *c.led, *c.fan, c.gpio])
    return crc_of(head_of(c) + motors + tail + struct.pack("<xI", c.reserve))


def state_crc(s):
    imu, power = s.imu_state, s.bms_state
    packed = head_of(s) + struct.pack("<13fB3x", *imu.quaternion, *imu.gyroscope, *imu.accelerometer, *imu.rpy, imu.temperature)
    packed += b"".join(struct.pack("<B3x7fB3x3I", m.mode, m.q, m.dq, m.ddq, m.tau_est, m.q_raw, m.dq_raw, m.ddq_raw, m.temperature, m.lost, *m.reserve)
                       for m in s.motor_state)
    packed += struct.pack("<4BiH4B15H", power.version_high, power.version_low, power.status, power.soc, power.current, power.cycle, *power.bq_ntc,
                          *power.mcu_ntc, *power.cell_vol)
    packed += struct.pack("<8hI", *s.foot_force, *s.foot_force_est, s.tick) + bytes([*s.wireless_remote, s.bit_flag])
    return crc_of(packed + struct.pack("<3xf2B2x2f4HI", s.adc_reel, s.temperature_ntc1, s.temperature_ntc2, s.power_v, s.power_a, *s.fan_frequency, s.reserve))


def numbers_of(state):
    motors = [state.motor_state[i] for i in MOTOR]
    return [*state.imu_state.quaternion, *state.imu_state.gyroscope, *(m.q for m in motors), *(m.dq for m in motors)]


def command(state, target, held, answers):
    """The message that asks for what the runner wants. The motors that this robot has not are asked for nothing."""
    n = len(target) // 4
    motors = [MotorCmd(1, NO_ANGLE, NO_SPEED, 0.0, 0.0, 0.0, [0] * 3) for _ in range(MOTORS)]
    for motor, angle, kp, kd in zip(MOTOR, target[:n], target[n : 2 * n], target[2 * n : 3 * n]):
        motors[motor] = MotorCmd(1, angle, 0.0, 0.0, kp, kd, [0] * 3)
    made = LowCmd([0xFE, 0xEF], 0xFF, 0, [0, 0], [0, 0], 0, motors, BmsCmd(0, [0] * 3), [0] * 40, [0] * 12, [0, 0], 0, answers, 0)
    made.crc = command_crc(made)
    return made


if __name__ == "__main__":
    sys.exit(bridge(arguments(__doc__), JOINTS, (LowState, LowCmd), state_crc, numbers_of, command))
