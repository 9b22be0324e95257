"""Methods that descriptions and callers name: their names, checked, and the parameters that a description gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.pipeline.documents import described_method
from eomgen.pipeline.scenes import SCENES

if TYPE_CHECKING:
    from eomgen.integrators.families.register import Method
    from eomgen.scene.scene import Scene
    from eomgen.system.description import Description


def method_of(scene: Scene, method: str | None) -> str:
    """Return the name of a method, or of the scene's. Raises UsageError or DescriptionError if there is none."""
    return method_name(SCENES.describe(scene), method)


def method_name(described: Description, method: str | None) -> str:
    """Return the requested method's name, or if None the described one's; the standard method for ``auto``. Raises
    UsageError or DescriptionError for an unknown name of a method."""
    from eomgen.integrators.families.register import AUTO, STANDARD, canonical_name  # noqa: PLC0415

    if (described.simulation.method if method is None else method) == AUTO:
        return STANDARD
    if method is not None:
        return canonical_name(method)
    return described_method(described.simulation, described.places.get("simulation.method", described.name))


def method_with_parameters(described: Description, method: str | None, *, for_runs: bool) -> Method:
    """Return a method (None: the described one) with the parameters in the description that the method has.

    Raises DescriptionError if the described method cannot take these parameters; a method that is not the described one
    gets the method's defaults then, and UsageError is raised without any.

    Parameters
    ----------
    for_runs : whether runs give the stepper its parameters, so that the parameters of the made stepper do not matter
    """
    from eomgen.integrators.families.register import method_compiled, method_named, method_parameters  # noqa: PLC0415

    name = method_name(described, method)
    try:
        return method_named(name, **method_parameters(name, {}, vars(described.simulation)))
    except UsageError as error:
        if name != method_name(described, None):
            return method_compiled(name) if for_runs else method_named(name)
        problems = []
        for p in error.problems:
            key = p.where.replace("method.", "simulation.")
            key = key if key in described.places else "simulation.method"
            problems.append(Problem(f"{described.places.get(key, described.name)} ({key})", p.what, p.hint))
        raise DescriptionError(problems) from None


def terms_of_step(scene: Scene, method: str) -> tuple[str, ...]:
    """Return the terms that a step of a method calls."""
    from eomgen.integrators.families.register import terms_of  # noqa: PLC0415

    return terms_of(method, is_constrained(scene), bool(scene.states))


def is_constrained(scene: Scene) -> bool:
    """Return whether the equations have constraints: of the scene, joints of absolute coordinates, drives of joints, or
    strains that a beam does not have."""
    beams = (getattr(element, "beam", None) for element in scene.elements)
    from_parts = [*(joint.drive for joint in scene.joints), *(getattr(beam, "absent_strains", ()) for beam in beams)]
    return bool(scene.constraints) or scene.coordinates == "absolute" or any(from_parts)
