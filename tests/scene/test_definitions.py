"""Named expressions: equal to their text in its place, recorded once, in scopes of their users, in included files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load_toml
from tests.docs.parts import whole
from tests.oracles.evaluation import tape_evaluator

HEAD = """
format = 1
name = "cart"
gravity = [0, 0, -9.81]
bodies.cart = { mass = 2.0 }
points.hook = { body = "cart", position = [0.1, 0, 0] }
parameters.k = { value = 100.0, tunable = true, unit = "N/m" }
inputs.push = { formula = "sin(3 * t)" }
[joints.rail]
type = "prismatic"
parent = "base"
child = "cart"
axis = [1, 0, 0]
initial = { position = 0.3, velocity = -0.2 }
"""
DEFINED = (
    HEAD
    + """
[definitions]
force = "-k * stretch - drag + push"
stretch = { formula = "position.hook[0] - 0.2", unit = "m", description = "beyond the free length" }
drag = "3 * v.rail * abs(v.rail)"
[states]
dose = { rate = "drag * v.rail" }
[efforts]
spring = { joint = "rail", effort = "force" }
[outputs]
power = { formula = "force * v.rail" }
[events]
slack = { when = "stretch - 0.15", action = "reset", reset = { dose = "dose + drag" } }
"""
)
_DRAG, _FORCE = "3 * v.rail * abs(v.rail)", "-k * (position.hook[0] - 0.2) - 3 * v.rail * abs(v.rail) + push"
WRITTEN = (
    HEAD
    + f"""
[states]
dose = {{ rate = "{_DRAG} * v.rail" }}
[efforts]
spring = {{ joint = "rail", effort = "{_FORCE}" }}
[outputs]
power = {{ formula = "({_FORCE}) * v.rail" }}
[events]
slack = {{ when = "position.hook[0] - 0.2 - 0.15", action = "reset", reset = {{ dose = "dose + {_DRAG}" }} }}
"""
)


def written(folder: Path, text: str, name: str = "scene.toml") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def problems(folder: Path, definitions: str, rest: str = "") -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        eomgen.load(written(folder, f"{HEAD}[definitions]\n{definitions}\n{rest}"))
    return [f"{problem.where.partition('(')[2]} {problem.what}; {problem.hint}" for problem in caught.value.problems]


@pytest.mark.slow
def test_a_definition_is_its_text_in_its_place(tmp_path: Path) -> None:
    runs = []
    for name, text in (("defined", DEFINED), ("written", WRITTEN)):
        model = eomgen.build(written(tmp_path, text, f"{name}.toml"), method="rk4")
        runs.append(model.simulate(0.5, 1e-3, parameters={"k": 80.0}))
    defined, whole = runs
    for one, other in ((defined.q, whole.q), (defined.z, whole.z), (defined.outputs["power"], whole.outputs["power"])):
        np.testing.assert_array_equal(one, other)


def test_a_definition_is_computed_once_under_its_name(tmp_path: Path) -> None:
    defined, whole = (derive(eomgen.load(written(tmp_path, text))) for text in (DEFINED, WRITTEN))
    assert {name: count.flops for name, count in defined.counts.items()} == {
        name: count.flops for name, count in whole.counts.items()
    }
    eomgen.generate(tmp_path / "scene.toml", tmp_path / "whole")
    eomgen.generate(written(tmp_path, DEFINED), tmp_path / "defined")
    text = (tmp_path / "defined" / "cart.c").read_text(encoding="utf-8")
    outputs = text[text.index("void cart_outputs(") :].split("\n}\n")[0]
    assert re.search(r"/\* Definition force \*/\n    const real drag_value = ", outputs)
    assert outputs.count("EG_ABS") == 1  # the force and the power take the same drag


AXLES = """
format = 1
name = "car"
gravity = [0, 0, 0]
bodies.car = { mass = 1500, inertia = [400, 2000, 2100] }
joints.plane = { type = "planar", parent = "base", child = "car", axis = [0, 0, 1] }
[parameters]
B = { value = 10.0, tunable = true }
D = { value = 4400.0, unit = "N", tunable = true }
DEFINITIONS
"""
TYRES = {"front_left": (1.2, 0.7), "front_right": (1.2, -0.7), "rear_left": (-1.4, 0.7), "rear_right": (-1.4, -0.7)}
SLIP = "atan2(velocity.here[1], abs(velocity.here[0]) + 0.1)"
SHAPE = f"(B * {SLIP} - 0.97 * (B * {SLIP} - atan(B * {SLIP})))"
MAGIC = f"""[definitions]
slip = {{ formula = "{SLIP}", unit = "rad" }}
stretched = "B * slip"
shape = "stretched - 0.97 * (stretched - atan(stretched))"
lateral = {{ formula = "-D * sin(1.9 * atan(shape))", unit = "N" }}"""


def tyres(definitions: str, law: str) -> str:
    forces = (
        f'[forces.{name}]\nbody = "car"\npoint = [{x}, {y}, 0]\naxes = "body"\nforce = [0, "{law}", 0]\n'
        for name, (x, y) in TYRES.items()
    )
    return AXLES.replace("DEFINITIONS", definitions) + "".join(forces)


def test_a_magic_formula_of_definitions_has_the_slip_of_each_tyre(rng: np.random.Generator) -> None:
    """Against the formula by hand (Pacejka, Tire and Vehicle Dynamics, 2012, chapter 4) and against one long text."""
    scenes = load_toml(tyres(MAGIC, "lateral")), load_toml(tyres("", f"-D * sin(1.9 * atan({SHAPE}))"))
    state = {"q": rng.normal(size=(20, 3)), "v": 5.0 * rng.normal(size=(20, 3)), "p": np.array([9.0, 4000.0])}
    defined, whole = (tape_evaluator(derive(scene))("force", state)["Q"] for scene in scenes)
    np.testing.assert_array_equal(defined, whole)
    (yaw, _, _), (turn, along_x, along_y) = state["q"].T, state["v"].T
    forward, sideways = np.cos(yaw) * along_x + np.sin(yaw) * along_y, np.cos(yaw) * along_y - np.sin(yaw) * along_x
    across, moment = np.zeros(20), np.zeros(20)
    for x, y in TYRES.values():
        slip = np.arctan2(sideways + turn * x, np.abs(forward - turn * y) + 0.1)
        force = -4000.0 * np.sin(1.9 * np.arctan(9.0 * slip - 0.97 * (9.0 * slip - np.arctan(9.0 * slip))))
        across, moment = across + force, moment + x * force
    expected = np.stack([moment, -np.sin(yaw) * across, np.cos(yaw) * across], axis=-1)
    np.testing.assert_allclose(defined, expected, rtol=0.0, atol=1e-13 * np.max(np.abs(expected)))


@pytest.mark.slow
def test_the_tyre_of_the_docs_has_slips_and_forces_of_the_magic_formula() -> None:
    """Along a run that brakes the wheel into sliding: forces against the formula by hand, and the axle's moment."""
    page = whole("scene")
    start = page.index('format = 1\nname = "wheel"')
    text = page[start : page.index("```", start)]
    braked = text + '[efforts.brake]\njoint = "spin"\neffort = "-9000 * t"\n'
    run = eomgen.build(load_toml(braked), profile="instant").simulate(0.4, 1e-3, error_estimate=False)
    speed, radius, steer = 20.0, 0.31, np.radians(2.0)
    along, across = speed * np.cos(steer), -speed * np.sin(steer)
    kappa, alpha = (radius * run["v.spin"] - along) / (along + 0.1), np.arctan2(across, along + 0.1)
    pure_x = np.sin(1.65 * np.arctan(11.0 * kappa - 0.2 * (11.0 * kappa - np.arctan(11.0 * kappa))))
    pure_y = -np.sin(1.4 * np.arctan(9.0 * alpha + 0.5 * (9.0 * alpha - np.arctan(9.0 * alpha))))
    both = np.maximum(1.0, np.hypot(pure_x, pure_y))
    load = run["tyre_forces"][:, 2]
    assert kappa.min() < -0.15 and both.max() > 1.0 and np.ptp(load) > 50.0
    expected = np.stack([1.05 * load * pure_x / both, load * pure_y / both], axis=1)
    np.testing.assert_allclose(run["tyre_forces"][:, :2], expected, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(run["longitudinal_slip"], kappa, atol=1e-14)
    moment = -radius * expected[:, 0] - 9000.0 * run.t
    np.testing.assert_allclose(1.1 * run["a.spin"], moment, rtol=0.0, atol=1e-3)


def test_a_definition_is_a_condition(tmp_path: Path) -> None:
    conditions = 'near = "gap < 0.25"\nclosing = "near and not (v.rail > 0)"\nsame = "closing"\ngap = "q.rail - 0.1"'
    formulas = ("2 if near else 3", "2 if closing else 3", "2 if same or t > 0.1 else 3", "1 if not near else 5")
    whole = {"near": "(q.rail - 0.1 < 0.25)", "closing": "(q.rail - 0.1 < 0.25 and not (v.rail > 0))"}
    defined = load_toml(f"{HEAD}[definitions]\n{conditions}\n[outputs]\ny = {{ formula = {list(formulas)} }}")
    written_out = [text.replace("same", "closing") for text in formulas]
    for name, text in whole.items():
        written_out = [formula.replace(name, text) for formula in written_out]
    inlined = load_toml(f"{HEAD}[outputs]\ny = {{ formula = {written_out} }}")
    assert defined.outputs[0].values == inlined.outputs[0].values


def test_a_condition_of_an_included_file_is_known_outside(tmp_path: Path) -> None:
    part = f'{HEAD}[definitions]\nnear = "q.rail < 0.25"\n[outputs]\ny = {{ formula = "2 if near else 3" }}'
    written(tmp_path, part, "part.toml")
    whole = """
format = 1
name = "two"
include.a = { file = "part.toml" }
definitions.far = "not a_near"
outputs.z = { formula = "2 if a_near else 3" }
outputs.w = { formula = "3 if far else 2" }
"""
    outputs = {output.name: output.values for output in eomgen.load(written(tmp_path, whole, "two.toml")).outputs}
    assert outputs["a_y"] == outputs["z"]


@pytest.mark.slow
def test_definitions_of_included_files_have_names_of_their_own(tmp_path: Path) -> None:
    written(tmp_path, DEFINED.replace('name = "cart"', 'name = "part"'), "part.toml")
    whole = """
format = 1
name = "two"
include.a = { file = "part.toml" }
include.b = { file = "part.toml", parameters = { k = 50 } }
definitions.force = "17 * q.a_rail"
outputs.own = { formula = "force" }
outputs.first = { formula = "a_force" }
"""
    model = eomgen.build(written(tmp_path, whole, "two.toml"), method="rk4")
    run = model.simulate(0.1, 1e-3)
    np.testing.assert_allclose(run.outputs["own"], 17 * run.q[:, 0], rtol=1e-14)
    a, v = run.q[:, 0], run.v[:, 0]
    expected = -100 * (a + 0.1 - 0.2) - 3 * v * np.abs(v) + np.sin(3 * run.t)
    np.testing.assert_allclose(run.outputs["first"], expected, rtol=1e-12)


def test_definitions_that_double_one_another_stay_within_a_limit(tmp_path: Path) -> None:
    chain = "\n".join(f'x{k} = "x{k - 1} * x{k - 1}"' for k in range(1, 40))
    [fault] = problems(tmp_path, f'x0 = "q.rail"\n{chain}')[:1]
    limits = "of 20000 and 150 at most (column 1)"
    fault = fault.partition(";")[0]
    assert fault == f"definitions.x15.formula) the formula has 32767 operations in 16 levels, {limits}"


@pytest.mark.slow_cases("1 + y{}-levels")
@pytest.mark.parametrize(
    ("form", "words"), [("1 + y{}", "levels"), ("y{}", "more than 50 definitions are within one another")]
)
def test_definitions_within_one_another_stay_within_a_limit(form: str, words: str, tmp_path: Path) -> None:
    lines = [f'y{k} = "{form.format(k - 1)}"' for k in range(1, 300)]
    for chain in (lines, lines[::-1]):
        [fault] = problems(tmp_path, "\n".join(['y0 = "q.rail"', *chain]), '[outputs]\ny = { formula = "y299" }')
        assert words in fault and "an internal state, an input or an output in place of a definition" in fault
    deep = "\n".join(['y0 = "q.rail"', *lines[:49]])
    rest = '[outputs]\ny = { formula = "y49" }\n[efforts.e]\njoint = "rail"\neffort = "y49"'
    scene = eomgen.load(written(tmp_path, f"{HEAD}[definitions]\n{deep}\n{rest}"))
    assert len(scene.parts["definitions"]) == 50


def test_one_mistake_is_told_once_in_any_order(tmp_path: Path) -> None:
    chain = [f'x{k} = "2 * x{k - 1}"' for k in range(1, 20)]
    for lines in (['x0 = "q.rai"', *chain], [*chain[::-1], 'x0 = "q.rai"']):
        assert problems(tmp_path, "\n".join(lines), '[outputs]\ny = { formula = "x19" }') == [
            "definitions.x0.formula) q.rai: there is no joint 'rai' (column 1); rail"
        ]


@pytest.mark.slow
def test_definitions_that_are_one_name_or_number_are_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = 'place = "q.rail"\nhalf = 0.5\nM_PI = "half * place"\nSIZE_MAX = "M_PI + M_PI * M_PI"\n'
    file = written(tmp_path, f'{HEAD}[definitions]\n{lines}[outputs]\ny = {{ formula = "SIZE_MAX * push" }}')
    assert main(["info", str(file)]) == 0
    assert "changes nothing" not in capsys.readouterr().out.replace("the parameter k changes nothing", "")
    run = eomgen.build(file, method="rk4").simulate(0.1, 1e-3)
    part = 0.5 * run.q[:, 0]
    np.testing.assert_allclose(run.outputs["y"], (part + part**2) * np.sin(3 * run.t), rtol=1e-13)


OUTPUT = '[outputs]\ny = {{ formula = "{}" }}'.format
LOAD, UNIT = 'load = "2 * v.rail"', "the unit 'N' is of a force, a speed in m/s is expected; \"m/s\", the unit of its"


@pytest.mark.parametrize(
    ("definitions", "rest", "expected"),
    [
        ('a = "b + 1"\nb = "2 * a"', "", "definitions.b.formula) the definition a mentions itself (column 1); an"),
        ('a = "sin(q.rai)"\nb = "2 * a"', OUTPUT("a + b"), "definitions.a.formula) q.rai: there is no joint 'rai'"),
        ("n = 100", OUTPUT("q.rail ** n"), "outputs.y.formula[0]) the exponent 100 is beyond 64 (column 11); exp()"),
        ('half = "q.rail / 2"', OUTPUT("1 if half else 2"), "outputs.y.formula[0]) a condition is needed here, not a"),
        (LOAD, OUTPUT("load(q.rail)"), "outputs.y.formula[0]) load is a number, not a function (column 1); load alone"),
        ('slip = "2 * velocity.here[0]"', OUTPUT("slip"), "outputs.y.formula[0]) in the definition slip, velocity.her"),
    ],
)
def test_mistakes_are_named_at_their_place(definitions: str, rest: str, expected: str, tmp_path: Path) -> None:
    [found] = problems(tmp_path, definitions, rest)
    assert found.startswith(expected)


def test_info_lists_definitions_and_notes_unused_ones(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path, DEFINED + '[definitions.spare]\nformula = "2 * stretch"\n')
    assert main(["info", str(file)]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"stretch +position\.hook\[0\] - 0\.2 +m +beyond the free length", printed)
    assert "the definition spare changes nothing: no formula mentions it" in printed
    assert printed.count("changes nothing") == 1


def test_a_unit_that_is_not_of_si_is_noted(tmp_path: Path) -> None:
    text = f'{HEAD}[definitions]\nway = {{ formula = "q.rail", unit = "mm" }}\n[outputs]\ny = {{ formula = "way" }}\n'
    note = "definitions.way.unit: its unit mm is a label, and its values are in m: labels do not convert values"
    assert note in eomgen.load(written(tmp_path, text)).notes
    assert note not in eomgen.load(written(tmp_path, text.replace('"mm"', '"m"'))).notes


def test_a_name_with_a_dot_is_named(tmp_path: Path) -> None:
    found = problems(tmp_path, 'v.rel = "v.rail - 1"', "")
    assert (
        "definitions.v.rel) definitions.v is a table with the key 'rel', and names have no dots; v_rel = \"v.rail - 1\""
    ) in found
