"""The contract of a force element."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.mechanics.forces.applied import law_of
from eomgen.products.testing.demands import PARTIALS, POWER, ContractError, check_c, demand, partials_error, power_error
from eomgen.products.testing.evaluation import Array
from eomgen.results.scenery import scenery
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.scene import Scene
from eomgen.scene.sections import sections_for


def check_force_element(scene: Scene, name: str, states: Mapping[str, Array] | None = None) -> None:
    """Check a force element in a scene.

    Demands: the law is the law of the element's class and gives the quantities that the section offers; the power that
    the law adds is the power of the forces (energy and power balance along the motion); partials agree with complex
    steps; builders have a method for the section; pictures show an element that is drawn; the generated C compiles
    without warnings.

    Parameters
    ----------
    scene : Scene
        With the element; further elements are checked, too.
    name : str
        Name of the element.
    states : mapping, optional
        Blocks ``q``, ``v``, ``t``, ... (n, size) of the states to look at; random ones if not given.

    Raises
    ------
    ContractError
        Naming the element, the demand, and the error.
    """
    named = [element for element in scene.elements if element.name == name]
    demand(bool(named), name, f"the scene {scene.name} has no such element")
    element = named[0]
    check_law_of_element(element)
    error = power_error(scene, states)
    demand(error <= POWER, name, f"the power of the law differs from the rate of energy by {error:.2g}, relative")
    error = partials_error(scene, states)
    demand(error <= PARTIALS, name, f"partials of the residual differ from complex steps by {error:.2g}, relative")
    derive(scene, ["outputs"])
    shown = scenery(describe(scene), {})
    drawn = {item["name"] for items in (shown["springs"], shown["tyres"]) for item in items}
    demand(
        (name in drawn) is (element.drawn() is not None),
        name,
        "pictures do not show the element as `drawn` of the class says",
    )
    check_c(scene)


def check_law_of_element(element: ForceElement) -> None:
    """Check that an element, the section and the law fit together. Raises ContractError."""
    kind = type(element)
    row = next((row for row in sections_for([kind.section]) if row.key == kind.section), None)
    if not isinstance(row, ElementSection):
        raise ContractError(f"{kind.section}: there is no such section of force elements")
    law = law_of(kind)
    demand(law.model is kind, kind.section, f"the law is of {law.model.__name__}, not of {kind.__name__}")
    given, offered = sorted(law.offers), sorted(row.offers)
    demand(given == offered, kind.section, f"the law offers {given}, and the section {offered}")
    method = row.method_name
    demand(callable(getattr(SceneBuilder("one"), method, None)), kind.section, f"builders have no method {method}")
