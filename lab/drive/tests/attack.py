#!/usr/bin/env python3
"""Attacks on `mild drive` over loopback, each of which must end as lab/drive/README.md says: strangers, damaged packets, a runner
that loses its terminal. Glitches, replays and other sessions have their tests in C.

Usage: attack.py PATH_TO_MILD [--seed S] [--packets N] [--only NAME]

--packets: how many damaged packets. The runner walks in real time: a case that fails is tried up to three times, because a busy
machine may hold up the robot. Prints a line for each case, and exits with 1 when one of them failed.
"""

import argparse
import math
import os
import pathlib
import pty
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time

from robot import DAMP, HEAD, POSE, SA01, WALK, Robot, Runner, modes, seal

CASES = []


def case(function):
    CASES.append(function)
    return function


def check(true, text):
    if not true:
        raise AssertionError(text)


def start(*options, **how):
    """A runner, and a robot that walks on it."""
    runner = Runner(MILD, *options, **how)
    robot = Robot(runner.port).start()
    return runner, robot


def quiet_end(runner):
    """Ends a runner that must not have damped."""
    check(runner.alive(), "the runner has ended")
    code, report, err = runner.end(signal.SIGINT)
    check(code == 0 and report["why_damped"] == "", err)
    return report


def asked(t, q):
    """The largest share of a joint's torque limit that a target asks for, at rest at q."""
    return max(kp * abs(x - at) / limit for x, at, kp, limit in zip(t["angle"], q, t["kp"], t["limit"]))


# ---- strangers ----


@case
def the_peer_is_named():
    runner = Runner(MILD, "--peer", "127.0.0.2")
    robot = Robot(runner.port)
    robot.walk(40)
    code, report, err = runner.end(signal.SIGINT)
    check(code == 0 and report["strangers"] == 40 and not robot.targets, f"{report['strangers']} {robot.targets}")
    robot = Robot(0)
    runner = Runner(MILD, "--peer", f"127.0.0.1:{robot.socket.getsockname()[1]}")
    robot.to = ("127.0.0.1", runner.port)
    other = Robot(runner.port)
    other.walk(40)
    robot.start()
    report = quiet_end(runner)
    check(report["strangers"] == 40 and not other.targets, f"{report['strangers']}")
    return "no other host, no other port"


@case
def targets_of_a_stranger():
    """A simulated robot takes targets of its runner alone, and nobody outside this machine can send any."""
    heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    heard.bind(("127.0.0.1", 0))
    heard.settimeout(60)
    port = heard.getsockname()[1]
    command = [MILD, "drive", "--simulate", "--connect", f"127.0.0.1:{port}", "--seconds", "2", "--patience", "3"]
    robot = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    packet, address = heard.recvfrom(4096)
    session = HEAD.unpack(packet[: HEAD.size])[8]
    stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    table = pathlib.Path("/proc/net/udp").read_text(encoding="ascii")
    local = [line.split()[1] for line in table.splitlines()[1:] if line.split()[1].endswith(f":{address[1]:04X}")]
    for i in range(300):
        head = HEAD.pack(b"MILD", 2, 2, 12, 1, i + 1, 1, 0, 9, session, SA01)
        floats = [3.0] * 12 + [200.0] * 12 + [1.0] * 12 + [100.0] * 12
        stranger.sendto(seal(head + struct.pack("<48f", *floats)), address)
        time.sleep(0.002)
    out, err = robot.communicate(timeout=60)
    check(robot.returncode == 2 and "no answer from" in err, f"{robot.returncode} {out} {err}")
    check(local == [f"0100007F:{address[1]:04X}"], f"bound to {local}")
    elsewhere = subprocess.run([MILD, "drive", "--simulate", "--connect", "192.0.2.1:9870"], capture_output=True, text=True, check=False)
    check(elsewhere.returncode == 2 and "--bind HOST" in elsewhere.stderr, elsewhere.stderr)
    return "300 of 300 not heard; bound to loopback"


# ---- damaged packets ----


def damage(packet):
    b = bytearray(packet)
    for _ in range(RANDOM.randint(1, 6)):
        kind, at = RANDOM.randrange(6), RANDOM.randrange(max(1, len(b)))
        if kind == 0 and b:
            b[at] = RANDOM.randrange(256)
        elif kind == 1:
            b = b[:at]
        elif kind == 2:
            b += RANDOM.randbytes(RANDOM.randint(1, 300))
        elif kind == 3 and len(b) > HEAD.size + 4:
            b[-4:] = seal(bytes(b[:-4]))[-4:]
        elif kind == 4 and len(b) > HEAD.size + 4:
            b[RANDOM.randrange(HEAD.size)] = RANDOM.randrange(256)
            b[-4:] = seal(bytes(b[:-4]))[-4:]
        elif len(b) >= HEAD.size + 8:
            wild = RANDOM.choice([math.nan, math.inf, -1e38, 1e6, 1e-40, 1e7])
            struct.pack_into("<f", b, HEAD.size + 4 * RANDOM.randrange((len(b) - HEAD.size - 4) // 4), wild)
            b[-4:] = seal(bytes(b[:-4]))[-4:]
    return bytes(b)


def bad_packet(robot):
    """One that is never good: damaged, or as good as the state of the robot itself."""
    good = robot.state()
    while (bad := damage(good)) == good:
        pass
    return bad


@case
def damaged_packets_before_a_robot():
    runner = Runner(MILD)
    sender = Robot(runner.port, answers=False)
    count = ARGS.packets // 2
    for i in range(count):
        sender.send(bad_packet(sender))
        if i % 100 == 0:
            time.sleep(0.002)
    sender.listen()
    check(runner.alive(), "the runner has ended")
    check(sender.bytes_in < 0.01 * sender.bytes_out, f"{sender.bytes_in} bytes for {sender.bytes_out}")
    Robot(runner.port).start()
    report = quiet_end(runner)
    reasons = {name: n for name, n in report["refused"].items() if n}
    return f"{count} packets, {sender.bytes_in} bytes back; refused {reasons}"


@case
def damaged_packets_while_it_walks():
    """From a stranger and from the robot's own address. One of the latter with a right checksum may put the counter far ahead: that damps,
    and the next runner gets the rest."""
    count, sent, refused, steps, damped, worst = ARGS.packets // 2, 0, 0, 0, 0, 0
    while sent < count:
        runner, robot = start("--glitch", "10", "--damp-after", "0.3")
        stranger = Robot(runner.port, answers=False)
        mode = WALK
        while sent < count and mode != DAMP:
            for _ in range(10):
                stranger.send(bad_packet(stranger))
                robot.send(bad_packet(robot))
            sent += 20
            for t in robot.walk(1):
                mode = t["mode"]
                worst = max(worst, asked(t, POSE) if mode == WALK else 0)
        code, report, err = runner.end(signal.SIGINT)
        check(code in (0, 2) and report["end"] in ("signal", "damped", "robot") and stranger.listen() == [], f"{code} {err}")
        refused, steps = refused + sum(report["refused"].values()), steps + report["steps"]
        damped += code == 2
    check(steps > 10 and worst < 0.99, f"{steps} steps, {worst:.2f} of a torque limit")
    return f"{sent} packets, {refused} refused, {steps} steps, at most {worst:.2f} of a torque limit; {damped} runners damped"


# ---- the runner itself ----


@case
def a_broken_pipe():
    reading, writing = os.pipe()
    runner, robot = start(stdout=writing)
    os.close(writing)
    os.close(reading)
    runner.process.stderr.close()
    runner.process.send_signal(signal.SIGINT)
    code = runner.process.wait(60)
    got = robot.listen()
    check(code == 2 and runner.json.exists() and got[-1]["mode"] == 4, f"{code} {modes(got)}")
    return "an end, the report as JSON, exit 2"


@case
def a_terminal():
    """Restored after a signal; one that hangs up stops the robot."""
    for by in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT):
        ours, theirs = pty.openpty()
        before = termios.tcgetattr(theirs)
        runner = subprocess.Popen(
            [MILD, "drive", "--listen", "127.0.0.1:0"],
            stdin=theirs,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
        )
        runner.stderr.readline()
        check(termios.tcgetattr(theirs) != before, "no keys")
        runner.send_signal(by)
        check(runner.wait(60) == 0, f"{by.name}: exit {runner.returncode}")
        check(termios.tcgetattr(theirs) == before, f"{by.name}: the terminal is not as before")
        os.close(ours)
        os.close(theirs)
    return "restored after TERM, HUP, INT, QUIT"


def attempt(function):
    """A busy machine may stall the runner in a case that does not ask for it."""
    for k in range(3):
        try:
            return True, function()
        except (AssertionError, IndexError, ValueError, subprocess.TimeoutExpired) as failure:
            text = f"{type(failure).__name__}: {failure}"
    return False, text


def main():
    failures = 0
    for function in CASES:
        if ARGS.only and ARGS.only not in function.__name__:
            continue
        good, text = attempt(function)
        failures += not good
        print(f"{'ok  ' if good else 'FAIL'} {function.__name__}: {text}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mild")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--packets", type=int, default=2000)
    parser.add_argument("--only", help="cases whose name contains this")
    ARGS = parser.parse_args()
    MILD = os.path.abspath(ARGS.mild)
    RANDOM = random.Random(ARGS.seed)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        sys.exit(main())
