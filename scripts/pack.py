#!/usr/bin/env python3
"""Data of many small files as one archive, and the way to read it: no file of it needs to be unpacked.

    scripts/pack.py lab/grains/records.tar.xz out/records           all below the folder goes in; what has the same name is replaced
    scripts/pack.py tests/fuzz/corpus.tar.xz/solve found_rows   a file goes into a folder of the archive
    scripts/pack.py --new ARCHIVE FOLDER                        what the archive had is dropped
    scripts/pack.py --check ARCHIVE...                          against the hashes in it

SHA256SUMS in an archive has the hash of every other file, as sha256sum writes it. The same files make the same archive."""
import argparse
import errno
import fnmatch
import functools
import hashlib
import io
import lzma
import pathlib
import sys
import tarfile

END, SUMS = ".tar.xz", "SHA256SUMS"
TIME = 1767225600  # 2026-01-01


def fail(text):
    print(f"pack.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- reading ----

def opened(path):
    """pathlib's path of a file or folder, or one that is read alike from an archive: lab/grains/records.tar.xz/sand."""
    path = pathlib.Path(path)
    archive, _ = split(path)
    if archive is None or not archive.is_file():
        return path
    contents(archive)
    return Inside(path)


def split(path):
    """The archive that a path goes through and the name in it; None and "": it goes through none."""
    archive = next((part for part in (path, *path.parents) if part.name.endswith(END)), None)
    return archive and pathlib.Path(archive), path.relative_to(archive).as_posix() if archive else ""


@functools.lru_cache
def contents(archive):
    """{name: bytes}."""
    try:
        with tarfile.open(archive, "r:xz") as file:
            return {member.name: file.extractfile(member).read() for member in file if member.isfile()}
    except (OSError, EOFError, lzma.LZMAError, tarfile.TarError) as error:
        fail(f"{archive} cannot be read ({error}): git checkout {archive}, or make it by scripts/pack.py --new")


class Inside(pathlib.PurePosixPath):
    """A path through an archive, with those parts of pathlib.Path that readers use."""

    def read_text(self, encoding="utf-8"):
        archive, name = split(self)
        if name not in contents(archive):
            raise FileNotFoundError(errno.ENOENT, "not in the archive", str(self))
        return contents(archive)[name].decode(encoding)

    def is_dir(self):
        archive, name = split(self)
        return name == "." or any(other.startswith(name + "/") for other in contents(archive))

    def exists(self):
        archive, name = split(self)
        return name in contents(archive) or self.is_dir()

    def glob(self, pattern):
        """Of files."""
        archive, name = split(self / pattern)
        return [Inside(archive / other) for other in contents(archive) if other.count("/") == name.count("/") and fnmatch.fnmatchcase(other, name)]


# ---- writing ----

def sums(files):
    return "".join(f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files) if name != SUMS).encode()


def write(archive, files):
    """The same bytes whenever and wherever it runs. 6: as small as 9 for 8 MB, and a tenth of the memory."""
    files = {**files, SUMS: sums(files)}
    part = archive.with_name(archive.name + ".part")
    with tarfile.open(part, "w:xz", format=tarfile.USTAR_FORMAT, preset=6 | lzma.PRESET_EXTREME) as file:
        for name in sorted(files):
            member = tarfile.TarInfo(name)
            member.size, member.mtime = len(files[name]), TIME
            file.addfile(member, io.BytesIO(files[name]))
    part.replace(archive)


def found(path):
    """(name, bytes) of a file, or of all files below a folder."""
    if path.is_dir():
        yield from ((file.relative_to(path).as_posix(), file.read_bytes()) for file in path.rglob("*") if file.is_file())
    elif path.is_file():
        yield path.name, path.read_bytes()
    else:
        fail(f"{path} is not there: it must be a file or folder to put into the archive")


def check(archive):
    files = contents(archive)
    wanted = dict(reversed(line.split("  ", 1)) for line in files.get(SUMS, b"").decode().splitlines())
    wrong = sorted(name for name in {*files, *wanted} - {SUMS} if name not in files or hashlib.sha256(files[name]).hexdigest() != wanted.get(name))
    if wrong or SUMS not in files:
        fail(f"{archive}: {wrong[0] if wrong else SUMS} is not as {SUMS} in it has it: git checkout {archive}")
    print(f"{archive}: {len(wanted)} files")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--new", action="store_true", help="begin with an empty archive")
    parser.add_argument("--check", action="store_true", help="only compares")
    parser.add_argument("archive", type=pathlib.Path, help="FILE.tar.xz, or a folder in it")
    parser.add_argument("paths", nargs="*", type=pathlib.Path, metavar="PATH")
    args = parser.parse_args()
    archive, folder = split(args.archive)
    if archive is None:
        fail(f"{args.archive}: an archive's name ends with {END}")
    if args.check:
        for each in (archive, *args.paths):
            check(each)
        return
    files = {} if args.new or not archive.exists() else dict(contents(archive))
    for path in args.paths:
        files.update(((pathlib.PurePosixPath(folder) / name).as_posix(), content) for name, content in found(path))
    write(archive, files)
    print(f"{archive}: {len(files) - (SUMS in files)} files, {archive.stat().st_size} bytes")


if __name__ == "__main__":
    main()
