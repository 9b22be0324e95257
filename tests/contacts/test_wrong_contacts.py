"""Messages on contacts that are wrong, each with place, cause and remedy."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import pytest

import eomgen
from eomgen.errors import DescriptionError, UsageError
from eomgen.scene.load import from_data
from tests.contacts.pairs import contact, scene_of
from tests.contacts.test_tangential_laws import VAN

TEXT = """format = 1
name = "ball"
parameters.n = {{ value = 1.5, tunable = true }}
{more}
bodies.ball = {{ mass = 2, inertia = [0.1, 0.1, 0.1] }}
joints.ball = {{ type = "free", parent = "base", child = "ball" }}
{entry}"""
FLOOR = '{ body = "base", axis = [0, 0, 1] }'
GOOD = contact("floor", FLOOR, 'body = "ball"', "hunt_crossley", "bristles")

WRONG = {
    'shape = "sphere"': {
        'shape = "cube"': "(contacts.floor.shape): there is no shape 'cube'; try: ",
        'shape = "ellipsoid"': "(contacts.floor): the shape ellipsoid needs the key semi_axes; try: semi_axes =",
        'shape = "disc"': "(contacts.floor.second): a contact of the shape disc needs the axes of this frame",
        'shape = "torus"': "(contacts.floor): the shape torus needs the key tube_radius; try: tube_radius = 0.05",
        'shape = "sphere"\nhousing = "cylinder"': "(contacts.floor): a housing needs a clearance; try: clearance",
        'shape = "sphere"\nclearance = 1e-3': "(contacts.floor.clearance): a clearance needs a housing; try: housing",
        'shape = "sphere"\nsurface = "x + z"': "(contacts.floor.surface): the height of a surface depends on x and y",
    },
    'body = "ball"': {
        'body = "base"': "(contacts.floor.second): both frames are in the same rigid body: base; try: frames in two",
    },
    "radius = 0.4": {"radius = 0": "(contacts.floor.radius): the size of a shape is 0; try: a number above 0"},
    "stiffness = 1e4": {
        "stiffness = -1": "(contacts.floor.normal.stiffness): the stiffness of a contact is -1; try: a number above 0",
        "onset = 1": "(contacts.floor.normal): the type hunt_crossley needs the key stiffness; try: stiffness = 1e6",
        "stiffness = 1e4, onset = 1": "(contacts.floor.normal.onset): onset has no meaning for hunt_crossley",
        "modulus = 1e4": "(contacts.floor.normal.modulus): modulus has no meaning for hunt_crossley; try: type = hertz",
    },
    'type = "bristles", friction = 0.5': {
        'type = "brush", coefficients = { STIFFNESS = 15, FRICTION = 1 }': "(contacts.floor.tangential.type): brush is "
        'a law of wheels, and a sphere has no spin axis; try: "bristles" or "coulomb", or shape = "torus"',
    },
    'type = "bristles", friction = 0.5, damping = 0.2': {
        'type = "formula"': "(contacts.floor.tangential): the law has no force and no moment; try: force_x = ",
    },
    "friction = 0.5": {
        "friction = inf": "tangential.friction): a finite number is needed here, not inf; try: friction = 0.5",
        "friction = {}": "a number or a formula is needed here, not a table; try: friction = 0.5",
        "friction = -0.5": "(contacts.floor.tangential.friction): the friction of a contact is -0.5; try: 0 or more",
    },
}


@pytest.mark.parametrize(
    ("good", "wrong", "message"),
    [(good, wrong, message) for good, changes in WRONG.items() for wrong, message in changes.items()],
)
def test_what_a_wrong_contact_is_told(good: str, wrong: str, message: str) -> None:
    text = TEXT.format(more="", entry=GOOD.replace(good, wrong, 1))
    with pytest.raises(DescriptionError) as caught:
        scene_of(text)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("more", "force", "message"),
    [
        ("parameters.gap = 2.0", "1e4 * gap", "gap is the gap of the contact here, and a parameter is called so too"),
        ("", "1e4 * load", "unknown name 'load'"),
        ("", "normal_force.floor", "normal_force.floor cannot be used here"),
    ],
)
def test_names_of_own_formulas(more: str, force: str, message: str) -> None:
    entry = contact("floor", FLOOR, 'body = "ball"', f'type = "formula", force = "{force}"')
    with pytest.raises(DescriptionError) as caught:
        scene_of(TEXT.format(more=more, entry=entry))
    assert "contacts.floor.normal.force" in str(caught.value) and message in str(caught.value)


def test_states_have_names_of_their_own() -> None:
    with pytest.raises(DescriptionError, match="the contact makes the state floor_bristle_x, and there is a parameter"):
        scene_of(TEXT.format(more="parameters.floor_bristle_x = 1.0", entry=GOOD))


#: Keys of a contact with a good value, a value that is refused, and the cause and remedy.
BOUNDS: dict[str, tuple[Any, Any, str]] = {
    "radius": (0.4, -0.1, "the size of a shape is -0.1; try: a number above 0"),
    "clearance": (1e-3, 0.0, "the clearance of a housing is 0; try: a number above 0"),
    "tube_radius": (0.05, 0.0, "the size of a shape is 0"),
    "semi_axes": ([0.1, 0.2, 0.3], [0.1, "n", 0.3], "the size of a shape is -1"),
    "normal.linear.stiffness": (1e4, -1.0, "the stiffness of a contact is -1; try: a number above 0"),
    "normal.linear.damping": (10.0, -1.0, "the damping of a contact is -1; try: 0 or more"),
    "normal.linear.onset": (1e-4, 0.0, "the onset of a contact is 0; try: a number above 0"),
    "normal.hunt_crossley.exponent": (1.5, 0.9, "the exponent of a contact is 0.9; try: 1 to 3"),
    "normal.hunt_crossley.damping": (0.1, -0.1, "the damping of a contact is -0.1; try: 0 or more"),
    "normal.lankarani_nikravesh.restitution": (0.5, 1.1, "the coefficient of restitution is 1.1; try: 0 to 1"),
    "normal.lankarani_nikravesh.impact_velocity": (1.0, 0.0, "the speed of an impact is 0; try: a number above 0"),
    "normal.hertz.modulus": (1e9, -1.0, "the elastic modulus is -1; try: a number above 0"),
    "normal.hertz.curvature_radius": (0.1, 0.0, "a radius of curvature is 0; try: a number above 0"),
    "tangential.coulomb.friction": (0.5, -0.5, "the friction of a contact is -0.5; try: 0 or more"),
    "tangential.coulomb.velocity": (0.1, 0.0, "the regularisation velocity is 0; try: a number above 0"),
    "tangential.viscous.damping": (0.1, -1.0, "the damping of a contact is -1; try: 0 or more"),
    "tangential.bristles.friction": (0.5, -1.0, "the friction of a contact is -1; try: 0 or more"),
    "tangential.bristles.bristle_length": (1e-4, 0.0, "the deflection of bristles is 0; try: a number above 0"),
    "tangential.bristles.damping": (1.0, -1.0, "the damping of a contact is -1; try: 0 or more"),
    "tangential.bristles.release": (1e-3, 0.0, "the time of release is 0; try: a number above 0"),
    "tangential.brush.coefficients.STIFFNESS": (15.0, -1.0, "the coefficient STIFFNESS is -1; try: a number above 0"),
    "tangential.tmeasy.coefficients.DFX1": (9e4, 0.0, "the coefficient DFX1 is 0; try: a number above 0"),
    "tangential.tmeasy.coefficients.FXM1": (3300.0, -3300.0, "the coefficient FXM1 is -3300; try: a number above 0"),
    "tangential.tmeasy.coefficients.FXS2": (0.0, -1.0, "the coefficient FXS2 is -1; try: 0 or more"),
    "tangential.tmeasy.coefficients.SYE1": (0.35, 0.0, "the coefficient SYE1 is 0; try: a number above 0"),
    "tangential.brush.coefficients.FRICTION": (0.9, 0.0, "the coefficient FRICTION is 0; try: a number above 0"),
}
NEEDED: dict[str, dict[str, Any]] = {
    "linear": {"stiffness": 1e4},
    "hunt_crossley": {"stiffness": 1e4},
    "lankarani_nikravesh": {"stiffness": 1e4, "restitution": 0.5, "impact_velocity": 1.0},
    "hertz": {"modulus": 1e9, "curvature_radius": 0.1},
    "coulomb": {"friction": 0.5},
    "viscous": {},
    "bristles": {"friction": 0.5},
    "brush": {"coefficients": {"STIFFNESS": 15.0, "FRICTION": 0.9}},
    "tmeasy": {"coefficients": {**VAN, "LOAD": 3000.0}},
}
SHAPE_OF: dict[str, dict[str, Any]] = {
    "tube_radius": {"shape": "torus", "second": {"body": "ball", "axis": [0, 1, 0]}},
    "semi_axes": {"shape": "ellipsoid", "second": {"body": "ball", "axis": [0, 1, 0], "x_axis": [1, 0, 0]}},
    "clearance": {"housing": "sphere"},
}  # fmt: skip  # a table


def data_with(path: str, value: Any) -> dict[str, Any]:
    """Return a ball on a floor with a value at a path: the key, or table, law and key."""
    data = tomllib.loads(TEXT.format(more="", entry=GOOD))
    floor = data["contacts"]["floor"]
    table, *names = path.split(".")
    if not names:
        if table == "semi_axes":
            floor.pop("radius")
        return {**data, "contacts": {"floor": {**floor, **SHAPE_OF.get(table, {}), table: value}}}
    law, *keys = names
    if law in ("brush", "tmeasy"):  # laws of wheels
        floor |= {**SHAPE_OF["tube_radius"], "tube_radius": 0.05}
    place = floor[table] = {"type": law, **copy.deepcopy(NEEDED[law])}
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    return data


@pytest.mark.parametrize("path", BOUNDS)
def test_values_out_of_bounds_are_refused(path: str) -> None:
    good, wrong, message = BOUNDS[path]
    place = ".".join(["contacts.floor", *(part for k, part in enumerate(path.split(".")) if k != 1)])
    assert from_data(data_with(path, good)).elements
    data = data_with(path, wrong)
    data["parameters"]["n"] = -1.0
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    assert f"({place}" in str(caught.value) and message in str(caught.value)


@pytest.mark.parametrize("path", BOUNDS)
def test_requirements_of_tunable_keys_are_kept(path: str) -> None:
    """The rule, which every call applies."""
    good, wrong, message = BOUNDS[path]
    data = data_with(path, [0.1, "n", 0.3] if path == "semi_axes" else "n")
    data["parameters"]["n"] = {"value": 0.2 if path == "semi_axes" else good, "tunable": True}
    (requirement,) = [item for item in from_data(data).requirements if "floor" in item.where]
    number = -1.0 if path == "semi_axes" else wrong
    assert requirement.rule is not None and bool(requirement.rule.broken([number]))
    assert requirement.rule.fault([number])[0].split(" [")[0] in message


@pytest.mark.parametrize(("name", "wrong"), [("SXS1", 0.13913), ("SXS2", 0.1), ("SYS1", 0.0), ("SYS2", 0.01)])
def test_slips_of_sliding_are_above_slips_of_the_largest_force(name: str, wrong: float) -> None:
    """For numbers, and for tunable parameters in every call."""
    path, peak = f"tangential.tmeasy.coefficients.{name}", name.replace("S", "M").replace("M", "S", 1)
    with pytest.raises(DescriptionError, match=f"the coefficients do not satisfy {peak} < {name}; try: values that do"):
        from_data(data_with(path, wrong))
    data = data_with(path, "n")
    (requirement,) = [item for item in from_data(data).requirements if "floor" in item.where]
    assert requirement.rule is not None
    assert requirement.rule.broken([wrong - VAN[peak]]) and not requirement.rule.broken([1.5 - VAN[peak]])


@pytest.mark.slow
def test_a_call_checks_the_bounds_of_tunable_keys() -> None:
    model = eomgen.build(scene_of(TEXT.format(more="", entry=GOOD.replace("damping = 0.1", 'exponent = "n"'))))
    with pytest.raises(UsageError, match="the exponent of a contact is 0 at n = 0"):
        model.simulate(0.01, 1e-3, parameters={"n": 0.0})


@pytest.mark.slow
def test_a_valley_narrower_than_the_ball_is_told_at_the_start() -> None:
    entry = GOOD.replace("radius = 0.4", 'radius = 0.4\nsurface = "5 * x**2"')
    entry = entry.replace("axis = [0, 0, 1]", "axis = [0, 0, 1], x_axis = [1, 0, 0]")
    entry = entry.replace('body = "ball"', 'body = "ball", position = [0.05, 0, 0.41]')
    run = eomgen.build(scene_of(TEXT.format(more="", entry=entry))).simulate(0.01, 1e-3, method="rk4")
    assert not run.success and "as in a valley that is narrower than the body; try: a surface" in run.message


def test_a_ball_below_its_floor_is_noted() -> None:
    entry = GOOD.replace('body = "ball"', 'body = "ball", position = [0, 0, -0.1]')
    notes = scene_of(TEXT.format(more="", entry=entry)).notes
    assert any("contacts.floor: ball starts 0.1 m below the plane, and is moved to the side" in note for note in notes)
    assert not any("below the plane" in note for note in scene_of(TEXT.format(more="", entry=GOOD)).notes)


def test_a_force_that_depends_on_itself_is_told() -> None:
    """Through a controller; friction may depend on the normal force."""
    servo = 'controllers.servo = { type = "lead_lag", signal = "normal_force.floor", time_constant = 1, lead = 1 }'
    for force, told in (("1e4 * deflection + servo", True), ("1e4 * deflection", False)):
        laws = f'type = "formula", force = "{force}"', 'type = "formula", force_x = "-0.1 * load"'
        text = TEXT.format(more=servo, entry=contact("floor", FLOOR, 'body = "ball"', *laws))
        if told:
            with pytest.raises(DescriptionError, match=r"controllers\.servo uses contacts\.floor uses"):
                scene_of(text)
        else:
            assert scene_of(text).states


@pytest.mark.parametrize(
    ("word", "remedy"),
    [
        ("bristle_x", "bristles"),
        ("bristle_y_rate", "bristles"),
        ("slip_x", "linear or brush or tmeasy or magic_formula"),
        ("deflection_y", "linear or brush or tmeasy or magic_formula"),
    ],
)
def test_quantities_that_a_law_does_not_have_are_refused(word: str, remedy: str) -> None:
    """And quantities that are truly 0 without friction are 0."""
    entries = [contact("floor", FLOOR, 'body = "ball"', "hunt_crossley", law) for law in ("", "coulomb")]
    for entry in entries:
        with pytest.raises(DescriptionError) as caught:
            scene_of(TEXT.format(more=f'outputs.seen = {{ formula = "{word}.floor" }}', entry=entry))
        assert f"there is no contact 'floor' with {word} (column 1); try: {remedy} as the type of" in str(caught.value)
        more = 'outputs.seen = { formula = ["friction_force_x.floor", "moment_z.floor"] }'
        assert scene_of(TEXT.format(more=more, entry=entry)).outputs
    with pytest.raises(DescriptionError, match=f"there is no contact 'wall' with {word}"):
        scene_of(TEXT.format(more=f'outputs.seen = {{ formula = "{word}.wall" }}', entry=GOOD))


@pytest.mark.slow
def test_a_surface_without_a_value_is_told() -> None:
    entry = GOOD.replace("radius = 0.4", 'radius = 0.4\nsurface = "sqrt(x - 1)"')
    entry = entry.replace("axis = [0, 0, 1]", "axis = [0, 0, 1], x_axis = [1, 0, 0]")
    run = eomgen.build(scene_of(TEXT.format(more="", entry=entry))).simulate(0.01, 1e-3, method="rk4")
    assert "of the surface of floor sqrt(-1) has no value at x = 0; try: another start" in run.message


def test_scenes_without_contacts_have_no_names_of_contacts() -> None:
    with pytest.raises(DescriptionError, match="unknown quantity 'gap'"):
        scene_of(TEXT.format(more='outputs.seen = { formula = "gap.floor" }', entry=""))
