#!/usr/bin/env python3
"""Makes the page of the arena from docs/s50.csv and docs/public-policies.csv, and a letter to the authors of each policy. Needs Python alone.

    scripts/arena.py build/arena                    # build/arena/index.html with its data and film; a part of `make site`
    scripts/arena.py --letters build/letters        # a text for each policy: how it was run, what came out, whether that is right
    scripts/arena.py --letters build/letters --only unitree_g1,playground_t1

Who and what a policy is stands in scripts/public_policies.py, stiffnesses of the measured grounds in docs/model.md."""
import argparse
import csv
import html
import math
import pathlib
import re
import shutil
import string
import sys

import public_policies

ROOT = public_policies.ROOT
DOCS = ROOT / "docs"
LOW, HIGH = 0.1, 1000.0  # [MPa/m] ends of the axis: the range of `mild trial --sweep stiffness`
GROUNDS = {"dry_sand_loose": "loose dry sand", "dry_sand_close": "close dry sand", "moist_sand": "moist sand", "gym_mat": "gym mat", "carpet": "carpet",
           "groomed_snow": "groomed snow", "artificial_turf": "artificial turf", "rubber_tile": "rubber tile", "running_track": "running track"}
FILM, CURVE = "two-g1.webp", "s50.png"
text = html.escape


def read(name):
    with open(DOCS / name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def marks():
    """{measured ground: stiffness [MPa/m]}, as docs/model.md has it."""
    page = (DOCS / "model.md").read_text(encoding="utf-8")
    return {ground: float(re.search(rf"^{ground} +([\d.]+) ", page, re.M).group(1)) for ground in GROUNDS}


class Policy:
    """A policy with its rows of both files."""

    def __init__(self, name):
        self.name, self.sweeps, self.trials = name, {}, {}
        known = public_policies.POLICIES.get(name)
        self.robot, self.model, self.file, *options = known or ("", "", "")
        self.options = " ".join(options).replace(f"{{clones}}/{self.file.split('/')[0]}/", "").replace("{clones}/", "").replace("{trial}", "examples/trial")
        folder = self.file.split("/")[0]
        self.ours = self.file.startswith("/")
        self.place, self.commit, self.licence = public_policies.REPOSITORIES.get(folder, ("", "", ""))
        own = [f"examples/trial/{name}.ini", *re.findall(r"examples/trial/\S+", self.options)]
        self.port = next((file for file in own if (ROOT / file).is_file()), "")  # '': what comes with the policy
        self.speed = float(next(iter(re.findall(r"--speed (\S+)", self.options)), 0.5))  # [m/s] of the command

    @property
    def legs(self):
        return 4 if any(robot in self.robot for robot in public_policies.FOUR_LEGS) else 2

    @property
    def order(self):
        """[MPa/m] by which rows are sorted: S50 or its bound."""
        return bound(self.sweeps["stiffness"])[0]

    @property
    def rigid(self):
        """On rigid ground, as text, '' where it was not tried."""
        row = self.trials.get("rigid")
        return row and f"{row['upright']} of {row['trials']}" + (f", {float(row['speed [m/s]']):.2f} m/s" if row["speed [m/s]"] else "") or ""


def number(cell):
    return float(cell) if cell not in ("", None) else math.nan


def digits(value):
    return f"{value:.3g}"


def bound(row):
    """(where the bar of a sweep begins, low, high); NaN where there is no such end. Without an S50 there is only a bound."""
    low, high, middle = number(row["low"]), number(row["high"]), number(row["S50"])
    if math.isnan(middle):
        return 1.001 * low if math.isnan(high) else 0.999 * high, math.nan, math.nan
    return middle, low, high


def s50(row):
    """S50 with its interval, as text."""
    low, high = number(row["low"]), number(row["high"])
    if not row["S50"]:
        return f"> {digits(low)}" if math.isnan(high) else f"< {digits(high)}"
    ends = " to ".join("?" if math.isnan(end) else digits(end) for end in (low, high))
    return f"{digits(number(row['S50']))} ({ends})"


def policies():
    """{name: Policy} of both files."""
    found = {}
    for row in read("s50.csv"):
        found.setdefault(row["policy"], Policy(row["policy"])).sweeps[row["sweep"]] = row
    for row in read("public-policies.csv"):
        found.setdefault(row["policy"], Policy(row["policy"])).trials[row["ground"]] = row
    return found


def place(value):
    """[%] from the left, of the logarithmic axis."""
    return 100 * min(1, max(0, math.log(value / LOW) / math.log(HIGH / LOW)))


def axis(grounds):
    ticks = [f'<span class="tick" style="left:{place(10.0**k):.1f}%">{10.0**k:g}</span>' for k in range(-1, 4)]
    names = [f'<span class="ground" style="left:{place(value):.1f}%">{GROUNDS[name]}</span>' for name, value in grounds.items()]
    return "".join(ticks[:1] + names + ticks[1:])


def chart(row, grounds):
    start, low, high = bound(row)
    lines = "".join(f'<i style="left:{place(value):.1f}%" title="{GROUNDS[name]}, {value:g} MPa/m"></i>' for name, value in grounds.items())
    if math.isnan(start):
        return lines
    ends = (place(LOW if math.isnan(low) else low), place(HIGH if math.isnan(high) else high))
    whisker = "" if math.isnan(low) and math.isnan(high) else f'<s style="left:{ends[0]:.1f}%;width:{ends[1] - ends[0]:.1f}%"></s>'
    return f'<b style="left:{place(start):.1f}%"></b>{lines}{whisker}'


def link(policy):
    if not policy.place:
        return text(policy.name)
    return f'<a href="https://github.com/{policy.place}/tree/{policy.commit}">{text(policy.name)}</a>'


def s50_row(policy, grounds):
    row = policy.sweeps["stiffness"]
    about = [policy.robot, "ours" if policy.ours and "ours" not in policy.robot else policy.place, policy.licence and f"licence: {policy.licence}"]
    cells = [f'<td data-v="{text(policy.name)}">{link(policy)}<small>{text(", ".join(filter(None, about)))}</small>',
             f'<td class="number" data-v="{"" if math.isnan(policy.order) else policy.order}">{text(s50(row))}', f'<td class="more">{row["trials"]}',
             f'<td class="more number">{text(policy.rigid)}', f'<td class="chart">{chart(row, grounds)}']
    return f'<tr{" class=ours" if policy.ours else ""}>' + "".join(cells)


def sweeps_table(found):
    """The sweeps but that of stiffness, where there are any."""
    rows = [f'<tr><td>{link(policy)}<td>{name}<td class="number">{text(s50(row))}<td>{"" if row["unit"] == "-" else text(row["unit"])}<td>{row["trials"]}'
            for policy in found for name, row in policy.sweeps.items() if name != "stiffness"]
    head = '<table class="sort"><thead><tr><th>policy<th>of the ground<th>half stay up<th>unit<th>trials</thead><tbody>'
    return f'<h2 id="sweeps">Friction, slip, damping</h2>\n<div class="wide">{head}{"".join(rows)}</tbody></table></div>' if rows else ""


def grounds_table(found):
    names = list(dict.fromkeys(name for policy in found for name in policy.trials))

    def cell(row):
        if not row:
            return "<td>"
        up, of = int(row["upright"]), int(row["trials"])
        return f'<td data-v="{up / of}"{" class=all" if up == of else "" if up else " class=none"}>{up if of == 10 else f"{up} of {of}"}'

    rows = [f'<tr><td data-v="{text(policy.name)}">{link(policy)}' + "".join(cell(policy.trials.get(name)) for name in names)
            for policy in found if policy.trials]
    head = "".join(f"<th>{name.replace('_', ' ')}" for name in names)
    return f'<table class="grounds sort"><thead><tr><th>policy{head}</thead><tbody>\n' + "\n".join(rows) + "\n</tbody></table>"


def says(measured, grounds):
    """What the bipeds of others do at two measured stiffnesses."""
    others = [policy for policy in measured if policy.legs == 2 and not policy.ours]
    fall = {ground: sum(policy.order > grounds[ground] for policy in others) for ground in ("gym_mat", "carpet")}
    return (f"At the stiffness of a gym mat ({grounds['gym_mat']:.0f} MPa/m) {fall['gym_mat']} of {len(others)} public bipeds fall in most trials, at that of "
            f"a carpet ({grounds['carpet']:.0f}) {fall['carpet']}.")


def make_page(folder, docs=""):
    """Writes FOLDER/index.html with what it shows. docs: address of the site's pages, '' for none."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    grounds, found = marks(), policies()
    measured = sorted((policy for policy in found.values() if "stiffness" in policy.sweeps), key=lambda policy: (math.isnan(policy.order), policy.order))
    others = [policy for policy in measured if not policy.ours]
    undone = sorted(set(found) - {policy.name for policy in measured})
    entry = re.search(r"^@software\{.*?^\}", (DOCS / "cite.md").read_text(encoding="utf-8"), re.M | re.S).group()
    curve = f'<figure><img src="{CURVE}" alt="Chance to stay up by stiffness"><figcaption>A sweep: trials, the chance to stay up, S50 and its interval.</figcaption></figure>'
    film = f'<figure><img src="{FILM}" alt="Two G1 on loose sand"><figcaption>Two G1 on loose sand: Unitree\'s policy falls, ours walks.</figcaption></figure>'
    page = string.Template((ROOT / "scripts/arena.html").read_text(encoding="utf-8")).substitute(
        policies=len(others), says=says(measured, grounds), axis=axis(grounds), rows="\n".join(s50_row(policy, grounds) for policy in measured),
        undone=f" Without an S50: {text(', '.join(undone))}." if undone else "", sweeps=sweeps_table(measured),
        grounds=grounds_table(sorted(found.values(), key=lambda policy: (policy not in measured, measured.index(policy) if policy in measured else 0))),
        film=film if (DOCS / FILM).is_file() else "", curve=curve if (DOCS / CURVE).is_file() else "", citation=text(entry), version=version(), licence='<a href="LICENSE-DATA.txt">text</a>',
        page=f'All about it: <a href="{docs}public-policies.html">Anybody\'s policy on soft ground</a>.' if docs else "All about it: docs/public-policies.md.")
    (folder / "index.html").write_text(page, encoding="utf-8")
    for name in ("s50.csv", "public-policies.csv", "LICENSE-DATA.txt", FILM, CURVE):
        if (DOCS / name).is_file():
            shutil.copy(DOCS / name, folder / name)


def version():
    return re.search(r"^project\(mild VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.M).group(1)


def letter(policy, grounds):
    """The text for the authors of a policy."""
    def inside(file):
        return file.partition("/")[2]

    results = [f"  S50 of {name:10} {s50(row)} {row['unit']}, {row['trials']} trials; in brackets the 90 % interval" for name, row in policy.sweeps.items()]
    for ground, row in policy.trials.items():
        speed = f", {float(row['speed [m/s]']):.2f} m/s" if row["speed [m/s]"] else ""
        fall = f", half of the falls by {float(row['median fall [s]']):.1f} s" if row["median fall [s]"] else ""
        results.append(f"  {ground:16}  {row['upright']} of {row['trials']} upright{speed}{fall}")
    port = f"{policy.port} of our tree, below" if policy.port else "what your repository has, read as it is"
    below = f"\n\n{policy.port}:\n\n{(ROOT / policy.port).read_text(encoding='utf-8').strip()}" if policy.port else ""
    options = ["--describe " + policy.port if policy.port and "--describe" not in policy.options else "", policy.options,
               f"--speed {policy.speed:g}" if "--speed" not in policy.options else "", "--seconds 20 --sweep stiffness"]
    command = " ".join(["mild trial", inside(policy.model), inside(policy.file), *filter(None, options)])
    return string.Template((ROOT / "scripts/letter.txt").read_text(encoding="utf-8")).substitute(
        place=policy.place, speed=f"{policy.speed:g}", name=policy.name, robot=policy.robot, commit=policy.commit, policy=inside(policy.file), port=port, command=command,
        model=inside(policy.model) if policy.model.split("/")[0] == policy.file.split("/")[0] else f"{inside(policy.model)} of {policy.model.split('/')[0]}",
        results="\n".join(results), below=below, track=digits(grounds["running_track"]), mat=digits(grounds["gym_mat"]), sand=digits(grounds["dry_sand_close"]))


def write_letters(folder, only):
    found = {name: policy for name, policy in policies().items() if policy.place}
    for name in set(only or []) - set(found):
        sys.exit(f"arena: --only: no policy of others is named {name}; there are {', '.join(found)}")
    folder.mkdir(parents=True, exist_ok=True)
    for name in only or found:
        (folder / f"{name}.txt").write_text(letter(found[name], marks()), encoding="utf-8")
    print(f"{len(only or found)} letters in {folder}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path, help="of the page")
    parser.add_argument("--letters", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--only", type=lambda names: names.split(","), help="letters about these policies, separated by commas")
    given = parser.parse_args()
    if not given.folder and not given.letters:
        parser.error("name a folder")
    if given.folder:
        make_page(given.folder)
        print(given.folder / "index.html")
    if given.letters:
        write_letters(given.letters, given.only)


if __name__ == "__main__":
    main()
