"""The claims of ``eomgen check`` on the tape, without compiled code: all agree at random states, and each is able to
fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification.claims.claim import Array, Blocks, Claim, Engine, Space
from eomgen.products.studies.verification.states import CheckedStates
from eomgen.system.terms import TERMS as TERMS_OF_SCENES
from tests.models.checked_scenes import drone, gate, reed, rod, striker
from tests.studies.claims_of_scenes import space_of, states_of
from tests.studies.test_exact_claims import SCENES as EXACT
from tests.studies.test_exact_claims import claims_of as exact_claims

SCENES = {"drone": drone, "gate": gate, "reed": reed, "rod": rod, "striker": striker}
STATES = 2
#: Terms of scenes of which few are derived; all terms by default.
TERMS = {"reed": ("section_loads", "residual", "poses", "twists", "equations", "constraint", "constraint_jacobian")}


@cache
def claims_of(scene: str) -> tuple[Space, tuple[Claim, ...], CheckedStates]:
    """Return the space and the claims of a scene, and random states near the initial one."""
    space = space_of(SCENES[scene](), TERMS.get(scene, [term.name for term in checking._CHECKED]))
    blocks = states_of(space.system, space.engine, STATES)
    return space, tuple(checking._claims(space)), CheckedStates(blocks, tuple(f"state {k}" for k in range(STATES)), ())


#: By scene: the beginnings of the names of claims that are judged; other claims are in ``test_exact_claims`` alone.
CHECKED: dict[str, tuple[str, ...]] = {
    "drone": (
        "base_motion.", "internal", "frame_jacobians.", "frame_jacobian_rates_world", "frame_drifts.",
        "frame_drifts_aligned", "frame_mobilities", "center_of_mass", "output", "input_rates", "parameter_partials",
        "momenta",
    ),
    "gate": ("constraint", "velocity_partials", "joint_velocities", "parameter_partials", "output_partials"),
    "reed": ("section_loads",),
    "rod": ("",),
    "striker": ("",),
}  # fmt: skip  # a table


@pytest.mark.slow_cases("rod", "gate", "drone")
@pytest.mark.parametrize("scene", CHECKED)
def test_claims_agree_at_random_states(scene: str, rng: np.random.Generator) -> None:
    space, claims, states = claims_of(scene)
    chosen = [claim for claim in claims if claim.name.startswith(CHECKED[scene])]
    assert all(any(claim.name.startswith(name) for claim in chosen) for name in CHECKED[scene])
    reports = [checking.judge_claim(claim, space.engine, space.engine, space.system, states, rng) for claim in chosen]
    assert [(report.name, report.verdict, str(report.worst)) for report in reports if report.verdict != "agrees"] == []
    errors = [report.complex_step for report in reports if report.complex_step is not None]
    assert max(errors, default=0.0) < 1e-11
    assert errors or scene == "reed"  # loads along its section have no partials to check


@pytest.mark.slow_cases("rod", "gate", "drone")
@pytest.mark.parametrize("scene", CHECKED)
def test_a_wrong_entry_of_one_state_fails_each_claim(scene: str, rng: np.random.Generator) -> None:
    """The largest entry changes by a millionth, a zero entry by a thousandth."""
    space, claims, states = claims_of(scene)
    for claim in claims:
        if claim.name.startswith(CHECKED[scene]):
            wrong = replace(claim, value=_changed(claim.value))
            report = checking.judge_claim(wrong, space.engine, space.engine, space.system, states, rng)
            assert (claim.name, report.verdict) == (claim.name, "FAILS")
            assert report.worst is not None and report.worst.state == "state 1"


def _changed(value: Callable[[Engine, Blocks], Array]) -> Callable[[Engine, Blocks], Array]:
    def changed(engine: Engine, state: Blocks) -> Array:
        array = np.array(value(engine, state))
        place = (1, *np.unravel_index(np.argmax(np.abs(array[1])), array.shape[1:]))
        array[place] = array[place] * (1.0 + 1e-6) if abs(array[place]) > 1e-9 else 1e-3
        return array

    return changed


#: Matrices of the closed form that their rates, and tau made of them, are held by.
BEHIND_RATES = {"system_jacobian", "adjoints", "joint_brackets", "link_brackets"}
#: Terms that claim nothing of their own: values that other forms are derivatives of.
CLAIM_NOTHING = {
    *("outputs", "event_actions", "samples", "poses", "frame_poses", "center_of_mass", "constraint", "constraint_size"),
    *("force", "internal_rate", "regressor_parameters"),
}


@pytest.mark.slow
def test_every_term_has_a_claim_and_every_claim_a_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """A new term must bring what holds it, a claim in ``eomgen/products/studies``, that is tested here or exactly."""
    names = {scene: {claim.name for claim in claims_of(scene)[1]} for scene in SCENES}
    exact = {name for scene in EXACT for name in exact_claims(scene, monkeypatch)[1]}
    claimed = {name.partition(".")[0] for of_scene in names.values() for name in of_scene}
    other_orders = {name for name, term in TERMS_OF_SCENES.items() if term.source and name[-1].isdigit()}
    assert set(TERMS_OF_SCENES) - claimed - CLAIM_NOTHING - BEHIND_RATES - other_orders == set()
    on_tape = {name for scene, known in names.items() for name in known if name.startswith(CHECKED[scene])}
    assert set().union(*names.values()) - on_tape - exact == set()
