"""A headless Chromium for tests: opens a page from disk and gives back what it drew, its HTML, and what it complained
of."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
MAC = Path("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome")
MISSING = (
    "these tests look at pages in Chromium, and none is installed; try: apt-get install chromium, or CHROMIUM=<its"
    " path>"
)
_QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--log-level=0",
)


def chromium() -> str | None:
    """Return the browser's command; ``CHROMIUM`` names one that is not on the path."""
    named = [os.environ["CHROMIUM"]] if "CHROMIUM" in os.environ else []
    found = next((path for name in (*named, *NAMES) if (path := shutil.which(name))), None)
    return found or (str(MAC) if MAC.is_file() else None)


def loaded(address: str) -> str:
    """Return the HTML of a page on a server after its scripts have run, for at most a minute of their time."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = [str(chromium()), *_QUIET, f"--user-data-dir={profile}", "--window-size=1400,1000"]
        words += ["--virtual-time-budget=60000", "--dump-dom", address]
        return subprocess.run(words, capture_output=True, text=True, timeout=300, check=True).stdout


def with_scripts(page: Path, *scripts: str) -> Path:
    """Return a copy of a page with scripts at its end: names of files of this folder, or texts."""
    texts = [Path(__file__).with_name(x).read_text(encoding="utf-8") if x.endswith(".js") else x for x in scripts]
    copy = page.with_name(f"asked_{page.name}")
    end = "".join(f"<script>{text}</script>" for text in texts)
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{end}</body>"), encoding="utf-8")
    return copy


def told_by(document: str) -> Any:
    """Return the JSON that a script has written into a page, None without any."""
    found = re.search(r'<body[^>]*\bdata-told="([^"]*)"', document)
    return json.loads(html.unescape(found[1])) if found else None


class Browser:
    """Opens pages, each in a new process with a new profile.

    Attributes
    ----------
    said : what the last page has written to its console.
    """

    def __init__(self, command: str, width: int = 1000, height: int = 640) -> None:
        self.command = command
        self.size = f"--window-size={width},{height}"
        self.said: list[str] = []

    def document(self, page: Path, place: str = "", *options: str) -> str:
        """Return the page's HTML after its scripts have run."""
        return self._run(page, place, "--dump-dom", *options)

    def picture(self, page: Path, place: str = "", *options: str) -> np.ndarray:
        """Return what the page looks like, (height, width, 3), 0 to 255."""
        import matplotlib.image  # this is a reader of PNG that is there anyway

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "page.png"
            self._run(page, place, f"--screenshot={file}", *options)
            return np.round(255 * matplotlib.image.imread(file)[..., :3]).astype(int)

    def _run(self, page: Path, place: str, *options: str) -> str:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            words = [self.command, *_QUIET, self.size, f"--user-data-dir={profile}", "--virtual-time-budget=2000"]
            words += [*options, f"{page.as_uri()}#{place}"]
            done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
        self.said = re.findall(r'CONSOLE[^\]]*\] "(.*)", source: ', done.stderr)
        return done.stdout
