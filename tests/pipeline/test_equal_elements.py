"""Programs of beams with many equal elements: continued from short beams, and equal to Programs that are derived."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import pytest

import eomgen
from eomgen.codegen.metadata import interface_layout
from eomgen.codegen.program import Program, ProgramFunction
from eomgen.codegen.targets.c.target import generate_files
from eomgen.codegen.targets.register import C
from eomgen.integrators.families.register import method_named
from eomgen.pipeline import equal_elements, equal_parts
from eomgen.pipeline.pipeline import build_reproducible
from eomgen.pipeline.programs import ProgramWriter, write_program
from eomgen.pipeline.requests import ProgramRequest
from eomgen.pipeline.scenes import SCENES
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.system.system import Sample
from eomgen.system.terms import Selection
from tests.models.cosserat import ROLL_UP, beam_scene

BENT = {"torsion": 500.0, "bending_y": 400.0, "bending_z": 300.0}


def cantilever(elements: int, **more: Any) -> dict[str, Any]:
    """Return a clamped beam of elements of 0.25 m under its weight."""
    scene = beam_scene(elements, {}, {"length": 0.25 * elements, **more.pop("beam", {})})
    return {**scene, "gravity": [0.0, 0.0, -9.81], "forces": {}, "parameters": {}, **more}


def hanging(elements: int, place: float) -> dict[str, Any]:
    """Return a cantilever with a pendulum, and a spring to the ground, at a place along it."""
    pendulum = {"mass": 2.0, "inertia": [0.1, 0.2, 0.3], "center_of_mass": [0.0, 0.0, -1.0]}
    hinge = {
        "type": "revolute",
        "parent": "rope",
        "child": "bob",
        "position": [place, 0.0, 0.0],
        "axis": [0.0, 1.0, 0.0],
    }
    scene = cantilever(elements)
    scene["joints"] = {**scene["joints"], "hinge": hinge}
    points = {
        "hook": {"body": "base", "position": [place, 0.0, 3.0]},
        "eye": {"body": "rope", "position": [place, 0.0, 0.0]},
    }
    springs = {"holder": {"first": "hook", "second": "eye", "stiffness": 50.0, "length": 1.0}}
    return {**scene, "bodies": {"bob": pendulum}, "points": points, "springs": springs}


def hinged(elements: int) -> dict[str, Any]:
    scene = cantilever(elements)
    for joint in scene["joints"].values():
        joint.update({"type": "revolute", "axis": [0.0, 1.0, 0.0]})
    return scene


def two_beams(elements: int) -> dict[str, Any]:
    scene = cantilever(elements)
    (name, beam), (joint, clamp) = next(iter(scene["beams"].items())), next(iter(scene["joints"].items()))
    second = {f"{joint}_2": {**clamp, "child": "other", "position": [0.0, 2.0, 0.0]}}
    return {**scene, "beams": {name: beam, "other": beam}, "joints": {**scene["joints"], **second}}


def beam_of_parts(*parts: tuple[int, float]) -> dict[str, Any]:
    """Return a cantilever of parts, each with a number of elements and a factor of the stiffness."""
    scene = cantilever(2)
    common = {"mass_per_length": 1.0, "rotary_inertia": [10.0, 10.0, 10.0]}
    every = [
        {
            "length": 0.25 * elements,
            "elements": elements,
            "stiffness": {name: factor * value for name, value in ROLL_UP.items()},
            **common,
        }
        for elements, factor in parts
    ]
    return {**scene, "beams": {"rope": {"model": "cosserat", "parts": every}}}


def programs(data: Mapping[str, Any], method: str = "generalized_alpha") -> tuple[Program, Program]:
    """Return the Program of a scene as it is built, and as it is derived."""
    scene = eomgen.load(data)

    def program(front_end: Any) -> Program:
        return write_program(
            ProgramRequest(scene, front_end, Selection(None, "given"), method), C, build_reproducible, for_runs=True
        )[0]

    return program(SCENES), program(dataclasses.replace(SCENES, program=lambda document, derived: None))


def files(program: Program) -> dict[str, str]:
    """Return the C with numbers for the names of local values, which depend on values that no function returns."""

    def plain(function: ProgramFunction) -> ProgramFunction:
        return dataclasses.replace(
            function, parts=tuple(dataclasses.replace(part, names=()) for part in function.parts)
        )

    return generate_files(dataclasses.replace(program, functions=tuple(map(plain, program.functions))))


def without_constant_mass(program: Program) -> dict[str, Any]:
    """Return a layout without the fact that is not asked for if a derived tree is deep."""
    layout = interface_layout(program)
    del layout["facts"]["constant_mass"]
    return layout


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let beams of so few elements be continued that the derived ones are made fast."""
    monkeypatch.setattr(equal_parts, "_WORK", 0.01)


@pytest.mark.slow
@pytest.mark.usefixtures("few")
def test_a_long_beam_is_continued_from_beams_of_28_and_more_elements() -> None:
    scene, counts = eomgen.load(cantilever(97)), []

    def derived(part: Scene, sample: Sample) -> tuple[Program, str]:
        counts.append((len(part.bodies) - 1, sample.parts, sample.missing))
        writer = ProgramWriter(SCENES, SCENES.describe(scene), Selection(None, "given"), method_named("rk4"), C)
        return writer.program(part, sample)

    alike = equal_elements.equal_elements(scene)
    assert alike is not None and alike.program(derived) is not None
    assert counts == [(29, 29, 68), (33, 33, 64), (37, 37, 60)]


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    "data",
    [
        cantilever(100, beam={"model": "inextensible", "stiffness": BENT}),
        hanging(108, 27.0),
        two_beams(96),
        beam_of_parts((42, 1.0), (1, 2.0), (60, 1.0)),
        beam_of_parts(*[(1, 1.0), (1, 2.0)] * 44),
    ],
    ids=["inextensible", "carrying at its end", "two", "runs of two lengths", "two kinds in turn"],
)
def test_c_of_long_beams_is_that_of_derived_ones(data: Mapping[str, Any]) -> None:
    assert equal_elements.equal_elements(eomgen.load(data)) is not None
    made, derived = programs(data)
    assert files(made) == files(derived)
    assert without_constant_mass(made) == without_constant_mass(derived)


def test_scenes_that_name_elements_are_derived_whole() -> None:
    scene = eomgen.load(cantilever(420))
    assert equal_elements.equal_elements(scene) is not None
    assert equal_elements.equal_elements(eomgen.load(cantilever(80))) is None
    outputs = {"moment": {"section_moment": "rope", "at": 10.0}}
    by_element = eomgen.load({**cantilever(420), "outputs": outputs})
    assert equal_elements.equal_elements(by_element) is None


def test_clamped_beams_alone_are_continued_from_very_short_ones() -> None:
    inextensible = cantilever(420, beam={"model": "inextensible", "stiffness": BENT})
    scenes = [cantilever(160), two_beams(420), hinged(420), hanging(840, 105.0), inextensible]
    alike = [equal_elements.equal_elements(eomgen.load(data)) for data in scenes]
    assert [item is not None and len(item.plans) == 2 for item in alike] == [False, True, False, False, False]
    assert [item is not None and item.is_clamped for item in alike] == [True, True, False, False, False]
    assert equal_elements.equal_elements(eomgen.load(hinged(160))) is None


@pytest.mark.parametrize(
    ("parts", "runs", "plan"),
    [
        (((500, 1.0), (1, 2.0), (499, 1.0)), [(1, 500), (1, 1), (1, 499)], ((117, (True, False, True)),)),
        (
            ((3000, 1.0), (1, 2.0), (2000, 1.0)),
            [(1, 3000), (1, 1), (1, 2000)],
            ((493, (True, False, True)), (251, (True, False, False))),
        ),
        (((1, 1.0), (1, 2.0)) * 250, [(2, 250)], ((55, (True,)),)),
        (((3, 1.0), (1, 2.0)) * 200, [(4, 200)], ((43, (True,)),)),
        (((100, 1.0), (1, 2.0), (60, 1.0)), None, ()),
    ],
)
def test_runs_of_equal_groups_and_the_steps_to_short_scenes(
    parts: Any, runs: list[tuple[int, int]] | None, plan: Any
) -> None:
    alike = equal_elements.equal_elements(eomgen.load(beam_of_parts(*parts)))
    assert (alike and [(run.period, run.groups) for _, run in alike.runs]) == runs
    steps = [(step.number, step.grows) for step in alike.plans[0]] if alike else []
    assert steps == [*plan]


def test_elements_with_other_halves_are_other_elements() -> None:
    beam = next(item.beam for item in eomgen.load(cantilever(10)).elements if isinstance(item, CosseratBeam))
    part = beam.parts[0]
    heavier = dataclasses.replace(part, halves=(part.section, part.section))
    assert equal_elements._kinds((part, heavier, dataclasses.replace(part))) == [0, 1, 0]


def test_short_scenes_keep_the_rest() -> None:
    alike = equal_elements.equal_elements(eomgen.load(hanging(420, 105.0)))
    assert alike is not None
    short: Scene = alike.fewer([410])
    assert len(short.bodies) == 12
    hinge = next(joint for joint in short.joints if joint.name == "hinge")
    assert (hinge.parent, {point.body for point in short.points}) == ("rope.10", {"base", "rope.10"})
