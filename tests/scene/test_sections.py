"""The register of sections: its rows fit together, and another distribution brings a section without a line in the
package."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from docs.scene_tables import renew
from eomgen.base.extensions import code_stamp
from eomgen.cli import main
from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import infix
from eomgen.formula.words import other_words
from eomgen.pipeline.scenes import SCENES
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.document.reference import schema
from eomgen.scene.document.schema import document_for, every_document
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import SceneNames
from eomgen.scene.load import load_toml
from eomgen.scene.reading.formula_units import unit_of
from eomgen.scene.section import in_reading_order
from eomgen.scene.sections import KEYS, OFFERED, others, own_sections
from tests.models import drags_for_eomgen as drags
from tests.models.drags_for_eomgen import law as law_of_drags
from tests.scene.distributions import install

MASS, COEFFICIENT, GRAVITY = 80.0, 0.25, 9.81
FALL = f"""
format = 1
name = "fall"
bodies.jumper = {{ mass = {MASS} }}
joints.down = {{ type = "prismatic", parent = "base", child = "jumper", axis = [0, 0, -1] }}
points.chute = {{ body = "jumper" }}
drags.air = {{ point = "chute", coefficient = "{COEFFICIENT} kg/m" }}
outputs.pull = {{ formula = "drag.air" }}
[simulation]
method = "rk4"
step = 1e-2
"""


def test_predecessors_are_sections_and_observers_come_last() -> None:
    rows = own_sections()
    keys = [row.key for row in rows]
    order = in_reading_order(rows)
    assert len(set(keys)) == len(keys) and sorted(keys) == sorted(row.key for row in order)
    for row in rows:
        assert all(order.index(row) > [other.key for other in order].index(key) for key in row.after), row.key
    assert [row.last for row in order] == sorted(row.last for row in order)


def test_fields_of_files_are_the_rows() -> None:
    assert tuple(name for name in every_document().model_fields if name in KEYS) == KEYS


def test_late_rows_are_the_rows_of_their_modules() -> None:
    assert tuple(row.key for row in own_sections()) == KEYS
    rows = [row for row in own_sections() if isinstance(row, ElementSection) and row.key in OFFERED]
    assert {row.key: row.offers for row in rows if row.offers} == {
        key: kinds for key, kinds in OFFERED.items() if kinds
    }


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install a distribution that brings the section ``drags``."""
    entries = f"[eomgen.sections]\ndrags = {drags.__name__}:DRAGS\nwinds = {drags.__name__}:WINDS\n"
    entries += f"[eomgen.formula_words]\nwind_speed = {drags.__name__}:WIND_SPEED\n"
    install(tmp_path, monkeypatch, "drags-for-eomgen", entries)
    others.cache_clear()
    other_words.cache_clear()
    yield
    others.cache_clear()
    other_words.cache_clear()


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_a_body_falls_with_a_drag_of_another_distribution() -> None:
    """v = v_t tanh(g t / v_t) with v_t = sqrt(m g / c)."""
    model = eomgen.build(load_toml(FALL), profile="quick")
    run = model.simulate(8.0)
    terminal = np.sqrt(MASS * GRAVITY / COEFFICIENT)
    assert np.max(np.abs(run.v[:, 0] - terminal * np.tanh(GRAVITY * run.t / terminal))) <= 1e-8 * terminal
    assert np.allclose(run.outputs["pull"], COEFFICIENT * run.v[:, 0] ** 2, rtol=1e-12)


#: A body on a slider in a wind whose speed is a word of another distribution.
WINDY = f"""
format = 1
name = "windy"
winds.site = {{ speed = 12, exponent = 0.25, time = "2 s" }}
bodies.sail = {{ mass = {MASS} }}
joints.along = {{ type = "prismatic", parent = "base", child = "sail", axis = [1, 0, 0] }}
efforts.push = {{ joint = "along", effort = "{COEFFICIENT} * wind_speed.site(20 + q.along)" }}
outputs.wind = {{ formula = "wind_speed.site(20 + q.along)" }}
[simulation]
method = "rk4"
step = 1e-2
"""


def windy(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the speed of the wind of ``WINDY``, m/s."""
    return np.asarray(12.0 * ((20.0 + x) / 10.0) ** 0.25 * (1.0 - np.exp(-t / 2.0)))


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_a_word_of_another_distribution_is_a_quantity_in_formulas() -> None:
    """The motion against SciPy's integration of m x'' = c w(20 + x, t)."""
    model = eomgen.build(load_toml(WINDY), profile="quick")
    run = model.simulate(3.0)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], COEFFICIENT / MASS * float(windy(np.asarray(t), y[0]))]

    exact = solve_ivp(rates, (0.0, 3.0), [0.0, 0.0], t_eval=run.t, rtol=1e-11, atol=1e-13)
    assert np.allclose(run.q[:, 0], exact.y[0], rtol=0.0, atol=1e-9)
    assert np.allclose(run.outputs["wind"], windy(run.t, run.q[:, 0]), rtol=1e-12)
    formula = load_toml(WINDY).outputs[0].values[0]
    assert infix(formula) == "wind_speed.site(20 + q.along)"
    values = evaluate_batch(formula, lambda symbol: run.t if symbol.kind == "time" else run.q[:, 0])
    assert np.allclose(values, windy(run.t, run.q[:, 0]), rtol=1e-12)
    assert unit_of(formula, SceneNames(joints={"along": "prismatic"})) == "m/s"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("wind_speed.sight(20)", r"wind_speed.sight: there are no winds 'sight' \(column 1\); try: site"),
        ("wind_speed.site(20, 1)", r"wind_speed.site\(\) takes 1 argument, not 2 .*; try: wind_speed.site\(z\)"),
        ("wind_speed.site", r"wind_speed.site is a function of z, and needs arguments .*; try: wind_speed.site\(z\)"),
        ("wind_speed(20)", r"unknown function 'wind_speed' .*; try: wind_speed.site\(z\)"),
    ],
)
def test_mistakes_in_its_words_are_told_as_in_any_other(written: str, message: str) -> None:
    text = WINDY.replace('formula = "wind_speed.site(20 + q.along)"', f'formula = "{written}"')
    with pytest.raises(DescriptionError, match=message):
        load_toml(text)


def test_without_the_distribution_its_words_are_unknown() -> None:
    other_words.cache_clear()
    others.cache_clear()
    text = WINDY.replace('winds.site = { speed = 12, exponent = 0.25, time = "2 s" }\n', "")
    with pytest.raises(DescriptionError, match=r"only functions can be called, not 'wind_speed.site'"):
        load_toml(text)


@pytest.mark.usefixtures("installed")
def test_words_of_included_files_have_the_names_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "windy.toml").write_text(WINDY, encoding="utf-8")
    whole = load_toml('format = 1\nname = "two"\n[include.left]\nfile = "windy.toml"\n', folder=tmp_path)
    assert infix(whole.outputs[0].values[0]) == "wind_speed.left_site(20 + q.left_along)"


@pytest.mark.usefixtures("installed")
def test_builders_includes_and_copies_know_it(tmp_path: Path) -> None:
    builder = SceneBuilder("fall").body("jumper", MASS).joint("down", "prismatic", "base", "jumper", axis=[0, 0, -1])
    scene = (
        builder.point("chute", "jumper").drag("air", "chute", "0.25 kg/m").output("pull", formula="drag.air").build()
    )
    assert scene.elements == load_toml(FALL).elements
    (tmp_path / "fall.toml").write_text(FALL, encoding="utf-8")
    whole = load_toml('format = 1\nname = "two"\n[include.left]\nfile = "fall.toml"\n', folder=tmp_path)
    assert [(element.name, element.section) for element in whole.elements] == [("left_air", "drags")]
    air = f'{{ point = "chute", coefficient = "{COEFFICIENT} kg/m" }}'
    text = FALL.replace(f"drags.air = {air}", "").replace("drag.air", "drag.air_1")
    text += f'[repeat.r]\nindices = {{ i = 2 }}\ndrags."air_{{i}}" = {air}\n'
    assert [element.name for element in load_toml(text).elements] == ["air_0", "air_1"]


@pytest.mark.usefixtures("installed")
def test_editors_and_pages_know_it() -> None:
    assert schema()["properties"]["drags"]["additionalProperties"] == {"$ref": "#/$defs/DragEntry"}
    assert "drags" not in KEYS and "drags" in every_document().model_fields
    row = "| `coefficient` | value of parameters, kg/m | required | force per squared velocity |\n"
    assert row in renew("<!-- keys of Drag -->\n<!-- end -->", {})


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("point =", "pint ="), r"scene.toml:7 \(drags.air.pint\): the key 'pint' is unknown here; try: point"),
        (('"0.25 kg/m"', "-1"), r"\(drags.air.coefficient\): the coefficient of a drag is -1; try: 0 or more"),
        (('"0.25 kg/m"', '"0.25 kg"'), r"\(drags.air.coefficient\): '0.25 kg' .*kg/m"),
        (("drag.air", "drag.are"), "\\(outputs.pull.formula\\[0\\]\\): drag.are: there is no drag 'are' \\(column"),
    ],
)
def test_mistakes_in_it_are_told_as_in_any_other(change: tuple[str, str], message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        load_toml(FALL.replace(*change))


def test_without_the_distribution_the_section_is_unknown() -> None:
    others.cache_clear()
    with pytest.raises(DescriptionError, match=r"scene.toml:7 \(drags\): the key 'drags' is unknown here"):
        load_toml(FALL)
    assert "drags" not in document_for({"drags": {}}).known_keys()


@pytest.mark.usefixtures("installed")
def test_libraries_follow_from_its_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_toml(FALL)
    before = SCENES.content(scene)
    assert before == SCENES.content(load_toml(FALL)) != scene.digest
    changed = tmp_path / "changed" / "__init__.py"
    changed.parent.mkdir()
    changed.write_text("LAW = None\n", encoding="utf-8")
    windy_before = SCENES.content(load_toml(WINDY))
    assert windy_before == SCENES.content(load_toml(WINDY))
    monkeypatch.setattr("inspect.getfile", lambda kind: str(changed))
    assert SCENES.content(scene) != before
    assert SCENES.content(load_toml(WINDY)) != windy_before


@pytest.fixture
def fogs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install a distribution of drags whose section, law and sizes are modules without a package."""
    for source, module in ((drags.__file__, "fog_section"), (law_of_drags.__file__, "fog_law")):
        text = Path(source).read_text(encoding="utf-8").replace(law_of_drags.__name__, "fog_law")
        text = text.replace(drags.__name__, "fog_section")
        (tmp_path / f"{module}.py").write_text(f"{text}\nimport fog_sizes\n", encoding="utf-8")
    (tmp_path / "fog_sizes.py").write_text("SIZE = 1\n", encoding="utf-8")
    entries = install(tmp_path, monkeypatch, "fogs", "[eomgen.sections]\ndrags = fog_section:DRAGS\n")
    entries.with_name("top_level.txt").write_text("fog_section\nfog_law\nfog_sizes\n", "utf-8")
    others.cache_clear()
    (tmp_path / "fall.toml").write_text(FALL.replace('"drag.air"', "1"), encoding="utf-8")
    yield tmp_path
    others.cache_clear()
    for name in ("fog_section", "fog_law", "fog_sizes"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("changed", ["fog_law", "fog_sizes"])
def test_libraries_follow_from_the_modules_of_its_law(changed: str, fogs: Path) -> None:
    """A process that has imported the law keeps the digest of the text that it runs."""
    scene = load_toml((fogs / "fall.toml").read_text(encoding="utf-8"))
    before = SCENES.content(scene)
    file = fogs / f"{changed}.py"
    file.write_text(file.read_text(encoding="utf-8") + "OTHER = 2\n", encoding="utf-8")
    after = SCENES.content(scene)
    assert before != after
    importlib.import_module("fog_law")
    file.write_text(file.read_text(encoding="utf-8") + "THIRD = 3\n", encoding="utf-8")
    assert SCENES.content(scene) == after


@pytest.mark.parametrize(
    ("module", "written", "instead", "code", "message"),
    [
        ("fog_law", "relative = minus", "relative = lost", 1, "name 'lost' is not defined; this is a fault of fogs;"),
        ("fog_section", "return Drag(", "return str(", 2, "drags.air: fog_section.read_drag returns a str, not a Drag"),
    ],
)
def test_faults_of_its_code_are_not_eomgen_s(
    module: str, written: str, instead: str, code: int, message: str, fogs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = fogs / f"{module}.py"
    text = file.read_text(encoding="utf-8").replace("Drag(name, entry.point, coefficient, values", "Drag(values")
    assert text.count(written) == 1
    file.write_text(text.replace(written, instead), encoding="utf-8")
    assert main(["info", str(fogs / "fall.toml")]) == code
    assert message in capsys.readouterr().err


def test_the_code_of_a_class_is_its_whole_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders above the package, which other distributions share, do not count."""
    package = tmp_path / "shared_by_many" / "gusts"
    (package / "inner").mkdir(parents=True)
    for file, text in (("__init__.py", ""), ("inner/__init__.py", ""), ("inner/kind.py", "class Gust: pass\n")):
        (package / file).write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    kind = importlib.import_module("shared_by_many.gusts.inner.kind").Gust
    stamps = []
    for place in (package.parent / "calm.py", package / "laws.py"):
        monkeypatch.setattr("eomgen.base.extensions._STAMPS", {})
        place.write_text("FORCE = 1.0\n", encoding="utf-8")
        stamps.append(code_stamp(kind))
    monkeypatch.setattr("eomgen.base.extensions._STAMPS", {})
    (package.parent / "calm.py").write_text("FORCE = 2.0\n", encoding="utf-8")
    assert stamps[0] != stamps[1] == code_stamp(kind)


def test_a_row_under_another_name_is_refused(installed: None, tmp_path: Path) -> None:
    [entries] = tmp_path.glob("*.dist-info/entry_points.txt")
    entries.write_text(f"[eomgen.sections]\nsails = {drags.__name__}:DRAGS\n", encoding="utf-8")
    others.cache_clear()
    match = r"the entry point 'sails' .* of the distribution drags-for-eomgen is the section \[drags\]"
    with pytest.raises(UsageError, match=match):
        load_toml(FALL.replace("drags", "sails"))
