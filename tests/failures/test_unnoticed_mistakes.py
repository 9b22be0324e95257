"""Mistakes that runs and scenes once passed over: each is answered now, and what is right is left alone."""

from __future__ import annotations

import functools
from typing import Any

import pytest

import eomgen

pytestmark = pytest.mark.slow


def slider(**keys: Any) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("slider").body("m", 1.0)
    return builder.joint("x", "prismatic", "base", "m", axis=[1, 0, 0], **keys)


def disc(**keys: Any) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("disc").body("w", 1.0, inertia=[1, 1, 1])
    return builder.joint("w", "revolute", "base", "w", axis=[0, 0, 1], **keys)


def built(builder: eomgen.SceneBuilder) -> eomgen.Model:
    return eomgen.build(builder.build(), profile="quick")


@functools.cache
def driven() -> eomgen.Model:
    return built(slider(drive="2*t"))


@functools.cache
def ball() -> eomgen.Model:
    builder = slider(initial={"position": 1.0}).effort("g", "x", -9.81).parameter("e", 0.8, tunable=True)
    when = {"when": "q.x", "direction": "falling", "action": "impact"}
    return built(builder.event("b", restitution="e", least_interval="2 s", **when))


def refused(builder: eomgen.SceneBuilder) -> str:
    with pytest.raises(eomgen.DescriptionError) as error:
        eomgen.derive(builder.build())
    return str(error.value)


# -- motions -----------------------------------------------------------------------------------------------------------


def test_a_sampled_loop_that_is_unstable_is_reported() -> None:
    loop = slider(initial={"position": 0.1}).state("f", sample="0.5 s", formula="-100*q.x-2*v.x")
    run = built(loop.effort("e", "x", "f")).simulate(10.0, 0.01)
    assert run.success
    assert "the motion grows without end: v.x by a factor of 1.5e+15" in run.message
    assert "gains, damping and stiffnesses, or a shorter time between samples" in run.message


def test_negative_damping_is_noted_and_its_growth_reported() -> None:
    scene = slider(stiffness=100, damping=-5, initial={"position": 0.1}).build()
    note = "joints.x.damping: the damping -5 is negative, and adds energy to every motion; 5 takes it away"
    assert note in scene.notes
    message = eomgen.build(scene, profile="quick").simulate(10.0, 0.01).message
    assert "the motion grows without end: v.x by a factor of 1.2e+08" in message
    assert "try: other signs or sizes of gains, damping and stiffnesses" in message
    assert "time between samples" not in message


def test_what_goes_far_without_growing_exponentially_is_left_alone() -> None:
    message = built(slider().effort("e", "x", "1e4 * t**3")).simulate(10.0, 0.01).message
    assert "grows without end" not in message


def test_multipliers_of_nothing_have_no_rounding() -> None:
    assert driven().simulate(0.2, 1e-3).message == "reached t = 0.2 s in 200 steps"


def test_an_initial_value_of_a_driven_joint_is_told_not_to_be_taken() -> None:
    message = driven().simulate(0.01, 1e-3, initial={"x": 0.5}).message
    assert "x: driven travel was off by 0.5: its drive prescribes it, and the initial value is not taken" in message
    assert "not taken" not in driven().simulate(0.01, 1e-3).message


def test_a_law_without_a_value_is_refused_with_its_time() -> None:
    model = built(slider(drive="sqrt(0.25-t)"))
    with pytest.raises(eomgen.UsageError, match=r"the driven travel has no value after t = 0\.25 s: a root, a log"):
        model.simulate(1.0, 1e-3)


def test_an_event_sooner_than_its_least_interval_names_the_key() -> None:
    message = ball().simulate(5.0, 1e-3).message
    assert "sooner than its least_interval of 2 s" in message and "try: a shorter least_interval, or an" in message


# -- values and keys ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [1.5, 80])
def test_a_restitution_above_one_is_refused(value: float) -> None:
    event = slider().event("b", when="q.x", action="impact", restitution=value)
    assert f"the restitution is {value}, and every impact would add energy; try: a number from 0 to 1" in refused(event)


def test_a_restitution_of_parameters_is_asked_for_at_every_call() -> None:
    with pytest.raises(eomgen.UsageError, match="the restitution is 2, and every impact would add energy at e = 2"):
        ball().simulate(0.01, 1e-3, parameters={"e": 2.0})


def test_a_logarithm_of_what_becomes_negative_is_no_jump() -> None:
    text = refused(slider(drive="0.1*log(0.25-t)"))
    assert "the driven travel has no value after t = 0.25 s" in text and "jumps" not in text
    assert "a formula that has one up to t = 10 s" in text


@pytest.mark.parametrize(
    ("drive", "pieces"),
    [
        ("3000 rpm", ("an angle in rad is expected", 'try: "314.159 * t" where it changes at that rate')),
        ("30 deg * t", ("formulas take numbers in SI, without units", 'try: "0.523599 * t"')),
    ],
)
def test_laws_with_units_get_the_law_in_si(drive: str, pieces: tuple[str, ...]) -> None:
    text = refused(disc(drive=drive))
    assert all(piece in text for piece in pieces), text


def test_a_speed_in_place_of_an_initial_angle_gets_no_law_of_time() -> None:
    assert "* t" not in refused(disc(initial={"position": "3000 rpm"}))


def test_a_number_for_a_table_gets_an_example() -> None:
    text = refused(slider(friction=0.3))
    assert "a table is needed here, not 0.3; try: friction = { coulomb = 0.3, velocity = 0.01 }" in text


# -- notes -------------------------------------------------------------------------------------------------------------


def notes(builder: eomgen.SceneBuilder) -> str:
    return " ".join(builder.build().notes)


def test_smoothing_without_jumps_is_noted() -> None:
    assert "joints.x.drive: smooth has no effect" in notes(slider(drive="0.1*sin(t)", smooth="10 ms"))
    assert not notes(slider(drive="1 if t > 1 else 0", smooth="10 ms"))


def test_a_frequency_written_as_a_time_between_samples_is_noted() -> None:
    note = 'states.f.sample: the time between two samples is 100 s; 100 a second are "0.01 s"'
    assert note in notes(slider().state("f", sample=100, formula="q.x"))
    assert not notes(slider().state("f", sample="100 s", formula="q.x"))
    assert not notes(slider().state("f", sample=5, formula="q.x"))


def test_a_delay_of_whole_seconds_is_noted() -> None:
    def delayed(delay: float | str) -> str:
        return notes(slider().state("f", sample="2 ms", formula="q.x", delay=delay))

    assert "states.f.delay: the delay 1 is 1 s, 500 samples" in delayed(1) and '"0.002 s"' in delayed(1)
    assert not delayed("1 s") and not delayed(0.004)
    assert not notes(slider().state("f", sample="100 ms", formula="q.x", delay=1))
