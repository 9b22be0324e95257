"""Controllers around the inverse dynamics of a robot: packages of ROS 2, and C in float for microcontrollers."""

from eomgen.base.products import Product

__all__ = []

_MODULE = "eomgen.products.controllers.computed_torque"
PRODUCT = Product(rows={"eomgen.targets": (f"{_MODULE}:ROS2", f"{_MODULE}:CORTEX_M4")})
