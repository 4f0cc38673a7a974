"""One self-contained page from the experiments."""
import base64
import dataclasses
import html
import io


@dataclasses.dataclass
class Claim:
    """What the paper says, and what was found."""
    what: str
    paper: str
    ours: str
    holds: bool
    there: str = "simulation"  # how the paper measured it; here it is always simulation


@dataclasses.dataclass
class Cell:
    """A cell of a table that is set apart: best, off (not compared), worse."""
    text: str
    kind: str


@dataclasses.dataclass
class Table:
    head: list
    rows: list
    title: str = ""


@dataclasses.dataclass
class Section:
    title: str
    text: str  # paragraphs, parted by an empty line
    figures: list = dataclasses.field(default_factory=list)  # of matplotlib
    tables: list = dataclasses.field(default_factory=list)
    claims: list = dataclasses.field(default_factory=list)
    there: str = "simulation"
    csv: list = dataclasses.field(default_factory=list)  # files beside the page


STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem;color:#222}
p,ul{max-width:60rem}table{border-collapse:collapse;font-size:.85rem;margin:1rem 0}caption{text-align:left;font-weight:600}
td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}
img{max-width:100%}.no{color:#a33;white-space:nowrap}.yes{color:#273;white-space:nowrap}h2{margin-top:2.5rem}
.best{font-weight:700;color:#273}.worse{color:#a33}.off{color:#999}.where{font-size:.85rem;color:#666;margin-top:-.6rem}
.wide{overflow-x:auto}"""


def image(figure):
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'


def cell(value, tag="td"):
    kind = f" class={value.kind}" if isinstance(value, Cell) else ""
    text = value.text if isinstance(value, Cell) else f"{value:.3g}" if isinstance(value, float) else str(value)
    return f"<{tag}{kind}>{html.escape(text)}</{tag}>"


def table(shown):
    head = "".join(cell(name, "th") for name in shown.head)
    rows = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in shown.rows)
    title = f"<caption>{html.escape(shown.title)}</caption>" if shown.title else ""
    return f"<div class=wide><table>{title}<tr>{head}</tr>{rows}</table></div>"


def claims(sections):
    """Where we contradict the paper comes first."""
    found = [(claim, number) for number, section in enumerate(sections) for claim in section.claims]
    found.sort(key=lambda pair: pair[0].holds)
    rows = "".join(f"<tr><td class={'yes' if c.holds else 'no'}>{'holds' if c.holds else 'does not hold'}</td>"
                   f"<td><a href=#s{number}>{html.escape(c.what)}</a></td><td>{html.escape(c.paper)}</td><td>{html.escape(c.there)}</td>"
                   f"<td>{html.escape(c.ours)}</td></tr>" for c, number in found)
    return ("<div class=wide><table><tr><th>here</th><th>claim</th><th>paper</th><th>measured there in</th><th>ours, in simulation</th>"
            f"</tr>{rows}</table></div>") if rows else ""


def body(section, number):
    parts = [f"<h2 id=s{number}>{html.escape(section.title)}</h2>",
             f"<p class=where>The paper: {html.escape(section.there)}. Here: simulation.</p>"]
    parts += [f"<p>{html.escape(text)}</p>" for text in section.text.split("\n\n")]
    parts += [image(figure) for figure in section.figures] + [table(shown) for shown in section.tables]
    if section.csv:
        parts.append("<p class=where>Numbers: " + ", ".join(f"<a href={name}>{name}</a>" for name in section.csv) + "</p>")
    return "\n".join(parts)


def write(path, sections, version, how):
    """how: what was run, for the top of the page."""
    parts = [f"<!doctype html><html lang=en><meta charset=utf-8><title>MILD, measured again</title><style>{STYLE}</style>",
             "<h1>MILD, measured again</h1>",
             f"<p>The experiments of Luo et al., RA-L 2025, by {html.escape(version)}. What the paper measured on a robot is simulation "
             "here: MuJoCo with the soft ground of mild/ground.h. The policies were trained in another engine, the batch engine, with the "
             f"same ground. {html.escape(how)}</p><h2>What holds, and what does not</h2>",
             "<p>Claims of the paper that do not hold here come first.</p>", claims(sections)]
    parts += [body(section, number) for number, section in enumerate(sections)]
    path.write_text("\n".join(parts), encoding="utf-8")
