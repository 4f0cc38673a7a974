"""The command `mild judge`, and `python -m mild judge`: ground models judged by grains (docs/grains.md). It runs scripts/judge.py of
the repository, whose records are too large for a wheel."""
import os
import pathlib
import runpy
import sys

SCRIPT = pathlib.Path("scripts", "judge.py")


def repository():
    """The repository that this package was built in, that MILD_HOME names, or that holds the working directory; None: none."""
    here = pathlib.Path(__file__).resolve()
    homes = [pathlib.Path(os.environ["MILD_HOME"])] if os.environ.get("MILD_HOME") else []
    return next((home for home in (*homes, *here.parents, pathlib.Path.cwd(), *pathlib.Path.cwd().parents)
                 if (home / SCRIPT).is_file() and (home / "grains" / "records").is_dir()), None)


def main(arguments=None):
    home = repository()
    if home is None:
        print("mild judge: the grains' records are in the repository, not in this package; run it in a clone of it, or set MILD_HOME to one",
              file=sys.stderr)
        return 2
    sys.argv = [str(home / SCRIPT), *(sys.argv[1:] if arguments is None else arguments)]
    sys.path.insert(0, str(home / "scripts"))
    try:
        runpy.run_path(sys.argv[0], run_name="__main__")
    except SystemExit as error:
        return error.code or 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
