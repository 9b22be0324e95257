"""The claims of ``eomgen check`` on the tape, without compiled code: all agree at random states, and each is able to
fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from eomgen.compiled.coordinates import coordinate_names
from eomgen.lie.product import update
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification.claims.claim import (
    FEW,
    Array,
    Blocks,
    Claim,
    Engine,
    Space,
    base_block,
    directions,
    on_tape,
)
from eomgen.products.studies.verification.states import CheckedStates
from eomgen.system.system import System
from eomgen.system.terms import TERMS as TERMS_OF_SCENES
from tests.models.checked_scenes import drone, gate, reed, rod, striker
from tests.studies.test_planted_errors import PLANTED

SCENES = {"drone": drone, "gate": gate, "reed": reed, "rod": rod, "striker": striker}
STATES = 2
#: Terms of scenes of which few are derived; all terms by default.
TERMS = {"reed": ("section_loads", "residual", "poses", "twists", "equations", "constraint", "constraint_jacobian")}


@cache
def derived(scene: str) -> System:
    return derive(SCENES[scene](), TERMS.get(scene, [term.name for term in checking._CHECKED]))


@cache
def claims_of(scene: str) -> tuple[tuple[Claim, ...], CheckedStates]:
    """Return the claims of a scene, and random states near the initial one."""
    system, rng = derived(scene), np.random.default_rng(7)
    engine, names = on_tape(system), coordinate_names(system.factors)[1]
    z_names = [state.name for state in system.states]
    rows, parameters = system.multipliers, [parameter.name for parameter in system.parameters]
    values = np.array([parameter.value for parameter in system.parameters])
    along = {
        "v": directions(names, np.ones(system.nv), rng),
        "z": directions(z_names, np.ones(system.nz), rng),
        "lam": directions(rows, np.ones(len(rows)), rng),
        "p": directions(parameters, np.where(values != 0.0, 0.5 * np.abs(values), 1.0), rng),
    }
    space = Space(
        system,
        engine,
        SCENES[scene](),
        describe(SCENES[scene]()),
        along | {"a": along["v"], "q": along["v"]},
        directions(names, np.ones(system.nv), rng, FEW),
        {"v": tuple(names), "z": tuple(z_names), "lam": tuple(rows)},
    )
    return tuple(checking._claims(space)), _states(system, engine, values, rng)


def _states(system: System, engine: Engine, parameters: Array, rng: np.random.Generator) -> CheckedStates:
    def drawn(size: int, reach: float = 1.0) -> Array:
        return rng.uniform(-reach, reach, (STATES, size))

    state = {
        "q": update(system.factors, np.tile(system.initial_q, (STATES, 1)), drawn(system.nv, 0.02)),
        **{name: drawn(system.nv) for name in ("v", "a", "j", "s")},
        "z": drawn(system.nz),
        "t": rng.uniform(0.1, 0.9, (STATES, 1)),
        **{name: drawn(system.nu) for name in ("u", "u_dot", "u_ddot")},
        "lam": drawn(len(system.multipliers)),
        "p": np.broadcast_to(parameters, (STATES, len(parameters))),
        **{name: drawn(size) for name, size in system.second_sizes.items()},
    }
    for name in ("base", "base_rates"):
        if name in engine:
            state[name] = base_block(engine, name, state)
    there = {name: block for name, block in state.items() if block.shape[-1]}
    return CheckedStates(there, tuple(f"state {k}" for k in range(STATES)), ())


#: By scene: the beginnings of the names of claims in the first tier; the other claims are of the second tier, compiled.
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


@pytest.mark.slow_cases("rod", "striker")
@pytest.mark.long_cases("gate", "drone")
@pytest.mark.parametrize("scene", CHECKED)
def test_claims_agree_at_random_states(scene: str, rng: np.random.Generator) -> None:
    system, (claims, states) = derived(scene), claims_of(scene)
    engine = on_tape(system)
    chosen = [claim for claim in claims if claim.name.startswith(CHECKED[scene])]
    assert all(any(claim.name.startswith(name) for claim in chosen) for name in CHECKED[scene])
    reports = [checking.judge_claim(claim, engine, engine, system, states, rng) for claim in chosen]
    assert [(report.name, report.verdict, str(report.worst)) for report in reports if report.verdict != "agrees"] == []
    errors = [report.complex_step for report in reports if report.complex_step is not None]
    assert max(errors, default=0.0) < 1e-11
    assert errors or scene == "reed"  # loads along its section have no partials to check


@pytest.mark.slow_cases("rod", "drone", "striker")
@pytest.mark.long_cases("gate")
@pytest.mark.parametrize("scene", CHECKED)
def test_a_wrong_entry_of_one_state_fails_each_claim(scene: str, rng: np.random.Generator) -> None:
    """The largest entry changes by a millionth, a zero entry by a thousandth."""
    system, (claims, states) = derived(scene), claims_of(scene)
    engine = on_tape(system)
    for claim in claims:
        if claim.name.startswith(CHECKED[scene]):
            wrong = replace(claim, value=_changed(claim.value))
            report = checking.judge_claim(wrong, engine, engine, system, states, rng)
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


@pytest.mark.long
def test_every_term_has_a_claim_and_every_claim_an_error_that_it_finds() -> None:
    """A new term must bring what holds it, a claim in ``eomgen/products/studies``, and an error: here, or compiled."""
    names = {scene: {claim.name for claim in claims_of(scene)[0]} for scene in SCENES}
    claimed = {name.partition(".")[0] for of_scene in names.values() for name in of_scene}
    other_orders = {name for name, term in TERMS_OF_SCENES.items() if term.source and name[-1].isdigit()}
    assert set(TERMS_OF_SCENES) - claimed - CLAIM_NOTHING - BEHIND_RATES - other_orders == set()
    on_tape = {name for scene, known in names.items() for name in known if name.startswith(CHECKED[scene])}
    assert set().union(*names.values()) - on_tape - {form for *_, form in PLANTED} == set()
