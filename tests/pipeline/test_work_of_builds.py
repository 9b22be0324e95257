"""Work of Python from a scene with many equal elements to its Program, counted: it grows with their number and no
faster."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.integrators.methods import method_named
from eomgen.integrators.newton.sample_matrices import samples_of
from eomgen.integrators.stepper_data import method_data
from eomgen.system.selection import Selection
from tests.models.cosserat import beam_scene

METHOD = "generalized_alpha"
#: Calls of Python's and of C's functions for one more element of a beam, by stage.
CALLS: Mapping[str, int] = {
    "read": 2700,
    "derived": 62000,
    "sampled": 4000,
    "stepped": 12100,
    "program": 27400,
}


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


def beam(elements: int) -> dict[str, Any]:
    """Return a cantilever under weight; its length grows with its elements."""
    scene = beam_scene(elements, {}, {"length": 0.25 * elements})
    return {**scene, "gravity": [0.0, 0.0, -9.81], "forces": {}, "parameters": {}}


def stages(data: Mapping[str, Any]) -> dict[str, int]:
    """Return the calls of each stage, as a run from a file takes them."""
    method, counts = method_named(METHOD), {}
    scene, counts["read"] = calls(lambda: eomgen.load(data))
    system, counts["derived"] = calls(lambda: method.prepared(eomgen.derive(scene)))
    _, counts["sampled"] = calls(lambda: samples_of(system))
    numbers, counts["stepped"] = calls(lambda: method_data(method, system, 1e-3))
    called = method.calls(system).union(method.terms(False, False, "mass" in system.functions))
    functions = Selection(None, "scene").functions(list(system.functions), called, implicit=method.implicit)
    _, counts["program"] = calls(lambda: to_program(system, numbers, functions))
    return counts


def test_calls_grow_with_the_elements_of_a_beam_and_no_faster() -> None:
    stages(beam(4))  # imports, and laws that are derived once
    few, more, most = (stages(beam(elements)) for elements in (12, 24, 48))
    for stage, budget in CALLS.items():
        added = most[stage] - more[stage]
        assert added <= 2.1 * (more[stage] - few[stage]), stage  # 4 times, if each element met all others
        assert added / 24 <= budget, stage
