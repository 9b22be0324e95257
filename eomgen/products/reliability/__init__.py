"""Random processes of scenes, and distributions of responses to them: random vibration, tails, reliability."""

from eomgen.base.products import Product

__all__ = ["section"]

PRODUCT = Product(
    names={name: f"eomgen.products.reliability.vibration:{name}" for name in ("RandomVibration", "random_vibration")},
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["random_processes", "vibration"]
