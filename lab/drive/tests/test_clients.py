#!/usr/bin/env python3
"""The clients of `mild drive`, lab/drive/examples/client.c and client.py: their packets, what they refuse, and a walk on sand between three
processes: runner, client, and the simulated robot of lab/drive/examples/simulated.py. In lockstep, so that a busy machine only makes it
slower. Usage: test_clients.py PATH_TO_MILD [TEST...]; with the package mild on PYTHONPATH."""
import hashlib
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "lab/drive/examples"
MILD = str(pathlib.Path(sys.argv.pop(1)).resolve())
WORK = tempfile.TemporaryDirectory()
KEY = pathlib.Path(WORK.name) / "key"
CLIENTS = {"c": [f"{WORK.name}/client"], "python": [sys.executable, str(EXAMPLES / "client.py")]}
STATE = [1, 0, 0, 0, 0.1, 0.2, 0.3, *[0.01 * i for i in range(12)], *[-0.5 * i for i in range(12)]]


def robot_id():
    text = (ROOT / "robots/sa01/robot.ini").read_text(encoding="utf-8")
    names = re.search(r"^names\s*=((?:.*\n)(?:[ \t]+.*\n)*)", text, re.M).group(1).split()
    return zlib.crc32("\n".join(names).encode())


def packet(**changes):
    """A target as lab/drive/README.md has it, from its own table."""
    field = dict(magic=b"MILD", version=2, kind=2, n=12, mode=1, sequence=1, answers=1, clock=5, session=77, peer=0, robot=robot_id(),
                 numbers=[0.1 * i for i in range(48)])
    field.update(changes)
    body = (field["magic"] + bytes([field["version"], field["kind"], field["n"], field["mode"]])
            + struct.pack("<IIQQQI", *[field[name] for name in ("sequence", "answers", "clock", "session", "peer", "robot")])
            + struct.pack("<48f", *field["numbers"]))
    return body + struct.pack("<I", zlib.crc32(body) ^ field.get("damage", 0))


class Talk:
    """A client between this test's pipes and this test's socket."""

    def __init__(self, client, *options):
        self.runner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.runner.bind(("127.0.0.1", 0))
        self.runner.settimeout(20)
        self.process = subprocess.Popen([*CLIENTS[client], "127.0.0.1", str(self.runner.getsockname()[1]), *options], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1)

    def state(self, *targets):
        """The packet of a state; then `targets` are sent, and the line that the client writes behind the next state comes back."""
        self.process.stdin.write(" ".join(map(str, STATE)) + "\n")
        heard, self.address = self.runner.recvfrom(4096)
        self.process.stdout.readline()
        for each in targets:
            self.runner.sendto(each, self.address)
        self.process.stdin.write(" ".join(map(str, STATE)) + "\n")
        self.runner.recvfrom(4096)
        return heard, [float(word) for word in self.process.stdout.readline().split()]

    def end(self):
        self.process.stdin.close()
        ends = [self.runner.recv(4096) for _ in range(3)]
        code = self.process.wait(20)
        for each in (self.process.stdout, self.process.stderr, self.runner):
            each.close()
        return code, ends



class Packets(unittest.TestCase):
    def test_state(self):
        for client in CLIENTS:
            talk = Talk(client)
            heard, line = talk.state()
            head, numbers = heard[:44], heard[44:-4]
            self.assertEqual(len(heard), 172)
            self.assertEqual(head[:8], b"MILD\x02\x01\x0c\x01")
            sequence, answers, clock, session, peer, robot = struct.unpack("<IIQQQI", head[8:])
            self.assertEqual((sequence, answers, peer, robot), (1, 0, 0, robot_id()))
            self.assertLess(abs(clock * 1e-6 - time.monotonic()), 30)
            self.assertNotEqual(session, 0)
            for got, wanted in zip(struct.unpack("<31f", numbers), STATE, strict=True):
                self.assertAlmostEqual(got, wanted, places=6)
            self.assertEqual(struct.unpack("<I", heard[-4:])[0], zlib.crc32(heard[:-4]))
            self.assertEqual(line, [])  # stand
            # the runner's greeting is not applied, and answered with its session
            _, line = talk.state(packet(mode=0, peer=session))
            self.assertEqual(line, [])
            heard, line = talk.state(packet(peer=session, sequence=2, answers=3))
            self.assertEqual(struct.unpack("<Q", heard[32:40])[0], 77)
            for got, wanted in zip(line, [0.1 * i for i in range(48)], strict=True):
                self.assertAlmostEqual(got, wanted, places=6)
            heard, again = talk.state(packet(mode=0, peer=session, sequence=3, numbers=[9.0] * 48))
            self.assertEqual(struct.unpack("<II", heard[8:16]), (7, 2))
            self.assertEqual(again[:12], line[:12])
            code, ends = talk.end()
            self.assertEqual((code, [each[7] for each in ends]), (0, [4, 4, 4]))

    def test_refused(self):
        """Each of these leaves the target that was."""
        for client in CLIENTS:
            talk = Talk(client)
            heard, _ = talk.state()
            peer = struct.unpack("<Q", heard[24:32])[0]
            high, low = [1.0] * 48, [2.0] * 48
            _, line = talk.state(packet(peer=peer, sequence=0xFFFFFFFE, numbers=high))
            self.assertEqual(line[:12] + line[24:], high[12:])
            later = dict(peer=peer, sequence=0xFFFFFFFF, numbers=low)
            for bad in (dict(damage=1), dict(magic=b"MILE"), dict(version=1), dict(kind=1), dict(n=11), dict(mode=5), dict(robot=1), dict(peer=peer + 1),
                        dict(session=78), dict(sequence=0xFFFFFFFE), dict(sequence=0xFFFFFFF0), dict(numbers=[float("nan")] + low[1:]),
                        dict(numbers=low[:12] + [-1.0] + low[13:]), dict(numbers=low[:47] + [-1.0])):
                _, line = talk.state(packet(**{**later, **bad}))
                line[12:24] = high[12:24]  # kp is 0 where this took longer than SILENCE
                self.assertEqual(line, high, (client, bad))
            for cut in (b"", b"MILD", packet(**later)[:-1], packet(**later) + b"\0"):
                _, line = talk.state(cut)
                line[12:24] = high[12:24]
                self.assertEqual(line, high, (client, cut))
            _, line = talk.state(packet(**{**later, "sequence": 5}))  # newer: the counter has passed through 0
            self.assertEqual(line[:12] + line[24:], low[12:])
            self.assertEqual(talk.end()[0], 0)

    def test_silence(self):
        """Damped by itself when no target came for 0.1 s, and not before."""
        for client in CLIENTS:
            talk = Talk(client)
            heard, _ = talk.state()
            for sequence in range(1, 100):  # a busy machine may take longer
                _, line = talk.state(packet(peer=struct.unpack("<Q", heard[24:32])[0], sequence=sequence, numbers=[1.0] * 48))
                if line == [1.0] * 48:
                    break
            self.assertEqual(line, [1.0] * 48)
            time.sleep(0.12)
            _, line = talk.state()
            self.assertEqual(line, [1.0] * 12 + [0.0] * 12 + [1.0] * 24, client)
            talk.end()

    def test_end(self):
        for client in CLIENTS:
            talk = Talk(client)
            heard, _ = talk.state()
            talk.runner.sendto(packet(peer=struct.unpack("<Q", heard[24:32])[0], mode=4), talk.address)
            talk.process.stdin.write(" ".join(map(str, STATE)) + "\n")
            talk.runner.recv(4096)
            self.assertEqual(talk.end()[0], 0)

    def test_nobody(self):
        for client in CLIENTS:
            talk = Talk(client)
            talk.state()
            self.assertEqual(talk.end()[0], 2)

    def test_key(self):
        talk = Talk("python", "--key", str(KEY))
        heard, _ = talk.state()
        self.assertEqual(heard[-16:], hashlib.blake2b(heard[:-16], key=KEY.read_bytes(), digest_size=16).digest())
        _, line = talk.state(packet(peer=struct.unpack("<Q", heard[24:32])[0]))
        self.assertEqual(line, [])
        talk.end()


class Walks(unittest.TestCase):
    def walk(self, client, runner_options=(), client_options=(), seconds=4, kill=False):
        runner = subprocess.Popen([MILD, "drive", "--config", str(ROOT / "configs/walk.ini"), "--command", "0.5,0,0", "--no-keys", "--listen", "127.0.0.1:0",
                                   "--late", "10", "--damp-after", "20", "--stall-after", "20", *runner_options], cwd=WORK.name, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        port = re.search(r"at 127\.0\.0\.1:(\d+);", runner.stderr.readline()).group(1)
        how = [] if kill else ["--lockstep"]
        robot = subprocess.Popen([sys.executable, str(EXAMPLES / "simulated.py"), *how, "--ground", "sand_dense", "--seconds", str(seconds), "--",
                                  *CLIENTS[client], "127.0.0.1", port, *how, *client_options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for process in (robot, runner):
            self.addCleanup(lambda process=process: process.poll() is None and process.kill())
        if kill:
            self.assertIn("the first target has come", robot.stderr.readline())
            time.sleep(0.3)
            runner.send_signal(signal.SIGKILL)
        said, errors = robot.communicate(timeout=120)
        runner_said = runner.communicate(timeout=60)[0]
        return said, errors, runner.returncode, runner_said

    def test_walk(self):
        ways = []
        for client, options in (("c", ()), ("python", ("--key", str(KEY)))):
            said, errors, code, report = self.walk(client, options, options)
            self.assertEqual(code, 0, errors)
            way, seconds, how = re.search(r"^sand_dense: ([-\d.]+) m in ([\d.]+) s, (\w+)", said).groups()
            self.assertEqual((how, round(float(seconds), 1)), ("upright", 4.0), said + errors)
            self.assertGreater(float(way), 1.4)
            self.assertLess(float(way), 2.4)
            self.assertIn("refused 0", report)
            self.assertIn("0 damped", report)
            ways.append(float(way))
        self.assertLess(abs(ways[0] - ways[1]), 0.3)  # the same policy, but each tick is the runner's

    def test_runner_dies(self):
        """In real time: the client damps the robot, which falls in place."""
        for client in CLIENTS:
            said, errors, _, _ = self.walk(client, seconds=30, kill=True)
            self.assertIn("fallen", said, errors)


if __name__ == "__main__":
    with WORK:
        KEY.write_bytes(os.urandom(32))
        KEY.chmod(0o600)
        subprocess.run([os.environ.get("CC", "cc"), "-std=c17", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsanitize=undefined",
                        "-fno-sanitize-recover", str(EXAMPLES / "client.c"), "-o", f"{WORK.name}/client"], check=True)
        unittest.main(verbosity=2)
