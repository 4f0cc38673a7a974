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


@dataclasses.dataclass
class Table:
    head: list
    rows: list


@dataclasses.dataclass
class Section:
    title: str
    figure: object  # of matplotlib, or None
    text: str
    table: Table = None
    claim: Claim = None


STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem;color:#222}
table{border-collapse:collapse;font-size:.9rem;margin:1rem 0}td,th{padding:.2rem .7rem;border-bottom:1px solid #ddd;text-align:left}
img{max-width:100%}.no{color:#a33}.yes{color:#273}h2{margin-top:2.5rem}"""


def image(figure):
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=120)
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'


def table(head, rows):
    def cells(row, tag):
        return "".join(f"<{tag}>{html.escape(f'{x:.3g}' if isinstance(x, float) else str(x))}</{tag}>" for x in row)
    return f"<table><tr>{cells(head, 'th')}</tr>" + "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows) + "</table>"


def claims(sections):
    """Where we contradict the paper comes first."""
    found = sorted((s.claim for s in sections if s.claim), key=lambda claim: claim.holds)
    rows = "".join(f"<tr><td class={'yes' if c.holds else 'no'}>{'holds' if c.holds else 'does not hold'}</td>"
                   f"<td>{html.escape(c.what)}</td><td>{html.escape(c.paper)}</td><td>{html.escape(c.ours)}</td></tr>" for c in found)
    return f"<table><tr><th>here</th><th>claim</th><th>paper</th><th>ours</th></tr>{rows}</table>" if rows else ""


def write(path, sections, version):
    parts = [f"<!doctype html><meta charset=utf-8><title>MILD, measured again</title><style>{STYLE}</style>",
             "<h1>MILD, measured again</h1>",
             f"<p>The paper's experiments by {html.escape(version)}. Hardware there is simulation here: the soft ground of mild/ground.h "
             "under MuJoCo, which neither trained the policies nor their estimates. Claims that do not hold come first.</p>",
             claims(sections)]
    for s in sections:
        parts.append(f"<h2>{html.escape(s.title)}</h2><p>{html.escape(s.text)}</p>")
        parts.append(image(s.figure) if s.figure else "")
        parts.append(table(s.table.head, s.table.rows) if s.table else "")
    path.write_text("\n".join(parts), encoding="utf-8")
