"""Methods of Hamiltonian systems: compositions of drifts and kicks, Runge-Kutta methods, and collocation at Gauss's
points: symplectic and symmetric implicit steps of any even order, for any H."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Iterator
from itertools import chain
from typing import Any, Literal, get_args

import numpy as np
from numpy.polynomial import Legendre

from eomgen.base.data import dataclass
from eomgen.base.messages import listed, nearest
from eomgen.base.products import fault_of_removed
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.integrators.compositions import composition_named, names_composition
from eomgen.integrators.compositions import compositions as every_composition
from eomgen.integrators.families.embedded_pair import DORMAND_PRINCE
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.products.fields.documents.document import Hamiltonian


@functools.cache
def gauss_collocation(stages: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return A, row by row, and b of the Runge-Kutta method whose stages are at the roots of the Legendre polynomial.

    A has ``stages``^2 numbers, b ``stages``. The order is twice the number of stages; one stage is the implicit
    midpoint rule. Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), sections II.1.3 and VI.4.2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(stages)
    # column j: weight j times the sum over k of (2 k + 1) P_k(node j) times the integral of P_k, on [-1, 1]
    series = [Legendre.basis(k) for k in range(stages)]
    integrals = np.array([polynomial.integ(lbnd=-1)(nodes) for polynomial in series])
    values = np.array([(2 * k + 1) * polynomial(nodes) for k, polynomial in enumerate(series)])
    A = np.einsum("ki,kj,j->ij", integrals, values, weights) / 4
    return tuple(A.ravel().tolist()), tuple((weights / 2).tolist())


#: Kinds of parts of steps; the index is the number in C.
Kind = Literal["DRIFT_FIRST", "KICK_FIRST", "COLLOCATION", "EXPLICIT", "PAIR"]
KINDS: tuple[Kind, ...] = get_args(Kind)
MIDPOINT = "implicit_midpoint"
_STAGES = {MIDPOINT: 1, **{f"gauss{2 * stages}": stages for stages in range(2, 7)}}
_SOURCE = "Hairer, Lubich and Wanner 2006, section II.1"
#: Default methods: for separable systems, and for other systems.
STANDARD, STANDARD_IMPLICIT = "omf4", "gauss6"


@dataclass(frozen=True)
class Method:
    """A method in the form required by the C templates.

    Attributes
    ----------
    fractions : of a step, of drifts and kicks in turn or of other steps
    stability_limit : the largest stable step times the largest frequency; 0 if there is none
    stages : of other steps than drifts and kicks
    A, b, error : coefficients of the stages, A by rows; for pairs the weights of the error estimate
    """

    name: str
    order: int
    kind: Kind
    fractions: tuple[float, ...]
    source: str
    stability_limit: float = 0.0
    stages: int = 0
    A: tuple[float, ...] = ()
    b: tuple[float, ...] = ()
    error: tuple[float, ...] = ()

    @property
    def is_composition(self) -> bool:
        """Whether steps consist of drifts and kicks."""
        return self.stages == 0

    @property
    def chooses_steps(self) -> bool:
        """Whether steps are chosen by a tolerance."""
        return self.kind == "PAIR"

    @property
    def gradients(self) -> int:
        """Evaluations of forces in a step of a composition; 0 for other methods."""
        return len(self.fractions) // 2 if self.is_composition else 0

    def work(self, n: int) -> int:
        """Return the number of doubles of working memory that the C needs for steps of n coordinates: 0 for drifts and
        kicks."""
        if self.is_composition:
            return 0
        vectors = krylov(n)
        return 2 * n * (1 + self.stages * (8 + vectors)) + (vectors + 1) * (vectors + 3)


def _explicit(name: str, kind: Kind, source: str, tableau: Any, order: int, **more: Any) -> Method:
    """Return the explicit Runge-Kutta method of a tableau (with ``A`` by rows and ``b``) in the form of the C
    templates."""
    A, b = (tuple(map(float, chain(*rows))) for rows in (tableau.A, [tableau.b]))
    return Method(name, order, kind, (1.0,), source, stages=len(b), A=A, b=b, **more)


_PAIR = DORMAND_PRINCE
_ERROR = tuple(float(x - y) for x, y in zip(_PAIR.b, _PAIR.b_hat, strict=True))
#: Methods of Runge and Kutta by name. The limit of the fourth order on the imaginary axis is the root of 8.
EXPLICIT = {
    "rk4": _explicit("rk4", "EXPLICIT", "Kutta 1901", RUNGE_KUTTA_MUNTHE_KAAS_4, 4, stability_limit=math.sqrt(8.0)),
    "rk45": _explicit(_PAIR.name, "PAIR", _PAIR.source, _PAIR, _PAIR.order, error=_ERROR),
}


#: Names of methods in other programs, and equal methods or substitutes here.
ELSEWHERE = {
    "velocity_verlet": 'leapfrog, which first="kick" begins with a kick',
    "stormer_verlet": "leapfrog",
    "symplectic_euler": "leapfrog, which costs the same",
    "forest_ruth": "yoshida4",
    "midpoint": MIDPOINT,
    "gauss2": MIDPOINT,
    "gauss_legendre": "gauss4, gauss6 or gauss8",
    "dop853": "rk45, or kahan_li8",
    "taylor": "gauss12 or kahan_li8, or rk45, which chooses its steps",
    "ias15": "gauss12 or kahan_li8, or rk45, which chooses its steps",
}


def krylov(n: int) -> int:
    """Return the largest number of Krylov vectors in an implicit step with n coordinates: the unknowns, at most 160,
    and as many as have two million entries together (at least 30)."""
    return min(2 * n * max(_STAGES.values()), 160, max(30, 2_000_000 // (2 * n)))


def method_for(document: Hamiltonian, name: str | None = None, first: str = "drift") -> Method:
    """Return a method of a system by name; by default the method of the file, or the standard method.

    If H is T(p) + V(q), names refer to the table of compositions, and steps begin with a drift or a kick
    (``first``). Otherwise the leapfrogs of a recursion are implicit midpoint steps. ``implicit_midpoint`` and
    ``gauss<order>`` take any H, as do ``rk4`` and ``rk45``, which are not symplectic.

    Raises
    ------
    UsageError
        An unknown name, or a composition of drifts and kicks for an H that is not T(p) + V(q).
    DescriptionError
        The same fault in the method of the file.
    """
    standard = STANDARD if document.separable else STANDARD_IMPLICIT
    if name is None:
        with method_of_file(document):
            return method_for(document, document.simulation.method or standard, first)
    if not isinstance(name, str) or not name:
        hint = f'"{standard}", or no method at all'
        raise UsageError(Problem("method", f"a method is called by its name, not {name!r} [E0776]", hint))
    key = name.lower().replace("-", "_")
    if stages := _STAGES.get(key):
        return _collocation(key, 2 * stages, (1.0,), _SOURCE, stages)
    if key in EXPLICIT:
        return EXPLICIT[key]
    if first not in ("drift", "kick"):
        raise UsageError(Problem("first", f"a step begins with a drift or a kick, not with {first!r} [E0329]", "drift"))
    check_name(key)
    try:
        composition = composition_named(key, "drift" if first == "drift" else "kick")
    except UsageError as error:
        raise UsageError([Problem("method", problem.what, problem.hint) for problem in error.problems]) from None
    if document.separable:
        kind: Kind = "DRIFT_FIRST" if first == "drift" else "KICK_FIRST"
        limit = composition.stability_limit
        return Method(composition.name, composition.order, kind, composition.fractions, composition.source, limit)
    if len(composition.leapfrogs) < 2:
        fault = f"{composition.name} needs H = T(p) + V(q), and {listed(document.coupled_terms)} depends on coordinates"
        fault += " and momenta [E0778]"
        hint = f"{MIDPOINT}, gauss4 or gauss6, or yoshida4 or suzuki4, whose parts are implicit midpoint steps then"
        raise UsageError(Problem("method", fault, hint))
    return _collocation(composition.name, composition.order, composition.leapfrogs, composition.source, 1)


def check_name(name: str) -> None:
    """Raise UsageError if no method has a name; makes no method."""
    key = name.lower().replace("-", "_")
    if not (key in _STAGES or key in EXPLICIT or names_composition(key)):
        known = [*(item.name for item in every_composition()), *_STAGES, *EXPLICIT]
        unknown = f"there is no method {key!r} of Hamiltonian systems [E0779]", nearest(key, known, ELSEWHERE)
        raise UsageError([Problem("method", *(fault_of_removed("method", key) or unknown))])


@contextlib.contextmanager
def method_of_file(document: Hamiltonian) -> Iterator[None]:
    """Within a ``with`` statement, change errors about the method to name its line in the file, if there is one."""
    try:
        yield
    except UsageError as error:
        if not document.method_place or any(problem.where != "method" for problem in error.problems):
            raise
        problems = [Problem(document.method_place, problem.what, problem.hint) for problem in error.problems]
        raise DescriptionError(problems) from None


def _collocation(name: str, order: int, fractions: tuple[float, ...], source: str, stages: int) -> Method:
    A, b = gauss_collocation(stages)
    return Method(name, order, "COLLOCATION", fractions, source, stages=stages, A=A, b=b)
