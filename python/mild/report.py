"""The command `mild report` (docs/report.md): one page of HTML about training runs. Needs nothing but Python: the program starts this file."""
import argparse
import array
import base64
import configparser
import html
import json
import math
import os
import pathlib
import signal
import stat
import sys
import urllib.parse

HERE = pathlib.Path(__file__).resolve().parent
DEFAULTS = next((file for home in (HERE / "data", HERE.parents[1]) if (file := home / "configs/default.ini").is_file()), "configs/default.ini")
TITLE = "<title>mild report</title>"  # by which a page is known again
POINTS = 300  # of a curve at most
PART_MAX, TEXT_MAX, LOG_MAX = 4 << 20, 1 << 20, 1 << 30  # bytes of a video in the page, of a text, of a log
COLORS = "#0072b2 #d55e00 #009e73 #cc79a7 #e69f00 #56b4e9 #000000 #b8a800".split()  # for colour-blind eyes (Okabe and Ito 2008); a darker yellow
HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 200, 52, 350, 26, 178  # [pixels] of a chart and its axes
HEAD = f"""<!doctype html>
<html lang=en><head><meta charset=utf-8>
<meta name=viewport content="width=device-width">{TITLE}
<style>
body{{font:15px/1.45 system-ui,sans-serif;max-width:75rem;margin:1.5rem auto;padding:0 1rem;color:#222}}
h2{{margin-top:2.2rem}}table{{border-collapse:collapse;font-size:.9rem;display:block;overflow-x:auto}}
td,th{{padding:.2rem .7rem;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}}
td:first-child{{white-space:nowrap}}
.n{{text-align:right}}.small{{font-size:.8rem;color:#555;white-space:pre-line}}
.charts{{display:grid;grid-template-columns:repeat(auto-fill,minmax(330px,1fr));gap:.8rem}}
svg{{width:100%}}svg text{{font:10px system-ui,sans-serif;fill:#555}}svg .title{{font-size:12px;fill:#222}}
.grid{{stroke:#e4e4e4}}i{{display:inline-block;width:.8em;height:.8em;margin-right:.5em;border-radius:2px}}
pre{{font-size:.8rem}}video{{max-width:100%;max-height:30rem}}
</style></head><body>
"""
SECTIONS = {  # column: title; those in LOGARITHMIC have such an axis
    "Episodes": {"episode/reward": "return of an episode", "episode/length_s": "length of an episode [s]", "episode/speed_error": "speed error [m/s]",
                 "episode/falls": "falls in an iteration", "episode/ended": "episodes that ended in an iteration",
                 "episode/assist": "help of the robots, 0 to 1", "episode/diverged": "diverged simulations in an iteration"},
    "Learner": {"loss/value": "value loss", "ppo/explained": "explained variance of the value", "loss/kl": "KL of the update [nat]",
                "loss/clip_share": "clipped share of the samples", "ppo/learning_rate": "learning rate", "ppo/action_std": "std of the action noise",
                "loss/entropy": "entropy [nat]", "loss/surrogate": "surrogate loss", "loss/mirror": "mirror loss",
                "ppo/gradient": "norm of the gradient", "ppo/skipped": "skipped minibatches"},
    "Estimates and VAE": {"loss/base_velocity": "error of the base velocity (loss)", "loss/feet_velocity": "error of the feet's velocity (loss)",
                          "loss/feet_height": "error of the feet's height (loss)", "loss/reconstruction": "reconstruction (loss)",
                          "loss/vae_kl": "KL of the latent [nat]"},
    "Speed": {"rate/steps_per_s": "policy steps per second", "rate/steps": "policy steps"}}
LOGARITHMIC = {"loss/value", "ppo/learning_rate", "loss/mirror", "ppo/gradient", "loss/base_velocity", "loss/feet_velocity", "loss/feet_height",
               "loss/reconstruction"}
EVAL = {"speed": ("asked [m/s]", "%.2f", 1), "velocity": ("measured [m/s]", "%.2f", 1), "cot": ("cost of transport", "%.2f", 1),
        "torque_max": ("largest torque [N m]", "%.0f", 1), "clearance": ("clearance [mm]", "%.0f", 1e3),
        "penetration": ("sinkage [mm]", "%.0f", 1e3), "drift": ("drift of a stance [mm]", "%.0f", 1e3)}


def escape(text):
    return html.escape(text, quote=False).replace('"', "&quot;")


# ---- the files of a run ----
class Inputs:
    """Reads regular files that are no links, for a page is for others and must not publish what a link leads to; knows them again."""

    def __init__(self):
        self.seen = set()

    def read(self, path, limit, text=True):
        try:
            number = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError as error:
            if os.path.islink(path):
                raise ValueError(f"{path}: it is a link, which is not followed here; put a regular file in its place") from None
            raise ValueError(f"{path}: cannot read: {error.strerror}") from None
        about = os.fstat(number)
        if not stat.S_ISREG(about.st_mode):
            os.close(number)
            raise ValueError(f"{path}: it is a {'folder' if stat.S_ISDIR(about.st_mode) else 'pipe or a device'}; put a regular file in its place")
        self.seen.add((about.st_dev, about.st_ino))
        with open(number, "rb") as file:
            data = file.read(limit + 1) if limit else b""
        if limit and len(data) > limit:
            raise ValueError(f"{path}: larger than {limit >> 20} MiB, the limit for files of this kind")
        return data.decode(errors="surrogateescape") if text else data


def settings(text, name):
    """{section.key: value} of a config, whatever version wrote it."""
    parser = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";",), default_section=None)
    parser.optionxform = str
    try:
        parser.read_string(text)
    except configparser.Error as error:
        line = error.errors[0][0] if getattr(error, "errors", None) else getattr(error, "lineno", 0)
        raise ValueError(f"{name}:{line}: neither `key = value` nor `[section]`; correct the line") from None
    return {f"{section}.{key}": value for section in parser.sections() for key, value in parser[section].items()}


class Run:
    def __init__(self, folder, inputs):
        self.folder, self.inputs = folder, inputs
        self.read_log(os.path.join(folder, "log.csv"))
        self.config, self.version = (self.text(name) for name in ("config.ini", "version.txt"))
        self.settings = settings(self.config or "", os.path.join(folder, "config.ini"))
        self.rows, written = [], self.text("eval.json")
        if written is not None:
            try:
                self.rows = json.loads(written)["rows"]
                wrong = not self.rows or any(not isinstance(row["ground"], str) for row in self.rows)
            except (ValueError, LookupError, TypeError, RecursionError):
                wrong = True
            if wrong:
                raise ValueError(f"{os.path.join(folder, 'eval.json')}: not what mild eval --json writes; write it again or remove it")
        self.videos = [os.path.join(folder, name) for name in sorted(os.listdir(folder)) if name.endswith(".mp4") and len(name) > 4][:4]

    def text(self, name):
        path = os.path.join(self.folder, name)
        return self.inputs.read(path, TEXT_MAX) if os.path.lexists(path) else None

    def read_log(self, path):
        """Columns by their names; a last line without an end is left out, because a training may be writing it."""
        if not os.path.lexists(path):
            raise ValueError(f"{path}: there is no such file; name a run folder of mild train")
        first, *lines = self.inputs.read(path, LOG_MAX).split("\n")
        names, values, before = first.rstrip("\r").split(","), array.array("d"), -1.0
        if names[0] != "iteration" or len(names) < 2 or not lines:
            raise ValueError(f"{path}: its first line does not begin with 'iteration,'; name a run folder of mild train")
        for number, line in enumerate(lines[:-1], 2):
            try:
                row = [float(word) for word in line.split(",")]
            except ValueError:
                raise ValueError(f"{path}:{number}: '{ascii(line[:40])[1:-1]}' is not a row of numbers; remove the line") from None
            if len(row) != len(names):
                raise ValueError(f"{path}:{number}: {len(row)} numbers under {len(names)} columns; remove the line")
            if not 0 <= row[0] <= 1e15:
                raise ValueError(f"{path}:{number}: {row[0]:g} is no iteration; remove the line")
            if row[0] <= before:
                raise ValueError(f"{path}:{number}: iteration {row[0]:g} after {before:g}; remove the lines of one of the two runs that wrote here")
            before = row[0]
            values.extend(row)
        if not values:
            raise ValueError(f"{path}: no row yet; wait for the training's first iteration")
        self.columns = {name: values[i :: len(names)] for i, name in enumerate(names)}
        self.iterations = self.columns["iteration"]

    def means(self, column, first, last, points):
        """Over the rows whose iteration is nearest to each of the even places from first to last; NaN where there is none."""
        places = (points - 1) / (last - first) if last > first else 0
        sums, counts = [0.0] * points, [0] * points
        for iteration, value in zip(self.iterations, self.columns[column]):
            if math.isfinite(value):
                here = int((iteration - first) * places + 0.5)
                sums[here] += value
                counts[here] += 1
        return [total / count if count else math.nan for total, count in zip(sums, counts)]

    def last(self, column, form):
        """The mean over the last twentieth, as a cell of a table."""
        values = self.columns.get(column, [])
        values = [value for value in values[len(values) - len(values) // 20 - 1 :] if math.isfinite(value)]
        return "<td class=n>" + (form % (sum(values) / len(values)) if values else "")

    def alike(self, other):
        """Whether the configs differ in train.seed alone."""
        return None not in (self.config, other.config) and self.settings.keys() == other.settings.keys() and all(
            value == other.settings[key] for key, value in self.settings.items() if key != "train.seed")


# ---- charts ----
class Axis:
    def __init__(self, low, high, start, end, logarithmic=False):
        self.low, self.high, self.start, self.end, self.logarithmic = low, high, start, end, logarithmic

    def scaled(self, value):
        return (math.log10(value) if value > 0 else math.nan) if self.logarithmic else value

    def __call__(self, value):
        return self.start + (self.scaled(value) - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self):
        """1, 2 or 5 times a power of ten, in about four steps; of a logarithmic axis powers of ten, and 2 and 5 times these where there is room."""
        span = self.high - self.low
        power = 10.0 ** math.floor(math.log10(span / 4))
        rest = span / 4 / power
        step = math.ceil(span / 6) if self.logarithmic else power * (1 if rest < 1.5 else 2 if rest < 3.5 else 5 if rest < 7.5 else 10)
        k = (math.floor if self.logarithmic else math.ceil)(self.low / step)
        while k * step <= self.high:
            for factor in ((1, 2, 5) if span < 3 else (1,)) if self.logarithmic else (0,):
                value = factor * 10.0 ** (k * step) if factor else k * step
                if self.low <= self.scaled(value) <= self.high:
                    yield value
            k += 1


def vertical(curves, logarithmic):
    """The axis of all curves and bands, with a margin: logarithmic where that is asked for and shows more than one decade."""
    axis = Axis(0, 0, BOTTOM, TOP, logarithmic)
    seen = [axis.scaled(value) for _, *lines in curves for line in lines for value in line or ()]
    seen = [value for value in seen if math.isfinite(value)] or [0]
    low, high = min(seen), max(seen)
    margin = 0.04 * (high - low)
    if margin <= 1e-9 * abs(high):
        margin = 0.1 * abs(high) or 1
    axis.low, axis.high = low - margin, high + margin
    return vertical(curves, False) if logarithmic and axis.high - axis.low < 1 else axis


def number(value):
    return f"{1e-6 * value:.4g}M" if abs(value) >= 1e6 else f"{1e-3 * value:.4g}k" if abs(value) >= 1e4 else f"{value:.4g}"


def chart(title, logarithmic, x, places, curves):
    """An <svg> of curves over the places on x: (color, mean, low or None, high), NaN where there is no point."""
    y = vertical(curves, logarithmic)
    parts = [f'<svg viewBox="0 0 {RIGHT + 10} {HEIGHT}"><text class=title x={LEFT} y=16>{escape(title)}</text>']
    for value in y.ticks():
        parts.append(f'<path class=grid d="M{LEFT} {y(value):.1f}H{RIGHT}"/><text x={LEFT - 5} y={y(value) + 4:.1f} text-anchor=end>'
                     f"{number(value)}</text>")
    parts += [f"<text x={x(value):.1f} y={BOTTOM + 15} text-anchor=middle>{number(value)}</text>" for value in x.ticks()] + ["\n"]

    def way(points):
        shown = [f"{x(place):.1f} {y(value):.1f}" for place, value in points]
        return "M" * bool(shown) + "L".join(shown)

    for color, mean, low, high in curves:
        if low:  # forward along the upper edge, back along the lower one
            edge = [row for row in zip(places, low, high) if math.isfinite(y.scaled(row[1])) and math.isfinite(y.scaled(row[2]))]
            around = way([(place, top) for place, _, top in edge] + [(place, bottom) for place, bottom, _ in reversed(edge)])
            parts.append(f'<path fill="{color}" fill-opacity=.18 d="{around}"/>\n')
        line = way([row for row in zip(places, mean) if math.isfinite(y.scaled(row[1]))])
        line += "h0" * bool(line)  # shows a single point
        parts.append(f'<path fill=none stroke="{color}" stroke-width=1.5 stroke-linecap=round d="{line}"/>\n')
    return "".join(parts) + "</svg>\n"


# ---- the page ----
class Page:
    """Runs that differ in train.seed alone are a group: one curve, their mean, in a band from the least to the greatest."""

    def __init__(self, runs, path):
        self.runs, self.path, self.groups = runs, path, []
        for run in runs:
            group = next((group for group in self.groups if group[0].alike(run)), None)
            group.append(run) if group else self.groups.append([run])
        self.first, self.last = min(run.iterations[0] for run in runs), max(run.iterations[-1] for run in runs)
        self.points = min(POINTS, max(2, *(len(run.iterations) for run in runs)))
        self.places = [self.first + k * (self.last - self.first) / (self.points - 1) for k in range(self.points)]
        self.x = Axis(self.first, self.last if self.last > self.first else self.first + 1, LEFT, RIGHT)

    def color(self, group):
        return COLORS[self.groups.index(group) % len(COLORS)]

    def chip(self, group):
        return f'<i style="background:{self.color(group)}"></i>'

    def chart(self, column, title):
        """Nothing where the column is 0 throughout."""
        curves = []
        for group in self.groups:
            lines = [run.means(column, self.first, self.last, self.points) for run in group if column in run.columns]
            values = [[value for value in at if math.isfinite(value)] or [math.nan] for at in zip(*lines)]
            mean = [sum(at) / len(at) for at in values]
            if any(value < 0 or value > 0 for value in mean):
                curves.append((self.color(group), mean, list(map(min, values)) if len(lines) > 1 else None, list(map(max, values))))
        return chart(title, column in LOGARITHMIC, self.x, self.places, curves) if curves else ""

    def charts(self):
        known = {column for section in SECTIONS.values() for column in section}
        rest = [name for name in dict.fromkeys(name for run in self.runs for name in run.columns) if name not in known and name != "iteration"]
        sections = {**SECTIONS, "Reward terms, per second lived": {name: name[7:] for name in rest if name.startswith("reward/")},
                    "Others": {name: name for name in rest if not name.startswith("reward/")}}
        for section, columns in sections.items():
            if columns:
                drawn = "".join(self.chart(*column) for column in columns.items())
                yield f"<h2>{section}</h2>\n<div class=charts>\n{drawn}</div>\n"

    def table(self):
        yield "<table><tr><th>run<th>iterations<th>return<th>episode [s]<th>speed error [m/s]<th>policy steps/s<th>made by\n"
        for run in self.runs:
            group = next(group for group in self.groups if run in group)
            cells = (run.last("episode/reward", "%.2f"), run.last("episode/length_s", "%.2f"), run.last("episode/speed_error", "%.3f"),
                     run.last("rate/steps_per_s", "%.0f"))
            yield (f"<tr><td>{self.chip(group)}{escape(run.folder)}<td class=n>{run.iterations[-1]:.0f}{''.join(cells)}<td class=small>"
                   f"{escape(run.version or '')}\n")
        yield ("</table><p class=small>Means over the last twentieth of each run. Runs whose configs differ in train.seed alone have one colour: the "
               "curve is their mean, the band reaches from the least to the greatest. A point is the mean over the iterations around it.</p>\n")

    def evaluation(self, run):
        def value_of(row, key):
            value = row.get(key)
            return value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan

        titles = "".join(f"<th>{title}" for title, _, _ in EVAL.values())
        yield f"<h2>Evaluation of {escape(run.folder)}</h2>\n<table><tr><th>ground<th>upright{titles}\n"
        for row in run.rows:
            yield f"<tr><td>{escape(row['ground'])}<td class=n>{value_of(row, 'success'):.0f} of {value_of(row, 'trials'):.0f}"
            for key, (_, form, factor) in EVAL.items():
                none = key in ("velocity", "cot") and value_of(row, "measured") == 0  # no trial lasted long enough
                value = math.nan if none else factor * value_of(row, key)
                yield "<td class=n>" + (form % value if math.isfinite(value) else "")
            yield "\n"
        yield "</table>\n"

    def video(self, run, path):
        part = os.path.lexists(path) and os.lstat(path).st_size <= PART_MAX
        data = run.inputs.read(path, PART_MAX if part else 0, text=False)
        if part:
            link = "data:video/mp4;base64," + base64.b64encode(data).decode()
        else:  # from the folder of the page
            link = urllib.parse.quote(os.fsencode(os.path.relpath(os.path.realpath(path), os.path.realpath(os.path.dirname(self.path) or "."))))
        return f'<h2>{escape(path)}</h2>\n<video controls loop src="{link}"></video>\n'

    def difference(self, key, between, defaults):
        """A row where the groups differ in the key, or, unless between, where all have it alike and not as the default."""
        compared = [group for group in self.groups if group[0].config is not None]  # the others are not compared
        values = [group[0].settings.get(key) for group in compared]
        differ = any(value != values[0] for value in values)
        if between != differ or not between and values[0] == defaults.get(key):
            return ""
        cells = []
        for group in self.groups if between else compared[:1]:
            value = group[0].settings.get(key)
            more = [run.settings[key] for run in group[1:] if key in run.settings] if key == "train.seed" else []
            cells.append(", ".join(["–" if value is None else value, *more]))
        return "<tr>" + "".join(f"<td>{escape(cell)}" for cell in (key, *cells, defaults.get(key, "–"))) + "\n"

    def configs(self):
        if all(run.config is None for run in self.runs):
            return
        defaults = settings(pathlib.Path(DEFAULTS).read_text(encoding="utf-8"), DEFAULTS)
        keys = dict.fromkeys([*defaults, *(key for group in self.groups for key in group[0].settings)])
        yield "<h2>Configs</h2>\n"
        for between in (True, False) if len(self.groups) > 1 else (False,):
            heads = [self.chip(group) + escape(os.path.basename(group[0].folder.rstrip("/"))) + (f" ({len(group)} seeds)" if len(group) > 1 else "")
                     for group in self.groups] if between else ["all runs" if len(self.groups) > 1 else "run"]
            yield f"<h3>{'Between the runs' if between else 'From the defaults'}</h3>\n<table><tr>"
            yield "".join(f"<th>{head}" for head in ("key", *heads, "default")) + "\n"
            yield from (self.difference(key, between, defaults) for key in keys)
            yield "</table>\n"
        for run in self.runs:
            if run.config is not None:
                yield f"<details><summary>{escape(run.folder)}/config.ini</summary><pre>{escape(run.config)}</pre></details>\n"

    def text(self):
        parts = [HEAD, f"<h1>Training run{'s' * (len(self.runs) > 1)}</h1>\n", *self.table(), *self.charts()]
        for run in self.runs:
            parts += self.evaluation(run) if run.rows else ()
        parts += [self.video(run, path) for run in self.runs for path in run.videos]
        return "".join([*parts, *self.configs(), "</body></html>\n"])


def write(text, path, inputs):
    """The whole page or none, and over no file that it was made from."""
    part, direct = f"{path}.{os.getpid()}.part", path == "-" or os.path.exists(path) and not os.path.isfile(path)  # a device or a pipe
    if not direct and os.path.exists(path) and ((about := os.stat(path)).st_dev, about.st_ino) in inputs.seen:
        raise ValueError(f"--out: {path} is also an input and would be overwritten; name another file")
    try:
        with open(1 if path == "-" else path if direct else part, "wb" if direct else "xb", closefd=path != "-") as file:
            file.write(text.encode(errors="surrogateescape"))
        if not direct:
            os.replace(part, path)
    except BrokenPipeError:
        raise
    except OSError as error:
        if os.path.lexists(part):
            os.unlink(part)
        folder = os.path.dirname(path)
        why = f"there is no folder {folder}; make it first" if folder and not os.path.isdir(folder) else f"cannot be written: {error.strerror}"
        raise ValueError(f"{'standard output' if path == '-' else f'--out {path}'}: {why}") from None


def beside(run):
    """The page that nobody named: only an earlier one is overwritten."""
    path = os.path.join(run, "report.html")
    if os.path.lexists(path) and TITLE not in Inputs().read(path, LOG_MAX)[:512]:
        raise ValueError(f"{path}: exists, and is no earlier report; name the page with --out FILE.html")
    return path


def plain(text):
    """On one line, without what moves a terminal's cursor: names in a run folder are anybody's."""
    return "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))


class Parser(argparse.ArgumentParser):
    def error(self, message):
        print(plain(f"mild report: {message}; mild report --help has examples"), file=sys.stderr)
        sys.exit(2)


def main(argv=None):
    """The command; 0, or 2 after one line on what is wrong."""
    parser = Parser(prog="mild report", usage="mild report RUN [RUN...] [--out FILE.html]", allow_abbrev=False,
                    formatter_class=argparse.RawDescriptionHelpFormatter,
                    description="Writes one page of HTML, with no other file needed, about training runs: curves, reward terms,\nhow the "
                    "configs differ, the evaluation in RUN/eval.json and the videos RUN/*.mp4 if there are any.\nSeveral runs are overlaid. "
                    "Those that differ in train.seed alone are drawn as their mean in a band.", epilog="examples:\n  mild report runs/mine\n"
                    "  mild eval --policy runs/mine/policy.safetensors --json runs/mine/eval.json\n"
                    "  mild report runs/seed1 runs/seed2 runs/other --out compare.html")
    parser.add_argument("runs", nargs="*", metavar="RUN", help="folder of mild train")
    parser.add_argument("--out", action="append", metavar="FILE.html",
                        help="page to write; - is standard output (default report.html in the first run)")
    given = parser.parse_args(argv)
    if not given.runs or len(given.out or []) > 1:
        parser.error(f"{'--out: given twice' if given.runs else 'no run given'}; use {parser.usage}")
    try:
        inputs, path = Inputs(), given.out[0] if given.out else beside(given.runs[0])
        write(Page([Run(folder, inputs) for folder in given.runs], path).text(), path, inputs)
        if not given.out:
            write(plain(f"report {path}") + "\n", "-", inputs)
    except (ValueError, MemoryError, PermissionError, FileNotFoundError) as error:
        print(plain(f"mild report: {'out of memory' if isinstance(error, MemoryError) else error}"), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    sys.exit(main())
