"""Mistakes in laws: one message each, with place and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import eomgen
from eomgen.errors import DescriptionError, ModelError, ToolchainError
from eomgen.products.laws import checks
from tests.models.c_laws import TYRE_C, TYRE_LAW, wheel_scene
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def told(error: type[Exception], scene: dict[str, Any], **options: Any) -> str:
    """Return what a build of a scene that fails says."""
    with pytest.raises(error) as caught:
        eomgen.build(scene, **options)
    return str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"source": "rubber.c"}, "(laws.tyre.source): cannot be read: No such file"),
        ({"source": "tyre.py"}, "'tyre.py' is a Python file; try: python = \"tyre.py\""),
        ({"function": "tire"}, "tyre.c has no function tire; try: void tire("),
        ({"partials": "slopes"}, "tyre.c has no function slopes; try: void slopes("),
        ({"function": "double"}, "'double' cannot be the name of a C function here"),
        ({"partials": "tyre"}, "values and partials are the same function; try: a function for each"),
        ({"arguments": {"a b": ""}}, "'a b' is not a name; try: letters, digits and underscores"),
        ({"arguments": {}}, "laws.tyre.arguments"),
        ({"parameters": {"load": 1.0}}, "load is an argument, too; try: another name for the parameter"),
        ({"parameters": {"mu": "nu"}}, "unknown name 'nu'"),
        ({"scales": {"slip": 1.0}}, "'slip' is neither an argument nor a parameter of the law; try: one of kappa"),
        ({"scales": {"load": 0.0}}, "laws.tyre.scales"),
        ({"unit": "N"}, "the key 'unit' is unknown"),
        (
            {"module": "laws.py"},
            "(laws.tyre.module): the key 'module' is unknown here; try: source, a C file; python, a file in Python; or"
            " [definitions], if the law has a formula",
        ),
        (
            {"arguments": {"kappa": "", "alpha": "deg", "load": "N"}},
            "(laws.tyre.arguments.alpha): a law has numbers in SI that are not converted, and 'deg' is not of SI;"
            ' try: "rad", and the factor in the file',
        ),
        (
            {"results": {"fx": "kN", "fy": "N"}},
            "(laws.tyre.results.fx): a law has numbers in SI that are not converted",
        ),
        ({"results": {"fx": "newtn", "fy": "N"}}, "(laws.tyre.results.fx): there is no unit 'newtn'"),
        ({"function": "exp"}, "'exp' cannot be the name of a C function here; try: letters, digits and underscores"),
        ({"scales": {"load": "1 kN"}}, "(laws.tyre.scales.load): a number is needed here, not '1 kN'"),
        ({"arguments": ["kappa"]}, "(laws.tyre.arguments): a table is needed here, not a list"),
    ],
)
def test_mistakes_in_entries(folder: Path, change: dict[str, Any], message: str) -> None:
    (folder / "tyre.py").write_text(TYRE_C, encoding="utf-8")
    assert message in told(DescriptionError, wheel_scene(TYRE_LAW | change, folder))


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("law.tire.fx(0, 0, 1)", "law.tire: there are no laws 'tire' (column 1); try: tyre"),
        ("law.tyre.fz(0, 0, 1)", "law.tyre has no result 'fz'"),
        ("law.tyre(0, 0, 1)", "law.tyre has the results fx, fy (column 1); try: law.tyre.fx(kappa, alpha, load)"),
        ("law.tyre.fy(0, 0)", "law.tyre() takes 3 arguments, not 2 (column 1); try: law.tyre.fy(kappa, alpha, load)"),
        ("tyre(0, 0, 1)", "unknown function 'tyre' (column 1); try: law.tyre.fx(kappa, alpha, load)"),
        ("laws.tyre(0, 0, 1)", "not 'laws.tyre' (column 1); try: law.tyre.fx(kappa, alpha, load)"),
        ("law.tyre", "law.tyre is a function of kappa, alpha, load, and needs arguments"),
        ("law.tyre.fx(0, 0, 1)[1]", "law.tyre has no component 1"),
        (
            "law.tyre.fx(0, v.axle, 1)",
            "the argument alpha of law.tyre is in rad by its own entry, and is given",
        ),
    ],
)
def test_mistakes_in_formulas(folder: Path, formula: str, message: str) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    scene["outputs"]["wrong"] = {"formula": formula}
    assert message in told(DescriptionError, scene)


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
        (
            "partials[2] = mu * x",
            "partials[2] = 1.004 * mu * x",
            "tyre_partials: the derivative of fx by load is",
        ),
        ("    results[0] =", "    ((double *)arguments)[0] = 0.0; results[0] =", "tyre writes to the arguments"),
        ("    results[0] =", "    ((double *)parameters)[1] = 0.0; results[0] =", "tyre writes to the parameters"),
        (
            "    results[0] =",
            "    if (load > 0.0) exit(3); results[0] =",
            "tyre ends the process by exit(3) at kappa = 0.",
        ),
        ("    results[0] =", "    exit(0); results[0] =", "tyre ends the process by exit(0) at kappa = 0."),
        ("    results[0] =", "    abort(); results[0] =", "tyre ends the process by SIGABRT at kappa = 0."),
        (
            "    partials[0] =",
            "    *(volatile double *)8 = 1.0; partials[0] =",
            "tyre_partials ends the process by SIGSEGV at kappa = 0.",
        ),
        (
            "    results[0] =",
            "    while (load > 0.0) { } results[0] =",
            "tyre does not return within 0.5 s at kappa = 0.",
        ),
    ],
)
def test_faults_of_the_functions(
    folder: Path, old: str, new: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "does not return" in message:  # others may need longer on a machine at work
        monkeypatch.setattr(checks, "_LONGEST", 0.5)
    scene = wheel_scene(TYRE_LAW, folder)
    assert old in TYRE_C
    (folder / "tyre.c").write_text("#include <stdlib.h>\n" + TYRE_C.replace(old, new), encoding="utf-8")
    said = told(ModelError, scene)
    assert message in said and "laws.tyre" in said


@pytest.mark.parametrize("term", ["rates_3", "rates_4"])
def test_terms_of_third_order_are_refused(folder: Path, term: str) -> None:
    with pytest.raises(ModelError) as error:
        eomgen.derive(wheel_scene(TYRE_LAW, folder), terms=[term])
    assert str(error.value) == (
        f"model error: {term}: law tyre has values and derivatives of first and second order, and order 3 is needed;"
        " try: terms without this one, or formulas in place of the law"
    )


def test_methods_of_series_have_no_laws(folder: Path) -> None:
    model = eomgen.build(wheel_scene(TYRE_LAW, folder), method="taylor")
    with pytest.raises(ModelError) as caught:
        model.simulate(0.01)
    assert (
        "taylor cannot run on this scene: a series in time needs derivatives of all orders, and 'law tyre' has"
        " values and slopes alone; try: generalized_alpha"
    ) in str(caught.value)


def test_formulas_that_need_more_derivatives_have_no_laws(folder: Path) -> None:
    """The place is named, with the kinds of formulas that may have laws, or what may stand there instead."""
    exact = "law.tyre cannot be used here: two exact derivatives are needed, and laws of files do not have these"
    formula = "0.1 * law.tyre.fx(t, 0, 1)"
    driven, base, fed, heavy, held, road = (wheel_scene(TYRE_LAW, folder) for _ in range(6))
    held["constraints"] = {"held": {"type": "formula", "equation": "q.travel - law.tyre.fx(q.axle, 0, 1)"}}
    road["points"] = {**road.get("points", {}), "hub": {"body": "car"}}
    road["tyres"] = {"front": {"center": "hub", "radius": 0.3, "stiffness": 1e5, "road": "law.tyre.fx(0, 0, 1)"}}
    driven["joints"]["travel"] = {**driven["joints"]["travel"], "drive": formula, "initial": {}}
    base["base"] = {"position": [formula, 0, 0]}
    fed["inputs"] = {"pull": {"formula": formula}}
    heavy["bodies"]["car"]["mass"] = formula.replace("t,", "0,")
    for scene, place, fault in (
        (driven, "joints.travel.drive", exact),
        (held, "constraints.held.equation", f"{exact} (column 12); try: an effort or a force that depends on it"),
        (
            road,
            "tyres.front.road",
            "law.tyre cannot be used here: damping of the tyre needs the rate of the road, whose slopes need second"
            " derivatives, and laws of files do not have these (column 1); try: a map of the heights in [maps], or the"
            " force of the tyre by the law in [forces]",
        ),
        (base, "base.position[0]", exact),
        (fed, "inputs.pull.formula", "law.tyre cannot be used here (column 7); try: time, parameters and curves only"),
        (heavy, "bodies.car.mass", "law.tyre cannot be used here (column 7); try: parameters only"),
    ):
        assert f"({place}): {fault}" in told(DescriptionError, scene)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            TYRE_C.replace("#include <math.h>", "/* headers: none */"),
            "try: #include <...> of the header with its declaration, as <math.h>",
        ),
        (
            TYRE_C.replace("void tyre(", "void tire(") + "void tyre(const double *a, const double *p, double *r);\n",
            "tyre.c: the function tyre is declared or called, and has no body in the file; try: the body in tyre.c",
        ),
    ],
)
def test_functions_without_header_or_body(folder: Path, text: str, message: str) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    (folder / "tyre.c").write_text(text, encoding="utf-8")
    assert message in told(ToolchainError, scene)


def test_a_mark_of_byte_order_is_no_fault(folder: Path) -> None:
    """Editors of Windows write one in front of UTF-8."""
    scene = wheel_scene(TYRE_LAW, folder)
    (folder / "tyre.c").write_text(TYRE_C, encoding="utf-8-sig")
    assert eomgen.load(scene).parts["laws"][0].code.source.text == TYRE_C


def test_functions_of_one_name_in_two_files(folder: Path) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    (folder / "rear.c").write_text(TYRE_C.replace("0.3", "0.2"), encoding="utf-8")
    scene["laws"]["rear"] = TYRE_LAW | {"source": "rear.c"}
    with pytest.raises(DescriptionError) as error:
        eomgen.load(scene)
    fault = "(laws.rear.function): the law tyre has a function tyre in another file; try: another name"
    assert fault in str(error.value)
    (folder / "rear.c").write_text(TYRE_C, encoding="utf-8")
    eomgen.load(scene)


@pytest.mark.slow
def test_helpers_of_one_name_in_two_files(folder: Path) -> None:
    scene = wheel_scene(TYRE_LAW, folder)
    text = TYRE_C.replace("static double magic", "double magic(double, double, double, double *);\ndouble magic")
    (folder / "tyre.c").write_text(text, encoding="utf-8")
    rear = TYRE_LAW | {"source": "rear.c", "function": "rear", "partials": "rear_partials"}
    (folder / "rear.c").write_text(text.replace("void tyre", "void rear"), encoding="utf-8")
    scene["laws"]["rear"] = rear
    scene["outputs"]["rear"] = {"formula": "law.rear.fx(0.1, 0, 1000)"}
    with pytest.raises(ToolchainError) as error:
        eomgen.build(scene, profile="quick")
    assert "the function magic is defined in another file, too, and models have all files linked; try: static" in str(
        error.value
    )


def test_a_law_that_is_not_a_number_is_named_by_the_run(folder: Path) -> None:
    text = "void spin(const double *a, const double *p, double *r)\n{\n    r[0] = a[0] > 2.9 ? p[0] / p[0] : a[0];\n}\n"
    (folder / "spin.c").write_text(text, encoding="utf-8")
    law = {"source": "spin.c", "function": "spin", "arguments": {"speed": "rad/s"}, "results": {"torque": "N m"}}
    joint = {"type": "revolute", "parent": "base", "child": "disc", "axis": [0, 0, 1], "initial": {"velocity": 3}}
    scene = {
        "format": 1,
        "name": "disc",
        "laws": {"spin": law | {"parameters": {"c": 0}}},
        "bodies": {"disc": {"mass": 1, "inertia": [1, 1, 1]}},
        "joints": {"axle": joint},
        "efforts": {"brake": {"joint": "axle", "effort": "-law.spin(v.axle)"}},
    }
    run = eomgen.build(scene, method="rk4", profile="quick").simulate(0.1, 1e-2)
    assert "where in a formula law.spin is nan at speed = 3;" in run.message
