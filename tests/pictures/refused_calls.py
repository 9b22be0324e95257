"""Refused calls of pictures from Python with their texts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from eomgen.products.pictures import section_loads
from eomgen.products.pictures.command import RestPicture
from tests.failures.failure import invoked


def rest_options(**given: object) -> dict[str, Any]:
    """Return options of ``eomgen equilibrium``."""
    return {"along": None, "over": (), "figure": None, "buckling": None, "path": None, **given}


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "figure of a path": (
        lambda: RestPicture(rest_options(along="load=0:10", figure="a.gif")),
        "--plot a.gif: a figure is a .png, .svg or .pdf file; try: --plot rest.png",
    ),
    "sections at no time": (
        lambda: section_loads._rows_at(cast(Any, SimpleNamespace(t=np.arange(3.0))), []),
        "plot_sections: at: there are no times; try: times in s, or no at for a map over time",
    ),
}

#: Readers of files: ending, call and exit code.
READERS: dict[str, tuple[str, Callable[[Path], object], int]] = {
    "page": (".npz", lambda path: invoked("animate", str(path), "--out", str(path.with_name("a.html"))), 7),
}
