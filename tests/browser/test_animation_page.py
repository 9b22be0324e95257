"""The animation as a browser shows it: bodies where the projection says, in their colours, at two times; controls that
work."""

from __future__ import annotations

import html
import itertools
import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.files import template_folder
from tests.browser.chromium import Browser, told_by, with_scripts
from tests.models.scenes import breaking

TRICK = "</script><script>document.title='taken'</script><!-- <b>&amp; ${name} @data@ \u2028"


@cache
def run() -> eomgen.Solution:
    """Return the motion of two boxes on a slowly moving base, a sphere, and a spring."""
    builder = eomgen.SceneBuilder("boxes", description=TRICK)
    builder.base(position=["0.1 * sin(t)", 0, 0], rotation=[([0, 0, 1], "0.2 * t")])
    builder.body("upper", 1.0, center_of_mass=[0, 0, -0.4], inertia=[0.06, 0.07, 0.03])
    builder.body("lower", 1.0, center_of_mass=[0, 0, -0.4], inertia=[0.06, 0.07, 0.03])
    builder.body("ball", 0.5, inertia=[0.01, 0.01, 0.01])
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, -1, 0], initial={"position": 1.0})
    builder.joint(
        "elbow", "revolute", "upper", "lower", axis=[1, -1, 0], position=[0, 0, -0.8], initial={"position": 0.7}
    )
    builder.joint(
        "rail", "prismatic", "base", "ball", axis=[1, 0, 0], position=[-1.0, 0, 0.3], initial={"velocity": -1.0}
    )
    builder.point("tip", "lower", [0, 0, -0.8]).point("anchor", "base", [-0.3, 0, 0.3]).point(
        "hook", "ball", [0.23, 0, 0]
    )
    builder.spring("cord", "anchor", "hook", stiffness=8.0, length=0.5)
    builder.output("tip", position="tip", unit="m")
    solution = eomgen.build(builder.build(), profile="quick").simulate(2.0, 1e-3)
    assert solution.success
    return solution


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run().animate(tmp_path_factory.mktemp("page") / "boxes.html")


def projected(view: dict, place: np.ndarray) -> tuple[int, int]:
    """Return the pixel (column, row) of a place in the world: a pinhole camera, worked out anew."""
    axes = np.array([view["right"], view["above"], view["forward"]])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    x, y, depth = axes @ (place - view["eye"])
    assert depth > 0
    column, row = view["middle"][0] + view["focal"] * x / depth, view["middle"][1] - view["focal"] * y / depth
    return round(column), round(row)


def palette() -> list[np.ndarray]:
    text = (template_folder() / "pictures" / "colours.js").read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("const PALETTE"))
    return [np.array([int(code[k : k + 2], 16) for k in (0, 2, 4)]) for code in re.findall(r"#([0-9a-f]{6})", line)]


def likeness(pixel: np.ndarray, colour: np.ndarray) -> float:
    """Return the cosine between two colours without their grey part: 1 for lighter and darker shades of one."""
    a, b = pixel - pixel.mean(), colour - colour.mean()
    return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b) + 1e-9)) if np.linalg.norm(a) > 12 else 0.0


def in_world(pose: np.ndarray, place: np.ndarray | list[float]) -> np.ndarray:
    """Return a place of a body in the world, by the rotation matrix of the stored quaternion."""
    w, x, y, z = pose[:4]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return pose[4:] + (np.eye(3) + 2 * w * cross + 2 * cross @ cross) @ place


def centres(solution: eomgen.Solution, row: int) -> dict[str, np.ndarray]:
    """Return the centres of mass in the world."""
    known = {"upper": [0, 0, -0.4], "lower": [0, 0, -0.4], "ball": [0, 0, 0]}
    return {name: in_world(solution.poses[name][row], center) for name, center in known.items()}


@pytest.mark.slow
@pytest.mark.long_cases("dark", "light")
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_bodies_are_where_the_projection_says_at_two_times(page: Path, browser: Browser, theme: str) -> None:
    copy, solution, places = with_scripts(page, "watch.js"), run(), {}
    for row in (200, 1100):
        picture = browser.picture(copy, f"t={float(solution.t[row])}&theme={theme}")
        assert all(line.startswith("view {") for line in browser.said), browser.said
        view = json.loads(browser.said[-1].removeprefix("view "))
        assert view["time"] == pytest.approx(solution.t[row], abs=1e-9)
        for (name, centre), colour in zip(centres(solution, row).items(), palette(), strict=False):
            column, line = places[name, row] = projected(view, centre)
            block = picture[line - 2 : line + 3, column - 2 : column + 3].reshape(-1, 3)
            assert np.median([likeness(pixel, colour) for pixel in block]) > 0.93, (
                f"{name} is not drawn at {column}, {line}"
            )
        if row == 1100:  # where the body was before, there is ground now
            column, line = places["lower", 200]
            assert np.hypot(*np.subtract(places["lower", 200], places["lower", 1100])) > 100
            assert likeness(picture[line, column], palette()[1]) < 0.9, f"lower is still drawn at {column}, {line}"
        corner = picture[5, 5].sum() / 3
        assert corner > 230 if theme == "light" else corner < 40


def far_corners(solution: eomgen.Solution, half: dict[str, list[float]], row: int) -> list[np.ndarray]:
    """Return the corners of boxes with these halves of sides about the origins of bodies, in the world."""
    found = []
    for name, sides in half.items():
        corners = (np.array(signs) * sides for signs in itertools.product((-1, 1), repeat=3))
        found += [in_world(solution.poses[name][row], corner) for corner in corners]
    return found


def _spinners() -> eomgen.SceneBuilder:
    """Return fourteen arms that turn at different rates, on a floor of 200 m."""
    builder = eomgen.SceneBuilder("spinners", gravity=[0, 0, 0])
    for k in range(14):
        builder.body(f"arm{k}", 1.0, inertia=[0.01, 0.01, 0.01])
        place, speed = [0.3 * k, 0, 0], {"velocity": 7.0 + k}
        builder.joint(f"pin{k}", "revolute", "base", f"arm{k}", axis=[0, 1, 0], position=place, initial=speed)
        builder.shape(f"blade{k}", body=f"arm{k}", type="box", size=[4.0, 0.1, 0.1])
    return builder.shape("floor", body="base", type="box", size=[200.0, 200.0, 0.01], position=[0, 0, -2.5])


@pytest.mark.long
def test_the_whole_motion_is_in_the_picture_and_large(browser: Browser, tmp_path: Path) -> None:
    half = {f"arm{k}": [2.0, 0.05, 0.05] for k in range(14)}
    solution = eomgen.build(_spinners().build(), profile="quick").simulate(2.0, 2e-3, method="rk4")
    page = solution.animate(tmp_path / "page.html")
    page = with_scripts(page, "watch.js")
    largest = 0.0
    for row in (0, 333, 700, 1000):
        height, width = browser.picture(page, f"t={float(solution.t[row])}&theme=light").shape[:2]
        view = json.loads(browser.said[-1].removeprefix("view "))
        pixels = np.array([projected(view, corner) for corner in far_corners(solution, half, row)])
        assert np.all(pixels >= 0) and np.all(pixels <= (width, height))
        largest = max(largest, float(np.max(np.ptp(pixels, axis=0) / (width, height))))
    assert largest > 0.3


@pytest.mark.slow
def test_every_control_does_what_it_says(page: Path, browser: Browser) -> None:
    told = told_by(browser.document(with_scripts(page, "controls.js"), "t=0&theme=light"))
    assert browser.said == []
    assert told["rows"] == 601 and told["begin"] == told["home"] == 0.0
    assert 0.0 < told["stepped"] <= 0.005 and told["end"] == 2.0 and told["clock"] == "2.000 s / 2.00 s"
    assert (told["faster"], told["slower"]) == ("0.5", "0.1")  # it begins with 0.2: two seconds play in ten
    assert told["theme"] == "dark" and told["turned"] and told["reset"] and told["folded"]
    assert told["playing"] and told["paused"] and told["played"] == pytest.approx(told["slid"] + 0.05 * 0.1)
    assert told["title"] == "boxes" and told["description"] == TRICK
    assert told["names"] == ["upper", "lower", "ball", "tip", "anchor", "hook", "cord"]
    assert told["unnamed"] == 0
    assert told["label"].startswith("3-D animation of boxes: 3 bodies from 0.000 s to 2.000 s.")


@pytest.mark.slow
def test_the_first_view_holds_all_that_is_drawn_in_windows_of_every_size(page: Path, browser: Browser) -> None:
    told = told_by(browser.document(with_scripts(page, "fitting.js"), "t=0"))
    assert browser.said == []
    margins = np.array(told["margins"])
    assert margins.shape == (3, 4) and margins.min() > 0.0, margins
    assert margins.min(axis=1).max() < 250.0, "the scene is not made tiny either"
    assert told["kept"], "a view that the user has turned stays when the window changes"


@pytest.mark.long
def test_a_run_that_failed_says_so_and_one_row_is_enough(browser: Browser, tmp_path: Path) -> None:
    solution = breaking().simulate()
    assert not solution.success
    document = browser.document(solution.animate(tmp_path / "failed.html"), "t=0")
    assert f"This run did not reach its end: {solution.message}" in html.unescape(document)
    single = breaking().simulate(0.0)
    assert len(single.t) == 1
    document = browser.document(single.animate(tmp_path / "single.html"))
    assert re.search(r'<input id="slider"[^>]*disabled', document) and browser.said == []


@pytest.mark.long_except_every(2)
@pytest.mark.slow
@pytest.mark.parametrize("faces", ["see-through", "solid"])
def test_a_beam_is_drawn_along_its_bent_axis(browser: Browser, tmp_path: Path, faces: str) -> None:
    """A force bends it by P x^2 (3 L - x) / 6 EI, 0.3 m at the tip; where it would be straight is nothing."""
    bending = {"shapes": "polynomial", "modes": 2, "normalisation": "unit", "stiffness": 50.0}
    model = eomgen.build(
        {
            "format": 1,
            "name": "bent",
            "beams": {"blade": {"length": 1.0, "mass_per_length": 1.0, "stiffening": False, "bending_z": bending}},
            "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "blade"}},
            "forces": {"pull": {"body": "blade", "point": [1.0, 0, 0], "force": [0, 0, 45.0]}},
        },
        profile="quick",
    )
    rest = model.equilibrium()
    page = model.simulate(0.0, initial={"blade": rest.q.tolist()}).animate(tmp_path / "bent.html")
    faced = ["shown.glass = false; draw();"] if faces == "solid" else []
    picture = browser.picture(with_scripts(page, "watch.js", *faced), "t=0&theme=light")
    assert all(line.startswith("view {") for line in browser.said), browser.said
    view = json.loads(browser.said[-1].removeprefix("view "))
    colour = palette()[0]
    for s in (0.3, 0.6, 0.9):
        deflected, chord = 0.15 * (3 * s**2 - s**3), 0.3 * s
        for height, there in ((deflected, True), (chord if s < 0.9 else 0.0, False)):
            column, line = projected(view, np.array([s, 0.0, height]))
            block = picture[line - 1 : line + 2, column - 1 : column + 2].reshape(-1, 3)
            alike = np.median([likeness(pixel, colour) for pixel in block]) > 0.93
            assert alike == there, f"the beam at {s}: {'not ' * there}drawn at height {height}"


@pytest.mark.slow
def test_what_is_behind_a_surface_is_hidden_and_what_is_seen_through_is_mixed(browser: Browser, tmp_path: Path) -> None:
    """The camera looks along -x at a red sphere, with smaller ones before, behind and beside it, and marked points."""
    builder = eomgen.SceneBuilder("spheres").body("hull", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("drive", "prismatic", "base", "hull", axis=[1, 0, 0])
    spheres = {
        "large": ([0, 0, 0], 0.2, "#ff0000", 1.0),
        "before": ([0.5, 0, 0], 0.05, "#0000ff", 1.0),
        "behind": ([-0.5, 0.15, 0], 0.05, "#0000ff", 1.0),
        "above": ([-0.5, 0, 0.4], 0.05, "#0000ff", 1.0),
        "glass": ([0.5, 0, -0.1], 0.04, "#00ff00", 0.5),
    }
    for name, (position, radius, color, opacity) in spheres.items():
        builder.shape(name, "sphere", "hull", radius=radius, position=position, color=color, opacity=opacity)
    marked = {"hidden": [-0.5, -0.15, 0.0], "free": [-0.5, 0.4, 0.0]}
    for name, position in marked.items():
        builder.point(name, "hull", position)
    run = eomgen.build(builder.build(), profile="quick").simulate(0.1, 1e-2, method="rk4")
    page = with_scripts(run.animate(tmp_path / "spheres.html"), "watch.js", "hiding.js")
    picture = browser.picture(page, "t=0&theme=light")
    assert all(line.startswith("view {") for line in browser.said), browser.said
    view = json.loads(browser.said[-1].removeprefix("view "))

    def seen(place: list[float]) -> np.ndarray:
        column, line = projected(view, np.array(place))
        return np.median(picture[line - 1 : line + 2, column - 1 : column + 2].reshape(-1, 3), axis=0)

    assert [int(np.argmax(seen(place))) for place, _, _, _ in spheres.values()][1:4] == [2, 0, 2]
    red, green, blue = seen(spheres["glass"][0])
    assert red > blue + 50 and green > blue + 50, "half of the red sphere behind the green glass"
    hidden, free = seen(marked["hidden"]), seen(marked["free"])
    assert hidden[0] > hidden[1] + 80 and hidden[0] > hidden[2] + 80
    assert np.ptp(free) < 60, "the mark of a point in front of nothing is white within"
