#!/usr/bin/env python3
"""Makes the documentation as a site: every Markdown file of the tree, the interface of libmild, and each file that they link to,
by MkDocs with the theme Material. The pages are those that a code host shows; the menu is docs/README.md's. Each version has a
folder of its own beside the others, which the site's header lets a reader choose. Fails when a link leads nowhere.
Usage: scripts/site.py FOLDER (`make site` runs it in a Python that has mkdocs-material)."""
import json
import logging
import os
import pathlib
import re
import shutil
import subprocess
import sys

import arena
import links
import notebook

HERE = pathlib.Path(__file__).resolve().parent
ARENA = "../arena/index.html"  # seen from the pages in docs
PICTURES = (".png", ".webp", ".svg", ".csv")
KINDS = {".c": "c", ".h": "c", ".cu": "cuda", ".cpp": "cpp", ".py": "python", ".sh": "bash", ".json": "json", ".ini": "ini", ".xml": "xml",
         ".ipynb": "json", ".cff": "yaml", ".mjs": "javascript", ".js": "javascript"}
LAST = dict.fromkeys(["CHANGELOG.md", "docs/log.md", "docs/api.md"], "---\nsearch:\n  boost: 0.3\n---\n\n")  # of what a search finds
# What the index of docs/README.md leaves to the tree's other pages.
MORE = ["docs/README.md", "docs/api.md", "configs/default.ini", "examples/README.md", "CHANGELOG.md", "VERSIONING.md", "SECURITY.md", "src/README.md"]


def title_of(text):
    return re.sub(r"[`*]", "", re.search(r"^# +(.*)$", links.prose_of_headings(text), re.M).group(1))


def version():
    """As 0.2: a version that only mends replaces the site of the one before."""
    return re.search(r"^project\(mild VERSION (\d+\.\d+)", (links.ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.M).group(1)


def menu(index):
    """The tables of docs/README.md as [(reader, [page])]; a page stands under the first reader who is sent there."""
    found, seen = [], set()
    for table in re.finditer(r"^\| ([^|]+) \| \|\n\|---\|---\|\n((?:\|.*\n)+)", index, re.M):
        pages = []
        for match in links.LINK.finditer(table.group(2)):
            page = os.path.normpath(os.path.join("docs", match.group(3).partition("#")[0]))
            if page.endswith(".md") and page not in seen:
                seen.add(page)
                pages.append(page)
        found.append((table.group(1), pages))
    return found


class Tree:
    """The pages as MkDocs reads them: links to files that are no pages become links to pages that show those."""

    def __init__(self, folder):
        self.folder, self.shown = folder, set()
        shutil.rmtree(folder, ignore_errors=True)
        self.texts = {str(page.relative_to(links.ROOT)): page.read_text(encoding="utf-8") for page in links.pages()}
        self.texts = {name: text for name, text in self.texts.items() if not name.startswith(".")}  # not the forms of a code host
        self.texts["docs/api.md"] = subprocess.run(
            [sys.executable, "scripts/api.py", *map(str, sorted(pathlib.Path("include/mild").glob("*.h")))],
            cwd=links.ROOT, check=True, capture_output=True, text=True).stdout
        for name in [*self.texts, *MORE]:
            if name in self.texts:
                self.write(name, LAST.get(name, "") + self.page(name, self.texts[name]))
            else:
                self.show(name)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def page(self, name, text):
        if name.startswith("docs/tutorials/") and "New file [" not in text and "```sh" in text and not name.endswith("README.md"):
            book = name.replace(".md", ".ipynb")
            self.write(book, notebook.notebook(text))
            text += f"\n[This page as a notebook]({os.path.basename(book)}){{ download }}\n"
            return self.linked(name, text, {os.path.basename(book)})
        if name == "docs/public-policies.md":
            text += f"\n[The arena: this table as a page to sort]({ARENA})\n"
            return self.linked(name, text, {ARENA})
        return self.linked(name, text, set())

    def linked(self, name, text, made):
        found, at = [], 0
        for match in links.LINK.finditer(links.prose(text)):
            url = match.group(3)
            found += [text[at:match.start(3)], url if url in made else self.target(name, url)]
            at = match.end(3)
        return "".join([*found, text[at:]])

    def target(self, name, url):
        file, _, anchor = url.partition("#")
        if re.match(r"[a-z]+:", url) or not file:
            return url
        there = os.path.normpath(os.path.join(os.path.dirname(name), file))
        if there in self.texts:
            return url
        self.show(there)
        return file if there.endswith(PICTURES) else self.beside(file, there)

    @staticmethod
    def beside(url, name):
        """The page that shows a file; not `law.h.html`, which a page of `law.h.md` would be where somebody has that, too."""
        return f"{url.rstrip('/')}/files.md" if (links.ROOT / name).is_dir() else f"{url}.md"

    def show(self, name):
        file = links.ROOT / name
        if name in self.shown:
            return
        self.shown.add(name)
        if name.endswith(PICTURES):
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, self.folder / name)
            return
        text = "\n".join(sorted(p.name for p in file.iterdir())) if file.is_dir() else file.read_text(encoding="utf-8")
        self.write(self.beside(name, name), f"---\nsearch:\n  exclude: true\ntitle: {name}\n---\n\n# `{name}`\n\n"
                                            f"~~~~~{KINDS.get(file.suffix, 'text')}\n{text}\n~~~~~\n")

    def nav(self):
        index = menu(self.texts["docs/README.md"])
        named = {page for _, pages in index for page in pages}
        more = [name for name in MORE if name not in named]
        nav = [{"Home": "README.md"}]
        for reader, pages in [*index, ("Reference", more)]:
            nav.append({reader: [{title_of(self.texts[name]): name} if name in self.texts else {name: self.beside(name, name)} for name in pages]})
        return nav


def config(tree, number):
    """What mkdocs.yml would say; JSON is YAML."""
    return {
        "site_name": f"mild {number}",
        "site_description": "Soft ground for simulated legged robots",
        "docs_dir": str(tree.folder),
        "nav": tree.nav(),
        "theme": {
            "name": "material", "font": False, "icon": {"logo": "material/grass"},
            "features": ["navigation.tabs", "navigation.tabs.sticky", "navigation.top", "navigation.footer", "search.suggest", "search.highlight",
                         "content.code.copy", "toc.follow"],
            "palette": [
                {"media": "(prefers-color-scheme: light)", "scheme": "default", "primary": "custom", "accent": "custom",
                 "toggle": {"icon": "material/weather-night", "name": "Dark"}},
                {"media": "(prefers-color-scheme: dark)", "scheme": "slate", "primary": "custom", "accent": "custom",
                 "toggle": {"icon": "material/weather-sunny", "name": "Light"}}]},
        "extra": {"version": {"provider": "mike"}, "polyfills": ["assets/iframe-worker.js"], "generator": False},
        "extra_css": ["assets/site.css"],
        "plugins": ["search", "offline"],
        "markdown_extensions": [
            "tables", "sane_lists", {"toc": {"permalink": True}}, {"pymdownx.highlight": {"use_pygments": True}}, "pymdownx.superfences", "pymdownx.tasklist", "attr_list"],
        "validation": {"nav": {"omitted_files": "ignore"}, "links": {"anchors": "warn", "unrecognized_links": "warn", "absolute_links": "warn"}},
        "strict": True,
    }


def slugify(value, separator):
    """The anchor of a heading, as code hosts make it (links.anchors)."""
    return re.sub(r"[^\w\- ]", "", value.lower()).replace(" ", separator)


def build(tree, folder, number):
    from mkdocs.commands.build import build as mkdocs_build
    from mkdocs.config import load_config
    from mkdocs.exceptions import Abort
    logging.basicConfig(level=logging.WARNING, format="site: %(message)s")
    said = config(tree, number)
    next(ext for ext in said["markdown_extensions"] if "toc" in ext)["toc"]["slugify"] = slugify
    shutil.rmtree(folder, ignore_errors=True)
    path = tree.folder.with_suffix(".json")  # MkDocs wants to have read one
    path.write_text("{}", encoding="utf-8")
    loaded = load_config(str(path), site_dir=str(folder), **said)
    loaded.plugins.on_startup(command="build", dirty=False)
    try:
        mkdocs_build(loaded)
    except Abort as stopped:
        sys.exit(f"site: {stopped}")


def main(folder):
    folder, number = pathlib.Path(folder).resolve(), version()
    if folder.exists() and any(folder.iterdir()) and not (folder / "versions.json").exists():
        sys.exit(f"site: {folder} holds something else than a site, which would be lost; name another folder")
    if links.main([]):
        sys.exit(1)
    tree = Tree(folder.with_name(folder.name + "-pages"))
    for name in ("site.css", "iframe-worker.js"):
        tree.write(f"assets/{name}", (HERE / name).read_text(encoding="utf-8"))
    arena.make_page(tree.folder / "arena", docs="../docs/")
    build(tree, folder / number, number)
    numbers = sorted((path.parent.name for path in folder.glob("*/index.html")), key=lambda text: [int(part) for part in text.split(".")], reverse=True)
    (folder / "versions.json").write_text(json.dumps([{"version": text, "title": text, "aliases": []} for text in numbers]), encoding="utf-8")
    (folder / "index.html").write_text(f'<!doctype html><meta charset=utf-8><title>mild</title><link rel=icon href="data:,"><meta http-equiv=refresh content="0; url={numbers[0]}/index.html">\n',
                                       encoding="utf-8")
    print(f"{len(tree.texts)} pages, {len(tree.shown)} files beside them; versions {', '.join(numbers)}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
