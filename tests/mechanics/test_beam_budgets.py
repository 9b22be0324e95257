"""Only what the scene needs: exact operation counts of beams, beside those of the beam that deforms in every way."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.savings import savings
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.load import from_data
from eomgen.system.system import System

SCENE = Path(__file__).resolve().parents[2] / "examples" / "spin_up_beam" / "scene.toml"
TERMS = ("mass", "coupling", "base_motion", "inverse_dynamics", "forward_dynamics", "partials")
ALL_WAYS: dict[str, Any] = {
    "bending_z": {"modes": 2, "stiffness": 1.4e4},
    "stretch": {"modes": 2, "stiffness": 2.8e7},
    "torsion": {"modes": 2, "stiffness": 1e4},
}
PENDULUM: dict[str, Any] = {"type": "revolute", "axis": [0, 0, 1]}
TIP: dict[str, Any] = {"type": "fixed", "parent": "blade", "child": "tip", "position": ["length", 0, 0]}


def data(name: str) -> dict[str, Any]:
    """Return the spin-up beam with two modes: in its plane or deforming in every way, on a hinge, with a mass at its
    tip."""
    found = tomllib.loads(SCENE.read_text())
    found["beams"]["blade"]["bending_y"] = {"modes": 2, "stiffness": "bending_stiffness"}
    found["outputs"] = {}
    if "spatial" in name:
        found["beams"]["blade"] |= {**ALL_WAYS, "polar_inertia": 6e-4}
    if "hinged" in name:
        del found["base"]
        found["gravity"] = [0, 0, 0]
        found["joints"]["clamp"] = {**found["joints"]["clamp"], **PENDULUM}
    if "tip" in name:
        found["bodies"] = {"tip": {"mass": 0.5}}
        found["joints"]["tip"] = TIP
    return found


@cache
def system_of(name: str) -> System:
    return derive(from_data(data(name)), TERMS)


#: Additions and multiplications of each term.
COUNTS: dict[str, tuple[int, ...]] = {
    "planar": (0, 0, 19, 27, 25, 9),
    "spatial": (0, 0, 75, 107, 97, 22),
    "planar, hinged": (16, 24, 0, 51, 48, 74),
    "spatial, hinged": (54, 74, 0, 165, 160, 219),
    "planar, tip": (34, 38, 83, 112, 124, 308),
    "planar, hinged, tip": (87, 107, 0, 146, 186, 520),
}


@pytest.mark.parametrize("name", COUNTS)
def test_number_of_operations(name: str) -> None:
    counts = system_of(name).counts
    assert tuple(counts[term].flops if term in counts else 0 for term in TERMS) == COUNTS[name]


def test_a_planar_beam_knows_its_plane_only() -> None:
    """Two coordinates and no more: no symbol of the other plane, of stretch or of torsion, no sine, no division."""
    system = system_of("planar")
    assert (system.nq, system.nv) == (2, 2)
    assert [factor.name for factor in system.factors] == ["blade"]
    for name in ("inverse_dynamics", "forward_dynamics", "partials"):
        assert system.counts[name].functions == system.counts[name].divisions == 0
    assert "bending_z, stretch, torsion of beam blade: the scene asks for none" in system.dropped
    assert [f"beam {text}" for text in system.beams] == [line for line in system.kept if line.startswith("beam blade")]
    assert "elastic coordinates 2 of bending_y" in system.beams[0]
    assert "the shortening of the bent axis kept" in system.beams[0]


def test_info_tells_what_the_full_spatial_beam_would_cost() -> None:
    without = [item for item in savings(from_data(data("planar"))) if item.what.startswith("beams deform")]
    found = {item.term: item for item in without}
    for term in ("inverse_dynamics", "forward_dynamics"):
        assert found[term].operations == system_of("planar").counts[term].flops
        assert found[term].without == pytest.approx(system_of("spatial").counts[term].flops, abs=60)
        assert found[term].without > 3 * found[term].operations


@pytest.mark.slow
def test_parameters_that_beams_need_fixed_stay_so_in_what_is_compared() -> None:
    builder = SceneBuilder("arm").parameter("reach", 0.8).parameter("aside", 0.0)
    builder.beam("link", "reach", mass_per_length=0.5, bending_z={"modes": 2, "stiffness": 100.0})
    builder.joint("shoulder", "revolute", "base", "link", axis=[0, -1, 0])
    builder.body("tool", 0.3, center_of_mass=[0, 0, "aside"], inertia=[1e-4, 1e-4, 1e-4])
    builder.joint("mount", "fixed", "link", "tool", position=["reach", 0, 0])
    found = [item for item in savings(builder.build()) if item.what == "fixed parameters folded"]
    assert found and all(item.without > item.operations for item in found)
