"""Methods of Hamiltonian systems: compositions of drifts and kicks, and of implicit midpoint steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from eomgen.errors import Problem, UsageError
from eomgen.integrators.compositions import Composition, composition_named
from eomgen.integrators.compositions import compositions as every_composition
from eomgen.scene.hamiltonian.document import Hamiltonian
from eomgen.text import listed, nearest

#: Kinds of parts of steps, by their numbers in C.
KINDS = ("DRIFT_FIRST", "KICK_FIRST", "MIDPOINT")
MIDPOINT = "implicit_midpoint"
#: Methods where the file and the caller name none: of separable systems, and of others.
STANDARD, STANDARD_IMPLICIT = "omf4", MIDPOINT


@dataclass(frozen=True)
class Method:
    """A method as its C takes it.

    Attributes
    ----------
    fractions : of a step, of drifts and kicks in turn or of implicit midpoint steps
    stability_limit : the largest stable step times the largest frequency; 0 where there is none
    """

    name: str
    order: int
    kind: Literal["DRIFT_FIRST", "KICK_FIRST", "MIDPOINT"]
    fractions: tuple[float, ...]
    source: str
    stability_limit: float = 0.0


def method_for(document: Hamiltonian, name: str, first: str = "drift") -> Method:
    """Return a method of a system by its name; the standard one for an empty name.

    Where H is T(p) + V(q), names are those of the table of compositions, and steps begin with a drift or a kick
    (``first``). Elsewhere, and for ``implicit_midpoint``, the leapfrogs of a recursion are implicit midpoint steps.

    Raises
    ------
    UsageError
        An unknown name, or a composition that needs drifts and kicks where there are none.
    """
    name = name or (STANDARD if document.separable else STANDARD_IMPLICIT)
    key = name.lower().replace("-", "_")
    if key == MIDPOINT:
        return Method(MIDPOINT, 2, "MIDPOINT", (1.0,), "Hairer, Lubich and Wanner 2006, section II.1")
    if first not in ("drift", "kick"):
        raise UsageError(Problem("first", f"a step begins with a drift or a kick, not with {first!r}", "drift"))
    composition = _composition(key, first)
    if document.separable:
        kind: Literal["DRIFT_FIRST", "KICK_FIRST"] = "DRIFT_FIRST" if first == "drift" else "KICK_FIRST"
        limit = composition.stability_limit
        return Method(composition.name, composition.order, kind, composition.fractions, composition.source, limit)
    if len(composition.leapfrogs) < 2:
        coupled = list(dict.fromkeys(term.name for term in document.terms if term.dependence == "coupled"))
        what = f"{composition.name} needs H = T(p) + V(q), and {listed(coupled)} depends on coordinates and momenta"
        hint = f"{MIDPOINT}, or yoshida4 or suzuki4, whose parts are implicit midpoint steps then"
        raise UsageError(Problem("method", what, hint))
    return Method(composition.name, composition.order, "MIDPOINT", composition.leapfrogs, composition.source)


def _composition(name: str, first: str) -> Composition:
    try:
        return composition_named(name, "drift" if first == "drift" else "kick")
    except UsageError as error:
        known = [MIDPOINT, *(item.name for item in every_composition())]
        hint = nearest(name, known)
        raise UsageError([Problem("method", f"there is no method {name!r} of Hamiltonian systems", hint)]) from error
