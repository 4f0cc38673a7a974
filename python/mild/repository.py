"""The commands `mild judge` (lab/grains/README.md) and `mild bench record` (lab/bench/README.md): scripts of the repository, whose grains' records
and robots of others are too large for a wheel."""
import os
import pathlib
import runpy
import sys

from . import _processor

SCRIPTS = {("judge",): "lab/grains/judge.py", ("bench", "record"): "lab/bench/record.py"}


def command_of(arguments):
    """The words with which a command of this module begins, or None."""
    return next((command for command in SCRIPTS if tuple(arguments[: len(command)]) == command), None)


def repository(script):
    """The repository that MILD_HOME names, that this package was built in, or that holds the working directory; None: none has the script."""
    here = pathlib.Path(__file__).resolve()
    homes = [pathlib.Path(os.environ["MILD_HOME"])] if os.environ.get("MILD_HOME") else []
    return next((home for home in (*homes, *here.parents, pathlib.Path.cwd(), *pathlib.Path.cwd().parents)
                 if (home / script).is_file()), None)


def main(arguments):
    """Runs one of SCRIPTS, by the command and its arguments. Returns an exit code."""
    command = command_of(arguments)
    script = SCRIPTS[command]
    home = repository(script)
    if home is None:
        print(f"mild {' '.join(command)}: {script} is in the repository, not in this package; run it in a clone of it, or set "
              "MILD_HOME to one", file=sys.stderr)
        return 2
    program = _processor.program()
    if program:
        os.environ.setdefault("MILD", str(program))  # the program that started this has set it
    sys.argv = [str(home / script), *arguments[len(command) :]]
    sys.path.insert(0, os.path.dirname(sys.argv[0]))
    try:
        runpy.run_path(sys.argv[0], run_name="__main__")
    except SystemExit as error:
        return error.code or 0
    return 0
