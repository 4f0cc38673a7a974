"""The command `mild`, and `python -m mild`: the program of this package. `mild trial`, `mild report`, `mild judge` and
`mild bench record` are the package's own (mild.trials, mild.report, mild.repository)."""
import importlib
import os
import signal
import sys

from . import _processor, repository

MODULES = {"trial": "mild.trials", "report": "mild.report"}  # by command; imported when it is asked for


def environment():
    """The environment of the program: where it finds the packages beside it."""
    variables = dict(os.environ, MILD_PYTHON=sys.executable)
    if (_processor.HERE / "data/bin").is_dir():  # a wheel's; the program may be that of mild_cuda
        variables["MILD_HOME"] = variables.get("MILD_HOME") or str(_processor.HERE / "data")  # empty counts as unset, for the program too
    variables["MILD_FFMPEG"] = _processor.ffmpeg() or "ffmpeg"
    return variables


def own(arguments):
    """Runs a command of the package. Returns its exit code; 141, as the program does, when nobody reads its output any more: `mild trial --keys | head`."""
    try:
        try:
            if arguments[0] in MODULES:
                return importlib.import_module(MODULES[arguments[0]]).main(arguments[1:])
            return repository.main(arguments)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the interpreter's own flush
        return 128 + signal.SIGPIPE


def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    if arguments and arguments[0] in MODULES or repository.command_of(arguments):
        return own(arguments)
    program = _processor.program()
    if program is None:
        print("mild: this installation has no program, because libraries of it were missing where it was built; a wheel has it "
              "(docs/install.md)", file=sys.stderr)
        return 2
    sys.stdout.flush()
    os.execve(program, ["mild", *arguments], environment())


if __name__ == "__main__":
    sys.exit(main())
