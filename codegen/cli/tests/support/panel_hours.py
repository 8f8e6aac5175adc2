"""The panel's page for hours, in headless Chromium: a simulated machine that runs and is jogged, and every 30 s what the page counts of
itself, its memory after collection, and late ticks. At the end what the real-time program says of its ticks. Behind the seconds, `client`: no
browser, but a client that takes every row and draws nothing; `alone`: no panel. What they differ by is what the panel costs.

    specgen build specs/reference.toml --target rt-pc -o controller
    pip install websocket-client
    python codegen/cli/tests/support/panel_hours.py specs/reference.toml controller/target/rt-pc/release/rt-pc 3600
"""

import contextlib
import json
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from typing import Any

from websocket import create_connection

PORT = 9333
CHROMIUM = ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1440,900"]


class Page:
    """A page of Chromium, over its debugging protocol."""

    def __init__(self) -> None:
        self.socket = create_connection(self.address(), suppress_origin=True)
        self.number = 0

    @staticmethod
    def address() -> str:
        for _ in range(200):
            with contextlib.suppress(OSError):
                tabs = json.load(urllib.request.urlopen(f"http://127.0.0.1:{PORT}/json"))
                for tab in tabs:
                    if tab["type"] == "page":
                        return str(tab["webSocketDebuggerUrl"])
            time.sleep(0.2)
        raise SystemExit("Chromium shows no page")

    def ask(self, method: str, **parameters: object) -> Any:
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv())
            if answer.get("id") == self.number:
                return answer["result"]

    def value(self, script: str) -> Any:
        return self.ask("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def text(self, name: str) -> str:
        return str(self.value(f"document.getElementById('{name}').textContent"))

    def press(self, name: str, seconds: float) -> None:
        box = f"document.getElementById('{name}').getBoundingClientRect()"
        x, y = self.value(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({box})")
        for kind in ["mousePressed", "mouseReleased"]:
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
            time.sleep(seconds if kind == "mousePressed" else 0)

    def wait(self, name: str, word: str) -> None:
        for _ in range(600):
            if word in self.text(name).lower():
                return
            time.sleep(0.1)
        raise SystemExit(f"{name} does not become {word}: {self.text(name)}")


def watch(page: Page, seconds: float) -> None:
    time.sleep(3)
    page.press("orders", 0.05)
    time.sleep(0.5)
    page.press("arm", 1.4)
    page.wait("chip", "holding")
    page.press("run", 1.4)
    page.wait("chip", "running")
    start = time.monotonic()
    while (passed := time.monotonic() - start) < seconds:
        time.sleep(min(30, seconds / 4))
        counted = page.value("JSON.stringify(document.documentElement.dataset)")
        page.ask("HeapProfiler.collectGarbage")
        memory = page.ask("Runtime.getHeapUsage")["usedSize"] / 1e6
        print(f"{passed:6.0f} s  {memory:.2f} MB  {page.text('chip')}  late {page.text('late')}  {counted}", flush=True)
        page.value("document.querySelectorAll('#jog button:not([disabled])')[0]?.click()")


def take(address: str, seconds: float) -> None:
    """Takes every row, as the page does, and counts the gaps between blocks."""
    host, token = re.fullmatch(r"http://([^/]+)/\S*?(\w{16,})", address).groups()  # type: ignore[union-attr]
    socket = create_connection(f"ws://{host}/socket?token={token}", origin=f"http://{host}")
    rows, gaps, due = 0, 0, None
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = socket.recv()
        if isinstance(message, str):
            continue
        blocks, number = struct.unpack_from("<II", message, 4)
        place = 72
        for _ in range(blocks):
            tick, _, every, count, _ = struct.unpack_from("<dIIII", message, place)
            gaps += due is not None and tick != due
            rows, due = rows + count, tick + every * count
            place += 24 + 200 * count
        socket.send(json.dumps({"do": "seen", "number": number}))
    print(f"{rows} rows, {gaps} gaps")
    socket.close()


def main(spec: str, program: str, seconds: float, who: str = "page") -> None:
    started: list[subprocess.Popen[str]] = []

    def start(*words: str, **streams: Any) -> subprocess.Popen[str]:
        started.append(subprocess.Popen(words, text=True, **streams))
        return started[-1]

    def there(path: Path) -> None:
        while not path.exists():
            time.sleep(0.1)

    with tempfile.TemporaryDirectory() as folder:
        link, summary = Path(folder, "link"), Path(folder, "summary.json")
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        try:
            start("specgen", "plant", spec, "--name", "panel-hours", **quiet)
            there(Path("/dev/shm/specgen-plant-panel-hours"))
            ticks = ["--sim", "panel-hours", "--elastic", "--sim-timeout", "5000", "--allow-no-rt", "--json"]
            with summary.open("w") as file:
                start(program, *ticks, "--link", str(link), stdout=file, stderr=subprocess.DEVNULL)
            there(link)
            if who == "alone":
                time.sleep(seconds)
            else:
                panel = ["panel", spec, "--socket", str(link), "--listen", "127.0.0.1:8133"]
                lines = start("specgen", *panel, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE).stderr
                assert lines
                address = next(found[0] for line in lines if (found := re.search(r"http://\S+", line)))
                threading.Thread(target=lines.read, daemon=True).start()
                if who == "client":
                    take(address, seconds)
                else:
                    start(*CHROMIUM, f"--remote-debugging-port={PORT}", f"--user-data-dir={folder}/profile", address, **quiet)
                    watch(Page(), seconds)
        finally:
            for one in reversed(started):
                one.terminate()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    one.wait(20)
        told = json.loads(summary.read_text())
        print({key: told[key] for key in ["planned", "on_time", "late", "skipped", "last_phase", "failure", "link"]})


main(sys.argv[1], sys.argv[2], float(sys.argv[3]), *sys.argv[4:])
