"""Runs the blocks of docs/soil.md in order, in one folder, and compares what they print with the block that follows: words exactly,
numbers within 0.5 %. Usage: test_soil_page.py MILD ROOT [--write: puts what they print into the page]"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?")


def same(found, wanted):
    if NUMBER.sub("#", found).split() != NUMBER.sub("#", wanted).split():
        return False
    return all(abs(float(a) - float(b)) <= 0.005 * abs(float(b)) + 1e-4 for a, b in zip(NUMBER.findall(found), NUMBER.findall(wanted)))


def main():
    mild, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    page = root / "docs/soil.md"
    parts = re.split(r"^```(\w+)\n(.*?)^```\n", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    wrong = ran = 0
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "build").mkdir()
        (pathlib.Path(folder) / "build/mild").symlink_to(mild)
        (pathlib.Path(folder) / "lab").symlink_to(root / "lab")
        said = None
        for i in range(1, len(parts), 3):
            kind, text = parts[i], parts[i + 1]
            if kind in ("sh", "python"):
                program = ["bash", "-euc"] if kind == "sh" else [sys.executable, "-c"]
                done = subprocess.run([*program, text], cwd=folder, capture_output=True, text=True, env={**os.environ, "MILD_HOME": str(root)})
                said, ran = done.stdout, ran + 1
                if done.returncode:
                    wrong += 1
                    print(f"block {ran} fails: {done.stderr}\n{text}", file=sys.stderr)
            elif "--write" in sys.argv:
                parts[i + 1] = said
            elif not same(said, text):
                wrong += 1
                print(f"block {ran} prints\n{said}and not\n{text}", file=sys.stderr)
    if "--write" in sys.argv:
        page.write_text("".join(part if i % 3 == 0 else f"```{part}\n" if i % 3 == 1 else f"{part}```\n" for i, part in enumerate(parts)), encoding="utf-8")
    print(f"soil_page: {ran} blocks")
    sys.exit(wrong > 0 or ran < 5)


if __name__ == "__main__":
    main()
