"""The momentum of a floating machine is kept along every axis along which nothing acts, or its drift is told."""

from __future__ import annotations

import re

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.doubts import momentum
from eomgen.products.doubts.momentum import momentum_drift
from tests.models.scenes import jointed_chain


def tumbling(gravity: float = 0.0) -> eomgen.Model:
    """Return a free body that spins about its middle axis and travels."""
    builder = eomgen.SceneBuilder("tumbling", gravity=[0, 0, -gravity])
    builder.body("body", 2.0, center_of_mass=[0.1, 0, 0], inertia=[1.0, 2.0, 3.0])
    free = {"position": [0, 0, 0], "velocity": [0.1, 3.0, 0.1, 0.5, 0.2, 0.0]}
    builder.joint("root", "free", "base", "body", initial=free)
    return eomgen.build(builder.build(), profile="quick")


def drift_of(model: eomgen.Model, run: eomgen.Solution) -> momentum.Drift | None:
    """Return what is said of the drift of a run."""
    return momentum_drift(model, (run.t, run.q, run.v, run.z), model.parameter_array(), None, run.multipliers)


WHICH = r"(angular )?momentum (along|about) [xyz], which no force changes, drifts by \S+ % of the momenta at work"


@pytest.mark.slow
def test_drift_is_told_and_a_fine_run_keeps_all() -> None:
    coarse = tumbling().simulate(20.0, 0.2)
    assert re.search(rf"; the estimated error is .*, and the {WHICH}; try: a step smaller than 0\.2 s", coarse.message)
    assert tumbling().simulate(5.0, 0.01, method="rk4").message == "reached t = 5 s in 500 steps"


def two_bodies(kind: str) -> eomgen.Model:
    """Return two tumbling bodies with a spring between them, or a hinge in absolute coordinates; nothing else acts."""
    coordinates = "absolute" if kind in ("hinge", "pinned") else "joint"
    builder = eomgen.SceneBuilder(f"two_{kind}", gravity=[0, 0, 0], coordinates=coordinates)
    builder.body("one", 2.0, center_of_mass=[0.1, 0, 0], inertia=[1.0, 2.0, 3.0])
    builder.body("other", 1.0, center_of_mass=[0.2, 0, 0], inertia=[0.3, 0.2, 0.1])
    free = {"position": [0, 0, 0], "velocity": [0.1, 3.0, 0.1, 0.5, 0.2, 0.0]}
    builder.joint("root", "free", "base", "one", initial=free)
    if kind == "spring":
        builder.joint(
            "second", "free", "base", "other", initial={"position": [1, 0, 0], "velocity": [2, 0.1, 0, 0, 0, 0]}
        )
        builder.point("here", "one", position=[0.3, 0, 0]).point("there", "other")
        builder.spring("cord", "here", "there", stiffness=20.0, length=0.5)
    else:
        builder.joint("hinge", "revolute", "one", "other", axis=[0, 0, 1], initial={"velocity": 1.0})
    if kind == "pinned":
        above = {"body": "base", "position": [0, 0, 2.0]}
        builder.constraint("pin", "distance", above, {"body": "one", "position": [0, 0, 0]}, length=2.0)
    return eomgen.build(builder.build(), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spring", "hinge"])
def test_the_momentum_of_several_bodies_together_is_kept(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = two_bodies(kind)
    assert re.search(WHICH, model.simulate(20.0, 0.2).message)
    monkeypatch.setattr(momentum, "REPORTED_MOMENTUM", 0.0)
    drifts = []
    for step in (0.02, 0.01):
        said = drift_of(model, model.simulate(1.0, step))
        assert said is not None
        drifts.append(said.share)
    assert 3.0 < drifts[0] / drifts[1] < 5.0  # of order 2


@pytest.mark.parametrize(
    ("count", "terms"), [(4, ("mass", "constraint_jacobian")), (60, ("mass_values", "jacobian_values"))]
)
def test_momentum_that_grows_in_a_jointed_chain_of_any_length_is_told(count: int, terms: tuple[str, ...]) -> None:
    """By whole matrices of few bodies, by nonzeros of many, with multipliers that cancel in the whole chain."""
    model = eomgen.build(jointed_chain(count, tied=False), terms=["force", *terms], profile="instant")
    t, q = np.linspace(0.0, 1.0, 5), np.tile(model.initial_q, (5, 1))
    multipliers = np.random.default_rng(1).normal(size=(5, len(model.multipliers)))
    v = np.tile(model.initial_v, (5, 1))
    assert momentum_drift(model, (t, q, v, v[:, :0]), model.parameter_array(), None, multipliers) is None
    v[2:] *= 1.1
    said = momentum_drift(model, (t, q, v, v[:, :0]), model.parameter_array(), None, multipliers)
    assert said is not None and said.share == pytest.approx(0.1 / 1.1, rel=0.05)
    assert momentum_drift(model, (t, q, v, v[:, :0]), model.parameter_array(), None, None) is None


@pytest.mark.slow
def test_runs_of_a_long_jointed_chain_have_what_tells_a_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(momentum, "REPORTED_MOMENTUM", 0.0)
    model = build_for_run(jointed_chain(60, tied=False), profile="instant")
    assert "mass" not in model.terms
    assert re.search(WHICH, model.simulate(0.01, 1e-3, error_estimate=False).message)


def test_friction_of_short_contacts_between_the_examined_rows_changes_a_momentum() -> None:
    """A ball thrown onto a floor touches it between two of the examined rows, or between two recorded rows."""
    start = {"position": [0, 0, 1.01], "velocity": [0, 0, 0, 5, 0, 0]}
    law = {"normal": {"type": "hunt_crossley", "stiffness": 1e6}, "tangential": {"type": "coulomb", "friction": 0.4}}
    scene = {
        "format": 1,
        "name": "thrown",
        "gravity": [0, 0, -9.81],
        "bodies": {"ball": {"mass": 1, "inertia": [4e-3] * 3}},
        "joints": {"ball": {"type": "free", "parent": "base", "child": "ball", "initial": start}},
        "contacts": {
            "floor": {
                "first": {"body": "base", "axis": [0, 0, 1]},
                "second": {"body": "ball"},
                "shape": "sphere",
                "radius": 0.1,
                **law,
            }
        },
    }
    runs = (
        eomgen.build(scene).simulate(0.75, 1e-4, method="rk4"),
        eomgen.build(scene).simulate(0.75, 1e-4, method="rk4", record_every=1500),
        eomgen.build(scene, method="rk45").simulate(0.75, 0.15, tolerance=1e-7),
    )
    for run in runs:
        assert run.v[-1, 3] < 4.9
        assert "momentum" not in str(run)
