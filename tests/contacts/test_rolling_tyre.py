"""Wheels on tyres from files and by coefficients: forces of the table, relaxation, standstill, messages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate as evaluate_formula_of
from eomgen.mechanics.derive import derive
from eomgen.products.contacts.tangential_laws import tangential_law
from eomgen.products.contacts.tyre_files import read_tyre_file
from eomgen.scene.scene import Scene
from tests.contacts.pairs import scene_of
from tests.contacts.states import MORE, OWN, own_tyre
from tests.contacts.test_tangential_laws import BRUSH, VAN
from tests.contacts.test_tangential_laws import LINEAR as LINEAR_SLIP
from tests.examples.demos import EXAMPLES
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import jacobian

SEEN = (
    *("gap", "normal_force", "friction_force_x", "friction_force_y", "slip_x", "slip_y", "camber", "wheel_speed"),
    *("velocity_x", "deflection_x_rate", "deflection_y_rate", "slip_velocity_y", "gap_rate"),
    *("moment_x", "moment_y", "moment_z"),
)
MIRRORED = ("friction_force_y", "slip_y", "camber", "deflection_y_rate", "slip_velocity_y", "moment_x", "moment_z")
TYRE = f'type = "magic_formula", file = "{OWN.as_posix()}"'
WHEEL = """format = 1
name = "wheel"
gravity = [0, 0, 0]
parameters.grip = {{ value = 0.9, tunable = true }}
bodies.wheel = {{ mass = 1e12, inertia = [1e12, 2e12, 1e12] }}
[joints.wheel]
type = "free"
parent = "base"
child = "wheel"
initial = {{ position = [0, 0, 0.29], velocity = [0, {speed}, 0, 20, {sideways}, 0] }}
[contacts.road]
first = {{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }}
second = {{ body = "wheel", axis = [0, 1, 0] }}
shape = "disc"
radius = 0.31
{normal}
tangential = {{ {law} }}
[outputs]
seen = {{ formula = [{seen}] }}
"""
SPRING = 'normal = { type = "linear", stiffness = "200 kN/m" }'


def wheel_text(law: str, normal: str = "", speed: float = 65.0, sideways: float = 0.1) -> str:
    seen = ", ".join(f'"{name}.road"' for name in SEEN)
    return WHEEL.format(speed=speed, sideways=sideways, law=law, normal=normal, seen=seen)


def wheel(law: str, speed: float = 65.0, sideways: float = 0.1, normal: str = "") -> Scene:
    """Return the scene of a heavy wheel, whose motion forces do not change."""
    return scene_of(wheel_text(law, normal, speed, sideways))


def file_of(version: str, folder: Path) -> Path:
    """Return the path of the own tyre as a file of another version."""
    fitted = OWN.read_text(encoding="utf-8").replace("= 61 ", f"= {version.replace('.', '').replace('52', '6')} ", 1)
    more = "".join(f"{key} = {value}\n" for key, value in MORE[version].items() if f"\n{key} " not in fitted)
    (folder / "car.tir").write_text(f"{fitted}[MORE]\n{more}", encoding="utf-8")
    return folder / "car.tir"


def coefficients_of(numbers: dict[str, float]) -> str:
    """Return the table of coefficients as TOML."""
    return f"coefficients = {{ {', '.join(f'{name} = {value!r}' for name, value in numbers.items())} }}"


def seen_at(scene: Scene, deflections: Array, mirror: float = 1.0, steps: int = 0) -> dict[str, Array]:
    """Return the quantities of the contact with the given deflections (n, 2) of the carcass, at speeds and cambers that
    vary, after ``steps`` of 0.5 ms in which the wheel stays in place; with ``mirror`` -1 of the mirrored motion."""
    count = len(deflections)
    lean = mirror * np.linspace(-0.1, 0.1, count)
    zero = np.zeros(count)
    q = np.stack([np.cos(lean / 2), np.sin(lean / 2), zero, zero, zero, zero, 0.29 * np.cos(lean)], axis=1)
    v = np.stack([zero, np.linspace(50.0, 80.0, count), zero, zero + 20.0, zero + mirror * 0.4, zero], axis=1)
    state = {"q": q, "v": v, "t": zero[:, np.newaxis], "z": deflections, "p": np.full((count, 1), 0.9)}
    evaluate, rates = tape_evaluator(derive(scene, ["outputs"])), [SEEN.index(f"deflection_{k}_rate") for k in "xy"]
    for _ in range(steps):
        state["z"] = state["z"] + 5e-4 * evaluate("outputs", state)["y"][:, rates]
    return dict(zip(SEEN, evaluate("outputs", state)["y"].T, strict=True))


@pytest.mark.parametrize(
    ("name", "version"),
    [*(("magic_formula", version) for version in MORE), *((name, "") for name in ("tmeasy", "brush", "linear"))],
)
def test_forces_of_a_steady_slip_are_the_values_of_the_table(name: str, version: str, tmp_path: Path) -> None:
    tables = {"tmeasy": VAN, "brush": BRUSH, "linear": LINEAR_SLIP}
    if version:
        path = file_of(version, tmp_path)
        file = read_tyre_file(path)
        assert file.version == version
        numbers = {**file.numbers, "LMUX": 0.9}
        text = f'type = "{name}", file = "{path.as_posix()}", coefficients = {{ LMUX = "grip" }}'
    else:
        numbers = tables[name]
        text = f'type = "{name}", {coefficients_of(numbers)}'
    scene, law = wheel(text, normal=SPRING), tangential_law(name, version)
    first = seen_at(scene, np.zeros((7, 2)))
    known = {"load": first["normal_force"], "camber": first["camber"], "wheel_speed": first["wheel_speed"]}
    known |= {"velocity_x": first["velocity_x"]}
    deflection = first["normal_force"] / 2e5
    radius = (
        law.values(["effective_radius"], numbers, **known)["effective_radius"]
        if version
        else 0.31 - deflection / 3 * np.cos(first["camber"])
    )
    slip_x = first["wheel_speed"] * radius / first["velocity_x"] - 1.0
    slip_y = first["slip_velocity_y"] / first["velocity_x"]
    found = seen_at(scene, np.zeros((7, 2)), steps=2000)
    for axis, slip in (("x", slip_x), ("y", slip_y)):
        np.testing.assert_allclose(found[f"deflection_{axis}_rate"], 0.0, atol=1e-11)
        np.testing.assert_allclose(found[f"slip_{axis}"], slip, rtol=1e-12, atol=1e-14)
        force = law.values([f"force_{axis}"], numbers, **known, slip_x=slip_x, slip_y=slip_y)[f"force_{axis}"]
        assert np.abs(force).min() > 1.0
        np.testing.assert_allclose(found[f"friction_force_{axis}"], force, rtol=1e-12, atol=1e-9)


def test_the_friction_depends_on_the_place() -> None:
    """The force is the one of the coefficient's value there, and the partials are exact."""
    law = f"{TYRE}, coefficients = {{{{ LMUX = {{}}, LMUY = 0.7 }}}}"
    patch = derive(wheel(law.format('"0.9 - 0.2 * contact_x - 0.1 * contact_y"')), ["outputs", "residual", "partials"])
    plain = derive(wheel(law.format('"grip"')), ["outputs"])
    rng = np.random.default_rng(63)
    q, v = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.29], (5, 1)), rng.normal(scale=0.1, size=(5, 6))
    q[:, 4:6], v[:, 1], v[:, 3] = rng.uniform(size=(5, 2)), 80.0, 20.0
    state = {"q": q, "v": v, "a": v, "t": np.zeros((5, 1)), "z": rng.normal(scale=0.1, size=(5, 2))}
    there = 0.9 - 0.2 * q[:, 4:5] - 0.1 * q[:, 5:6]
    found, expected = (
        tape_evaluator(system)("outputs", {**state, "p": grip})["y"]
        for system, grip in ((patch, there), (plain, there))
    )
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    given, evaluate = {**state, "p": there}, tape_evaluator(patch)
    exact = evaluate("partials", given)["K"]
    np.testing.assert_allclose(
        exact, jacobian(evaluate, patch.factors, "residual", "r", given, "q"), rtol=1e-5, atol=1e-2
    )
    assert np.abs(exact[:, :, 3]).max() > 100.0  # N/m along the road


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_response_to_a_step_of_slip_has_the_relaxation_length(axis: str) -> None:
    """After one length the slip, and the force of a small slip, has 1 - 1/e of its change."""
    law, numbers = tangential_law("magic_formula", "6.1"), own_tyre().numbers
    load = 2e5 * 0.02
    length = float(law.values([f"relaxation_{axis}"], numbers, load=load, camber=0.0)[f"relaxation_{axis}"])
    rolling = law.values(["effective_radius"], numbers, load=load, wheel_speed=65.8)
    motion = (65.65, 0.0) if axis == "x" else (20.0 / float(rolling["effective_radius"]), 0.1)
    scene = wheel(TYRE, *motion, normal=SPRING)
    run = eomgen.build(scene).simulate(length, length / 1000.0, method="rk4")
    seen = dict(zip(SEEN, run["seen"].T, strict=True))
    np.testing.assert_allclose(seen["normal_force"], load, rtol=1e-3)
    slip = seen[f"slip_{axis}"]
    place = 1000 // 20  # at 20 m/s
    assert 0.1 < length < 1.0 and abs(slip[-1]) > 1e-3
    assert slip[place] / slip[-1] == pytest.approx(1.0 - math.exp(-1.0), rel=2e-4)
    force = seen[f"friction_force_{axis}"] - seen[f"friction_force_{axis}"][0]
    assert force[place] / force[-1] == pytest.approx(1.0 - math.exp(-1.0), rel=0.03)


def test_the_force_acts_on_the_road() -> None:
    """The lateral force has the arm of the loaded radius about the centre, the longitudinal one the rolling radius."""
    scene = wheel(f'type = "brush", {coefficients_of(BRUSH)}', normal=SPRING)
    state = {"q": np.array([[1.0, 0, 0, 0, 0, 0, 0.29]]), "v": np.array([[0, 60.0, 0, 20.0, 0.1, 0]])}
    state |= {"t": np.zeros((1, 1)), "z": np.array([[-0.05, 0.02]]), "p": np.zeros((1, 1))}
    evaluate = tape_evaluator(derive(scene, ["force", "outputs"]))
    moment, force = np.split(evaluate("force", state)["Q"][0], 2)
    seen = dict(zip(SEEN, evaluate("outputs", state)["y"][0], strict=True))
    assert force[:2] == pytest.approx([seen["friction_force_x"], seen["friction_force_y"]], rel=1e-12)
    assert moment[1] == pytest.approx(-(0.31 - 0.02 / 3.0) * force[0], rel=1e-12)
    assert moment[0] == pytest.approx(0.29 * force[1], rel=1e-12)


def locked_wheel(law: str, gravity: str, axis: str = "[1, 0, 0]", speed: float = 0.0) -> Scene:
    """Return the scene of a wheel without an axle that a trolley guides along an axis."""
    text = WHEEL.format(
        law=law, speed=0.0, sideways=0.0, normal=SPRING.replace(" }", ", damping = 4000 }"), seen='"velocity_x.road"'
    )
    start, end = text.index("[joints"), text.index("[contacts")
    rails = f"""bodies.trolley = {{ mass = 0 }}
[joints.along]
type = "prismatic"
parent = "base"
child = "trolley"
axis = {axis}
initial = {{ velocity = {speed} }}
[joints.up]
type = "prismatic"
parent = "trolley"
child = "wheel"
axis = [0, 0, 1]
position = [0, 0, 0.29]
"""
    text = text[:start] + rails + text[end:]
    text = text.replace("mass = 1e12, inertia = [1e12, 2e12, 1e12]", "mass = 400")
    return scene_of(text.replace("[0, 0, 0]", gravity, 1))


@pytest.mark.slow
def test_a_braked_wheel_on_a_slope_stays_standing() -> None:
    run = eomgen.build(locked_wheel(TYRE, "[-1.92, 0, -9.62]")).simulate(6.0, 1e-3, method="rk4")
    creep = np.abs(run["seen"])
    assert creep[:1000].max() > 1e-3 and creep[-1000:].max() < 1e-6
    assert -0.01 < run.q[-1, 0] < -1e-3


@pytest.mark.parametrize(
    ("law", "normal", "message"),
    [
        (
            f"{TYRE}, coefficients = {{ LMUXX = 3 }}",
            "",
            "(contacts.road.tangential.coefficients.LMUXX): 'LMUXX' is not a coefficient of magic_formula; try: LMUX",
        ),
        (f"{TYRE}, coefficients = {{ force_x = 3 }}", "", "coefficients.force_x): 'force_x' is not a coefficient of"),
        (
            f"{TYRE}, coefficients = {{ VERTICAL_DAMPING = -3 }}",
            "",
            "the coefficient VERTICAL_DAMPING is -3; try: 0 or",
        ),
        ('type = "magic_formula"', SPRING, "the type magic_formula needs the key file; try: file = "),
        ('type = "magic_formula", file = ""', SPRING, 'should have at least 1 character; try: file = "car.tir"'),
        (f"{TYRE}, coefficients = {{ PKX1 = -20 }}", "", "coefficients.PKX1): the coefficient PKX1 is -20; try: a"),
        (f"{TYRE}, coefficients = {{ PKY1 = 20 }}", "", "coefficients.PKY1): the coefficients do not satisfy PKY1 < 0"),
        (
            'type = "brush", file = "no.tir", coefficients = { STIFFNESS = 1, FRICTION = 1 }',
            SPRING,
            "no meaning for br",
        ),
        ('type = "magic_formula", file = "no.tir"', SPRING, "(contacts.road.tangential.file"),
        ('type = "brush", coefficients = { FRICTION = 1 }', SPRING, "tangential): coefficients are missing: STIFFNESS"),
        ('type = "brush"', SPRING, "(contacts.road.tangential): the type brush needs the key coefficients"),
        (f'type = "coulomb", friction = 1, file = "{OWN.name}"', SPRING, "file has no meaning for coulomb"),
        ('type = "coulomb", friction = 1', "", "(contacts.road): no law of the normal force, and no tyre's file"),
    ],
)
def test_wrong_tyres_are_told(law: str, normal: str, message: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        wheel(law, normal=normal)
    own = [item for item in caught.value.problems if "outputs.seen" not in item.where]
    assert len(own) == 1 and message in str(caught.value)


def test_a_tube_is_smaller_than_the_tyre() -> None:
    text = wheel_text(TYRE).replace("radius = 0.31", "tube_radius = 0.05").replace('"disc"', '"torus"')
    assert scene_of(text).elements
    with pytest.raises(
        DescriptionError, match=r"\(contacts\.road\.radius\): the size of a shape is -0\.09; try: a numb"
    ):
        scene_of(text.replace("0.05", "0.4"))


def test_a_file_for_no_side_is_noted_if_a_side_is_asked_for(tmp_path: Path) -> None:
    text = OWN.read_text(encoding="utf-8")
    (tmp_path / "car.tir").write_text(text.replace("'LEFT'", "'UNKNOWN'", 1), encoding="utf-8")
    law = f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"'
    told = "contacts.road.tangential.side: TYRESIDE = 'UNKNOWN' of car.tir is taken as 'left'"
    assert any(told in note for note in wheel(f'{law}, side = "right"').notes)
    assert not any("TYRESIDE" in note for note in (*wheel(law).notes, *wheel(f'{TYRE}, side = "right"').notes))


def test_a_missing_file_is_told_with_files_of_tyres_alone(tmp_path: Path) -> None:
    (tmp_path / "cat.tir").write_text("", encoding="utf-8")
    (tmp_path / "car.toml").write_text("", encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"No such file or directory; try: .*cat\.tir$"):
        wheel(f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"')


IN_SCENE = "(contacts.road.tangential.file)"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("FNOMIN ", "FNOMIN = -4 $", "car.tir:30 (FNOMIN) (contacts.road.tangential.file): the coefficient FNOMIN is"),
        (
            "PKY1 ",
            "$",
            "(contacts.road.tangential): coefficients are missing: PKY1; try: coefficients = { PKY1",
        ),
        ("PKY1 ", "PKY1 = 0 $", f"car.tir:118 (PKY1) {IN_SCENE}: the coefficients do not satisfy PKY1 < 0 < PKY2"),
        ("PKY1 ", "PKY1 = 20 $", f"car.tir:118 (PKY1) {IN_SCENE}: the coefficients do not satisfy PKY1 < 0 < PKY2"),
        ("PKX1 ", "PKX1 = -22 $", f"car.tir:74 (PKX1) {IN_SCENE}: the coefficient PKX1 is -22; try: a number above 0"),
        ("KPUMIN ", "KPUMIN = 1 $", f"car.tir:57 (KPUMIN) {IN_SCENE}: the coefficient KPUMIN is 1; try: 0 or less"),
        ("KPUMAX ", "KPUMAX = -1 $", f"car.tir:58 (KPUMAX) {IN_SCENE}: the coefficient KPUMAX is -1; try: 0 or more"),
        ("KPUMIN ", "FZMAX = 0 $", f"car.tir:57 (FZMAX) {IN_SCENE}: the coefficient FZMAX is 0; try: a number above"),
        ("VERTICAL_STIFFNESS ", "$", "tangential): coefficients are missing: Q_FZ1; try: coefficients = { VERTICAL_"),
        ("= 61 ", "= 70 ", "car.tir:13 (FITTYP) (contacts.road.tangential.file): the Magic Formula of FITTYP = 70 is"),
    ],
)
def test_wrong_numbers_of_a_file_are_told_once_with_their_line(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "car.tir").write_text(OWN.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DescriptionError) as caught:
        wheel(f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"')
    assert len(caught.value.problems) == 1 and message in str(caught.value)


@pytest.mark.parametrize(
    "changes",
    [
        {"PKY1 ": "PKY1 = 20 $", "PKY2 ": "PKY2 = -1.8 $"},  # the same force
        {"PDY1 ": "PDY1 = -1 $"},
        {"KPUMIN ": "KPUMIN = 0 $"},
        {"KPUMAX ": "KPUMAX = 0 $"},
    ],
)
def test_numbers_of_published_files_are_taken(changes: dict[str, str], tmp_path: Path) -> None:
    text = OWN.read_text(encoding="utf-8")
    for old, new in changes.items():
        text = text.replace(old, new, 1)
    (tmp_path / "car.tir").write_text(text, encoding="utf-8")
    assert wheel(f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"').elements


@pytest.mark.parametrize("version", MORE)
def test_the_file_gives_the_normal_force(version: str, tmp_path: Path) -> None:
    """A3 at the deflection, with the tangential forces of the wheel itself; exactly so without their influence."""
    path = file_of(version, tmp_path)
    numbers, law = read_tyre_file(path).numbers, tangential_law("magic_formula", version)
    slips = np.stack([np.linspace(-0.3, 0.2, 7), np.linspace(0.1, -0.2, 7)], axis=1)
    loads = {}
    for influence, tolerance in ((1.0, 0.01 if version == "6.2" else 2e-3), (0.0, 1e-12)):
        weak = {name: influence * numbers[name] for name in ("Q_FCX", "Q_FCY")}
        scene = wheel(f'type = "magic_formula", file = "{path.as_posix()}", {coefficients_of(weak)}')
        seen = seen_at(scene, slips)
        known = {name: seen[name] for name in ("camber", "wheel_speed", "velocity_x")}
        known |= {f"force_held_{axis}": seen[f"friction_force_{axis}"] for axis in "xy"}
        deflection = -seen["gap"]
        force = law.values(["vertical_force"], {**numbers, **weak}, **known, deflection=deflection)["vertical_force"]
        damping = numbers["VERTICAL_DAMPING"] * seen["gap_rate"]
        np.testing.assert_allclose(seen["normal_force"], force - damping, rtol=tolerance)
        loads[influence] = seen["normal_force"]
    assert np.abs(loads[1.0] / loads[0.0] - 1.0).max() > 0.02


def test_a_rim_meets_the_road_and_the_elastic_force_has_a_potential(tmp_path: Path) -> None:
    (tmp_path / "car.tir").write_text(
        OWN.read_text(encoding="utf-8").replace("RIM_RADIUS", "BOTTOM_STIFF = 2\nBOTTOM_OFFST = 5\nRIM_RADIUS"),
        encoding="utf-8",
    )
    path, weak = (tmp_path / "car.tir").as_posix(), coefficients_of({"Q_FCX": 0.0, "Q_FCY": 0.0})
    text = wheel_text(f'type = "magic_formula", file = "{path}", {weak}')
    scene = scene_of(text.replace("gap.road", "energy.potential"))
    heights = 0.31 - np.array([-0.01, 0.0, 5e-5, 1e-4, 0.02, 0.1, 0.115, 0.11505, 0.1151, 0.15])
    evaluate = tape_evaluator(derive(scene, ["outputs", "energy"]))

    def at(heights: Array) -> dict[str, Array]:
        zero = np.zeros((len(heights), 1))
        q = np.column_stack([np.ones(len(heights)), np.zeros((len(heights), 5)), heights])
        state = {"q": q, "v": np.zeros((len(heights), 6)), "t": zero, "z": np.zeros((len(heights), 2)), "p": zero}
        return dict(zip(("potential", *SEEN[1:]), evaluate("outputs", state)["y"].T, strict=True))

    force, step = at(heights)["normal_force"], 1e-7
    slope = (at(heights - step)["potential"] - at(heights + step)["potential"]) / (2.0 * step)
    np.testing.assert_allclose(force, slope, rtol=1e-6, atol=1e-5)
    assert force[0] == 0.0 and (force[-1] - 2e6 * 0.035) == pytest.approx(force[5] * 1.5, rel=0.15)


def test_the_radius_of_the_shape_is_that_of_the_file() -> None:
    for shape, radius in (("disc", 0.31), ('torus"\ntube_radius = "10 cm', 0.21)):
        text = wheel_text(TYRE).replace("radius = 0.31\n", "").replace('"disc"', f'"{shape}"')
        (element,) = scene_of(text).elements
        assert evaluate_formula_of(element.radius, lambda _: 0.0) == pytest.approx(radius)  # type: ignore[attr-defined]
    with pytest.raises(DescriptionError, match="the shape disc needs the key radius"):
        scene_of(wheel_text(f'type = "brush", {coefficients_of(BRUSH)}', SPRING).replace("radius = 0.31\n", ""))


def test_a_tyre_of_the_other_side_is_a_mirrored_tyre() -> None:
    """Forces and moments of the right tyre in mirrored motion; the file is of a left tyre."""
    slips = np.stack([np.linspace(-0.1, 0.1, 7), np.linspace(0.05, -0.1, 7)], axis=1)
    left, right = (wheel(f'{TYRE}, side = "{side}"') for side in ("left", "right"))
    here, there = seen_at(left, slips), seen_at(right, slips * [1.0, -1.0], mirror=-1.0)
    for name in SEEN:
        sign = -1.0 if name in MIRRORED else 1.0
        np.testing.assert_allclose(there[name], sign * here[name], rtol=1e-10, atol=1e-9, err_msg=name)
    plain = seen_at(wheel(TYRE), slips)
    np.testing.assert_array_equal(plain["friction_force_y"], here["friction_force_y"])
    assert np.abs(plain["friction_force_y"] - seen_at(right, slips)["friction_force_y"]).min() > 0.1


def test_moments_of_the_tyre_are_quantities() -> None:
    slips = np.stack([np.linspace(-0.1, 0.1, 7), np.linspace(0.05, -0.1, 7)], axis=1)
    for more, option in (("", ""), (", tangents = true", "tangents")):
        seen, law = seen_at(wheel(TYRE + more), slips), tangential_law("magic_formula", "6.1", option)
        known = {name: seen[name] for name in ("camber", "wheel_speed", "velocity_x", "slip_x", "slip_y")}
        known |= {"load": seen["normal_force"]}
        results = {
            "moment_x": "moment_x",
            "moment_y": "moment_y",
            "moment_z": "moment_z",
            "friction_force_x": "force_x",
        }
        found = law.values([*results.values()], own_tyre().numbers, **known)
        for name, result in results.items():
            assert np.abs(found[result]).min() > 0.1
            np.testing.assert_allclose(seen[name], found[result], rtol=1e-10)


def test_a_note_lists_keys_without_use(tmp_path: Path) -> None:
    """Among them the mode, if it asks for less than combined slip."""
    scene = wheel(TYRE)
    text = f"{OWN.name}: keys that the law does not use: ASPECT_RATIO, PDXP1, PKYP1, Q_RA1"
    assert [note for note in scene.notes if note.startswith(text)]
    assert float(seen_at(scene, np.zeros((1, 2)))["normal_force"][0]) == pytest.approx(4000.0, rel=0.3)
    assert len(scene.states) == 2 and scene.states[0].name == "road_deflection_x"
    (tmp_path / "car.tir").write_text(OWN.read_text(encoding="utf-8").replace("= 124", "= 123"), encoding="utf-8")
    other = wheel(f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"')
    assert [note for note in other.notes if "USE_MODE" in note]


def test_slips_camber_and_load_end_at_the_ranges_of_the_file(tmp_path: Path) -> None:
    """Forces beyond are forces at the ends, and one note says so."""
    ends = "KPUMIN = -0.02\nKPUMAX = 1\nALPMIN = -1\nALPMAX = 0.015\nCAMMIN = -1\nCAMMAX = 0.05\nFZMAX = 3.9\n"
    fitted = OWN.read_text(encoding="utf-8").replace(
        "KPUMIN                  = -1.5\nKPUMAX                  = 1.5\n", ""
    )
    (tmp_path / "car.tir").write_text(f"{fitted}[RANGE]\n{ends}", encoding="utf-8")
    scene = wheel(f'type = "magic_formula", file = "{(tmp_path / "car.tir").as_posix()}"')
    text = "KPUMIN = -0.02, KPUMAX = 1, ALPMIN = -1, ALPMAX = 0.015"
    text = f"car.tir: slips, camber and load end at the ranges of the file: {text}"
    assert [note for note in scene.notes if f"{text}, CAMMIN = -1, CAMMAX = 0.05, FZMAX = 3900" in note]
    seen = seen_at(scene, np.zeros((7, 2)), steps=2000)
    known = {name: seen[name] for name in ("velocity_x", "wheel_speed")}
    known |= {"load": np.minimum(seen["normal_force"], 3900.0), "camber": np.clip(seen["camber"], -1.0, 0.05)}
    known |= {"slip_x": np.clip(seen["slip_x"], -0.02, 1.0), "slip_y": np.minimum(seen["slip_y"], math.tan(0.015))}
    free = tangential_law("magic_formula", "6.1").values(["force_x", "force_y"], own_tyre().numbers, **known)
    assert (seen["normal_force"] > 3900.0).any() and (seen["camber"] > 0.05).any() and (seen["slip_y"] > 0.016).all()
    np.testing.assert_allclose(seen["friction_force_x"], free["force_x"], rtol=1e-3)
    np.testing.assert_allclose(seen["friction_force_y"], free["force_y"], rtol=1e-3)


def test_notes_of_a_file_are_told_once(tmp_path: Path) -> None:
    """Of two wheels with the same tyre; the tyres of examples cause no note."""
    (tmp_path / "wheel.toml").write_text(wheel_text(TYRE), encoding="utf-8")
    whole = (
        'format = 1\nname = "two"\ninclude.left = { file = "wheel.toml" }\ninclude.right = { file = "wheel.toml" }\n'
    )
    (tmp_path / "two.toml").write_text(whole, encoding="utf-8")
    notes = eomgen.load(tmp_path / "two.toml").notes
    assert sum(OWN.name in note for note in notes) == 2  # keys, ranges
    for name in ("rolling_tyre/system/wheel", "motorcycle/system/motorcycle", "driving_car/system/step_steer"):
        assert not [note for note in eomgen.load(EXAMPLES / f"{name}.toml").notes if ".tir" in note]


def test_a_file_is_found_from_the_folder_of_an_included_scene(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    text = WHEEL.format(
        law='type = "magic_formula", file = "car.tir"', speed=65, sideways=0, normal="", seen='"slip_x.road"'
    )
    (tmp_path / "parts" / "wheel.toml").write_text(text, encoding="utf-8")
    (tmp_path / "parts" / "car.tir").write_text(OWN.read_text(encoding="utf-8"), encoding="utf-8")
    whole = 'format = 1\nname = "two"\ninclude.left = { file = "parts/wheel.toml" }\n'
    (tmp_path / "two.toml").write_text(whole, encoding="utf-8")
    scene = eomgen.load(tmp_path / "two.toml")
    assert [state.name for state in scene.states] == ["left_road_deflection_x", "left_road_deflection_y"]
