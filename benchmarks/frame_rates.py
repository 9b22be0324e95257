"""Frames per second of live pages, playing in real time in a headless Chromium without a graphics card.

    make live
    python -m benchmarks.frame_rates out/live/*.html [--seconds 6]

Each page is opened in a new browser of 1280 by 900 pixels and plays at the speed of its slider; its script counts the
frames that the browser shows, and the seconds of the model by which the page moved on.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import threading
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
  const began = performance.now(), from = state.time;
  let frames = 0;
  requestAnimationFrame(function count() {
    const passed = performance.now() - began;
    frames += 1;
    if (passed < 1000 * SECONDS) requestAnimationFrame(count);
    else location.href = `/counted?frames=${frames}&seconds=${passed / 1000}&model=${state.time - from}`;
  });
});</script></body>"""
#: Seconds beyond the play after which a page is given up.
PATIENCE = 30.0
CHROMIUM = ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=1280,900")


class Count(NamedTuple):
    """Shown frames, the seconds that passed, and the seconds of the model by which the page moved on."""

    frames: float
    seconds: float
    model: float


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
                counted.put(Count(*(float(given[name][0]) for name in Count._fields)))
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
        try:
            return counted.get(timeout=seconds + PATIENCE)
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
    rows = [[name, figure(one.frames / one.seconds), figure(one.model / one.seconds)] for name, one in counts]
    print(table(["page", "frames per second", "seconds of the model per second"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
