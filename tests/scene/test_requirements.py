"""What values must be: one table for the scene as it is read and for parameters that a call gives, with a row for every
key."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from eomgen.compiled.arguments import Requirements
from eomgen.errors import DescriptionError, UsageError
from eomgen.mechanics.describe import describe
from eomgen.pipeline.readings import from_text, to_text
from eomgen.scene.joints.moved_inertia import MovableInertia
from eomgen.scene.load import from_data
from eomgen.scene.reading.requirements import BOUNDS, RELATIONS, UNBOUNDED, Row, bound_of
from eomgen.scene.sections import bounds_of, own_sections
from tests.models import library
from tests.scene.every_value import Path, key_at, number_at, parameter_keys, places, scene_of, scene_with, without_value

KEYS = set(parameter_keys())
#: Without numbers that are fixed when the scene is read.
ALL_BOUNDS = {key: row for key, row in bounds_of(own_sections()).items() if key in KEYS or key in BOUNDS}
#: Formulas that have the value N where X is 1, and all that a value can be wrong by elsewhere.
FORMULAS = ("N * X", "N + X - 1", "N / X", "N * sqrt(X)", "-N + 2 * N * X")
VALUES = (0.0, -1.0, 2.0, 1e-3, 1e3, -1e-6, 0.5)
#: Sections for pictures alone, whose values no run refuses: a picture does (``test_shapes``).
DRAWN = {row.key for row in own_sections() if row.drawn}
OF_RUNS = tuple(place for place in places() if place[0] not in DRAWN)


def test_every_key_of_parameters_has_a_row_or_may_be_any_number() -> None:
    any_number = UNBOUNDED | {
        f"{row.key}.{key}" for row in own_sections() for key, bound in row.bounds.items() if bound is None
    }
    assert set(ALL_BOUNDS) | any_number == KEYS and not set(ALL_BOUNDS) & any_number
    related = {key for row in RELATIONS.values() for key in row.keys}
    assert related <= KEYS


def test_the_scene_of_this_test_has_every_key() -> None:
    assert {key_at(place) for place in places()} == KEYS
    assert from_data(scene_with(("joints", "hinge", "damping"), 0.1)).requirements == ()


@pytest.mark.parametrize("key", ALL_BOUNDS)
def test_values_out_of_bounds_are_refused_and_those_within_are_not(key: str) -> None:
    """By themselves: just beyond the bound, far beyond it, and within it."""
    row = ALL_BOUNDS[key]
    assert all(bound_of(key.replace(".", ".entry.", 1) + place, ALL_BOUNDS) is row for place in ("", "[2]"))
    good = next(number_at(place) for place in places() if key_at(place) == key)
    assert not row.broken([good]) or good == 0.0
    zero, negative = bool(row.broken([0.0])), bool(row.broken([-1e-9]))
    assert (zero, negative) in {(True, True), (False, True), (True, False)} and negative == bool(row.broken([-1e9]))
    flags = row.broken([np.array([1e-9, 0.0, -1e-9])])
    np.testing.assert_array_equal(flags, [key == "contacts.normal.exponent", zero, negative])  # above 1
    assert "{" not in row.fault([-0.5])[0] and row.fault([-0.5])[1]


@pytest.mark.parametrize("row", [*ALL_BOUNDS.values(), *RELATIONS.values()], ids=lambda row: row.keys[0])
def test_files_store_rules_by_name(row: Row) -> None:
    """A lambda, or a function within another one, has no name by which a file could store it."""
    again = from_text(to_text(row))
    assert again == row
    numbers = [-0.5] * (6 if row.keys == ("bodies.inertia",) else 3 if row.keys == ("beams.rotary_inertia",) else 2)
    numbers = numbers[: 1 if row.stage == 0 or (len(row.keys) == 1 and len(numbers) == 2) else None]
    assert again.fault(numbers) == row.fault(numbers) and again.broken(numbers) == row.broken(numbers)


def test_files_store_rules_of_sections() -> None:
    """Rules that sections make of several parts, by a formula at one place of each key of a scene."""
    there = {key_at(place): place for place in OF_RUNS}
    kept = from_data(scene_of({place: formula_at(place, "N * X") for place in there.values()})).requirements
    text = to_text(kept)
    assert len(kept) > len(there) and to_text(from_text(text)) == text


def refusal_at_build(place: Path, formula: str, X: float) -> set[str]:
    try:
        from_data(scene_with(place, formula, X))
    except DescriptionError as error:
        return {without_value(str(problem)) for problem in error.problems}
    return set()


def refusal_at_run(checked: Requirements, parameters: np.ndarray) -> set[str]:
    try:
        checked.check(parameters)
    except UsageError as error:
        assert all(" at X = " in problem.what for problem in error.problems)
        return {without_value(str(problem)) for problem in error.problems}
    return set()


def formula_at(place: Path, kind: str) -> str:
    number = number_at(place)
    return kind.replace("N", f"({number!r})") if number or kind == "N + X - 1" else "X - 1"


def compare(place: Path, kind: str, values: Iterable[float]) -> bool:
    """Hold values given to a call against the same values in the scene; return whether all were refused."""
    formula = formula_at(place, kind)
    checked = Requirements(describe(from_data(scene_with(place, formula))), ("X",))
    refused = []
    for X in values:
        at_build, at_run = refusal_at_build(place, formula, X), refusal_at_run(checked, np.array([X]))
        assert bool(at_run) == bool(at_build) and at_run <= at_build, (place, formula, X, at_build, at_run)
        assert refusal_at_run(checked, np.array([[1.0], [X], [1.0]])) == at_run
        refused.append(bool(at_run))
    return all(refused)


@pytest.mark.long_except_every(32)
@pytest.mark.slow_except("beams.section.elastic_modulus")
@pytest.mark.parametrize("key", dict.fromkeys(key_at(place) for place in OF_RUNS))
def test_a_call_refuses_what_the_scene_refuses_in_the_same_words(key: str, rng: np.random.Generator) -> None:
    """At one place of each key, by a random formula: whatever refuses a value in the scene, by itself or with
    others."""
    there = [place for place in OF_RUNS if key_at(place) == key]
    place = there[rng.integers(len(there))]
    kind = FORMULAS[rng.integers(len(FORMULAS))]
    compare(place, kind, [float(rng.choice(VALUES))])


#: Places, formulas and values of X, with what a call is told.
TOLD: dict[tuple[Path, str, float], str] = {
    (
        ("bodies", "slider", "mass"),
        "X",
        -1.0,
    ): "(bodies.slider.mass): the mass -1 is negative at X = -1; try: a positive",
    (
        ("joints", "sleeve", "limits", "lower", 1),
        "-2 * X",
        -1.5,
    ): "(joints.sleeve.limits[1]): the lower limit 3 m is not"
    " below the upper one, 2 m at X = -1.5; try: lower below upper",
    (
        ("bodies", "slider", "mass"),
        "X",
        0.0,
    ): "(joints.rail): the joint rail cannot be moved by a force: it carries neither"
    " mass nor inertia, so the inertia matrix is singular at X = 0; try: mass or inertia for the body slider",
    (
        ("points", "end", "position", 0),
        "sqrt(X)",
        -1.0,
    ): "(points.end.position[0]): sqrt(-1) has no finite value at X = -1",
}


@pytest.mark.parametrize(("asked", "message"), TOLD.items(), ids=lambda value: str(value)[:40])
def test_what_a_call_is_told(asked: tuple[Path, str, float], message: str) -> None:
    place, formula, X = asked
    checked = Requirements(describe(from_data(scene_with(place, formula))), ("X",))
    with pytest.raises(UsageError) as caught:
        checked.check(np.array([X]))
    assert len(caught.value.problems) == 1
    assert str(caught.value).startswith(f"usage error: scene {message}")


def test_bodies_without_mass_in_absolute_coordinates() -> None:
    scene = library.scene(
        "pendulum",
        coordinates="absolute",
        parameters={"X": {"value": 1.0, "tunable": True}},
        bodies__rod={"mass": "X", "inertia": [1, 1, 1]},
    )
    checked = Requirements(describe(from_data(scene)), ("X",))
    fault = r"\(bodies.rod\): in absolute coordinates the body rod has a free joint, and the bodies that it carries"
    with pytest.raises(UsageError, match=fault):
        checked.check(np.array([0.0]))


def test_followers_without_mass_leave_nothing_to_move() -> None:
    """Of a group that moves together one inertia is enough, and a multiplier of zero leaves the group."""
    scene = scene_with(("bodies", "follower", "mass"), "X")
    scene["bodies"]["follower"]["inertia"] = [0.0, 0.0, 0.0]
    scene["joints"]["follow"]["mimic"]["multiplier"] = "Y"
    scene["parameters"]["Y"] = {"value": 0.5, "tunable": True}
    checked = Requirements(describe(from_data(scene)), ("X", "Y"))
    checked.check(np.array([[1.0, 0.5], [1e-3, -2.0]]))
    with pytest.raises(UsageError, match=r"neither it nor its followers carry mass or inertia.* at X = 0, Y = 0\.5"):
        checked.check(np.array([[1.0, 0.5], [0.0, 0.5]]))
    with pytest.raises(UsageError, match="the joint lead cannot be moved by a force: it carries neither mass nor"):
        checked.check(np.array([1.0, 0.0]))


@pytest.mark.slow
def test_no_check_where_a_scene_requires_nothing() -> None:
    """A tunable spring may have any stiffness: nothing is kept, and nothing evaluated."""
    assert from_data(scene_with(("springs", "coil", "stiffness"), "X")).requirements == ()
    assert len(from_data(scene_with(("springs", "coil", "stiffness"), "X / 2")).requirements) == 1
    mass, moved = from_data(scene_with(("bodies", "slider", "mass"), "X")).requirements
    assert mass.rule is BOUNDS["bodies.mass"] and isinstance(moved.rule, MovableInertia)


def test_the_first_set_of_a_batch_that_is_wrong_is_named() -> None:
    checked = Requirements(describe(from_data(scene_with(("bodies", "slider", "mass"), "X"))), ("X",))
    batch = np.random.default_rng(1).uniform(0.1, 2.0, (20_000, 1))
    checked.check(batch)
    batch[12_345], batch[17_000] = -3.0, -4.0
    with pytest.raises(UsageError, match=r"the mass -3 is negative at X = -3"):
        checked.check(batch.reshape(4, 5000, 1))
