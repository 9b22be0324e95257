"""Animations: motion and scenery of a solution in one self-contained HTML file without network access.

Everything that the user named reaches the page as JSON in a block of data, if no text can end the block or become
code.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.files import template_folder, write_text
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.pictures.beam_curves import frames_along, nearest_station, pieces_of, stations
from eomgen.results.poses import PosesAndScenery
from eomgen.results.recorded import RecordedSolution
from eomgen.system.description import BASE, WORLD

#: Stored pictures per second of motion; short runs have at least FEWEST pictures, and the pictures of a page take at
#: most LARGEST bytes.
RATE, FEWEST, LARGEST = 60.0, 600, 24_000_000
#: Steps of a coordinate of a vertex over the size of its shape: the largest number of two bytes.
_STEPS = 65_535
#: Maximum size of a page embedded in a notebook, bytes.
_INLINE = 4_000_000
#: Styles and scripts of the picture, below ``pictures`` in the folder of templates, by their marks in a page.
SCRIPTS = {
    "style": "animation.css",
    **{name: f"{name}.js" for name in ("geometry", "colours", "stage", "raster", "drawing", "controls", "page")},
}


class InlineAnimation:
    """A page that a notebook shows within a cell, apart from the notebook's own scripts.

    Parameters
    ----------
    page : str
        Text of the page.
    """

    def __init__(self, page: str) -> None:
        self.page = page

    def __repr__(self) -> str:
        return f"<animation, {len(self.page.encode())} bytes of HTML; a notebook shows it>"

    def _repr_html_(self) -> str:
        style = "width:100%;height:30em;border:0"
        return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{html.escape(self.page)}"></iframe>'


class AnimatedSolution(RecordedSolution, Protocol):
    """Data of a page: a ``Solution`` with poses."""

    @property
    def poses_and_scenery(self) -> PosesAndScenery: ...


@overload
def animate(solution: AnimatedSolution, path: str | Path) -> Path: ...
@overload
def animate(solution: AnimatedSolution, path: None = None) -> InlineAnimation: ...
def animate(solution: AnimatedSolution, path: str | Path | None = None) -> Path | InlineAnimation:
    """Write the motion as one self-contained HTML file, or display the motion in a notebook.

    Parameters
    ----------
    path : str or Path, optional
        Name of the file, which ends in ``.html``; without a name a notebook shows the page, up to 4 MB.

    Returns
    -------
    Path or InlineAnimation
        The path of the file; without a path an object that notebooks show.

    Raises
    ------
    UsageError
        A solution without poses, another ending, or a page that is too large for a notebook.
    FileError
        The path cannot be written.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.simulate(0.1, 1e-3).animate("motion.html").name
    'motion.html'
    """
    if path is not None:
        path = check_name(Path(path))
        write_text(path, animation_page(solution))
        return path
    page = animation_page(solution)
    if (size := len(page.encode())) > _INLINE:
        fault = f"the page has {size / 1e6:.1f} MB, and a notebook takes {_INLINE / 1e6:.0f} MB [E1259]"
        raise UsageError(Problem("animate", fault, 'a file of its own: animate("motion.html")'))
    return InlineAnimation(page)


def check_name(path: Path) -> Path:
    """Return the path of a page unchanged. Raises UsageError if the path does not end in ``.html``."""
    if path.suffix.lower() not in (".html", ".htm"):
        kind = path.suffix or "a file without a suffix"
        fault = f"an animation cannot be saved as {kind} [E1260]"
        raise UsageError(Problem(str(path), fault, f"{path.stem or 'animation'}.html"))
    return path


def animation_page(solution: AnimatedSolution) -> str:
    """Return the text of the HTML page of a solution. Raises FileError if its poses or scenery do not have the expected
    content. Poses are thinned to 60 a second (short runs: up to 600 in all) and stored as single precision; the page
    interpolates."""
    poses_and_scenery = solution.poses_and_scenery
    try:
        data = packed(solution, poses_and_scenery)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        fault = f"its poses or its scenery are not in eomgen's format: {type(error).__name__}: {error} [E1261]"
        raise FileError(Problem("solution", fault, "eomgen simulate again")) from None
    parts = {name: f"pictures/{file}" for name, file in SCRIPTS.items()}
    return page_of("pictures/animation.html", parts, data, str(solution.metadata.get("version", "")))


def page_of(
    template: str, parts: Mapping[str, str], data: Mapping[str, Any], version: str, *, content: str = ""
) -> str:
    """Return the text of a page: a template with its styles and scripts, and data as JSON.

    Parameters
    ----------
    template : below the folder of templates
    parts : files below the folder of templates, by their marks in the template
    data : JSON types, with the ``name`` that is the title of the page
    version : of eomgen
    content : HTML at the mark ``content``
    """
    folder = template_folder()
    texts = {name: (folder / file).read_text(encoding="utf-8").rstrip() for name, file in parts.items()}
    texts |= {"title": html.escape(data["name"]), "version": html.escape(version), "content": content}
    # no bracket can end the surrounding block of the page or begin another
    marks = str.maketrans({mark: f"\\u{ord(mark):04x}" for mark in "&<>"})
    texts["data"] = json.dumps(data, sort_keys=True, allow_nan=False).translate(marks)
    page = (folder / template).read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda mark: texts[mark[1]], page)


def packed(solution: AnimatedSolution, seen: PosesAndScenery, most: int | None = None) -> dict[str, Any]:
    """Return the data of a page with a motion and its scenery, JSON types; arrays are base64 texts.

    Parameters
    ----------
    solution : times, coordinates and metadata
    seen : poses of bodies (rows, 7) by name, and the scenery
    most : number of stored pictures at most; None for no limit beyond the page's size
    """
    poses, scenery = seen
    carriers = _Carriers(poses, scenery)
    rows, stacked = carriers.moved(solution, poses, most)
    bodies = [body for body in scenery["bodies"] if carriers.beam_of.get(body["name"], body["name"]) == body["name"]]
    order = [body["name"] for body in bodies]
    numbers = {name: number for number, name in enumerate(order)}
    used = {end for spring in scenery["springs"] for end in (spring["first"], spring["second"])}

    points = {
        item["name"]: {
            "name": item["name"],
            **carriers.place(item["body"], item["position"]),
            "body": numbers.get(carriers.beam_of.get(item["body"], item["body"]), -1),
            "trace": item["trace"],
            "drawn": item["trace"] or item["name"] in used,
        }
        for item in scenery["points"]
    }
    if not points:
        last = scenery["bodies"][-1]
        name = f"centre of {last['name']}"
        center = carriers.place(last["name"], last["solid"]["center"])
        number = numbers[carriers.beam_of.get(last["name"], last["name"])]
        points[name] = {"name": name, **center, "body": number, "trace": True, "drawn": True}
    return {
        "name": str(solution.metadata.get("scene", "scene")),
        "description": scenery["description"],
        "success": solution.success,
        "message": solution.message,
        "gravity": scenery["gravity"],
        "base": carriers.numbers.get(BASE, -1),
        "carriers": carriers.count,
        "times": base64_text(solution.t[rows].astype("<f8")),
        "poses": base64_text(stacked.astype("<f4")),
        "bodies": [carriers.body(body) for body in bodies],
        "joints": [
            {**joint, "seat": carriers.place(joint["parent"], joint["position"]), "child": carriers.of(joint["child"])}
            for joint in scenery["joints"]
        ],
        "points": list(points.values()),
        "springs": [carriers.line(item, points) for item in scenery["springs"]],
        "rods": [
            {"name": rod["name"], "ends": [carriers.place(end["body"], end["position"]) for end in rod["ends"]]}
            for rod in scenery["rods"]
            if rod["name"] in carriers.exact
            or rod["name"] not in carriers.beam_of  # elements are drawn with the beam of these elements
        ],
        "tyres": [{**tyre, "center": points[tyre["center"]]} for tyre in scenery["tyres"]],
        "ground": scenery.get("ground"),
        "roads": [{**road, "center": points[road["center"]]} for road in scenery.get("roads", ())],
        "shapes": [_packed_shape(carriers.shape(shape, numbers)) for shape in scenery.get("shapes", ())],
    }


class _Carriers:
    """Carriers of the drawn objects of a page, by numbers: bodies in the order of poses, then frames along beams; -1 is
    the world."""

    def __init__(self, poses: Mapping[str, Array], scenery: Mapping[str, Any]) -> None:
        self.numbers = {name: number for number, name in enumerate(poses)}
        self.axes = {axis["name"]: axis for axis in scenery.get("axes", ())}
        self.exact = {beam["nodes"][0]: beam for beam in scenery.get("beams", ())}
        self.beam_of = {node: name for name, beam in self.exact.items() for node in beam["nodes"]}
        frames = {name: len(axis["x"]) for name, axis in self.axes.items()}
        elements = {name: len(beam["nodes"]) - 1 for name, beam in self.exact.items()}
        frames |= {name: count * pieces_of(count) + 1 for name, count in elements.items()}
        self.along: dict[str, list[int]] = {}
        self.count = len(self.numbers)
        for name, count in frames.items():
            self.along[name] = list(range(self.count, self.count + count))
            self.count += count

    def of(self, body: str) -> int:
        """Return the number of a body's frame."""
        return self.numbers.get(BASE, -1) if body == BASE else -1 if body == WORLD else self.numbers[body]

    def place(self, body: str, position: list[float]) -> dict[str, Any]:
        """Return the carrier (a number) of a place of a body, and its position (3,) in the carrier's frame, as keys
        ``carrier`` and ``position``; on a beam the carrier is the frame nearest to the place."""
        if axis := self.axes.get(body):
            number, within = nearest_station(axis, position)
            return {"carrier": self.along[body][number], "position": within}
        return {"carrier": self.of(body), "position": position}

    def line(self, line: Mapping[str, Any], points: Mapping[str, Any]) -> dict[str, Any]:
        """Return the data of a force between points, with data of points in place of their names. A bent line has also
        the points on the path, and obstacles with carriers."""
        ends = {**line, "first": points[line["first"]], "second": points[line["second"]]}
        if "path" not in line:
            return ends
        obstacles = [
            {
                **item,
                **self.place(item["body"], item["position"]),
                "side": points[item["side"]] if item["side"] else None,
            }
            for item in line["obstacles"]
        ]
        return {**ends, "path": [points[name] for name in line["path"]], "obstacles": obstacles}

    def body(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Return the data of a body with its carrier; a beam has the carriers along its ``axis``, and ``ties``, places
        that lines join to it; a geometrically exact one also its outline, and the frames for each element."""
        name, shown = body["name"], {**body, "carrier": self.of(body["name"])}
        if beam := self.exact.get(name):
            radius = float(max(np.hypot(*corner) for corner in beam["outline"]))
            shown["solid"] = {**body["solid"], "kind": "cylinder", "size": [radius, 20.0 * radius]}
            shown |= {"ties": [], "outline": beam["outline"], "pieces_of_element": pieces_of(len(beam["nodes"]) - 1)}
        elif name in self.axes:
            shown["ties"] = [self.place(name, link) for link in body["links"]]
        return {**shown, "links": [], "axis": self.along[name]} if name in self.along else shown

    def shape(self, shape: Mapping[str, Any], numbers: Mapping[str, int]) -> dict[str, Any]:
        """Return the data of a shape with its carrier, on a beam the nearest frame, and the number of its body;
        vertices are moved into the carrier's frame. ``numbers`` are of bodies by name."""
        anchor = self.place(shape["body"], shape["origin"])
        offset = np.array(anchor["position"]) - np.array(shape["origin"])
        vertices = (np.array(shape["vertices"]) + offset).tolist() if offset.any() else shape["vertices"]
        owner = numbers.get(self.beam_of.get(shape["body"], shape["body"]), -1)
        return {**shape, "carrier": anchor["carrier"], "body": owner, "vertices": vertices}

    def moved(
        self, solution: AnimatedSolution, poses: Mapping[str, Array], most: int | None = None
    ) -> tuple[NDArray[np.intp], Array]:
        """Return the rows to keep, (n,), at most ``most``, and the poses of all carriers there, (n, count, 7). Rows
        with a pose that is not finite are left out; raises ValueError if all are."""
        stacked = np.stack(list(poses.values()), axis=1)
        rows = np.flatnonzero(np.isfinite(stacked).all(axis=(1, 2)))
        if len(rows):
            rows = rows[_thinned(solution.t[rows], 4 * 7 * self.count, most)]
        with np.errstate(over="ignore", invalid="ignore"):
            bent = [stations(axis, poses[name][rows], solution.q[rows]) for name, axis in self.axes.items()]
        here = {name: pose[rows] for name, pose in poses.items()}
        curved = [frames_along(here, beam["nodes"]) for beam in self.exact.values()]
        whole = np.concatenate([stacked[rows], *bent, *curved], axis=1)
        finite = np.isfinite(whole).all(axis=(1, 2))
        if not finite.any():
            raise ValueError("no pose is finite")
        return rows[finite], whole[finite]


def _thinned(t: Array, size: int, most: int | None = None) -> NDArray[np.intp]:
    """Return the indices of the rows at times t that the page keeps, the first and the last included; ``size`` is the
    size of a row in bytes, ``most`` the largest number of rows."""
    wanted = min(max(RATE * float(t[-1] - t[0]), FEWEST), max(LARGEST / size, 2.0))
    wanted = wanted if most is None else min(wanted, most - 1)
    if len(t) <= wanted:
        return np.arange(len(t))
    moments = np.linspace(t[0], t[-1], int(wanted) + 1)
    return np.unique(np.clip(np.searchsorted(t, moments - 0.5 * (t[1] - t[0])), 0, len(t) - 1))


def _packed_shape(shape: Mapping[str, Any]) -> dict[str, Any]:
    """Return a shape in an eighth of the text: vertices as whole steps of 1/65535 of the size from the lowest corner,
    faces as triangles, both as base64 texts."""
    vertices = np.array(shape["vertices"], dtype=float).reshape(-1, 3)
    low = np.min(vertices, axis=0)
    step = float(np.max(vertices - low)) / _STEPS or 1.0
    triangles = [[face[0], *face[k : k + 2]] for face in shape["faces"] for k in range(1, len(face) - 1)]
    wide = len(vertices) > _STEPS
    return {
        **shape,
        "vertices": base64_text(np.round((vertices - low) / step).astype("<u2")),
        "low": low.tolist(),
        "step": step,
        "faces": base64_text(np.array(triangles, dtype="<u4" if wide else "<u2")),
        "wide": wide,
    }


def base64_text(array: NDArray[Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
