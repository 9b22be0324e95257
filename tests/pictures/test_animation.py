"""What animations are made of: poses with a solution, solids with a body's inertia, pages that hold no code of
others."""

from __future__ import annotations

import base64
import json
import pickle
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import eomgen
from eomgen.base.files import read_arrays, write_arrays
from eomgen.cli import main
from eomgen.mechanics.describe import describe
from eomgen.products.pictures import animation
from eomgen.products.pictures.animation import animation_page
from eomgen.products.pictures.scenery import equivalent_solid, scenery
from tests.models.scenes import PENDULUM_TOML, absolute, flyer, pendulum, pendulum_scene


def data_of(page: str) -> dict:
    (text,) = re.findall(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def stored(data: dict) -> tuple[np.ndarray, np.ndarray]:
    times = np.frombuffer(base64.b64decode(data["times"]), "<f8")
    return times, np.frombuffer(base64.b64decode(data["poses"]), "<f4").reshape(len(times), data["carriers"], 7)


# -- poses of solutions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [pendulum, flyer, absolute])
def test_poses_are_the_models(make) -> None:
    model = make()
    run = model.simulate(0.3, 1e-2)
    assert set(run.poses) == {*model.bodies, *(["base"] if make is pendulum else [])}
    for name in model.bodies:
        assert run.poses[name].shape == (len(run.t), 7)
        np.testing.assert_array_equal(run.poses[name], model.pose(name, run.q, run.t))
    if make is pendulum:
        np.testing.assert_array_equal(run.poses["base"], model.base(run.t)[:, :7])


def test_poses_follow_the_parameters_of_the_run() -> None:
    run = pendulum().simulate(0.2, 1e-3, parameters={"shake": 0.5, "length": 0.8})
    np.testing.assert_allclose(run.poses["base"][:, 4], 0.5 * np.sin(7.0 * run.t), atol=1e-14)
    (body,) = run.poses_and_scenery.scenery["bodies"]
    assert body["solid"]["center"] == [0.0, 0.0, -0.8]
    tip = {"name": "tip", "body": "link", "position": [0.0, 0.0, -1.6], "trace": True}
    assert run.poses_and_scenery.scenery["points"] == [tip]


def test_poses_are_stored_and_read_back(tmp_path: Path) -> None:
    run = flyer().simulate(0.1, 1e-2)
    for again in (pickle.loads(pickle.dumps(run)), eomgen.Solution.load(run.save(tmp_path / "run.npz"))):
        assert set(again.poses) == {"hull", "arm", "slug"}
        for name, poses in run.poses.items():
            np.testing.assert_array_equal(again.poses[name], poses)
        assert animation_page(again) == animation_page(run)
        assert again.metadata == run.metadata


def test_parts_of_a_run_are_drawn_as_one(tmp_path: Path) -> None:
    model, file = pendulum(), tmp_path / "run.ckpt"
    first = model.simulate(0.2, 1e-2, checkpoint=file, checkpoint_every=10)
    whole = first.followed_by(model.resume(file, 0.3))
    np.testing.assert_allclose(whole.t, np.arange(31) * 1e-2, atol=1e-12)
    np.testing.assert_array_equal(whole.poses["link"], model.pose("link", whole.q, whole.t))


@pytest.mark.slow
def test_poses_are_compiled_when_they_are_asked_for_and_kept_from_then_on(tmp_path: Path) -> None:
    """A solution that was stored without them says what to do."""
    run = eomgen.build(pendulum_scene(), terms=["forward_dynamics"], profile="quick").simulate(0.1, 1e-2, method="rk4")
    text = r"solution: it was stored without poses of bodies, so it cannot be drawn; try: eomgen simulate, or"
    with pytest.raises(eomgen.UsageError, match=text):
        eomgen.Solution.load(run.save(tmp_path / "run.npz")).animate(tmp_path / "run.html")
    assert list(tmp_path.iterdir()) == [tmp_path / "run.npz"]
    np.testing.assert_array_equal(run.poses["link"], pendulum().pose("link", run.q, run.t))
    again = eomgen.Solution.load(run.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(again.poses["link"], run.poses["link"])
    assert again.animate(tmp_path / "run.html").exists()


def test_a_notebook_shows_the_page_that_a_file_would_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Frames(HTMLParser):
        found: ClassVar[list[dict[str, str | None]]] = []

        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            self.found.append({"tag": tag, **dict(attrs)})

    run = pendulum().simulate(0.1, 1e-2)
    shown = run.animate()
    Frames().feed(shown._repr_html_())
    (frame,) = Frames.found
    assert frame["tag"] == "iframe" and frame["sandbox"] == "allow-scripts"
    assert frame["srcdoc"] == run.animate(tmp_path / "run.html").read_text(encoding="utf-8")
    assert "a notebook shows it" in repr(shown)
    monkeypatch.setattr(animation, "_INLINE", 1000)
    text = r"animate: the page has 0\.\d MB, and a notebook takes 0 MB; try: a file of its own: animate\("
    with pytest.raises(eomgen.UsageError, match=text):
        run.animate()


# -- solids ------------------------------------------------------------------------------------------------------------


def inertia_of(solid: dict, mass: float, rng: np.random.Generator) -> np.ndarray:
    """Return the inertia about the centre of a million points strewn evenly over the solid."""
    points = rng.uniform(-0.5, 0.5, size=(1_000_000, 3))
    if solid["kind"] == "box":
        points *= solid["size"]
    else:
        radius, height = (solid["size"][0], solid["size"][1] if solid["kind"] == "cylinder" else 2 * solid["size"][0])
        points *= [2 * radius, 2 * radius, height]
        axes = slice(0, 2) if solid["kind"] == "cylinder" else slice(0, 3)
        points = points[np.linalg.norm(points[:, axes], axis=1) < radius]
    points = points @ np.array(solid["axes"])
    return mass * (np.eye(3) * np.mean(np.sum(points**2, axis=1)) - points.T @ points / len(points))


@pytest.mark.parametrize(
    ("kind", "moments"),
    [
        ("sphere", [2.0, 2.0, 2.0]),
        ("cylinder", [2.0, 2.0, 0.5]),
        ("cylinder", [3.0, 1.6, 1.6]),
        ("box", [0.6, 1.0, 1.4]),
    ],
)
def test_solids_have_the_inertia_of_their_body(kind: str, moments: list[float], rng: np.random.Generator) -> None:
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    inertia = Q @ np.diag(moments) @ Q.T
    solid = equivalent_solid(3.0, np.array([1.0, 2.0, 3.0]), inertia)
    assert solid["kind"] == kind and solid["center"] == [1.0, 2.0, 3.0]
    assert np.linalg.det(np.array(solid["axes"])) == pytest.approx(1.0)
    np.testing.assert_allclose(inertia_of(solid, 3.0, rng), inertia, atol=6e-3 * max(moments))


def test_what_has_no_value_at_these_parameters_is_named() -> None:
    builder = eomgen.SceneBuilder("rooted").parameter("length", 1.0, tunable=True)
    builder.body("rod", 1.0, center_of_mass=[0, 0, "-sqrt(length)"], inertia=[0.1, 0.1, 0.1])
    builder.joint("hinge", "revolute", "base", "rod", axis=[0, 1, 0])
    with pytest.raises(eomgen.NumericalError) as caught:
        scenery(describe(builder.build()), {"length": -1.0})
    assert (
        str(caught.value)
        == "numerical error: bodies.rod.center_of_mass: cannot be drawn: sqrt(-1) has no finite value; try: other"
        " parameters"
    )


# -- pages -------------------------------------------------------------------------------------------------------------


def test_pictures_are_thinned_to_sixty_a_second() -> None:
    run = pendulum().simulate(20.0, 1e-3)
    times, poses = stored(data_of(animation_page(run)))
    assert len(times) == 1201 and (times[0], times[-1]) == (run.t[0], run.t[-1])
    assert np.diff(times).max() < 0.018
    rows = np.searchsorted(run.t, times)
    np.testing.assert_array_equal(poses[:, 0], run.poses["link"][rows].astype(np.float32))
    assert len(animation_page(run)) < 200_000


def test_a_page_asks_nobody_for_anything() -> None:
    run = pendulum().simulate(0.01)
    page = animation_page(run)
    assert data_of(page)["shapes"] == [] and data_of(page)["message"] == run.message
    assert "default-src 'none'" in page
    assert set(re.findall(r"https?://[^\s\"']+", page)) == {"http://www.w3.org/2000/svg"}  # a name, nothing is fetched
    assert not re.search(r"<(link|img|iframe|object)\b|@import|\bfetch\(|XMLHttpRequest|import\(| src=", page)


def test_stored_sceneries_of_others_are_refused(tmp_path: Path) -> None:
    arrays, metadata = read_arrays(pendulum().simulate(0.01).save(tmp_path / "run.npz"))
    metadata["scenery"]["bodies"][0]["name"] = "stranger"
    write_arrays(tmp_path / "changed.npz", arrays, metadata)
    text = (
        "solution: its poses or its scenery are not in eomgen's format: KeyError: 'stranger'; try: eomgen simulate"
        " again"
    )
    with pytest.raises(eomgen.FileError, match=text):
        eomgen.Solution.load(tmp_path / "changed.npz").animate(tmp_path / "run.html")
    write_arrays(tmp_path / "short.npz", {**arrays, "poses": arrays["poses"][:-1]}, metadata)
    with pytest.raises(
        eomgen.FileError, match="not a solution written by eomgen: the poses of link do not fit to its times"
    ):
        eomgen.Solution.load(tmp_path / "short.npz")
    write_arrays(tmp_path / "few.npz", arrays, {**metadata, "posed": ["link"]})
    with pytest.raises(eomgen.FileError, match="not a solution written by eomgen: its arrays do not fit together"):
        eomgen.Solution.load(tmp_path / "few.npz")


def test_files_with_an_array_for_each_body_are_read(tmp_path: Path) -> None:
    run = pendulum().simulate(0.01)
    arrays, metadata = read_arrays(run.save(tmp_path / "run.npz"))
    poses, names = arrays.pop("poses"), metadata.pop("posed")
    assert names == list(run.poses)
    arrays |= {f"poses.{name}": poses[:, index] for index, name in enumerate(names)}
    write_arrays(tmp_path / "former.npz", arrays, metadata)
    stored = eomgen.Solution.load(tmp_path / "former.npz").poses
    for name in names:
        np.testing.assert_array_equal(stored[name], run.poses[name])


# -- the command line --------------------------------------------------------------------------------------------------


def test_animate_runs_a_scene_or_takes_a_solution(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(PENDULUM_TOML, encoding="utf-8")
    page = tmp_path / "new" / "page.html"
    assert main(["animate", str(file), "--out", str(page), "--t-end", "0.4", "--set", "length=0.6"]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert re.fullmatch(
        rf"reached t = 0\.4 s in 400 steps\nwritten to {re.escape(str(page))}, 0\.\d+ MB: open it in a browser\n",
        captured.err,
    )
    assert data_of(page.read_text(encoding="utf-8"))["name"] == "shaken"
    eomgen.build(file).simulate(0.4, parameters={"length": 0.6}).save(tmp_path / "run.npz")
    again = tmp_path / "again.html"
    assert main(["animate", str(tmp_path / "run.npz"), "--out", str(again)]) == 0
    assert again.read_bytes() == page.read_bytes()


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["{npz}", "--out", "{dir}/page.gif"], 2, "an animation cannot be saved as .gif; try: page.html"),
        (["{npz}", "--out", "{dir}/p.html", "--t-end", "2"], 2, "--t-end would change a run, and this one is stored"),
    ],
)
def test_mistakes_are_named(
    words: list[str], code: int, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    npz = pendulum().simulate(0.01).save(tmp_path / "run.npz")
    assert main(["animate", *(word.format(npz=npz, dir=tmp_path) for word in words)]) == code
    error = capsys.readouterr().err
    assert text in error and error.count("\n") == 1


# -- shapes ------------------------------------------------------------------------------------------------------------


def whole_numbers(text: str) -> np.ndarray:
    """Return the whole numbers of a shape on a page."""
    return np.frombuffer(base64.b64decode(text), "<u2").astype(int)


@pytest.mark.slow
def test_shapes_stand_on_the_page_at_their_bodies_with_their_colours() -> None:
    builder = eomgen.SceneBuilder("cart")
    builder.body("hull", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("drive", "prismatic", "base", "hull", axis=[1, 0, 0], initial={"velocity": 1.0})
    builder.shape("cabin", "box", "hull", size=[0.4, 0.2, 0.1], position=[0, 0, 0.3], color="#0f0", opacity=0.5)
    builder.shape("wall", "sphere", "world", radius=0.2)
    data = data_of(animation_page(eomgen.build(builder.build(), profile="quick").simulate(0.1, 1e-2, method="rk4")))
    cabin, wall = data["shapes"]
    assert [cabin["carrier"], cabin["body"], wall["carrier"], wall["body"]] == [0, 0, -1, -1]
    assert [cabin["color"], cabin["opacity"], wall["color"]] == ["#00ff00", 0.5, ""]
    corners = np.array(cabin["low"]) + cabin["step"] * whole_numbers(cabin["vertices"]).reshape(-1, 3)
    assert cabin["step"] == 0.4 / 65535 and not cabin["wide"]
    faces = whole_numbers(cabin["faces"]).reshape(-1, 3)
    normals = np.cross(*(corners[faces[:, k]] - corners[faces[:, 0]] for k in (1, 2)))
    outward = np.sum(normals * (np.mean(corners[faces], axis=1) - [0, 0, 0.3]), axis=1)
    assert np.all(outward > 0.0)
    assert 0.5 * np.sum(np.linalg.norm(normals, axis=1)) == pytest.approx(0.28, rel=1e-4)
    np.testing.assert_allclose([corners.min(0), corners.max(0)], [[-0.2, -0.1, 0.25], [0.2, 0.1, 0.35]], atol=4e-6)


def test_lines_of_massless_bodies_are_drawn_without_shapes_only() -> None:
    """The base of an include is such a body: its lines beside shapes would look like parts of the machine."""
    builder = eomgen.SceneBuilder("cart").body("hull", 1.0, inertia=[1, 1, 1]).body("hull_base", 0.0)
    builder.body("arm", 1.0, center_of_mass=[0, 0.2, 0], inertia=[1, 1, 1])
    builder.joint("drive", "prismatic", "base", "hull", axis=[1, 0, 0])
    builder.joint("mount", "fixed", "hull", "hull_base").point("eye", "hull", [0, 0, 0.5])
    builder.joint("hinge", "revolute", "hull_base", "arm", axis=[1, 0, 0], position=[0, 0.3, 0])

    def links() -> dict[str, list[list[float]]]:
        return {body["name"]: body["links"] for body in scenery(describe(builder.build()), {})["bodies"]}

    bare = links()
    assert bare["hull_base"] == [[0.0, 0.3, 0.0]]
    builder.shape("cabin", "box", "hull", size=[0.4, 0.2, 0.1])
    assert links() == {**bare, "hull_base": []}
    # joints of such bodies are not marked, since a ball or a pin would float beside the shapes
    marked = {item["name"]: not item.get("unmarked") for item in scenery(describe(builder.build()), {})["joints"]}
    assert marked == {"drive": True, "mount": False, "hinge": False}


def test_wheels_have_the_radius_of_their_tyres_and_stand_on_the_road() -> None:
    """A wheel at the centre of mass is drawn in place of its body; a wheel of a hull beside the hull's solid."""
    builder = eomgen.SceneBuilder("cart").body("hull", 10.0, inertia=[1, 1, 1]).body("wheel", 1.0, inertia=[1, 1, 1])
    builder.joint("free", "free", "base", "hull", initial={"position": [0, 0, 0.55]})
    builder.joint("spin", "revolute", "hull", "wheel", axis=[0, 1, 0], position=[0.5, 0, 0])
    builder.point("front", "wheel", [0, 0, 0]).point("rear", "hull", [-0.5, 0, 0])
    for name in ("front", "rear"):
        builder.tyre(f"tyre_{name}", name, radius=0.3, stiffness=1e4, road=0.25, slip={"stiffness": [15, 12]})
    seen = scenery(describe(builder.build()), {})
    for name, body, whole in (("tyre_front", "wheel", True), ("tyre_rear", "hull", False)):
        parts = [part for part in seen["shapes"] if part["name"] == name]
        assert {(part["body"], part["whole"]) for part in parts} == {(body, whole)}
        vertices = np.concatenate([part["vertices"] for part in parts]) - parts[0]["origin"]
        assert np.max(np.hypot(vertices[:, 0], vertices[:, 2])) == pytest.approx(0.3, rel=1e-5)
    assert seen["ground"] == [0.0, 0.0, 0.25]
    builder.shape("own", "sphere", "wheel", radius=0.1)
    assert {part["name"] for part in scenery(describe(builder.build()), {})["shapes"]} == {"own", "tyre_rear"}


def test_rolling_solids_have_the_radius_of_their_contact() -> None:
    builder = eomgen.SceneBuilder("coin").body("coin", 1.0, inertia=[0.01, 0.01, 0.02])
    builder.joint("free", "free", "base", "coin", initial={"position": [0, 0, 0.3], "rotation": [([1, 0, 0], 1.5707)]})
    frames = {"body": "base", "position": [0, 0, 0.1], "axis": [0, 0, 1]}, {"body": "coin"}
    builder.constraint("rim", "rolling", *frames, radius=0.2, shape="sphere")
    seen = scenery(describe(builder.build()), {})
    (ball,) = seen["shapes"]
    assert ball["whole"] and seen["ground"] == [0.0, 0.0, 0.1]
    np.testing.assert_allclose(np.linalg.norm(ball["vertices"], axis=1), 0.2, rtol=1e-5)
