"""Work of Python from a scene with many equal elements to its Program, counted: it grows with their number and no
faster."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.register import C
from eomgen.integrators.families.register import method_named
from eomgen.integrators.newton.sample_matrices import samples_of
from eomgen.integrators.stepper_data import method_data
from eomgen.pipeline.pipeline import build_reproducible
from eomgen.pipeline.programs import write_program
from eomgen.pipeline.requests import ProgramRequest
from eomgen.pipeline.scenes import SCENES
from eomgen.system.terms import Selection
from tests.models.cosserat import beam_scene

METHOD = "generalized_alpha"
#: Calls of Python's and of C's functions for one more element of a beam, by stage: of a cantilever, and of a beam that
#: is held at both ends. Steps have 41 for tables of rows of eliminations that are alike, which make the C a tenth.
CALLS: Mapping[bool, Mapping[str, int]] = {
    False: {"read": 1600, "derived": 59_200, "sampled": 4000, "stepped": 11_900, "program": 26_200},
    True: {"read": 1500, "derived": 123_000, "sampled": 4800, "stepped": 15_400, "program": 25_800},
}
#: The same of all stages from the scene to the Program, of a long beam.
CONTINUED = 182


def calls(work: Callable[[], Any]) -> tuple[Any, int]:
    """Return a result, and how many functions of Python and of C are called for it."""
    count = 0

    def counted(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        return work(), count
    finally:
        sys.setprofile(before)


def beam(elements: int, *, held: bool) -> dict[str, Any]:
    """Return a cantilever under weight, or one whose end is held, too; its length grows with its elements."""
    length = 0.25 * elements
    scene = beam_scene(elements, {}, {"length": length})
    constraints = {"end": {"type": "fixed", "first": at("base", length), "second": at("rope", length)}} if held else {}
    added = {"gravity": [0.0, 0.0, -9.81], "forces": {}, "parameters": {}, "constraints": constraints}
    return {**scene, **added}


def at(body: str, x: float) -> dict[str, Any]:
    return {"body": body, "position": [x, 0.0, 0.0]}


def stages(data: Mapping[str, Any]) -> dict[str, int]:
    """Return the calls of each stage, as a run from a file takes them."""
    method, counts = method_named(METHOD), {}
    scene, counts["read"] = calls(lambda: eomgen.load(data))
    system, counts["derived"] = calls(lambda: method.prepared(eomgen.derive(scene)))
    _, counts["sampled"] = calls(lambda: samples_of(system))
    numbers, counts["stepped"] = calls(lambda: method_data(method, system, 1e-3))
    called = method.calls(system).union(method.terms(bool(system.multipliers), False, "mass" in system.functions))
    functions = Selection(None, "scene").functions(list(system.functions), called, implicit=method.implicit)
    _, counts["program"] = calls(lambda: to_program(system, numbers, functions))
    return counts


@pytest.mark.long
@pytest.mark.parametrize("held", [False, True])
def test_calls_grow_with_the_elements_of_a_beam_and_no_faster(held: bool) -> None:
    stages(beam(4, held=held))  # imports, and laws that are derived once
    few, more, most = (stages(beam(elements, held=held)) for elements in (12, 24, 48))
    for stage, budget in CALLS[held].items():
        added = most[stage] - more[stage]
        assert added <= 2.3 * (more[stage] - few[stage]), stage  # 4 times, if each element met all others
        assert added / 24 <= budget, stage


@pytest.mark.long
def test_long_beams_are_continued_and_not_derived() -> None:
    def program(elements: int) -> int:
        scene = eomgen.load(beam(elements, held=False))
        request = ProgramRequest(scene, SCENES, Selection(None, "given"), METHOD)
        return calls(lambda: write_program(request, C, build_reproducible, for_runs=True))[1]

    program(420)  # imports
    assert (program(1020) - program(420)) / 600 <= CONTINUED
