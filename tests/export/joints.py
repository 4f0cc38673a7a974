"""The table of joints in docs/policy.md beside those of an export. Usage: joints.py SOURCE_FOLDER policy_weights.h"""

import pathlib
import re
import sys


def check(source, names, pose, kp, kd, limit, low, high):
    """Order of the names; of each joint the numbers."""
    page = (pathlib.Path(source) / "docs/policy.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")] for line in page.splitlines() if line.startswith("| `leg_")]
    assert [row[1].split("`")[1] for row in rows] == names
    for i, row in enumerate(rows):
        assert [float(cell) for cell in row[2:6]] == [pose[i], kp[i], kd[i], limit[i]], row
        assert row[6].endswith(f", {low[i]:g} to {high[i]:g}"), row


def numbers(text, name):
    return [float(number.rstrip("f")) for number in re.search(rf"policy_{name}\[.*{{(.*)}};", text)[1].split(", ")]


if __name__ == "__main__":
    header = pathlib.Path(sys.argv[2]).read_text(encoding="utf-8")
    joints = re.findall(r'"(.*)"', header)
    check(sys.argv[1], joints, *(numbers(header, name) for name in ("pose", "kp", "kd", "limit", "low", "high")))
