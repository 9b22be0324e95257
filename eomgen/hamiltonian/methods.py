"""Methods of Hamiltonian systems: compositions of drifts and kicks, and of implicit steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from eomgen.errors import Problem, UsageError
from eomgen.hamiltonian.collocation import HIGHEST_ORDER, gauss_collocation
from eomgen.integrators.compositions import Composition, composition_named
from eomgen.integrators.compositions import compositions as every_composition
from eomgen.scene.hamiltonian.document import Hamiltonian
from eomgen.text import listed, nearest

#: Kinds of parts of steps, by their numbers in C.
KINDS = ("DRIFT_FIRST", "KICK_FIRST", "COLLOCATION")
MIDPOINT = "implicit_midpoint"
_OF_GAUSS = tuple(f"gauss{order}" for order in range(4, HIGHEST_ORDER + 1, 2))
#: Vectors at most of the Krylov subspace in which linear equations of implicit steps are solved, numbers that they may
#: take together, and vectors that there always are.
_MOST_VECTORS, _MOST_NUMBERS, _FEWEST_VECTORS = 160, 2_000_000, 30
_SOURCE = "Hairer, Lubich and Wanner 2006, section II.1"
#: Methods where the file and the caller name none: of separable systems, and of others.
STANDARD, STANDARD_IMPLICIT = "omf4", MIDPOINT


@dataclass(frozen=True)
class Method:
    """A method as its C takes it.

    Attributes
    ----------
    fractions : of a step, of drifts and kicks in turn or of implicit steps
    stability_limit : the largest stable step times the largest frequency; 0 where there is none
    stages : of implicit steps, which are collocation at Gauss's points
    """

    name: str
    order: int
    kind: Literal["DRIFT_FIRST", "KICK_FIRST", "COLLOCATION"]
    fractions: tuple[float, ...]
    source: str
    stability_limit: float = 0.0
    stages: int = 0

    @property
    def implicit(self) -> bool:
        """Whether steps solve equations."""
        return self.stages > 0

    def work(self, n: int) -> int:
        """Return how many numbers of memory steps of n coordinates need: of drifts and kicks none."""
        vectors = krylov(n)
        of_vectors = 2 * n * (1 + self.stages * (8 + vectors))
        return of_vectors + (vectors + 1) * (vectors + 3) if self.implicit else 0

    @property
    def A(self) -> tuple[float, ...]:
        """Coefficients of implicit steps, stages x stages by rows."""
        return gauss_collocation(self.stages)[0] if self.stages else ()

    @property
    def b(self) -> tuple[float, ...]:
        """Weights of the stages of implicit steps."""
        return gauss_collocation(self.stages)[1] if self.stages else ()


def krylov(n: int) -> int:
    """Return the vectors of the Krylov subspace for steps of n coordinates: as many as unknowns where these are few."""
    return min(HIGHEST_ORDER * n, _MOST_VECTORS, max(_FEWEST_VECTORS, _MOST_NUMBERS // (2 * n)))


def method_for(document: Hamiltonian, name: str, first: str = "drift") -> Method:
    """Return a method of a system by its name; the standard one for an empty name.

    Where H is T(p) + V(q), names are those of the table of compositions, and steps begin with a drift or a kick
    (``first``). Elsewhere the leapfrogs of a recursion are implicit midpoint steps. ``implicit_midpoint`` and
    ``gauss<order>`` take any H.

    Raises
    ------
    UsageError
        An unknown name, or a composition that needs drifts and kicks where there are none.
    """
    name = name or (STANDARD if document.separable else STANDARD_IMPLICIT)
    key = name.lower().replace("-", "_")
    if key == MIDPOINT:
        return Method(MIDPOINT, 2, "COLLOCATION", (1.0,), _SOURCE, stages=1)
    if key in _OF_GAUSS:
        order = int(key.removeprefix("gauss"))
        return Method(key, order, "COLLOCATION", (1.0,), _SOURCE, stages=order // 2)
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
        hint = f"{MIDPOINT}, gauss4 or gauss6, or yoshida4 or suzuki4, whose parts are implicit midpoint steps then"
        raise UsageError(Problem("method", what, hint))
    return Method(
        composition.name, composition.order, "COLLOCATION", composition.leapfrogs, composition.source, stages=1
    )


def _composition(name: str, first: str) -> Composition:
    try:
        return composition_named(name, "drift" if first == "drift" else "kick")
    except UsageError as error:
        known = [MIDPOINT, *_OF_GAUSS, *(item.name for item in every_composition())]
        hint = nearest(name, known)
        raise UsageError([Problem("method", f"there is no method {name!r} of Hamiltonian systems", hint)]) from error
