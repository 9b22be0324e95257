"""Mistakes in calls from Python: each is answered with what is meant, and nothing shows Python's bare errors."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.calls import (
    UnknownAttribute,
    attributes_elsewhere,
    checked_call,
    meant_term,
    methods_of_models,
)
from eomgen.system.terms import TERMS, nearest_term
from tests.models.scenes import PENDULUM_TOML, pendulum, pendulum_scene

CART = {
    "format": 1, "name": "cart", "bodies": {"cart": {"mass": 1}},
    "joints": {"rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}},
}  # fmt: skip  # a table


def builder() -> eomgen.SceneBuilder:
    return eomgen.SceneBuilder("cart").body("cart", 1.0)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: pendulum().simulate(1.0, u={"torque": 1.0}), "simulate: there is no argument 'u'; try: inputs"),
        (lambda: pendulum().simulate(1.0, dt=1e-3), "simulate: there is no argument 'dt'; try: step"),
        (
            lambda: pendulum().simulate(1.0, tolerence=1e-3),
            "simulate: there is no argument 'tolerence'; try: tolerance",
        ),
        (
            lambda: pendulum().simulate(1.0, h=1e-3, params={}),
            "there is no argument 'h', 'params'; try: step and parameters",
        ),
        (
            lambda: pendulum().simulate(1.0, 1e-3, "rk4"),
            "simulate: 3 arguments without a name, and 2 can be: t_end, step; try: the others by name",
        ),
        (lambda: pendulum().resume("run.ckpt", tend=3.0), "resume: there is no argument 'tend'; try: t_end"),
        (lambda: pendulum().force([0.1], [0.2], inputs=[1.0]), "force: there is no argument 'inputs'; try: u"),
        (lambda: pendulum().mass(), "mass: the argument q is missing; try: q=..."),
        (lambda: pendulum().mass([0.1], q=[0.1]), "mass: the argument q is given twice, by its place and by its name"),
        (
            lambda: pendulum().linearize(when=0.1),
            "linearize: there is no argument 'when'; try: one of q, v, a, t, u, z",
        ),
        (lambda: eomgen.build(CART, metod="rk4"), "build: there is no argument 'metod'; try: method"),
        (eomgen.build, "build: the argument scene is missing; try: a scene or the path of one"),
        (
            lambda: eomgen.build(builder()),
            "a SceneBuilder collects a scene, which its method build returns; try: builder.",
        ),
        (lambda: eomgen.load(3), "a scene, a path or a mapping like a scene file is needed, not int; try: eomgen.load"),
        (lambda: eomgen.load(CART, lock=["rail"]), "load: lock: for URDF files only; try: the path of a .urdf file"),
        (
            lambda: eomgen.load(pendulum_scene(), coordinates="absolute"),
            (
                "coordinates: this Scene has joint coordinates, and they are chosen where it is read; try: the path or"
                " the mapping"
            ),
        ),
        (
            lambda: eomgen.Model("x.toml"),
            'Model: the arguments library, stepper are missing; try: eomgen.build("scene.toml")',
        ),
        (lambda: eomgen.Solution("x.npz"), 'z, multipliers are missing; try: eomgen.Solution.load("run.npz")'),
        (
            lambda: eomgen.Scene("x.toml"),
            'Scene: the arguments bodies, joints are missing; try: eomgen.load("scene.toml")',
        ),
        (
            lambda: builder().joint("rail", "prismatic", "base", "cart", axes=[1, 0, 0]),
            "joint: there is no argument 'axes'; try: axis or x_axis",
        ),
        (lambda: builder().body("other"), "body: the argument mass is missing; try: mass=..."),
        (lambda: pendulum().evaluate("inertia", [0.1]), "energy; try: mass"),
        (lambda: pendulum().evaluate("jacobians", [0.1]), 'energy; try: eomgen.build(scene, terms=[..., "jacobians"])'),
        (
            lambda: eomgen.build(CART, terms=["inertia", "h"]),
            "no term is called 'inertia', 'h'; try: mass and coupling",
        ),
        (
            lambda: eomgen.derive(CART, terms=["mass"]).sympy("force"),
            (
                "sympy: the term force is not in this System, which was derived with mass; "
                'try: eomgen.derive(scene, terms=[..., "force"])'
            ),
        ),
        (lambda: pendulum().evaluate(["mass"], [0.1]), "the term ['mass'] is not in this model, which was built with"),
        (lambda: pendulum().evaluate(["mass"], [0.1]), "energy; try: mass"),
        (lambda: pendulum().evaluate(np.array([0.1]), "mass"), "the term [0.1] is not in this model"),
        (
            lambda: eomgen.derive(CART, terms=["mass"]).latex(["mass"]),
            "the term ['mass'] is not in this System, which was derived with mass; try: mass",
        ),
        (lambda: eomgen.derive(CART, terms=["mass"]).sympy("Q"), "was derived with mass; try: force"),
        (
            lambda: eomgen.generate("folder", CART),
            "folder: the path of a folder is needed, not dict; try: generate(scene, folder), the scene first",
        ),
        (
            lambda: pendulum().attach("run.npz"),
            "a solution is needed, not str; try: model.attach(eomgen.Solution.load(path))",
        ),
    ],
)
def test_calls_that_cannot_be_taken(call: Callable[[], object], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        call()


@pytest.mark.parametrize(
    ("owner", "name", "text"),
    [
        (
            pendulum_scene,
            "simulate",
            "a Scene has no 'simulate'; try: eomgen.build(scene).simulate(...), of the compiled model",
        ),
        (builder, "simulate", "a SceneBuilder has no 'simulate'; try: eomgen.build(builder.build()).simulate(...)"),
        (
            lambda: eomgen.derive(CART, ["mass"]),
            "linearize",
            "a System has no 'linearize'; try: eomgen.build(scene).linearize",
        ),
        (pendulum, "crba", "a Model has no 'crba'; try: mass"),
        (pendulum, "identify", "a Model has no 'identify'; try: eomgen.identify(scene, ...)"),
        (pendulum, "intial_q", "a Model has no 'intial_q'; try: initial_q"),
        (lambda: pendulum().simulate(0.01, 1e-2), "output", "a Solution has no 'output'; try: outputs"),
    ],
)
def test_attributes_that_there_are_not(owner: Callable[[], object], name: str, text: str) -> None:
    thing = owner()
    with pytest.raises(UnknownAttribute, match=re.escape(text)) as caught:
        getattr(thing, name)
    assert isinstance(caught.value, eomgen.UsageError) and isinstance(caught.value, AttributeError)
    assert not hasattr(thing, name) and getattr(thing, name, None) is None


def test_names_of_other_tools_are_answered_with_sentences() -> None:
    for owner, answers in attributes_elsewhere().items():
        own = getattr(eomgen, owner, None)
        for name, answer in answers.items():
            assert name.isidentifier() and not hasattr(own, name), f"{owner}.{name}"
            assert isinstance(answer, str) and answer, f"{owner}.{name}"
    assert {name for name in attributes_elsewhere()["HamiltonianSolution"] if name.startswith("err")} == {
        "error",
        "errors",
    }


def test_the_package_itself_names_where_runs_are() -> None:
    with pytest.raises(
        AttributeError, match=r"no attribute 'simulate'; try: eomgen\.build\(scene\)\.simulate\(\.\.\.\)"
    ):
        eomgen.simulate  # noqa: B018
    with pytest.raises(AttributeError, match="no attribute 'SceneBulder'; try: SceneBuilder"):
        eomgen.SceneBulder  # noqa: B018


def test_a_scene_is_loaded_from_all_that_build_takes(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    read = eomgen.load(path)
    assert eomgen.load(read) is read and eomgen.load(read, coordinates="joint") is read
    made = eomgen.load(CART)
    assert made.name == "cart" and made.digest == eomgen.load(made).digest
    solid = {**CART, "bodies": {"cart": {"mass": 1, "inertia": [1, 1, 1]}}}
    assert eomgen.load(solid, coordinates="absolute").coordinates == "absolute"


def test_errors_from_within_a_call_pass() -> None:
    @checked_call(number="value")
    def halved(value: float) -> float:
        return value / 2

    assert halved(3.0) == 1.5
    with pytest.raises(TypeError, match="unsupported operand"):
        halved("3")  # type: ignore[arg-type]
    with pytest.raises(eomgen.UsageError, match="halved: there is no argument 'number'; try: value"):
        halved(number=3.0)  # type: ignore[call-arg]


def test_lists_name_what_there_is() -> None:
    assert all(hasattr(eomgen.Model, name) for name in methods_of_models())
    known = {meant_term(name) for name in ("inertia", "M", "bias", "gravity", "RNEA", "ABA", "kinetic", "phi", "b")}
    assert known <= set(TERMS) and not meant_term("mass")
    assert nearest_term("mas") == "mass" and nearest_term("mass_rate").startswith("mass_rates")


def test_numbers_that_numpy_writes_into_formulas_are_named() -> None:
    angle = np.float64(0.3)
    formula = f"{angle!r} * sin(t)" if "np" in repr(angle) else "np.float64(0.3) * sin(t)"
    made = builder().joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0])
    for text, hint in (
        (formula, 'the number alone: NumPy writes np.float64(...) into a text, f"{float(x)}" writes a plain one'),
        ("np.sin(t)", "sin(...)"),
        ("foo.bar(t)", "one of abs, acos"),
    ):
        made = builder().joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", text)
        with pytest.raises(eomgen.DescriptionError, match=re.escape(f"; try: {hint}")) as caught:
            made.build()
        name = text.partition("(")[0]
        assert f"only functions can be called, not '{name}' (column 1)" in caught.value.report()
