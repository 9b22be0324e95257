"""Long trees are checked without whole matrices: by energies, the recursion to and fro, the extended system of
steps."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.mechanics import scene_tape
from eomgen.mechanics.terms import implicit_step as extended
from eomgen.mechanics.terms import implicit_step as iteration
from eomgen.mechanics.tree import links
from eomgen.products.studies.verification import check as checking
from eomgen.studies import check

LINKS = 9


@pytest.fixture(autouse=True)
def long_from_six_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A chain of nine is long here; what is built of it stays out of other tests' cache."""
    monkeypatch.setattr(links, "MANY", 6)
    monkeypatch.setattr(scene_tape, "FLAT", 0)  # nine links in a row are no flat tree here
    monkeypatch.setattr(checking, "LARGE", 8)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))


def chain() -> eomgen.Scene:
    builder, parent = eomgen.SceneBuilder("long").base(position=["0.1 * sin(5 * t)", 0, 0]), "base"
    for k in range(LINKS):
        builder.body(f"link_{k}", 0.5, center_of_mass=[0, 0, -0.1], inertia=[1e-3, 1e-3, 1e-4])
        place = {"axis": [k % 2, (k + 1) % 2, 0], "position": [0, 0, -0.2 if k else 0]}
        builder.joint(f"joint_{k}", "revolute", parent, f"link_{k}", **place, damping=0.01, initial={"position": 0.3})
        parent = f"link_{k}"
    return builder.simulation(step=1e-3, duration=1.0).build()


@pytest.mark.slow
def test_every_closed_form_of_a_long_tree_agrees() -> None:
    report = check(chain(), states=3, profile="instant")
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]
    names = {form.name for form in report.forms}
    wanted = {"coupling.h", "inverse_dynamics.tau", "forward_dynamics.vdot", "residual.r", "energy", "twists", "base"}
    assert names == wanted | {f"iteration.{name}" for name in "KCM"}


@pytest.mark.slow
def test_an_error_in_the_extended_system_of_a_long_tree_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    original = extended.extended_partials

    def wrong(*arguments: object) -> object:
        entries, owners = original(*arguments)  # type: ignore[arg-type]
        place = max(entries["X"])
        return {**entries, "X": {**entries["X"], place: -entries["X"][place]}}, owners

    monkeypatch.setattr(iteration, "extended_partials", wrong)
    report = check(chain(), states=2, only=["iteration", "energy"], profile="instant")
    assert {form.name for form in report.failures} <= {"iteration.K", "iteration.C", "iteration.M"} and report.failures
