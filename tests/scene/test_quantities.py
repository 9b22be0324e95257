"""The walk over the quantities of a scene: keys, units by type and component, owners."""

from __future__ import annotations

import tomllib

from eomgen.scene.document.quantities import quantities

SCENE = """
format = 1
name = "cart"
gravity = [0.0, 0.0, -9.81]
parameters.k = { value = 20.0, unit = "N/m" }
bodies.cart = { mass = 2.0, inertia = [0.1, 0.2, 0.3] }
joints.rail = { type = "prismatic", parent = "base", child = "cart", axis = [1.0, 0.0, 0.0], damping = "2*k" }
joints.hinge = { type = "revolute", parent = "cart", child = "arm", axis = [0.0, 1.0, 0.0], damping = 0.3 }
bodies.arm = { mass = 1.0 }
states.filter = { unit = "m", rate = "(q.rail - filter)/0.1" }
"""


def test_quantities_have_key_unit_value_and_owner() -> None:
    found = {quantity.key: quantity for quantity in quantities(tomllib.loads(SCENE))}
    assert found["bodies.cart.inertia[2]"].value == 0.3 and found["bodies.cart.inertia[2]"].unit == "kg m^2"
    assert found["bodies.cart.mass"].owner == ("bodies", "cart") and found["bodies.cart.mass"].unit == "kg"
    assert found["gravity[2]"].owner == () and found["gravity[2]"].unit == "m/s^2"
    assert found["parameters.k.value"].unit == "N/m"
    assert found["states.filter.rate"].unit == "m/s"


def test_units_follow_the_type_of_the_entry() -> None:
    found = {quantity.key: quantity.unit for quantity in quantities(tomllib.loads(SCENE))}
    assert (found["joints.rail.damping"], found["joints.hinge.damping"]) == ("N s/m", "N m s/rad")


def test_fields_can_be_left_out() -> None:
    found = {quantity.field for quantity in quantities(tomllib.loads(SCENE), frozenset(["parameters", "rate"]))}
    assert "mass" in found and not {"value", "rate"} & found


def test_an_entry_in_its_short_form_is_the_value_of_one_key() -> None:
    (found,) = quantities({"definitions": {"hit": "q.rail - 2"}})
    assert (found.key, found.field, found.owner, found.value) == (
        "definitions.hit", "formula", ("definitions", "hit"), "q.rail - 2",
    )  # fmt: skip  # a row
