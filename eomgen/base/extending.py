"""Names for other distributions: all that sections, force laws, words of formulas, joint types, integrators, sources,
targets and front ends of an installed package import of eomgen, as ``eomgen.extending``.

Each name is imported from its module on first use, so that a schema imports no tape, and a law no schema. Modules of
these names may move; the names here stay.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

#: Module below ``eomgen`` -> names.
_HOMES = {
    "base.arrays": ("Array",),
    "base.messages": ("key_of",),
    "base.verbs": ("Verb",),
    "codegen.targets.target": ("Target",),
    "errors": ("EomgenError", "Problem", "UsageError"),
    "formula.nodes": ("Formula", "Number", "Symbol"),
    "formula.words": ("Signature", "Word"),
    "integrators.families.family": (
        "BAD_ARGUMENT",
        "NOT_FINITE",
        "Family",
        "Field",
        "MethodName",
        "Setting",
        "Sizes",
        "Status",
    ),
    "integrators.families.needs": ("UNCONSTRAINED",),
    "mechanics.forces.loads": ("Law", "Loads", "push"),
    "mechanics.forces.symbols": ("Quantities",),
    "pipeline.front_end": ("FrontEnd",),
    "scene.forces.element": ("ForceElement",),
    "scene.forces.element_section": ("ElementSection",),
    "scene.joints.frames": ("Site",),
    "scene.formula.scope": ("FIXED_PARAMETERS", "PARAMETERS", "POSITIONS", "SPRING_FORCE", "TIME", "VELOCITIES"),
    "scene.joint_types": ("Connection", "ElementaryMotion"),
    "scene.reading.key_metadata": ("Table", "key", "of_fixed_parameters", "of_parameters", "optional"),
    "scene.reading.kinds": ("Description", "Triple", "Value", "Values"),
    "scene.reading.requirements": ("above_zero", "not_below_zero"),
    "scene.section": ("Reading", "Section"),
    "scene.sources.source": ("Source",),
    "symbolic.operations": ("Op",),
    "symbolic.scalar": ("Algebra", "Scalar", "apply", "dot", "minus", "scaled", "transpose"),
    "system.system": ("System",),
}
#: Names that two modules have, under another one here: vectors of formulas, and of numbers on the tape.
_RENAMED = {"FormulaVector": ("formula.nodes", "Vector"), "Vector": ("symbolic.scalar", "Vector")}
#: Module below ``eomgen`` and name there, by name.
PLACES = {name: (module, name) for module, names in _HOMES.items() for name in names} | _RENAMED

__all__ = sorted(PLACES)  # noqa: PLE0605  # one list of the names


def __getattr__(name: str) -> Any:
    """Import a name from its module."""
    if name not in PLACES:
        raise AttributeError(f"module 'eomgen.extending' has no attribute {name!r}")
    module, attribute = PLACES[name]
    globals()[name] = value = getattr(import_module(f"eomgen.{module}"), attribute)
    return value


def __dir__() -> list[str]:
    return __all__
