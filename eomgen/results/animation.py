"""Animations: motion and scenery of a solution in one self-contained HTML file without network access.

Everything that the user named reaches the page as JSON in a block of data, where no text can end the block or become
code.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.errors import FileError, Problem, UsageError
from eomgen.files import write_text
from eomgen.resources import template_folder
from eomgen.results.scenery import PosesAndScenery
from eomgen.system.description import BASE, WORLD

#: Stored pictures per second of motion; those of short runs are at least FEWEST, and a page holds at most LARGEST bytes
#: of them.
RATE, FEWEST, LARGEST = 60.0, 600, 24_000_000
_SCRIPTS = {
    "style": "animation.css",
    "geometry": "geometry.js",
    "colours": "colours.js",
    "stage": "stage.js",
    "drawing": "drawing.js",
    "page": "page.js",
}


class Animated(Protocol):
    """What a page shows: a ``Solution``."""

    @property
    def t(self) -> Array: ...
    @property
    def success(self) -> bool: ...
    @property
    def message(self) -> str: ...
    @property
    def metadata(self) -> Mapping[str, Any]: ...
    @property
    def poses_and_scenery(self) -> PosesAndScenery: ...


def write_animation(solution: Animated, path: str | Path) -> Path:
    """Write a solution's motion as one HTML file: all in it, nothing fetched; return its path.

    Poses are thinned to 60 a second (short runs: up to 600 in all) and stored as single precision; the page
    interpolates.

    Raises
    ------
    UsageError
        A solution without poses, or a name that ends otherwise than in ``.html``.
    FileError
        The path cannot be written, or the solution's file did not hold what eomgen writes.
    """
    path = check_name(Path(path))
    write_text(path, animation_page(solution))
    return path


def check_name(path: Path) -> Path:
    """Return the path of a page as it is. Raises UsageError where it does not end in ``.html``."""
    if path.suffix.lower() not in (".html", ".htm"):
        kind = path.suffix or "a file without a suffix"
        raise UsageError(
            Problem(str(path), f"an animation cannot be saved as {kind}", f"{path.stem or 'animation'}.html")
        )
    return path


def animation_page(solution: Animated) -> str:
    """Return the text of the page; see ``write_animation``."""
    poses_and_scenery = solution.poses_and_scenery
    try:
        data = _packed(solution, poses_and_scenery.poses, poses_and_scenery.scenery)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        what = f"its poses or its scenery are not what eomgen writes: {type(error).__name__}: {error}"
        raise FileError(Problem("solution", what, "eomgen simulate again")) from None
    folder = template_folder() / "html"
    page = (folder / "animation.html").read_text(encoding="utf-8")
    parts = {name: (folder / file).read_text(encoding="utf-8").rstrip() for name, file in _SCRIPTS.items()}
    parts |= {"title": html.escape(data["name"]), "version": html.escape(str(solution.metadata.get("version", "")))}
    parts["data"] = _harmless(json.dumps(data, sort_keys=True, allow_nan=False))
    return re.sub(r"@(\w+)@", lambda mark: parts[mark[1]], page)


def _harmless(text: str) -> str:
    """Return JSON in which no bracket can end the block it stands in or begin another."""
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _packed(solution: Animated, poses: Mapping[str, Array], scenery: Mapping[str, Any]) -> dict[str, Any]:
    """Return the page's data; bodies are numbered in the order of the poses, -1 is the world."""
    carriers = {name: number for number, name in enumerate(poses)}
    stacked = np.stack(list(poses.values()), axis=1)
    finite = np.isfinite(stacked).all(axis=(1, 2))
    if not finite.any():
        raise ValueError("no pose is finite")
    t, stacked = solution.t[finite], stacked[finite]
    rows = _thinned(t, stacked[0].size * 4)
    order = [body["name"] for body in scenery["bodies"]]
    used = {end for spring in scenery["springs"] for end in (spring["first"], spring["second"])}

    def carrier(body: str) -> int:
        return carriers.get(BASE, -1) if body == BASE else -1 if body == WORLD else carriers[body]

    def at(item: Mapping[str, Any]) -> dict[str, Any]:
        return {"carrier": carrier(item["body"]), "position": item["position"]}

    points = {
        item["name"]: {
            "name": item["name"],
            **at(item),
            "body": order.index(item["body"]) if item["body"] in order else -1,
            "trace": item["trace"],
            "drawn": item["trace"] or item["name"] in used,
        }
        for item in scenery["points"]
    }
    if not points:
        last = scenery["bodies"][-1]
        name = f"centre of {last['name']}"
        camera = {"body": last["name"], "position": last["solid"]["center"]}
        points[name] = {"name": name, **at(camera), "body": len(order) - 1, "trace": True, "drawn": True}
    return {
        "name": str(solution.metadata.get("scene", "scene")),
        "description": scenery["description"],
        "success": solution.success,
        "message": solution.message,
        "gravity": scenery["gravity"],
        "base": carriers.get(BASE, -1),
        "carriers": len(carriers),
        "times": _base64(t[rows].astype("<f8")),
        "poses": _base64(stacked[rows].astype("<f4")),
        "bodies": [{**body, "carrier": carrier(body["name"])} for body in scenery["bodies"]],
        "joints": [
            {**joint, "parent": carrier(joint["parent"]), "child": carrier(joint["child"])}
            for joint in scenery["joints"]
        ],
        "points": list(points.values()),
        "springs": [
            {**item, "first": points[item["first"]], "second": points[item["second"]]} for item in scenery["springs"]
        ],
        "rods": [{"name": rod["name"], "ends": [at(end) for end in rod["ends"]]} for rod in scenery["rods"]],
        "tyres": [{**tyre, "center": points[tyre["center"]]} for tyre in scenery["tyres"]],
    }


def _thinned(t: Array, size: int) -> NDArray[np.intp]:
    """Return the rows of ``size`` bytes each to keep, the first and the last among them."""
    wanted = min(max(RATE * float(t[-1] - t[0]), FEWEST), max(LARGEST / size, 2.0))
    if len(t) <= wanted:
        return np.arange(len(t))
    moments = np.linspace(t[0], t[-1], int(wanted) + 1)
    return np.unique(np.clip(np.searchsorted(t, moments - 0.5 * (t[1] - t[0])), 0, len(t) - 1))


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
