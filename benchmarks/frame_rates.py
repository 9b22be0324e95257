"""Frames per second of live pages, playing in real time in a headless Chromium without a graphics card.

    make live
    python -m benchmarks.frame_rates out/live/*.html [--seconds 6]

Each page is opened in a new browser of 1280 by 900 pixels and plays at the speed of its slider; its script counts the
frames that the browser shows, and the seconds of the model by which the page moved on. Other work of the machine takes
frames; the processor time of a frame, of all processes of the browser, changes less (Linux alone).
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from benchmarks.measure import figure, machine, table

#: The page reports by opening another address: its own policy forbids every other connection.
COUNTER = """<script>ready.then(() => {
  play(true);
  const began = performance.now(), from = state.time, clock = Date.now() / 1000;
  let frames = 0;
  requestAnimationFrame(function count() {
    const passed = performance.now() - began;
    frames += 1;
    if (passed < 1000 * SECONDS) requestAnimationFrame(count);
    else location.href = `/counted?frames=${frames}&seconds=${passed / 1000}&model=${state.time - from}&began=${clock}`;
  });
});</script></body>"""
#: Seconds beyond the play after which a page is given up.
PATIENCE = 30.0
#: Seconds between samples of the browser's processor time.
SAMPLING = 0.05
CHROMIUM = ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=1280,900")


class Count(NamedTuple):
    """Shown frames, the seconds that passed, the seconds of the model by which the page moved on, the time at which it
    began, and the seconds of processors that the browser took for it; not a number if the system does not tell."""

    frames: float
    seconds: float
    model: float
    began: float
    processor: float = math.nan


def processor_time(process: int) -> float:
    """Return the seconds of processors that a process and those below it have used; not a number without /proc."""
    children: dict[int, list[int]] = {}
    seconds: dict[int, float] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        children.setdefault(int(fields[1]), []).append(int(folder.name))
        seconds[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    found = [process]
    for number in found:
        found += children.get(number, [])
    return sum(seconds.get(number, 0.0) for number in found) if seconds else math.nan


def count(page: Path, seconds: float, command: str = "chromium") -> Count:
    """Return the frames that a browser shows while a page plays.

    Raises
    ------
    RuntimeError
        If the page does not start to play.
    """
    text = page.read_text(encoding="utf-8").replace("</body>", COUNTER.replace("SECONDS", f"{seconds}"))
    counted: Queue[Count] = Queue()

    class Server(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            address = urlsplit(self.path)
            if address.path == "/counted":
                given = parse_qs(address.query)
                counted.put(Count(*(float(given[name][0]) for name in Count._fields[:4])))
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(text.encode() if address.path == "/" else b"")

        def log_message(self, *_: object) -> None:
            """Keep the terminal free of requests."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Server) as server, tempfile.TemporaryDirectory() as profile:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        words = [command, *CHROMIUM, f"--user-data-dir={profile}", f"http://127.0.0.1:{server.server_port}/"]
        browser = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        used: list[tuple[float, float]] = []
        try:
            while counted.empty() and (not used or time.time() < used[0][0] + seconds + PATIENCE):
                used.append((time.time(), processor_time(browser.pid)))
                time.sleep(SAMPLING)
            found = counted.get_nowait()
            during = [sample for sample in used if found.began <= sample[0] <= found.began + found.seconds]
            share = found.seconds / (during[-1][0] - during[0][0])
            return found._replace(processor=share * (during[-1][1] - during[0][1]))
        except Empty:
            raise RuntimeError(f"{page.name} does not start to play") from None
        finally:
            browser.kill()
            browser.wait()
            server.shutdown()


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.frame_rates", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=6.0)
    arguments = parser.parse_args(words)
    print(machine())
    counts = [(page.stem, count(page, arguments.seconds)) for page in arguments.pages if page.stem != "index"]
    rows = [
        [
            name,
            figure(one.frames / one.seconds),
            figure(one.model / one.seconds),
            figure(1000.0 * one.processor / one.frames),
        ]
        for name, one in counts
    ]
    heading = ["page", "frames per second", "seconds of the model per second", "processor time of a frame, ms"]
    print(table(heading, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
