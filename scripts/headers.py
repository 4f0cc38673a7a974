#!/usr/bin/env python3
"""The C headers of every version of MuJoCo that the engine plugin is built for (docs/plugin.md): plugin/headers.tar.xz.

Usage: scripts/headers.py [--check]
Takes them from the wheels that scripts/mujoco.txt names, with hashes, and writes the archive, or compares it with them.
To support a version: its line into scripts/mujoco.txt, this script, the range in pyproject.toml, `make plugin-check`."""
import io
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
ARCHIVE = ROOT / "plugin/headers.tar.xz"
FOLDER = "mujoco/include/"


def fetch(line, folder):
    """The wheel of a line of scripts/mujoco.txt, for the platform of its hash."""
    pathlib.Path(folder, "line.txt").write_text(line)
    subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps", "--require-hashes",
                    "--only-binary", ":all:", "--python-version", "3.11", "--implementation", "cp", "--platform",
                    "manylinux_2_28_x86_64", "-d", folder, "-r", f"{folder}/line.txt"], check=True)
    return next(pathlib.Path(folder).glob("*.whl"))


def headers(wheel):
    """What <mujoco/mujoco.h> includes, itself first: {name: bytes}."""
    found, wanted = {}, ["mujoco/mujoco.h"]
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        while wanted:
            name = wanted.pop()
            if name not in found and FOLDER + name in names:
                found[name] = archive.read(FOLDER + name)
                wanted += re.findall(r'#include [<"](mujoco/[^>"]+)', found[name].decode())
    return found


def write(files):
    """The same bytes whenever and wherever it runs."""
    with tarfile.open(ARCHIVE, "w:xz", preset=9) as archive:
        for name, content in sorted(files.items()):
            member = tarfile.TarInfo(name)
            member.size, member.mtime = len(content), 1767225600  # 2026-01-01
            archive.addfile(member, io.BytesIO(content))


def main():
    files = {}
    for line in (ROOT / "scripts/mujoco.txt").read_text().splitlines():
        version = line.split()[0].split("==")[1]
        with tempfile.TemporaryDirectory() as folder:
            found = headers(fetch(line, folder))
        files.update((f"{version}/{name}", content) for name, content in found.items())
        print(f"{version}: {len(found)} headers", flush=True)
    if "--check" not in sys.argv:
        write(files)
        return
    with tarfile.open(ARCHIVE) as archive:
        kept = {member.name: archive.extractfile(member).read() for member in archive}
    if kept != files:
        apart = sorted(name for name in {*kept, *files} if kept.get(name) != files.get(name))
        sys.exit(f"headers: {ARCHIVE.name} is not what the wheels have: {', '.join(apart[:3])} ...; run scripts/headers.py")


main()
