"""Symplectic compositions of drifts and kicks: coefficients by rule, order conditions, stability limits, errors."""

__all__ = ["Composition", "composition_named", "compositions", "leapfrog_recursion", "names_composition", "order_of"]

from eomgen.integrators.compositions.composition import Composition, order_of
from eomgen.integrators.compositions.table import (
    composition_named,
    compositions,
    leapfrog_recursion,
    names_composition,
)
