"""A robot's side of the packets of lab/drive/README.md, by Python's standard library alone: for attack.py and test_edges.py."""

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


def robot_id():
    """CRC-32 of SA01's joints' names, read from robot.ini by itself."""
    text = (ROOT / "robots/sa01/robot.ini").read_text(encoding="utf-8")
    names = re.search(r"^names\s*=((?:.*\n)(?:[ \t]+.*\n)*)", text, re.M).group(1).split()
    return zlib.crc32("\n".join(names).encode())


SA01 = robot_id()


def seal(body):
    return body + struct.pack("<I", zlib.crc32(body))


def target(packet):
    """The parts of a packet of targets, whose seal must be right."""
    assert seal(packet[:-4]) == packet, "a target with a wrong seal"
    magic, version, kind, n, mode, sequence, answers, clock, session, peer, robot = HEAD.unpack(packet[: HEAD.size])
    assert (magic, version, kind, robot) == (b"MILD", 2, 2, SA01)
    numbers = struct.unpack(f"<{4 * n}f", packet[HEAD.size : -4])
    parts = [numbers[i * n : (i + 1) * n] for i in range(4)]
    return dict(zip(("angle", "kp", "kd", "limit"), parts), mode=mode, sequence=sequence, session=session, peer=peer)


class Robot:
    """A socket that sends states, and answers the runner's session once it has heard it."""

    def __init__(self, port, answers=True):
        self.to = ("127.0.0.1", port)
        self.answers = answers
        self.session = int.from_bytes(os.urandom(8), "little") | 1
        self.peer = self.sequence = self.bytes_in = self.bytes_out = 0
        self.targets = []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)

    def state(self):
        head = HEAD.pack(b"MILD", 2, 1, 12, WALK, self.sequence, 0, int(time.monotonic() * 1e6), self.session, self.peer, SA01)
        flicker = 1e-6 * (self.sequence & 1)  # of the last bits, as real sensors do: what repeats itself damps
        return seal(head + struct.pack("<31f", 1, 0, 0, 0, 0, 0, flicker, *[angle + flicker for angle in POSE], *[0] * 12))

    def send(self, packet):
        self.socket.sendto(packet, self.to)
        self.bytes_out += len(packet)

    def listen(self):
        """The targets that have come since."""
        new = []
        while True:
            try:
                packet = self.socket.recv(65536)
            except (BlockingIOError, ConnectionRefusedError):
                break
            self.bytes_in += len(packet)
            new.append(target(packet))
            if self.answers and self.peer == 0:
                self.peer = new[-1]["session"]
        self.targets += new
        return new

    def walk(self, count):
        """Sends so many states, and returns the targets that came in that time."""
        new = []
        for _ in range(count):
            self.sequence += 1
            self.send(self.state())
            time.sleep(0.005)
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
