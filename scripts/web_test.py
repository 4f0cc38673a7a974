#!/usr/bin/env python3
"""Opens the page of `mild web` in headless Chromium, walks ten seconds, and checks what came of it (docs/web.md).

Usage: scripts/web_test.py [--mild build/mild] [--shots FOLDER]
Drives the browser by its DevTools protocol. Pictures are drawn by the processor here, so the page may lower
its resolution, as it does on a slow phone; the physics may not be slower than real time."""

import argparse
import base64
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

BYTES, READY, PACE, SPEED = 3e6, 2.0, 0.99, 0.1  # bounds: [B], [s], [-] of real time, [-] of the command


class Browser:
    """One page of headless Chromium."""

    def __init__(self, width, height):
        self.folder = tempfile.mkdtemp()
        program = shutil.which("chromium") or shutil.which("google-chrome")
        if not program:
            sys.exit("web_test: chromium is missing; scripts/setup.sh web installs it")
        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--remote-debugging-port=0", f"--user-data-dir={self.folder}",
             "--no-first-run", "--mute-audio", f"--window-size={width},{height}", "about:blank"],
            stderr=subprocess.PIPE, text=True)
        port = None
        for line in self.process.stderr:
            found = re.search(r"ws://127.0.0.1:(\d+)/", line)
            if found:
                port = int(found[1])
                break
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
        address = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
        self.socket = socket.create_connection(("127.0.0.1", port))
        path = address.split(str(port), 1)[1]
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        self.left = b""
        while b"\r\n\r\n" not in self.left:
            self.left += self.socket.recv(65536)
        self.left = self.left.split(b"\r\n\r\n", 1)[1]
        self.number, self.errors = 0, []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def take(self, count):
        while len(self.left) < count:
            more = self.socket.recv(1 << 20)
            if not more:
                raise OSError("the browser has gone")
            self.left += more
        taken, self.left = self.left[:count], self.left[count:]
        return taken

    def message(self):
        text = b""
        while True:
            first, second = self.take(2)
            length = second & 127
            if length >= 126:
                length = int.from_bytes(self.take(2 if length == 126 else 8), "big")
            text += self.take(length)
            if first & 128:
                return json.loads(text)

    def call(self, method, **parameters):
        self.number += 1
        text = json.dumps({"id": self.number, "method": method, "params": parameters}).encode()
        size = bytes([128 | len(text)]) if len(text) < 126 else bytes([128 | 126]) + len(text).to_bytes(2, "big")
        self.socket.sendall(b"\x81" + size + bytes(4) + text)  # a mask of zeros
        while True:
            answer = self.message()
            self.listen(answer)
            if answer.get("id") == self.number:
                return answer.get("result", {})

    def listen(self, event):
        what, about = event.get("method"), event.get("params", {})
        if what == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif what == "Runtime.consoleAPICalled" and about["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in about["args"]))
        elif what == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(about["entry"]["text"] + " " + about["entry"].get("url", ""))

    def value(self, expression):
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True).get("result", {}).get("value")

    def wait(self, expression, seconds):
        end = time.time() + seconds
        while time.time() < end and not self.errors:
            value = self.value(expression)
            if value:
                return value
            time.sleep(0.1)
        return None

    def picture(self, path):
        pathlib.Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        self.process.terminate()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def serve(mild):
    """Starts `mild web` on a free port; returns the process and the address."""
    server = subprocess.Popen([mild, "web", "--port", "0"], stdout=subprocess.PIPE, text=True)
    found = re.search(r"http://[\w.:]+/", server.stdout.readline())
    if not found:
        sys.exit("web_test: mild web does not say where the page is")
    return server, found[0]


def press(browser, kind, code, key):
    browser.call("Input.dispatchKeyEvent", type=kind, code=code, key=key)


def drive(browser):
    """Keys, sliders and the list of grounds as somebody uses them; returns what is wrong."""
    wrong = []
    browser.value("app.script = null; app.choose(6, 0)")
    press(browser, "keyDown", "KeyS", "s")
    if not browser.wait("app.core.view().velocity[0] < -0.3", 20):
        wrong.append("the key S does not walk backward")
    press(browser, "keyUp", "KeyS", "s")
    press(browser, "keyDown", "ArrowLeft", "ArrowLeft")
    if not browser.wait("app.core.view().velocity[2] > 0.5", 20):
        wrong.append("the key ArrowLeft does not turn")
    press(browser, "keyUp", "ArrowLeft", "ArrowLeft")
    press(browser, "keyDown", "Digit1", "1")
    press(browser, "keyUp", "Digit1", "1")
    if not browser.wait("app.ground === 0 && app.core.view().link[3] < 0.5", 5):
        wrong.append("the key 1 does not choose rubber")
    browser.value("$ = document.getElementById('stiffness'); $.value = 1; $.dispatchEvent(new Event('input'))")
    if not browser.wait("app.time > 0 && document.getElementById('stiffness-value').textContent === '\u00d7 4.00'", 5):
        wrong.append("the slider of the stiffness does not say what it is")
    browser.value("document.querySelectorAll('#grounds button')[7].click()")
    if not browser.wait("app.ground === 6", 5):
        wrong.append("a click does not choose loose sand")
    browser.value("app.time0 = app.time; app.driver.touched = true")
    stiff = browser.wait("app.time > app.time0 + 2 && Math.max(...app.core.view().depth)", 20)
    if not stiff or stiff > 0.03:
        wrong.append(f"loose sand four times as stiff carries the robot at {stiff} m")
    browser.value("app.takeSoil({name: 'mars.ini', text: async () => '[ground]\\npreset = sandy_loam\\nmu = 0.5\\n'})")
    if not browser.wait("app.ground === 10 && app.time > 1", 10):
        wrong.append("a soil's file is not the ground")
    browser.value("app.takeSoil({name: 'mars.ini', text: async () => '[ground]\\nmu = 9\\n'})")
    if not browser.wait("/^mars.ini/.test(document.getElementById('toast').textContent) && app.ground === 10", 10):
        wrong.append("a soil that is none is not refused")
    fetched = "performance.getEntriesByType('resource').filter((e) => /bin$/.test(e.name)).map((e) => e.name.split('/').pop()).join()"
    if browser.value(fetched) != "sa01.bin":
        wrong.append(f"before another robot is chosen {browser.value(fetched)} is fetched")
    for button, name, feet in [(1, "g1", 2), (2, "go1", 4), (3, "g1_run", 2), (4, "g1_jump", 2), (0, "sa01", 2)]:
        browser.value(f"document.querySelectorAll('#robots button')[{button}].click(); app.script = () => [0.55, 0, 0]")
        if not browser.wait(f"app.robot === {button} && app.core.view().feet === {feet} && app.core.view().link[3] > 0.6 && !app.fallen", 30):
            wrong.append(f"{name} does not walk when it is chosen")
    if browser.value(fetched) != "sa01.bin,g1.bin,go1.bin,g1_run.bin,g1_jump.bin":
        wrong.append(f"{browser.value(fetched)} are fetched, and not each robot once")
    return wrong


def walk(address, bounds):
    """The page's own test; returns what is wrong."""
    browser = Browser(480, 300)
    wrong, ready = [], []
    for query in ["", "", "test=0.6&ground=6"]:  # the fastest of three: others share the processor
        browser.call("Network.clearBrowserCache")
        browser.call("Page.navigate", url=f"{address}?{query}")
        ready.append(browser.wait("window.app && app.ready", 60) or 60)
    report = browser.wait("window.report && JSON.stringify(window.report)", 60)
    wrong += drive(browser) if report and bounds else []
    if report:
        report = {"ready": min(ready), **json.loads(report)}
        print("web_test: " + ", ".join(f"{k} {v:.4g}" for k, v in report.items()))
        checks = {
            f"{report['bytes'] / 1e6:.2f} MB are transferred": report["bytes"] < BYTES,
            f"the page is ready after {report['ready']:.2f} s": report["ready"] < READY,
            f"{report['simulated']:.2f} s are simulated in {report['elapsed']:.2f} s": report["simulated"] > PACE * report["elapsed"],
            f"the robot fell or leans, {report['upright']:.2f}": report["upright"] > 0.95 and not report["fell"],
            f"it walks at {report['speed']:.2f} m/s of {report['asked']:.2f}": abs(report["speed"] / report["asked"] - 1) < SPEED,
        }
        wrong += [text for text, good in checks.items() if bounds and not good]
    else:
        wrong.append("no report")
    wrong += browser.errors
    browser.close()
    return wrong


SHOTS = {  # name: width, height, query, seconds of walking
    "stripes": (1280, 800, "", 7), "sand": (1280, 800, "ground=6", 9), "grass": (1280, 800, "ground=5", 7),
    "foam": (1280, 800, "ground=2", 7), "rigid": (1280, 800, "ground=8", 5), "waves": (1280, 800, "ground=7&shape=1", 9),
    "phone": (390, 844, "ground=6", 7), "g1": (1280, 800, "robot=g1&ground=6", 9), "go1": (1280, 800, "robot=go1&ground=5", 9),
    "go1_stripes": (1280, 800, "robot=go1", 12), "g1_phone": (390, 844, "robot=g1", 8), "go1_phone": (390, 844, "robot=go1&ground=6", 7),
}


def shoot(address, folder, names):
    """Pictures to look at; the browser's clock is the wall's, so the page catches up what drawing costs."""
    wrong = []
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    for name in names or SHOTS:
        width, height, query, seconds = SHOTS[name]
        browser = Browser(width, height)
        browser.call("Page.navigate", url=f"{address}?{query}")
        browser.wait("window.app && app.steps > 0", 20)
        browser.value("app.picture.adapt = () => {}; app.picture.scale = app.picture.blades = 1; app.script = () => [0.55, 0, 0]; app.driver.touched = true")
        browser.wait(f"app.time > {seconds}", 90)
        browser.picture(f"{folder}/{name}.png")
        print(f"web_test: {folder}/{name}.png")
        wrong += browser.errors
        browser.close()
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mild", default="build/mild")
    parser.add_argument("--address", help="of a page that is served already")
    parser.add_argument("--shots", help="folder for pictures, instead of the test")
    parser.add_argument("names", nargs="*", help="which pictures")
    arguments = parser.parse_args()
    os.chdir(pathlib.Path(__file__).parent.parent)
    server, address = (None, arguments.address) if arguments.address else serve(arguments.mild)
    try:
        wrong = shoot(address, arguments.shots, arguments.names) if arguments.shots else walk(address, True)
    finally:
        if server:
            server.terminate()
    for text in wrong:
        print(f"web_test: {text}", file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
