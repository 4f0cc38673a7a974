"""The command `mild`, and `python -m mild`: the program of this package. `mild trial`, `mild judge` and
`mild bench record` are the package's own (mild.trials, mild.repository)."""
import importlib
import os
import sys

from . import _processor, repository


def environment():
    """The environment of the program: where it finds the packages beside it."""
    variables = dict(os.environ, MILD_PYTHON=sys.executable)
    if (_processor.HERE / "data/bin").is_dir():  # a wheel's; the program may be that of mild_cuda
        variables["MILD_HOME"] = variables.get("MILD_HOME") or str(_processor.HERE / "data")  # empty counts as unset, for the program too
    variables["MILD_FFMPEG"] = _processor.ffmpeg() or "ffmpeg"
    return variables


def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    if arguments[:1] == ["trial"]:
        return importlib.import_module("mild.trials").main(arguments[1:])
    if repository.command_of(arguments):
        return repository.main(arguments)
    program = _processor.program()
    if program is None:
        print("mild: this installation has no program, because libraries of it were missing where it was built; a wheel has it "
              "(docs/install.md)", file=sys.stderr)
        return 2
    sys.stdout.flush()
    os.execve(program, ["mild", *arguments], environment())


if __name__ == "__main__":
    sys.exit(main())
