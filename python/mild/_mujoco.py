"""What is made for one version of MuJoCo: the package's mujoco/VERSION has the engine plugin and the module _envs for it."""
from . import _processor

FOLDER = _processor.folder() / "mujoco"


def folder(name, what):
    """The folder with a file `name` (a pattern) for the MuJoCo that is imported. Raises RuntimeError with the remedy."""
    try:
        import mujoco
    except ImportError as error:
        raise RuntimeError(f"{what}: MuJoCo cannot be imported: {error}; `pip install '{requirement(name)}'`") from error
    version = mujoco.mj_versionString()
    place = FOLDER / version
    if not any(place.glob(name)):
        raise RuntimeError(f"{what}: this package has none for MuJoCo {version}, but for {', '.join(versions(name)) or 'none'}; "
                           f"`pip install '{requirement(name)}'`, or a mild that has one")
    return place


def versions(name):
    """Versions of MuJoCo for which a file `name` is here, oldest first."""
    found = {path.parent.name for path in FOLDER.glob(f"*/{name}")}
    return sorted(found, key=lambda version: [int(number) for number in version.split(".")])


def requirement(name):
    """What pip must install for it."""
    found = versions(name)
    return f"mujoco>={found[0]},<={found[-1]}" if found else "mujoco"
