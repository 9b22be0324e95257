"""The check can fail: errors planted in any closed form of a compiled model, or in derivations, are found and named."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.compiled.functions import Functions
from eomgen.errors import Message
from eomgen.mechanics import derive as derive_module
from eomgen.mechanics.constraints.rows import ConstraintCalculus
from eomgen.mechanics.dynamics import separated
from eomgen.pipeline import pipeline
from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification.claims.claim import Claim, Second
from eomgen.products.studies.verification.report import FormReport
from eomgen.studies import CheckReport, check
from tests.models.checked_scenes import drone, gate, reed, rod, striker
from tests.models.library import scene_file

Array = np.ndarray
SCENES = {"drone": drone, "gate": gate, "reed": reed, "rod": rod, "striker": striker}
_derive = pipeline.derive


@cache
def _derived(scene: str, terms: tuple[str, ...]) -> eomgen.System:
    return _derive(SCENES[scene](), terms)


@pytest.fixture
def derived_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scenes' systems and models are the same in all tests that change only what the compiled functions give."""

    def derive(scene: eomgen.Scene, terms: Sequence[str]) -> eomgen.System:
        return _derived(scene.name, tuple(terms)) if scene is SCENES[scene.name]() else _derive(scene, terms)

    monkeypatch.setattr(pipeline, "derive", derive)
    monkeypatch.setattr(checking, "_terms", lambda scene, only: [term.name for term in checking._CHECKED])


#: By scene: terms with outputs that are planted, whose forms have the names of both. Outputs of other terms are changed
#: on the tape, in ``test_claims_on_tape``.
OWN = {
    "drone": (
        "mass M, coupling h, inverse_dynamics tau, residual r, forward_dynamics vdot, partials K C M, "
        "equations r zdot, iteration K C M Rz Fq Fv Fz, rates tau tau_dot tau_ddot, "
        "mass_rates M_dot M_ddot, coupling_rates h_dot h_ddot, force_rates Q_dot Q_ddot, "
        "base_motion_rates b_dot b_ddot, "
        "rates_closed tau tau_dot tau_ddot, mass_rates_closed M_dot M_ddot, system_jacobian_rates J_dot J_ddot, "
        "adjoints_rates A_dot A_ddot, joint_brackets_rates ad_joints_dot ad_joints_ddot, "
        "link_brackets_rates ad_links_dot ad_links_ddot, coriolis C, coriolis_skew C, coriolis_rates C_dot C_ddot, "
        "coriolis_skew_rates C_dot C_ddot, forward_rates vdot vdot_dot vdot_ddot, "
        "linearization M0 C0 K0 Rz Fq Fv Fz B0 Fu E0 Fw, frame_jacobians_aligned J, frame_jacobians_world J, "
        "frame_jacobian_rates J_dot, frame_jacobian_rates_aligned J_dot, frame_drifts_world drift, "
        "centroidal_momentum A, centroidal_momentum_rate A_dot, centroidal_drift drift, second_partials Hd"
    ),
    "gate": (
        "equations Phi w, iteration B Z, jacobian_values B, acceleration_partials Aq Av, second_partials Hd, "
        "mass_values M_values, reaction_partials N Np, input_derivatives input_derivatives"
    ),
}
#: Derivatives of whole functions, whose one output and form have the name of the term.
DERIVATIVES = {
    "drone": ("inverse_dynamics", "forward_dynamics", "internal_rate", "outputs", "frame_poses"),
    "gate": ("residual", "momenta"),
}
#: Scene, term, its output, and the form that must be found wrong.
PLANTED = [
    *(
        (scene, term, output, f"{term}.{output}")
        for scene, text in OWN.items()
        for term, *outputs in map(str.split, text.split(", "))
        for output in outputs
    ),
    *(
        (scene, f"{name}_{kind}", f"{name}_{kind}", f"{name}_{kind}.{name}_{kind}")
        for scene, names in DERIVATIVES.items()
        for name in names
        for kind in ("derivatives", "hessian")
    ),
    ("drone", "force", "Q", "inverse_dynamics.tau"),
    ("drone", "energy", "energy", "energy"),
    ("drone", "base", "base", "base"),
    ("drone", "base_rates", "base_rates", "base_rates"),
    ("drone", "internal_rate", "zdot", "equations.zdot"),
    ("drone", "poses", "pose", "twists"),
    ("drone", "twists", "twist", "twists"),
    ("drone", "accelerations", "acceleration", "accelerations"),
    ("drone", "jacobians", "J", "jacobians"),
    ("drone", "regressor", "tau0", "regressor.Y"),
    ("drone", "regressor_parameters", "pi", "regressor.Y"),
    ("drone", "frame_poses", "frame_pose", "frame_jacobians.J"),
    ("drone", "center_of_mass", "m", "centroidal_momentum.A, linear"),
    ("drone", "center_of_mass", "c", "center_of_mass_jacobian.J"),
    ("gate", "constraint", "Phi", "constraint_jacobian.B"),
    ("gate", "constraint_jacobian", "B", "constraint_jacobian.B by w"),
]
#: What is done to the largest entry of an output.
CHANGES: tuple[Callable[[Array], Array], ...] = (
    lambda value: -value,
    lambda value: value * (1.0 + 1e-6),
    lambda value: 0.0 * value,
)
#: Where states could not be drawn without the largest entry: a quaternion's, or that of B which holds a body.
KEPT = {"base", "poses", "constraint_jacobian"}


def planted(
    monkeypatch: pytest.MonkeyPatch, term: str, outputs: Collection[str], change: Callable[[Array], Array]
) -> None:
    """Change the entry of each output that is largest when it is first asked for, wherever the compiled function is
    called."""
    original, places = Functions.__call__, dict[str, int]()

    def wrong(self: Functions, name: str, blocks: object) -> tuple[Array, ...]:
        values = list(original(self, name, blocks))  # type: ignore[arg-type]
        for number, output in enumerate(self.output_names(name)):
            if name == term and output in outputs:
                shape = self._shapes[name][number]
                rows = values[number].reshape(-1, int(np.prod(shape))).copy()
                place = places.setdefault(output, int(np.argmax(np.max(np.abs(rows), axis=0))))
                rows[:, place] = change(rows[:, place])
                values[number] = rows.reshape(values[number].shape)
        return tuple(values)

    monkeypatch.setattr(Functions, "__call__", wrong)


PLACES = list(dict.fromkeys((scene, term) for scene, term, *_ in PLANTED))


@pytest.mark.slow
@pytest.mark.usefixtures("derived_once")
@pytest.mark.parametrize(("scene", "term"), PLACES)
def test_errors_in_any_compiled_form_are_found_and_named(
    scene: str, term: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One in each output at once: a change of sign, by a millionth, or to zero, by the place in the table."""
    forms = {output: form for where, name, output, form in PLANTED if (where, name) == (scene, term)}
    change = 1 if term in KEPT else PLACES.index((scene, term)) % len(CHANGES)
    planted(monkeypatch, term, forms, CHANGES[change])
    report = check(SCENES[scene](), states=3, only=sorted({*forms.values()}), profile="quick")
    assert not report.passed
    found = {item.name: item.worst for item in report.failures}
    assert {*forms.values()} <= found.keys()
    for form in forms.values():
        worst = found[form]
        assert worst is not None and worst.state in report.states
        assert worst.value != worst.expected and not abs(worst.value - worst.expected) <= worst.bar  # or no number


# -- errors in derivations, through the C ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Wrong models must not stay where other tests look for theirs."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("EOMGEN_CACHE", str(folder))
        yield folder


def sign_of_partials(patch: pytest.MonkeyPatch) -> None:
    from eomgen.mechanics import scene_tape

    original = scene_tape.inertial_partials

    def wrong(*arguments: object) -> object:
        K, C, M = original(*arguments)  # type: ignore[arg-type]
        return K, [[C[0][0], -C[0][1]], C[1]], M

    patch.setattr(scene_tape, "inertial_partials", wrong)


def factor_of_coupling(patch: pytest.MonkeyPatch) -> None:
    original = separated.coupling
    patch.setattr(separated, "coupling", lambda tree: [0.999 * value for value in original(tree)])


def missing_base_motion(patch: pytest.MonkeyPatch) -> None:
    original = separated.base_motion
    patch.setattr(separated, "base_motion", lambda tree, base: [value - value for value in original(tree, base)])


def late_rates(patch: pytest.MonkeyPatch) -> None:
    original = derive_module._blocks

    def wrong(scene_tape: object, name: str) -> object:
        blocks = list(original(scene_tape, name))  # type: ignore[arg-type]
        last = blocks[-1]
        late = replace(last, refs=(-last.refs[0], *last.refs[1:])) if name == "rates" else last
        return [*blocks[:-1], late]

    patch.setattr(derive_module, "_blocks", wrong)


def missing_bias(patch: pytest.MonkeyPatch) -> None:
    original = ConstraintCalculus.bias
    patch.setattr(ConstraintCalculus, "bias", lambda self: [value - value for value in original(self)])


def swing(folder: Path, name: str) -> Path:
    """Write the arm on a base that moves, with a torque over time."""
    moves = {
        f"joints__{joint}__initial": {"position": 0.4, "velocity": v}
        for joint, v in (("shoulder", 0.8), ("elbow", -0.5))
    }
    base = {"position": ["0.1 * sin(5 * t)", 0, "0.2 * t**2"]}
    torques = {"shoulder_torque": {"formula": "0.2 * sin(3 * t)"}, "elbow_torque": {"formula": 0}}
    return scene_file(folder, "arm", description=name, base=base, inputs=torques, **moves)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize(
    ("plant", "form", "coordinates"),
    [
        (factor_of_coupling, "coupling.h", "joint"),
        (missing_base_motion, "base_motion.b", "joint"),
        (late_rates, "rates.tau_ddot", "joint"),
        (missing_bias, "constraint_bias.g", "absolute"),
    ],
)
def test_an_error_in_a_derivation_is_found_in_the_compiled_model(
    plant: Callable[[pytest.MonkeyPatch], None],
    form: str,
    coordinates: Literal["joint", "absolute"],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = eomgen.load(swing(tmp_path, plant.__name__), coordinates=coordinates)
    plant(monkeypatch)
    report = check(scene, states=3, only=[form], profile="quick")
    assert [item.name for item in report.failures] == [form]


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_an_error_ends_with_exit_code_6_and_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["check", str(swing(tmp_path, "sign")), "--states", "3", "--only", "partials"]
    with monkeypatch.context() as patch:
        sign_of_partials(patch)
        assert main(command) == 6
    output = capsys.readouterr()
    verdicts = {line.split()[0]: line.split()[-1] for line in output.out.splitlines() if line.startswith("partials.")}
    assert verdicts == {"partials.K": "agrees", "partials.C": "FAILS", "partials.M": "agrees"}
    said = [line for line in output.err.splitlines() if line.startswith("partials.C FAILS: v.shoulder along v.elbow: ")]
    assert len(said) == 1 and re.search(
        r": -?[0-9.e-]+, but -?[0-9.e-]+ by [a-z ]+ \(known to .*\), at .*state", said[0]
    )
    assert "1 of 3 closed forms not shown to agree" in output.err


def test_a_report_of_nothing_has_not_passed() -> None:
    assert not CheckReport("empty", (), 0, ()).passed


def test_a_scene_with_states_left_out_agrees_where_defined() -> None:
    forms = (FormReport("tau", "", "", "agrees"),)
    others, left_out = Message("2 of 4 states were not found [W0088]"), Message("all states but one [W0087]")
    assert CheckReport("some", (), 0, forms, (others,)).summary == "all agree"
    assert CheckReport("some", (), 0, forms, (others, left_out)).summary == "all agree where defined"


@pytest.mark.long
@pytest.mark.usefixtures("derived_once")
def test_a_second_derivation_without_numbers_is_no_agreement(monkeypatch: pytest.MonkeyPatch) -> None:
    own, forms = checking.judge_claim, []

    def judged(claim: Claim, *given: Any) -> FormReport:
        if (second := claim.second) is not None:
            claim = replace(claim, second=Second("by", lambda engine, state: np.nan * second(engine, state)))
            forms.append(claim.name)
        return own(claim, *given)

    monkeypatch.setattr(checking, "judge_claim", judged)
    report = check(drone(), states=2, profile="quick")
    failed = {form.name: str(form.worst) for form in report.forms if form.verdict == "FAILS"}
    assert forms and set(failed) == set(forms) and not report.passed
    assert all("not a number by" in text for text in failed.values())
