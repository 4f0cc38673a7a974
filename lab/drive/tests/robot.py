"""A robot's side of the packets of lab/drive/README.md, by Python's standard library alone: for test_attack.py and attack.py."""

import hashlib
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import time
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[3]
POSE = [0, 0, -0.24, 0.48, -0.24, 0] * 2  # in which SA01 stands
HEAD = struct.Struct("<4s4BIIQQQI")
WAIT, WALK, HOLD, DAMP, END = range(5)


def robot_id(name):
    """CRC-32 of the joints' names, read from robot.ini by itself."""
    text = (ROOT / "robots" / name / "robot.ini").read_text(encoding="utf-8")
    names = re.search(r"^names\s*=((?:.*\n)(?:[ \t]+.*\n)*)", text, re.M).group(1).split()
    return zlib.crc32("\n".join(names).encode())


SA01 = robot_id("sa01")


def seal(body, key=None):
    return body + (hashlib.blake2b(body, key=key, digest_size=16).digest() if key else struct.pack("<I", zlib.crc32(body)))


def target(packet, key=None):
    """The parts of a packet of targets, whose seal must be right."""
    size = 16 if key else 4
    assert seal(packet[:-size], key) == packet, "a target with a wrong seal"
    magic, version, kind, n, mode, sequence, answers, clock, session, peer, robot = HEAD.unpack(packet[: HEAD.size])
    assert (magic, version, kind, robot) == (b"MILD", 2, 2, SA01)
    numbers = struct.unpack(f"<{4 * n}f", packet[HEAD.size : -size])
    parts = [numbers[i * n : (i + 1) * n] for i in range(4)]
    return dict(zip(("angle", "kp", "kd", "limit"), parts), mode=mode, sequence=sequence, session=session, peer=peer)


class Robot:
    """A socket that sends states, and answers the runner's session once it has heard it."""

    def __init__(self, port, key=None, robot=SA01, answers=True):
        self.to = ("127.0.0.1", port)
        self.key, self.robot, self.answers = key, robot, answers
        self.session = int.from_bytes(os.urandom(8), "little") | 1
        self.peer = self.sequence = self.bytes_in = self.bytes_out = 0
        self.targets, self.sent = [], []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)

    def state(self, sequence=None, clock=None, q=None, qd=None, quaternion=(1, 0, 0, 0), omega=(0, 0, 0), mode=WALK, n=12, version=2):
        clock = int((time.monotonic() if clock is None else clock) * 1e6) & (2**64 - 1)
        sequence = self.sequence if sequence is None else sequence
        head = HEAD.pack(b"MILD", version, 1, n, mode, sequence & 0xFFFFFFFF, 0, clock, self.session, self.peer, self.robot)
        flicker = 1e-6 * (sequence & 1)  # of the last bits, as real sensors do: what repeats itself damps
        q, qd = [angle + flicker for angle in (q or POSE)[:n]], (qd or [0] * 12)[:n]
        return seal(head + struct.pack(f"<{7 + 2 * n}f", *quaternion, *omega[:2], omega[2] + flicker, *q, *qd), self.key)

    def send(self, packet):
        self.socket.sendto(packet, self.to)
        self.bytes_out += len(packet)
        self.sent.append(packet)

    def listen(self):
        """The targets that have come since."""
        new = []
        while True:
            try:
                packet = self.socket.recv(65536)
            except (BlockingIOError, ConnectionRefusedError):
                break
            self.bytes_in += len(packet)
            new.append(target(packet, self.key))
            if self.answers and self.peer == 0:
                self.peer = new[-1]["session"]
        self.targets += new
        return new

    def walk(self, count, period=0.005, **changes):
        """Sends so many states, with `changes`, and returns the targets that came in that time."""
        new = []
        for _ in range(count):
            self.sequence += 1
            self.send(self.state(**changes))
            time.sleep(period)
            new += self.listen()
        return new

    def start(self, timeout=30):
        """Walks until the runner does."""
        until = time.monotonic() + timeout
        while not any(t["mode"] == WALK for t in self.walk(1)):
            assert time.monotonic() < until, "the runner does not walk"
        return self


class Runner:
    """A process of `mild drive`, by default with so much patience that a busy machine does not damp the robot."""

    count = 0

    def __init__(self, mild, *options, patience=("--damp-after", "1", "--late", "1", "--stall-after", "20"), **how):
        Runner.count += 1
        pairs = zip(patience[::2], patience[1::2])
        patience = [text for pair in pairs if pair[0] not in options for text in pair]  # an option is given once
        self.json = pathlib.Path(f"runner{Runner.count}.json")
        self.process = subprocess.Popen(
            [mild, "drive", "--no-keys", "--listen", "127.0.0.1:0", "--json", str(self.json), *patience, *options],
            stdin=subprocess.DEVNULL,
            stdout=how.pop("stdout", subprocess.PIPE),
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
            **how,
        )
        self.line = self.process.stderr.readline()
        self.port = int(re.search(r"at 127\.0\.0\.1:(\d+);", self.line).group(1))

    def alive(self):
        return self.process.poll() is None

    def end(self, by=None):
        """Its exit code, its report, and what it said."""
        if by and self.alive():
            self.process.send_signal(by)
        out, err = self.process.communicate(timeout=60)
        report = json.loads(self.json.read_text(encoding="utf-8"))
        return self.process.returncode, report, err


def modes(targets):
    """How many targets of each mode."""
    names = ("wait", "walk", "hold", "damp", "end")
    return {name: count for i, name in enumerate(names) if (count := sum(t["mode"] == i for t in targets))}
