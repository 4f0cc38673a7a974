#!/usr/bin/env python3
"""The site of `make site` in headless Chromium, from files and from a server: the pages of the menu on a dark desktop and a light phone
(with --shots also the other way round). Nothing is asked of another machine, no error, no page wider than the screen, every picture there, text that can be told
from its ground; a search finds, the version is chosen, the arena sorts, a tutorial is two clicks from home.
Usage: test_site.py SOURCE_FOLDER [SITE_FOLDER] [--shots FOLDER]"""
import argparse
import functools
import http.server
import json
import pathlib
import re
import sys
import threading
import time

parser = argparse.ArgumentParser()
parser.add_argument("source", type=pathlib.Path)
parser.add_argument("site", type=pathlib.Path, nargs="?")
parser.add_argument("--shots", type=pathlib.Path, help="pictures of each page at each width, to look at")
given = parser.parse_args()
site = (given.site or given.source / "build/site").resolve()
sys.path.insert(0, str(given.source / "scripts"))
import web_test  # noqa: E402


class Browser(web_test.Browser):
    def listen(self, event):
        """A page that is a file may not ask for the list of versions, and has no choice of them: no fault."""
        super().listen(event)
        self.errors = [text for text in self.errors if not re.search("file:.*versions.json", text)]


MENU = "JSON.stringify([...document.querySelectorAll('.md-nav--primary a.md-nav__link, .md-tabs__link')].map(a => a.href.split('#')[0]))"
WIDER = """[...document.querySelectorAll('article *')].filter(e => e.getBoundingClientRect().right > innerWidth + 1
    && !e.closest('.md-typeset__scrollwrap, .wide, pre, .highlight, nav')).map(e => e.outerHTML.slice(0, 80))[0]
    || (document.documentElement.scrollWidth > innerWidth ? 'the page' : '')"""
MISSING = "[...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src)[0] || ''"
CONTRAST = """(() => {
    const light = c => { const [r, g, b] = c.match(/[\\d.]+/g).map(Number).map(v => (v /= 255) <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4);
        return .2126 * r + .7152 * g + .0722 * b };
    const ground = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor; if (!/, 0\\)|transparent/.test(c)) return light(c) } return 1 };
    let worst = 21;
    for (const e of document.querySelectorAll('article p, article td, article li, article h1, article h2, article a:not(.headerlink)')) {
        const canvas = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
        canvas.fillStyle = getComputedStyle(document.body).backgroundColor; canvas.fillRect(0, 0, 1, 1);
        canvas.fillStyle = getComputedStyle(e).color; canvas.fillRect(0, 0, 1, 1);
        const a = light(canvas.getImageData(0, 0, 1, 1).data.join()), b = ground(e);
        worst = Math.min(worst, (Math.max(a, b) + .05) / (Math.min(a, b) + .05));
        if (worst < 4.5) return worst.toFixed(1) + ' ' + e.outerHTML.slice(0, 80);
    }
    return '' })()"""
SEARCH = """(() => { const q = document.querySelector('.md-search__input'); document.querySelector('#__search').click(); q.focus();
    setTimeout(() => { q.value = 'bevameter plate'; q.dispatchEvent(new InputEvent('input', {bubbles: true}));
                       q.dispatchEvent(new Event('keyup', {bubbles: true})) }, 500) })()"""
SORT = """(() => { const [policy, s50] = document.querySelectorAll('table.s50 th button'), rows = document.querySelector('table.s50').tBodies[0].rows;
    const said = button => { button.click(); return [...rows].map(row => row.cells[button === policy ? 0 : 1].dataset.v).join(' ') };
    return JSON.stringify([said(policy), said(s50), said(s50)]) })()"""
FOUND = "[...document.querySelectorAll('.md-search-result__link')].map(a => a.href)[0] || ''"
faults = []


def look(browser, address, name):
    browser.errors.clear()
    browser.call("Page.navigate", url=address)
    browser.wait(f"document.readyState === 'complete' && location.href === {address!r}", 20)
    for what, expression in (("wider than the screen", WIDER), ("no picture", MISSING), ("too little contrast", CONTRAST)):
        said = browser.value(expression)
        if said is None or said:
            faults.append(f"{name} {address}: {what}: {said}")
    faults.extend(f"{name} {address}: {text}" for text in browser.errors)
    if given.shots:
        given.shots.mkdir(parents=True, exist_ok=True)
        browser.picture(given.shots / f"{name}-{re.sub('[^a-z0-9]+', '-', address.rsplit('site/', 1)[-1].lower())}.png")


def searched(browser, address, name):
    browser.call("Page.navigate", url=address)
    browser.wait(f"document.readyState === 'complete' && location.href === {address!r}", 20)
    time.sleep(0.5)
    browser.value(SEARCH)
    found = browser.wait(FOUND, 10)
    if not found or not re.search("/docs/(model|grains|soil|tutorials)", found):
        faults.append(f"{name}: a search for plates finds {found}")


def sorted_rows(browser, address, name):
    """The page of the arena by name, by S50, and by S50 downward."""
    look(browser, address, name)
    names, up, down = (text.split() for text in json.loads(browser.value(SORT)))
    up, down = list(map(float, up)), list(map(float, down))
    if len(names) < 20 or names != sorted(names, key=str.lower) or up != sorted(up) or down != up[::-1]:
        faults.append(f"{name}: the arena does not sort: {names} {up} {down}")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


version = re.search(r"project\(mild VERSION (\d+\.\d+)", (given.source / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
if not (site / version / "index.html").is_file():
    sys.exit(f"FAIL: {site} has no site of {version}; make site")
home = f"{(site / version).as_uri()}/index.html"
foreign = [f"{page.name}: {url}" for page in site.rglob("*.html") for url in re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="(https?:[^"]*)"', page.read_text(encoding="utf-8"))]
faults += [f"asks another machine: {text}" for text in foreign]
pages = []
kinds = [("desktop-dark", 1440, 900, True), ("phone", 390, 844, False), ("desktop", 1440, 900, False), ("phone-dark", 390, 844, True)]
for name, width, height, dark in kinds if given.shots else kinds[:2]:
    browser = Browser(width, height)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
    if not pages:
        browser.call("Page.navigate", url=home)
        browser.wait("document.querySelector('.md-tabs__link')", 20)
        tabs = sorted(set(re.findall(r'"([^"]+)"', browser.value(MENU))))
        for tab in tabs:
            browser.call("Page.navigate", url=tab)
            browser.wait(f"document.readyState === 'complete' && location.href === {tab!r}", 20)
            pages += re.findall(r'"([^"]+)"', browser.value(MENU))
        pages = sorted(set(pages))
        if len(pages) < 40 or not any("tutorials/deploy" in page for page in pages):
            faults.append(f"only {len(pages)} pages in the menu")
    for page in pages:
        look(browser, page, name)
    sorted_rows(browser, f"{(site / version).as_uri()}/arena/index.html", name)
    searched(browser, home, name)
    browser.close()

server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site))
threading.Thread(target=server.serve_forever, daemon=True).start()
browser, address = Browser(1440, 900), f"http://127.0.0.1:{server.server_port}"
browser.call("Page.navigate", url=f"{address}/")
if not browser.wait(f"location.pathname === '/{version}/index.html'", 10):
    faults.append(f"the address of the site does not lead to {version}")
if not browser.wait(f"document.querySelector('.md-version__current')?.textContent.includes('{version}')", 10):
    faults.append("no choice of versions")
searched(browser, f"{address}/{version}/index.html", "server")
faults += [f"server: {text}" for text in browser.errors]
browser.close()
server.shutdown()
print("\n".join(faults[:40]))
print(f"{len(pages)} pages of the menu, {len(faults)} faults")
sys.exit(bool(faults))
