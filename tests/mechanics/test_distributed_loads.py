"""Distributed loads on beams against handbook deflections, against many forces at points, and by buckling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from tests.models.cache import shared_cache
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.states import on_base, random_states

__all__ = ["shared_cache"]

LENGTH, BENDING, LOAD = 2.0, 70.0, 3.0


def loaded(
    ends: str = "clamped_free", shapes: str = "polynomial", force: object = (0, 0, -LOAD), **load: object
) -> eomgen.SceneBuilder:
    """Return a beam from the world along x with a load, whose bending is measured at its end and its middle."""
    bending = {"shapes": shapes, "modes": 3, "stiffness": BENDING, "ends": ends}
    if shapes == "finite_elements":
        bending |= {"elements": 2, "modes": 2 * 2, "normalisation": "natural"}
    builder = eomgen.SceneBuilder("loaded", gravity=[0, 0, 0])
    builder.beam("beam", LENGTH, mass_per_length=0.5, bending_z=bending, bending_y=bending)
    builder.joint("clamp", "fixed", "base", "beam")
    builder.distributed_load("wind", "beam", force, **load)
    builder.point("tip", "beam", [LENGTH, 0, 0]).point("middle", "beam", [LENGTH / 2, 0, 0])
    return builder.output("tip", position="tip").output("middle", position="middle")


@pytest.mark.parametrize(
    ("ends", "shapes", "profile", "where", "deflection"),
    [
        ("clamped_free", "polynomial", [1], "tip", LENGTH**4 / 8),
        pytest.param("clamped_free", "finite_elements", [1], "tip", LENGTH**4 / 8, marks=pytest.mark.slow),
        ("clamped_free", "finite_elements", [1, -1], "tip", LENGTH**4 / 30),
        pytest.param("clamped_free", "finite_elements", [0, 1], "tip", 11 * LENGTH**4 / 120, marks=pytest.mark.slow),
        pytest.param("clamped_free", "polynomial", [2], "middle", 2 * 17 * LENGTH**4 / 384, marks=pytest.mark.slow),
    ],
)
def test_static_deflections_are_those_of_handbooks(
    ends: str, shapes: str, profile: list[float], where: str, deflection: float
) -> None:
    """w L^4 / 8 E I of a cantilever, w L^4 / 30 and 11 w L^4 / 120 of triangles, 17 w L^4 / 384 at the middle."""
    model = eomgen.build(loaded(ends, shapes, profile=profile).build(), profile="quick")
    rest = model.equilibrium()
    found = model.outputs(rest.q, np.zeros(model.nv))[where]
    assert found[2] == pytest.approx(-LOAD * deflection / BENDING, rel=1e-9)
    assert found[1] == pytest.approx(0.0, abs=1e-12)


PROFILE = np.array([0.4, -1.0, 2.0])


def swinging(*, still: bool = False) -> eomgen.SceneBuilder:
    """Return a beam that bends, stretches and twists on a hinge, on a base that moves."""
    kinds = {"modes": 2, "shapes": "polynomial", "stiffness": 40.0}
    builder = eomgen.SceneBuilder("swinging")
    if not still:
        builder.base(position=["0.2 * sin(t)", 0, 0], rotation=[([0, 0, 1], "0.3 * t")])
    builder.beam(
        "beam",
        LENGTH,
        mass_per_length=0.7,
        mass_profile=[1, -0.3],
        polar_inertia=0.01,
        bending_y=kinds,
        bending_z=kinds,
        stretch=kinds,
        torsion={**kinds, "modes": 1},
    )
    return builder.joint("swing", "revolute", "base", "beam", axis=[0, 1, 0], position=[0.1, 0.2, 0.3])


@pytest.mark.parametrize("axes", ["world", "beam"])
def test_on_a_beam_made_rigid_it_is_its_resultant(axes: str, rng: np.random.Generator) -> None:
    """Simplified scenes of studies have such beams: int p ds = 0.4 - 1/2 + 2/3, int p s ds = 0.2 - 1/3 + 1/2."""
    force = ["2 + v.swing", "sin(t)", "-3 + q.swing"]
    one = swinging().distributed_load("wind", "beam", force, profile=PROFILE.tolist(), axes=axes).build()
    total, first = LENGTH * (0.4 - 0.5 + 2.0 / 3.0), LENGTH**2 * (0.2 - 1.0 / 3.0 + 0.5)
    point = [first / total, 0.0, 0.0]
    resultant = [f"{total!r} * ({part})" for part in force]
    other = swinging().force("f", "beam", point=point, force=resultant, axes="body" if axes == "beam" else "world")
    rigid = [
        replace(scene, bodies=tuple(replace(body, beam=None) for body in scene.bodies))
        for scene in (one, other.build())
    ]
    _agree_of(rigid, rng)


def test_axes_of_the_beam_turn_with_its_frame(rng: np.random.Generator) -> None:
    turned = ["2 * cos(q.swing) - 3 * t * sin(q.swing)", "v.swing", "-2 * sin(q.swing) - 3 * t * cos(q.swing)"]
    one = swinging(still=True).distributed_load("wind", "beam", [2, "v.swing", "-3 * t"], axes="beam")
    _agree(one, swinging(still=True).distributed_load("wind", "beam", turned), rng)


def _agree(one: eomgen.SceneBuilder, other: eomgen.SceneBuilder, rng: np.random.Generator) -> None:
    _agree_of([one.build(), other.build()], rng)


def _agree_of(scenes: list[eomgen.Scene], rng: np.random.Generator) -> None:
    systems = [derive(scene, ["force", "energy"]) for scene in scenes]
    state = random_states(systems[0], 5, rng)
    if "base" in systems[0].functions:
        state = on_base(tape_evaluator(systems[0]), state)
    for term in ("force", "energy"):
        found, expected = (tape_evaluator(system)(term, state) for system in systems)
        for name, values in expected.items():
            assert np.max(np.abs(values)) > 1.0
            np.testing.assert_allclose(found[name], values, rtol=1e-11, atol=1e-11 * np.max(np.abs(values)))


def test_loads_that_cannot_be() -> None:
    for keys, text in (
        ({"beam": "bean"}, "there is no beam 'bean'; try: beam"),
        ({"profile": []}, "the list of coefficients is empty"),
        ({"profile": [0, 0]}, "all coefficients are zero, so there is no load"),
        ({"force": ["a.clamp", 0, 0]}, "force"),
    ):
        builder = loaded()
        with pytest.raises(DescriptionError, match=text):
            builder.distributed_load("other", **{"beam": "beam", "force": [0, 0, 1], **keys}).build()


def test_only_exact_beams_take_distributed_moments() -> None:
    message = r"distributed_loads\.wind\.moment\): only geometrically exact beams take distributed moments; try: model"
    with pytest.raises(DescriptionError, match=message):
        loaded(moment=[0, 0, 1]).build()
