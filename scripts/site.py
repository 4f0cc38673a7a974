#!/usr/bin/env python3
"""Makes the documentation as static pages: every Markdown file of the tree, the interface of libmild, and each file that they link
to. Fails when a link leads nowhere. Usage: scripts/site.py FOLDER (`make site` runs it in a Python that has `markdown`)."""
import html
import pathlib
import re
import shutil
import subprocess
import sys

import markdown

import links

FIRST = ["README.md", "docs/README.md", "docs/results.md", "docs/install.md", "docs/python.md", "docs/your-robot.md", "docs/task.md", "docs/model.md"]
STYLE = """body{font:16px/1.55 system-ui,sans-serif;color:#222;margin:0;display:flex}
nav{flex:0 0 14rem;padding:1rem;background:#f4f4f2;min-height:100vh;font-size:.9rem}nav a{display:block;padding:.15rem 0}
main{max-width:60rem;min-width:0;padding:1rem 2rem 4rem}a{color:#0b4f8a;text-decoration:none}a:hover{text-decoration:underline}
table{border-collapse:collapse;display:block;overflow-x:auto;font-size:.9rem}td,th{border:1px solid #ddd;padding:.25rem .6rem;
text-align:left;vertical-align:top}pre{background:#f4f4f2;padding:.7rem;overflow-x:auto}code{font-size:.88em}img{max-width:100%}
@media(max-width:50rem){body{display:block}nav{min-height:0}}"""


def slug(value, separator):
    """As links.anchors has it; `separator` is what the toc extension hands over."""
    return re.sub(r"[^\w\- ]", "", value.lower()).replace(" ", separator)


def title_of(text, name):
    found = re.search(r"^# +(.*)$", links.prose_of_headings(text), re.M)
    return re.sub(r"[`*]", "", found.group(1)) if found else name


def page_name(name):
    """The page of a file of the tree, both relative: a text file that is not ours to render is shown as it is."""
    if name == "README.md":
        return "index.html"
    return name.removesuffix(".md") + ".html" if name.endswith(".md") else name + ".html"


def way(page, target):
    """Relative URL from one page to another."""
    up = "../" * page.count("/")
    return up + target


class Site:
    def __init__(self, folder):
        self.folder = folder
        self.texts = {str(p.relative_to(links.ROOT)): p.read_text(encoding="utf-8") for p in links.pages()
                      if not str(p.relative_to(links.ROOT)).startswith(".")}  # not the forms of a code host
        self.texts["docs/api.md"] = subprocess.run(
            [sys.executable, "scripts/api.py", *map(str, sorted(pathlib.Path("include/mild").glob("*.h")))],
            cwd=links.ROOT, check=True, capture_output=True, text=True).stdout
        self.shown = {}  # file that a page links to: its page, or the file itself for pictures

    def nav(self, page):
        rest = sorted(name for name in self.texts if name not in FIRST and name.startswith("docs/"))
        last = sorted(name for name in self.texts if name not in FIRST and not name.startswith("docs/") and "LICENSE" not in name)
        names = [name for name in [*FIRST, *rest, *last] if name in self.texts]
        return "".join(f'<a href="{way(page, page_name(name))}">{html.escape(title_of(self.texts[name], name))}</a>' for name in names)

    def write(self, page, title, body):
        path = self.folder / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
                        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head><body><nav>{self.nav(page)}</nav>"
                        f"<main>{body}</main></body></html>\n", encoding="utf-8")

    def target(self, name, page, url):
        """Where a link of a page leads on the site."""
        file, _, anchor = url.partition("#")
        if re.match(r"[a-z]+:", url) or not file:
            return url
        there = ((links.ROOT / name).parent / file).resolve().relative_to(links.ROOT)
        if str(there) not in self.texts:
            self.shown[str(there)] = str(there) if there.suffix in (".png", ".webp", ".mp4", ".svg") else page_name(str(there))
        to = page_name(str(there)) if str(there) in self.texts else self.shown[str(there)]
        return way(page, to) + (f"#{anchor}" if anchor else "")

    def render(self, name, text):
        page = page_name(name)
        body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc", "sane_lists"],
                                 extension_configs={"toc": {"slugify": slug}})
        body = re.sub(r'(href|src)="([^"]*)"', lambda m: f'{m.group(1)}="{self.target(name, page, html.unescape(m.group(2)))}"', body)
        self.write(page, title_of(text, name), body)

    def show(self, name, page):
        file = links.ROOT / name
        if page == name:
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, self.folder / name)
            return
        text = "\n".join(sorted(p.name for p in file.iterdir())) if file.is_dir() else file.read_text(encoding="utf-8")
        self.write(page, name, f"<h1>{html.escape(name)}</h1><pre>{html.escape(text)}</pre>")

    def make(self):
        for name, text in self.texts.items():
            self.render(name, text)
        for name, page in self.shown.items():
            self.show(name, page)

    def faults(self):
        """Links of the finished pages that lead nowhere."""
        for path in sorted(self.folder.rglob("*.html")):
            for url in re.findall(r'(?:href|src)="([^"]*)"', re.sub(r"<pre>.*?</pre>", "", path.read_text(encoding="utf-8"), flags=re.S)):
                file, _, anchor = url.partition("#")
                if re.match(r"[a-z]+:", url):
                    continue
                to = path.parent / file if file else path
                if not to.exists():
                    yield f"{path.relative_to(self.folder)}: {url} leads nowhere"
                elif anchor and f'id="{anchor}"' not in to.read_text(encoding="utf-8"):
                    yield f"{path.relative_to(self.folder)}: {url} has no such heading"


def main(folder):
    site = Site(pathlib.Path(folder))
    empty = not site.folder.exists() or (site.folder.is_dir() and not any(site.folder.iterdir()))
    if not empty and not (site.folder / "docs/api.html").exists():
        sys.exit(f"site: {folder} holds something else than a site, which would be lost; name another folder")
    shutil.rmtree(folder, ignore_errors=True)
    site.make()
    found = list(site.faults())
    print("\n".join([*found, f"{len(site.texts)} pages, {len(site.shown)} files beside them, {len(found)} links lead nowhere"]))
    return 1 if found else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
