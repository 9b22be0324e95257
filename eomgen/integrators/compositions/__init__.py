"""Symplectic compositions of drifts and kicks: coefficients by rule, stability limits, errors."""

__all__ = ["Composition", "composition_named", "compositions", "leapfrog_recursion", "names_composition"]

from eomgen.integrators.compositions.composition import Composition
from eomgen.integrators.compositions.table import (
    composition_named,
    compositions,
    leapfrog_recursion,
    names_composition,
)
