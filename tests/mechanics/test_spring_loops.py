"""Springs of one kind are one loop: the same forces, energies and partials as one by one, in a text of one length."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import eomgen
from eomgen.codegen.scheduling.bodies import Bodies
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.mechanics.derive import derive
from eomgen.mechanics.forces import springs
from eomgen.symbolic.evaluate import evaluate
from tests.mechanics.checks import check_same_values
from tests.models.nets import LENGTH, MASS, SLACK, STIFFNESS, net

TERMS = ("force", "inverse_dynamics", "residual", "iteration", "energy", "momenta")


@pytest.mark.parametrize(
    "kind",
    [
        {"group": "R3xSO3"},
        {"group": "SE3", "place": (0.02, -0.01, 0.03)},
        pytest.param({"group": "R3xSO3", "place": (0.02, -0.01, 0.03)}, marks=pytest.mark.slow),
        pytest.param({"group": "SE3", "damping": 0.0}, marks=pytest.mark.slow),
        {"group": "SE3", "damping": 0.0, "coordinates": "joint", "tunable": True},
        {"joint": "prismatic", "coordinates": "joint"},
        pytest.param({"group": "SE3", "anchors": "world"}, marks=pytest.mark.slow),
    ],
)
def test_the_same_equations_as_one_by_one(kind: dict[str, object], monkeypatch: pytest.MonkeyPatch) -> None:
    scene = net(4, 3, **kind)  # type: ignore[arg-type]  # keys of net
    loops = derive(scene, TERMS)
    assert any(len(getattr(loop, "gather", ())) and loop.count == 17 for loop in loops.tape.maps)  # type: ignore[attr-defined]
    monkeypatch.setattr(springs, "FEWEST", 10**9)
    alone = derive(scene, TERMS)
    assert not alone.tape.maps
    for name, numbers in check_same_values(loops, alone).items():
        assert np.max(np.abs(numbers), initial=0.0) > 0.0 or "iteration" in name or "energy" in name, name


def statements(scene: eomgen.Scene, terms: tuple[str, ...]) -> int:
    """Return the statements that the functions of terms have, loops of springs included."""
    system = derive(scene, terms)
    count = 0
    for name in terms:
        function = system.functions[name]
        made = schedule(
            system.tape, [block.refs for block in function.outputs], function.inputs, bodies=(bodies := Bodies())
        )
        count += sum(len(part.statements) for part in made.parts)
        count += sum(len(run.loop.kernel.op) for run in bodies.loops)
    return count


def test_a_spring_with_an_actuator_and_one_on_a_long_chain_stay_alone() -> None:
    builder = eomgen.SceneBuilder("mixed", gravity=[0, 0, 0])
    builder.point("wall", "base", [-0.3, 0.2, 0.1])
    for k in range(10):
        builder.body(f"link{k}", 1.0, center_of_mass=[0.5, 0, 0], inertia=[0.1, 0.1, 0.1])
        parent = f"link{k - 1}" if k else "base"
        builder.joint(f"joint{k}", "revolute", parent, f"link{k}", axis=[0, 1, 0], position=[1 if k else 0, 0, 0])
        builder.point(f"tip{k}", f"link{k}", [1, 0, 0.1])
        force = "2.0 * sin(t)" if k == 2 else 0.0
        builder.spring(f"spring{k}", "wall", f"tip{k}", stiffness=100.0, length=1.0, force=force)
    for k in range(springs.FEWEST):
        builder.point(f"wall{k}", "base", [1.0, 0.1 * k, 2.0])
        builder.spring(f"on_tip{k}", f"wall{k}", "tip9", stiffness=100.0, length=1.0)
    system = derive(builder.build(), ("force",))
    assert not system.tape.maps  # kinds of one each, and one whose partials are along ten hinges


def test_a_taut_net_has_the_frequencies_of_the_lattice() -> None:
    """Transverse motion of a taut square net of point masses in a fixed frame, each string with tension T.

    omega_jk^2 = 4 T/(m l) (sin^2(j pi/(2 (rows + 1))) + sin^2(k pi/(2 (columns + 1)))): Rayleigh, The Theory of Sound.
    """
    rows, columns = 4, 3
    system = derive(net(rows, columns, group="R3xSO3", gravity=0.0, damping=0.0), ("iteration",))
    still = {"q": np.array(system.initial_q), "v": np.zeros(6 * rows * columns), "a": np.zeros(6 * rows * columns)}
    K, M = (np.zeros((6 * rows * columns, 6 * rows * columns)) for _ in "KM")
    for block in system.functions["iteration"].outputs:
        for name, matrix in (("K", K), ("M", M)):
            if block.name == name:
                matrix[tuple(np.array(system.patterns[name]).T)] = evaluate(system.tape, block.refs, still)
    transverse = range(5, 6 * rows * columns, 6)
    found = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)[np.ix_(transverse, transverse)]).real)
    tension = STIFFNESS * (LENGTH - SLACK)
    sines = [np.sin(np.arange(1, n + 1) * math.pi / (2 * (n + 1))) ** 2 for n in (rows, columns)]
    expected = np.sort(np.add.outer(*sines).ravel()) * 4.0 * tension / (MASS * LENGTH)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_the_text_names_the_springs() -> None:
    system = derive(net(4, 3, group="R3xSO3"), ("force",))
    labels = [loop.label for loop in system.tape.maps]  # type: ignore[attr-defined]
    assert any(re.fullmatch(r"forces of 17 springs, x_0_0 to y_3_1", label) for label in labels), labels


def test_forward_dynamics_of_many_bodies_is_by_blocks_of_the_mass_matrix() -> None:
    """Articulated bodies would be recorded beside them, and then left out: they have as many operations."""
    scene = net(5, 4)
    found = derive(scene, ["forward_dynamics", "mass", "inverse_dynamics"])
    random = np.random.default_rng(5)
    inputs = {"q": np.array(found.initial_q), "v": random.standard_normal(found.nv), "a": np.zeros(found.nv)}

    def value(name: str) -> np.ndarray:
        return np.array(evaluate(found.tape, found.functions[name].outputs[0].refs, inputs), dtype=float)

    M = value("mass").reshape(found.nv, found.nv)
    np.testing.assert_allclose(value("forward_dynamics"), np.linalg.solve(M, -value("inverse_dynamics")), rtol=1e-9)
    assert not any("articulated" in label for _, label in found.tape.blocks)
