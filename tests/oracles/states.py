"""Random states and derivatives by complex steps, as ``eomgen.testing`` has them."""

from eomgen.products.testing.states import (
    STEP,
    derivative,
    displaced,
    jacobian,
    on_base,
    quaternion_product,
    random_states,
    random_unit_quaternions,
    rotation_of,
)

__all__ = [
    "STEP",
    "derivative",
    "displaced",
    "jacobian",
    "on_base",
    "quaternion_product",
    "random_states",
    "random_unit_quaternions",
    "rotation_of",
]
