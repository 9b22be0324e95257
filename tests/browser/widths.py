"""Layout of the pages of a site at two widths in Chromium: ``python -m tests.browser.widths docs/_build/html``.

Reported are parts of a page that end beyond its width without a box that scrolls, text that a box cuts off, and
pictures that are not there.
"""

from __future__ import annotations

import contextlib
import html
import json
import re
import sys
import threading
from collections.abc import Iterator, Sequence
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from tests.browser.chromium import MISSING, chromium, loaded

#: Widths of the window, px: a screen and a telephone.
WIDTHS = (1280, 400)
#: Pages in one process of Chromium.
_TOGETHER = 40
#: Opens pages one after the other in a frame of a width, which a window may not have, and lists the faults of each.
_PAGE = Path(__file__).with_name("widths.html")


class _Handler(SimpleHTTPRequestHandler):
    def do_GET(self) -> None:
        if not self.path.startswith("/?"):
            return super().do_GET()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(_PAGE.read_bytes())
        return None

    def log_message(self, *_: object) -> None:
        """Print no requests."""


@contextlib.contextmanager
def _served(site: Path) -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, directory=str(site))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/"
        server.shutdown()


def faults(site: Path, pages: Sequence[str], width: int) -> list[str]:
    """Return the faults of pages, ``/how_to/units/``, of a site at a width in px."""
    found: list[str] = []
    with _served(site) as address:
        for start in range(0, len(pages), _TOGETHER):
            document = loaded(f"{address}?w={width}&p={','.join(pages[start : start + _TOGETHER])}")
            match = re.search(r"FAULTS(.*)END</pre>", document, re.DOTALL)
            if match is None:
                raise RuntimeError(f"Chromium did not come to the end of the pages from {pages[start]} on")
            found += [str(fault) for fault in json.loads(html.unescape(match[1]))]
    return found


def main(arguments: list[str]) -> int:
    """Print the faults of all pages of a site; return 1 if there are any."""
    if chromium() is None:
        sys.stderr.write(f"{MISSING}\n")
        return 2
    site = Path(arguments[0])
    pages = [f"/{path.parent.relative_to(site).as_posix()}/".replace("/./", "/") for path in site.rglob("index.html")]
    lines = [f"{width}: {fault}\n" for width in WIDTHS for fault in faults(site, sorted(pages), width)]
    sys.stdout.writelines([*lines, f"{len(pages)} pages at {' and '.join(map(str, WIDTHS))} px: {len(lines)} faults\n"])
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
