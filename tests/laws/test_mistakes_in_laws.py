"""Mistakes in laws: one message each, with place and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import eomgen
from eomgen.errors import DescriptionError, ModelError, ToolchainError
from tests.models.c_laws import TYRE_C, TYRE_LAW, wheel_scene
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"source": "rubber.c"}, "rubber.c' is no file"),
        ({"source": "tyre.py"}, "'tyre.py' does not end in .c"),
        ({"function": "tire"}, "tyre.c has no function tire; try: void tire("),
        ({"partials": "slopes"}, "tyre.c has no function slopes; try: void slopes("),
        ({"function": "double"}, "'double' cannot be the name of a C function here"),
        ({"partials": "tyre"}, "values and partials are the same function; try: a function for each"),
        ({"arguments": {"a b": ""}}, "'a b' is no name; try: letters, digits and underscores"),
        ({"arguments": {}}, "laws.tyre.arguments"),
        ({"parameters": {"load": 1.0}}, "load is an argument, too; try: another name for the parameter"),
        ({"parameters": {"mu": "nu"}}, "unknown name 'nu'"),
        ({"scales": {"slip": 1.0}}, "'slip' is no argument and no parameter of the law; try: one of kappa, alpha"),
        ({"scales": {"load": 0.0}}, "laws.tyre.scales"),
        ({"unit": "N"}, "the key 'unit' is unknown"),
        (
            {"python": "laws.py"},
            "(laws.tyre.python): the key 'python' is unknown here; try: source, a C file; or [definitions], if the law"
            " has a formula",
        ),
    ],
)
def test_mistakes_in_entries(folder: Path, change: dict[str, Any], message: str) -> None:
    (folder / "tyre.py").write_text(TYRE_C, encoding="utf-8")
    with pytest.raises(DescriptionError) as error:
        eomgen.build(wheel_scene(TYRE_LAW | change, folder))
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("law.tire.fx(0, 0, 1)", "law.tire: there are no laws 'tire' (column 1); try: tyre"),
        ("law.tyre.fz(0, 0, 1)", "law.tyre has no result 'fz'"),
        ("law.tyre(0, 0, 1)", "law.tyre has the results fx, fy (column 1); try: law.tyre.fx(kappa, alpha, load)"),
        ("law.tyre.fy(0, 0)", "law.tyre() takes 3 arguments, not 2 (column 1); try: law.tyre.fy(kappa, alpha, load)"),
        ("law.tyre", "law.tyre is a function of kappa, alpha, load, and needs arguments"),
        ("law.tyre.fx(0, 0, 1)[0]", "law.tyre has no component 0"),
        (
            "law.tyre.fx(0, v.axle, 1)",
            "the argument alpha of law.tyre is in rad by its own entry, and is given",
        ),
    ],
)
def test_mistakes_in_formulas(folder: Path, formula: str, message: str) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    scene["outputs"]["wrong"] = {"formula": formula}
    with pytest.raises(DescriptionError) as error:
        eomgen.build(scene)
    assert message in str(error.value)


def test_drives_and_constraints_have_no_laws(folder: Path) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    scene["constraints"] = {"held": {"type": "formula", "equation": "q.travel - law.tyre.fx(q.axle, 0, 1)"}}
    with pytest.raises(DescriptionError) as error:
        eomgen.build(scene)
    assert (
        "law.tyre cannot be used here: two exact derivatives are needed, and laws of files do not have these"
        " (column 12);"
        " try: an effort or a force that depends on it"
    ) in str(error.value)


@pytest.mark.parametrize(("old", "new"), [("results[0] = mu", "result[0] = mu"), ("void tyre(", "int tyre(")])
def test_faults_of_the_compiler_name_the_line(folder: Path, old: str, new: str) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    text = TYRE_C.replace(old, new)
    (folder / "tyre.c").write_text(text, encoding="utf-8")
    line = text[: text.index(new)].count("\n") + 1
    with pytest.raises(ToolchainError) as error:
        eomgen.build(scene)
    assert f"tyre.c:{line}: the C compiler finds" in str(error.value)
    assert "try: C99, and void tyre(const double *arguments, const double *parameters, double *results)" in str(
        error.value
    )
    assert str(error.value).count("try:") <= 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("arguments[2], mu = p", "arguments[3], mu = p", "tyre reads beyond 3 arguments and 2 parameters"),
        ("results[1] = -mu * load * y * weight;", "", "or leaves entry 1 of 2 unset"),
        ("results[1] =", "results[2] = 1.0; results[1] =", "tyre writes beyond 2 entries"),
        (
            "    results[0] =",
            "    static int calls = 0; ++calls; results[0] = calls +",
            "tyre gives other values in a second call with the same arguments; try: no static variables",
        ),
        (
            "partials[2] = mu * x",
            "partials[2] = -mu * x",
            "tyre_partials: the derivative of fx by load is",
        ),
    ],
)
def test_faults_of_the_functions(folder: Path, old: str, new: str, message: str) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    assert old in TYRE_C
    (folder / "tyre.c").write_text(TYRE_C.replace(old, new), encoding="utf-8")
    with pytest.raises(ModelError) as error:
        eomgen.build(scene)
    assert message in str(error.value)
    assert "laws.tyre" in str(error.value)


@pytest.mark.parametrize("term", ["rates_3", "rates_4"])
def test_terms_of_third_order_are_refused(folder: Path, term: str) -> None:
    with pytest.raises(ModelError) as error:
        eomgen.derive(wheel_scene(TYRE_LAW, folder), terms=[term])
    assert str(error.value) == (
        f"model error: {term}: law tyre has values and derivatives of first and second order, and order 3 is needed;"
        " try: terms without this one, or formulas in place of the law"
    )


@pytest.mark.parametrize("method", ["hermite", "taylor"])
def test_methods_of_series_have_no_laws(folder: Path, method: str) -> None:
    with pytest.raises(ModelError) as error:
        eomgen.build(wheel_scene(TYRE_LAW, folder), method=method).simulate(0.01)
    assert (
        f"{method} cannot run on this scene: a series in time needs derivatives of all orders, and 'law tyre' has"
        " values and slopes alone; try: generalized_alpha"
    ) in str(error.value)


def test_drives_and_bases_have_no_laws(folder: Path) -> None:
    """Of a drive, a base and an input the place is named, with the kinds of formulas that may have laws."""
    exact = "law.tyre cannot be used here: two exact derivatives are needed, and laws of files do not have these"
    formula = "0.1 * law.tyre.fx(t, 0, 1)"
    driven, base, fed, heavy = (wheel_scene(TYRE_LAW, folder) for _ in range(4))
    driven["joints"]["travel"] = {**driven["joints"]["travel"], "drive": formula, "initial": {}}
    base["base"] = {"position": [formula, 0, 0]}
    fed["inputs"] = {"pull": {"formula": formula}}
    heavy["bodies"]["car"]["mass"] = formula.replace("t,", "0,")
    for scene, place, fault in (
        (driven, "joints.travel.drive", exact),
        (base, "base.position[0]", exact),
        (fed, "inputs.pull.formula", "law.tyre cannot be used here (column 7); try: time, parameters and curves only"),
        (heavy, "bodies.car.mass", "law.tyre cannot be used here (column 7); try: parameters only"),
    ):
        with pytest.raises(DescriptionError) as error:
            eomgen.build(scene)
        assert f"({place}): {fault}" in str(error.value)
