"""The robot's side of `mild drive` (lab/drive/README.md), by Python's standard library: sends what the sensors say, and hands the drives what
the policy asks for.

    python client.py HOST PORT [--lockstep] [--key FILE]

JOINTS, `read` and `write` are yours to write for your robot. Here a robot is a pair of pipes, behind which simulated.py is one."""
import argparse
import hashlib
import math
import os
import socket
import struct
import sys
import time
import zlib

JOINTS = [f"leg_{side}{i}_joint" for side in "lr" for i in range(1, 7)]  # as in robot.ini; numbers are in this order
SILENCE = 0.1  # [s] without a target after which the robot is damped
HEAD = struct.Struct("<4s4BIIQQQI")
WAIT, WALK, HOLD, DAMP, END = range(5)


def read():
    """The next state of the sensors, at 200 Hz or more: quaternion w x y z (base to world), angular velocity in the base's own axes,
    angles, speeds, SI units. None: there is none any more."""
    numbers = [float(word) for word in sys.stdin.readline().split()]
    return numbers or None


def write(target):
    """Torques clip(kp (angle - q) - kd qd, +-limit) until the next call; target: angles, kp, kd, limits. None: stand as you are."""
    print(*target or [], flush=True)


class Client:
    def __init__(self, host, port, joints, key=None):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect((host, port))  # hears that address alone
        self.key, self.n, self.robot = key, len(joints), zlib.crc32("\n".join(joints).encode())
        self.session = int.from_bytes(os.urandom(8), "little") | 1
        self.runner = self.sequence = self.newest = self.answers = 0  # the runner's session, 0: not known yet
        self.mode, self.target, self.heard = WAIT, None, 0.0

    def seal(self, body):
        if self.key:
            return body + hashlib.blake2b(body, key=self.key, digest_size=16).digest()
        return body + struct.pack("<I", zlib.crc32(body))

    def send(self, state, mode=WALK):
        self.sequence = self.sequence + 1 & 0xFFFFFFFF
        head = HEAD.pack(b"MILD", 2, 1, self.n, mode, self.sequence, self.newest, time.monotonic_ns() // 1000, self.session, self.runner, self.robot)
        try:
            self.socket.send(self.seal(head + struct.pack(f"<{7 + 2 * self.n}f", *state)))
        except ConnectionRefusedError:
            pass  # no runner is there yet

    def take(self, packet):
        """Takes a packet if it is a target for this robot and newer than the last one; anything else is left alone."""
        body = packet[: HEAD.size + 16 * self.n]
        if len(body) < HEAD.size + 16 * self.n or self.seal(body) != packet:
            return
        magic, version, kind, n, mode, sequence, answers, _, session, peer, robot = HEAD.unpack_from(body)
        if (magic, version, kind, n, peer, robot) != (b"MILD", 2, 2, self.n, self.session, self.robot) or mode > END:
            return
        if self.runner and (session != self.runner or not 0 < (sequence - self.newest & 0xFFFFFFFF) < 1 << 31):
            return
        numbers = struct.unpack_from(f"<{4 * self.n}f", body, HEAD.size)
        if not all(map(math.isfinite, numbers)) or min(numbers[self.n:]) < 0:
            return
        self.runner, self.newest, self.answers, self.mode = session, sequence, answers, mode
        if mode != WAIT:
            self.target, self.heard = list(numbers), time.monotonic()

    def listen(self, lockstep):
        """Takes what has come. In lockstep it waits for the answer to the newest state: 2 s, or 10 ms while no runner is there."""
        until = time.monotonic() + ((2 if self.runner else 0.01) if lockstep else 0)
        while True:
            answered = self.runner and self.answers == self.sequence
            self.socket.settimeout(0 if answered else max(0, until - time.monotonic()))
            try:
                self.take(self.socket.recv(2048))
            except (BlockingIOError, TimeoutError):
                return
            except ConnectionRefusedError:
                pass

    def wanted(self, patient=False):
        """The newest target, damped when it is old; None: none has come."""
        if self.target and time.monotonic() - self.heard > SILENCE and not patient:
            self.target[self.n : 2 * self.n] = [0.0] * self.n
        return self.target


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("host")
    parser.add_argument("port", type=int)
    parser.add_argument("--lockstep", action="store_true", help="wait for the answer to each state: for a robot whose time stands still meanwhile")
    parser.add_argument("--key", help="the file that the runner has, too")
    given = parser.parse_args()
    client = Client(given.host, given.port, JOINTS, open(given.key, "rb").read() if given.key else None)
    last = [1.0] + [0.0] * (6 + 2 * client.n)
    while client.mode != END and (state := read()):
        last = state
        client.send(state)
        client.listen(given.lockstep)
        write(client.wanted(patient=given.lockstep))
    for _ in range(3):
        client.send(last, END)
    said = "has ended" if client.mode == END else "still runs" if client.runner else "was never there"
    print(f"client: {client.sequence} states sent, the runner {said}", file=sys.stderr)
    sys.exit(0 if client.runner else 2)


if __name__ == "__main__":
    main()
