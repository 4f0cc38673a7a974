#!/usr/bin/env python3
"""mpirun for `mild train` (docs/ranks.md). Usage: scripts/ranks.py MPIRUN_OPTIONS build/mild train ...

Ctrl-C, SIGTERM and SIGHUP save the run and end it, as they do for one process; a second one ends it
at once. mpirun alone would kill the processes a second after the first. So this sends it SIGUSR1,
which it passes on to them. A failure is one line: that of mild, or mpirun's on a process that died."""

import signal
import subprocess
import sys

RULE = "-" * 74
# shared memory of a process that was killed; a pipe to one that has ended, which libevent still asks for
NOISE = ("Read -1, expected", "[warn] Epoll")


def without_frames(lines):
    """Lines of mpirun's standard error, from whose framed texts only `mpirun noticed ...` is kept."""
    frame = None
    for line in lines:
        text = line.rstrip("\n")
        if text == RULE:
            if frame is None:
                frame = []
                continue
            message = "\n".join(frame)
            if message.startswith("mpirun noticed"):
                yield message.replace("\n", " ") + "\n"
            elif "non-zero" not in message and "MPI_ABORT" not in message:  # a mistake in its options, say
                yield message + "\n"
            frame = None
        elif frame is None:
            if not any(text in line for text in NOISE):
                yield line
        else:
            frame.append(text)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    # in a session of its own, so that the terminal's Ctrl-C reaches this process alone
    launcher = subprocess.Popen(["mpirun", "--bind-to", "none", *sys.argv[1:]], stdin=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True, start_new_session=True)
    wanted = [signal.SIGTERM, signal.SIGUSR1]
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: launcher.send_signal(wanted.pop() if wanted else signal.SIGTERM))
    for line in without_frames(launcher.stderr):
        if not line.startswith("mpirun: Forwarding signal"):
            print(line, end="", file=sys.stderr, flush=True)
    code = launcher.wait()
    sys.exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    main()
