"""The program grains and lab/grains/run.py on beds of a few hundred grains: records, manifest, going on, mistakes; archives of records.
test_run.py PROGRAM SOURCE"""
import csv
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile

PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
spec = importlib.util.spec_from_file_location("run", SOURCE / "lab/grains" / "run.py")
run = importlib.util.module_from_spec(spec)
spec.loader.exec_module(run)
FORBIDDEN = {(0.078, 0.039), (0.117, 0.078), (0.039, 0.039), (0.058, 0.058), (0.0585, 0.0585), (0.215, 0.098)}  # of other judges


def the_list_is_as_it_should_be():
    widths = {}
    for family, case, share, side in run.check():
        assert share <= 0.08
        shape = case.split()[1]
        if shape.startswith("rect"):
            sides = tuple(sorted((float(v) for v in shape.split(":")[1].split(",")[:2]), reverse=True))
            assert sides not in FORBIDDEN, case
        widths[f"{family}/{case.split()[0]}"] = side
    for family in run.FAMILIES:
        assert any(key.startswith(family + "/") for key in widths), family
    fitted = [widths[f"{family}/{name}"] for family in ("sand", "slick") for name in ("disc120", "square100", "square100-drag15")]
    print(f"{len(widths)} cases; the plates that are fitted are {min(fitted):.0f} grains wide and more")
    assert min(fitted) > 19.9


def begin(folder, *args):
    """run.main as a user calls it."""
    sys.argv = ["run.py", "--program", PROGRAM, "--out", str(folder), "--rows", "20", *args]
    try:
        run.main()
    except SystemExit as end:
        return end.code
    return 0


def records_are_made_once(folder):
    run.FAMILIES = {"tiny": {"seeds": "1-2", "box": "0.08,0.07,0.012", "grain": 0.005, "friction": 0.5, "settle": 0.06}}
    run.BLOCKS = [("tiny", ["press rect:0.02,0.02 0 press:0.002@0.2", "tilted disc:0.02 10 press:0.001@0.2"]),
                  ("tiny", ["drag rect:0.02,0.02 0 press:0.002@0.2 drag:0.002@0.2 load:0.002@0.2 swipe:2@2 hold:0.002 move:0.1,0.05,0,1,2,0.02"])]
    assert begin(folder, "--only", "press") == 0
    with open(folder / "tiny" / "press-1.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["depth_m"]) < 0 and all(
        abs(float(row["sinkage_m"]) - (float(row["depth_m"]) + 0.0005)) < 2e-6 for row in rows)  # since the stage began, above the bed
    first = (folder / "tiny" / "press-2.csv").read_bytes()
    assert not (folder / "tiny" / "drag-1.csv").exists()
    assert begin(folder) == 0
    assert (folder / "tiny" / "press-2.csv").read_bytes() == first
    assert not list(folder.glob("*/*.part"))
    manifest = json.loads((folder / "manifest.json").read_text())
    assert set(manifest) == {"tiny", "tiny/press", "tiny/tilted", "tiny/drag"}
    assert manifest["tiny/drag"]["seeds"] == "1-2" and manifest["tiny/drag"]["hours"] >= 0
    other = folder / "other"
    assert begin(other, "--have", str(folder)) == 0 and not list(other.glob("tiny/*.csv"))
    packed(folder)
    assert begin(folder / "more", "--have", str(folder / "tiny.tar.xz")) == 0 and not list(folder.glob("more/tiny/*.csv"))
    assert begin(other, "--only", "press", "--seeds", "2") == 0
    same = (other / "tiny" / "press-2.csv").read_bytes() == first
    print(f"records of one bed alone are those of two beds: {same}")
    assert same
    with open(folder / "tiny" / "drag-1.csv", newline="", encoding="utf-8") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert [row["stage"] for row in rows] == sorted(row["stage"] for row in rows) and rows[-1]["stage"] == 5
    turned = [row for row in rows if row["stage"] == 3][-1]
    assert abs(turned["path_m"] - 0.004) < 1e-5 and abs(turned["pitch_rad"] - 0.0349) < 2e-3
    assert abs(rows[-1]["path_m"] - 0.006) < 1e-5 and abs(rows[-1]["pitch_rad"] - turned["pitch_rad"] - 0.02) < 1e-4
    assert abs([row for row in rows if row["stage"] == 1][-1]["depth_m"] - 0.002) < 1e-5


def pack(*words):
    return subprocess.run([sys.executable, SOURCE / "scripts" / "pack.py", *map(str, words)], capture_output=True, text=True)


def packed(folder):
    """tiny.tar.xz of the records is read as they are, is the same when made again, and takes a file more."""
    archive, again = folder / "tiny.tar.xz", folder / "again.tar.xz"
    assert pack(archive, folder / "manifest.json").returncode == 0 and pack(f"{archive}/tiny", folder / "tiny").returncode == 0
    inside = run.pack.opened(archive)
    names = sorted(file.name for file in inside.glob("tiny/*-1.csv"))
    assert names == sorted(file.name for file in folder.glob("tiny/*-1.csv")) and len(names) == 3
    for name in ("manifest.json", *(f"tiny/{name}" for name in names)):
        assert (inside / name).exists() and (inside / name).read_text() == (run.pack.opened(folder) / name).read_text()
    assert (inside / "tiny").is_dir() and not (inside / "tin").exists() and not (inside / "tiny" / names[0]).is_dir()
    assert [file.stem for file in run.pack.opened(archive / "tiny").glob("press-1.csv")] == ["press-1"]
    with run.pack.tarfile.open(archive) as file:
        file.extractall(folder / "copy")
    assert pack("--new", again, folder / "copy").returncode == 0 and again.read_bytes() == archive.read_bytes()
    (folder / "copy" / "manifest.json").write_text("{}")
    assert pack(again, folder / "copy" / "manifest.json").returncode == 0 and pack("--check", again, archive).returncode == 0
    assert run.pack.opened(again / "manifest.json").read_text() == "{}"


def archives_are_whole():
    """Those of the repository."""
    archives = [SOURCE / "tests/fuzz/corpus.tar.xz", *sorted((SOURCE / "lab/grains").glob("*.tar.xz"))]
    got = pack("--check", *archives)
    print(got.stdout, got.stderr)
    assert got.returncode == 0 and len(got.stdout.splitlines()) == 4
    records = run.pack.opened(run.RECORDS)
    manifest = json.loads((records / "manifest.json").read_text())
    cases = [f"{family}/{case.split()[0]}" for family, block in run.BLOCKS for case in block]
    assert all(key in manifest and list(records.glob(f"{key}-[0-9]*.csv")) for key in cases)


def archives_that_are_not(folder):
    for content in (b"", b"no archive", (SOURCE / "lab/grains/newton.tar.xz").read_bytes()[:9000]):
        (folder / "bad.tar.xz").write_bytes(content)
        words = [SOURCE / "lab/grains" / "run.py", "--list", "--have", folder / "bad.tar.xz"]
        got = subprocess.run([sys.executable, *words], capture_output=True, text=True)
        print("pack.py ->", got.stderr.strip())
        assert got.returncode == 2 and got.stderr.startswith("pack.py: ") and got.stderr.count("\n") == 1 and "bad.tar.xz" in got.stderr
    with run.pack.tarfile.open(folder / "other.tar.xz", "w:xz") as archive:
        archive.add(__file__, "x.py")
    (folder / "SHA256SUMS").write_text(f"{'0' * 64}  x.py\n")
    with run.pack.tarfile.open(folder / "changed.tar.xz", "w:xz") as archive:
        archive.add(__file__, "x.py")
        archive.add(folder / "SHA256SUMS", "SHA256SUMS")
    for words in (("--check", folder / "other.tar.xz"), ("--check", folder / "changed.tar.xz"), (folder / "x.zip", __file__),
                  (folder / "x.tar.xz", folder / "none")):
        got = pack(*words)
        print("pack.py ->", got.stderr.strip())
        assert got.returncode == 2 and got.stderr.startswith("pack.py: ") and got.stderr.count("\n") == 1


def mistakes_are_one_line():
    got = subprocess.run([sys.executable, SOURCE / "lab/grains" / "run.py", "--program", "/none"], capture_output=True, text=True)
    print("run.py ->", got.stderr.strip())
    assert got.returncode == 2 and got.stderr.startswith("run.py: ") and got.stderr.count("\n") == 1
    for args in (["--grain", "x"], ["--nothing", "1"], ["--case", "a disc:0.1 0"], ["--case", "a cube:1 0 press:0.1@1"],
                 ["--case", "a disc:0.1 0 press:0.1"], ["--case", "a disc:0.1 0 fly:1@1"], ["--case", "a disc:0.1 0 move:1,0,0,0,0"], ["--box", "1,1"],
                 ["--box", "0.01,0.01,0.01"], ["--seeds", "3-1"], ["--bed", "/none"], ["--contact", "glue"], ["--grain"],
                 ["--steps", "0"], ["--density", "0"], ["--spread", "2"], ["--bands", "-1"], ["--seeds", "1e30"], ["--rows", "1e20"],
                 ["--grain", "0"], ["--sole", "sphere:0.02"], ["--bed", "/dev/null"], ["--case", "a sphere:-0.1 0 press:0.1@1"],
                 ["--case", "a rect:0,0.1 0 press:0.1@1"], ["--bed", __file__]):
        got = subprocess.run([PROGRAM, *args], capture_output=True, text=True)
        print(" ".join(args), "->", got.stderr.strip())
        assert got.returncode == 2 and got.stderr.startswith("grains: ") and got.stderr.count("\n") == 1, args


if __name__ == "__main__":
    the_list_is_as_it_should_be()
    mistakes_are_one_line()
    archives_are_whole()
    with tempfile.TemporaryDirectory() as name:
        archives_that_are_not(pathlib.Path(name))
    with tempfile.TemporaryDirectory() as name:
        records_are_made_once(pathlib.Path(name))
