"""A compiled model at rest as sparse equations in a load factor for all loads or for one parameter; section forces of
geometrically exact beams are extrapolated from the strains of their elements.

In a step of Newton's method strains change to second order in addition to their linear change, and a stiff section
makes large forces of that, which spoil the next tangent. With the section forces of the linear change in the geometric
part of the tangent instead, slender beams take as many steps as others: D. Magisano, L. Leonetti and G. Garcea, Comput.
Methods Appl. Mech. Engrg. 313 (2017) 986.

An element between frames A and B has d = log(H_A^-1 H_B), d' = T^-1(d) v_B - T^-1(-d) v_A, and its nodes take D^T s by
the section forces s, D being the derivative of d along both twists.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import nearest, shown
from eomgen.compiled.rest.driven_rest import held_base
from eomgen.compiled.rest.sparse_partials import SparsePartials, sparse_partials, whole_partials
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.compiled.terms import Inputs, Parameters, TermsAt
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import symbols
from eomgen.lie import numeric
from eomgen.lie.few_poses import differences, slopes
from eomgen.lie.groups import SE3
from eomgen.lie.product import update
from eomgen.solvers.bordered_newton import WHOLE, Balance, LoadedState, LoadedStatics, Matrix, Tangents, sparse
from eomgen.system.description import BASE, ElementStiffness

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Step of differences of poses, rad or m.
_SMALL = 1e-6
#: Name of the last elements in the results that are kept with a library.
_KEPT = "element strains"


class ElementStrains:
    """All elements of a model's geometrically exact beams, at one set of parameters.

    Attributes
    ----------
    stiffness : (elements, 6, 6) section forces by change of d: stiffness by length
    """

    def __init__(self, model: CompiledModel, p: Array, arguments: dict[str, Any]) -> None:
        """Prepare all elements of the beams at parameters p (np,); ``arguments`` are t, parameters and base, as of
        ``model.evaluate``."""
        self.model = model
        beams = model.description.element_stiffness
        self._mentioned = _stiffness_parameters(beams)
        self.stiffness = np.zeros((0, 6, 6))
        self._values: dict[str, float] | None = None
        self._set(p, arguments)
        number = {name: index for index, name in enumerate(model.bodies)}
        pairs = [pair for beam in beams for pair in pairwise(beam.nodes)]
        self._first, self._second = (np.array([number[pair[end]] for pair in pairs], int) for end in (0, 1))
        self._own = {factor.name: factor.v_start for factor in model.factors if factor.group == "SE3"}
        self._nodes = sorted({*self._first.tolist(), *self._second.tolist()})
        self._ends = [np.searchsorted(self._nodes, nodes) for nodes in (self._first, self._second)]
        fixed_bodies = _fixed_to_base(model)
        starts = [self._own.get(model.bodies[node]) for node in self._nodes]
        self._free = [(node_index, start) for node_index, start in enumerate(starts) if start is not None]
        self._carried = [
            (node_index, node)
            for node_index, node in enumerate(self._nodes)
            if starts[node_index] is None and model.bodies[node] not in fixed_bodies
        ]
        self._last: tuple[Array, Matrix] | None = None  # q and twists: a correction asks twice
        self._by_d: tuple[Array, Array, Array] | None = None  # d and derivatives along twists

    def __len__(self) -> int:
        return len(self.stiffness)

    def at(self, p: Array, arguments: dict[str, Any]) -> ElementStrains:
        """Return a copy of these elements at other parameters p (np,), t and base (``arguments``)."""
        elements = copy(self)
        elements._set(p, arguments)
        if self._carried:
            elements._last = None
        return elements

    def _set(self, p: Array, arguments: dict[str, Any]) -> None:
        self._given, self._at = arguments, self.model.evaluator.at(**arguments)
        values = self.model.description.values(dict(zip(self.model.parameters, p.tolist(), strict=True)))
        mentioned = {name: values[name] for name in self._mentioned}
        if mentioned != self._values:
            beams, self._values = self.model.description.element_stiffness, mentioned
            self.stiffness = np.concatenate([np.zeros((0, 6, 6)), *(beam.matrices(values) for beam in beams)])

    def values(self, q: Array) -> Array:
        """Return d of all elements, (elements, 6), rotations first, rad and m."""
        (pose,) = self._at("poses", q=q)
        return differences(pose[self._first], pose[self._second])

    def derivative(self, q: Array, d: Array) -> Matrix:
        """Return the derivative of all d by q (left-trivialised), (6 elements, nv)."""
        return self._times_twists(self._along(d)[0], q)

    def doubt(self, d: Array) -> str:
        """Return a sentence on the element that turns most if this is nearly half a turn, else empty text. d are the
        strains (elements, 6); beyond half a turn they are ambiguous."""
        turns = np.linalg.norm(d[:, :3], axis=1)
        if not np.any(turns > 3.1):
            return ""
        worst = int(np.argmax(turns))
        first, second = (self.model.bodies[nodes[worst]] for nodes in (self._first, self._second))
        return f"the element between {first} and {second} turns by half a turn; more elements turn less each"

    def geometric(self, q: Array, d: Array, derivative: Matrix, forces: Array) -> Matrix:
        """Return the geometric part of the tangent due to section forces (elements, 6) at q, (nv, nv), sparse for large
        models. ``derivative`` is the derivative of d by q; bodies that carry nodes are taken as fixed."""
        changes = np.einsum("keij,ei->ekj", self._along(d)[1], forces)
        turned = self._times_twists(changes, q)
        if isinstance(turned, np.ndarray):
            return np.asarray(turned.T @ derivative)
        return csc_array(turned.T @ derivative)

    def _along(self, d: Array) -> tuple[Array, Array]:
        """Return the derivatives of d along the twists of both nodes, (elements, 6, 12), and their derivatives by the
        components of d, (6, elements, 6, 12); kept for the last d (elements, 6)."""
        if self._by_d is None or not np.array_equal(self._by_d[0], d):
            self._by_d = np.array(d), *slopes(d)
        return self._by_d[1:]

    def _times_twists(self, blocks: Array, q: Array) -> Matrix:
        """Return blocks (elements, 6, 12) of the elements' two nodes times the twists of these, (6 elements, nv)."""
        twists = self._twists(q)
        if not isinstance(twists, np.ndarray):
            return csc_array(self._node_matrix(blocks) @ twists)
        return np.asarray(blocks @ twists).reshape(6 * len(self), -1)

    def _node_matrix(self, blocks: Array) -> csr_array:
        """Return blocks (elements, 6, 12) of the elements' two nodes as one sparse matrix (6 elements, 6 nodes)."""
        rows = 6 * np.arange(len(self))[:, np.newaxis, np.newaxis] + np.arange(6)[:, np.newaxis]
        first, second = (6 * places for places in self._ends)
        columns = np.concatenate([first[:, np.newaxis] + np.arange(6), second[:, np.newaxis] + np.arange(6)], axis=1)
        rows, columns = np.broadcast_arrays(rows, columns[:, np.newaxis, :])
        shape = (6 * len(self), 6 * len(self._nodes))
        return csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=shape)

    def _twists(self, q: Array) -> Matrix:
        """Return the derivative of the nodes' body twists by v at q, kept for the last q. Up to ``WHOLE`` components of
        v an array for both nodes of each element, (elements, 12, nv), else sparse for all nodes, (6 nodes, nv)."""
        if self._last is None or (self._carried and not np.array_equal(self._last[0], q)):
            twists = self._twists_at(q)
            if isinstance(twists, np.ndarray):
                of_nodes = twists.reshape(len(self._nodes), 6, -1)
                twists = np.concatenate([of_nodes[places] for places in self._ends], axis=1)
            self._last = np.array(q), twists
        return self._last[1]

    def _twists_at(self, q: Array) -> Matrix:
        """Return the derivative of all nodes' body twists by v at q, (6 nodes, nv), sparse for more than ``WHOLE``
        components of v. It is the identity for free nodes, zero for nodes on the base, and else computed through the
        joints."""
        rows, columns = [np.zeros(0, int)], [np.zeros(0, int)]
        entries = [np.zeros(0)]
        for node_index, start in self._free:
            rows.append(6 * node_index + np.arange(6))
            columns.append(start + np.arange(6))
            entries.append(np.ones(6))
        if self._carried and self.model.nv:
            twists = self._twists_of([node for _, node in self._carried], q)
            for number, (node_index, _) in enumerate(self._carried):
                column, row = np.nonzero(twists[:, number])
                rows.append(6 * node_index + row)
                columns.append(column)
                entries.append(twists[column, number, row])
        places, shape = (np.concatenate(rows), np.concatenate(columns)), (6 * len(self._nodes), self.model.nv)
        if self.model.nv > WHOLE:
            return csc_array((np.concatenate(entries), places), shape=shape)
        whole = np.zeros(shape)
        whole[places] = np.concatenate(entries)
        return whole

    def _twists_of(self, nodes: list[int], q: Array) -> Array:
        """Return the body twists of nodes for each component of v, (nv, nodes, 6); without the term ``twists`` by
        differences of poses."""
        nv, along = self.model.nv, np.eye(self.model.nv)
        if "twists" in self.model.functions:
            moving = self.model.evaluate("twists", q, along, **self._given)["twist"]
            still = self.model.evaluate("twists", q, np.zeros(nv), **self._given)["twist"]
            return np.asarray(moving[:, nodes] - still[nodes])
        ends = [update(self.model.factors, np.tile(q, (nv, 1)), sign * _SMALL * along) for sign in (-1.0, 1.0)]
        less, more = (self.model.evaluate("poses", end, **self._given)["pose"][:, nodes] for end in ends)
        between = numeric.compose(SE3, numeric.inverse(SE3, less), more)
        return numeric.log(SE3, between) / (2.0 * _SMALL)


def _stiffness_parameters(beams: Sequence[ElementStiffness]) -> set[str]:
    """Return the parameters by which stiffnesses of sections change."""
    formulas = {entry for beam in beams for rows in beam.stiffness for row in rows for entry in row}
    return {symbol.name for formula in formulas for symbol in symbols(formula)}


def _fixed_to_base(model: CompiledModel) -> set[str]:
    """Return the base and the bodies fixed to the base by joints."""
    held = {BASE}
    for hinge in model.description.drawing.hinges:  # parents before their children
        if hinge.type == "fixed" and hinge.parent in held:
            held.add(hinge.child)
    return held


#: Step of central differences by the load factor, relative to the scale of the factor.
_STEP = 1e-5
#: A factor and both ends of the differences, in steps, which are evaluated in one batch.
_ENDS = np.array([0.0, 1.0, -1.0])


@dataclass(frozen=True)
class LoadParameter:
    """The varied quantity of a load path: a tunable parameter, an input, or the time of formulas.

    Attributes
    ----------
    name, unit : str
    parameters, u, t : values of all quantities that are not varied
    """

    model: CompiledModel
    name: str
    unit: str
    parameters: Array
    u: Inputs
    t: float

    @classmethod
    def of(
        cls, model: CompiledModel, call: str, name: str, parameters: Parameters, t: float, u: Inputs
    ) -> LoadParameter:
        """Return the varied quantity by name: a tunable parameter, an input, or ``t``. ``call`` names the caller in
        messages. Raises UsageError for another name, or inputs that are not given by name if an input is varied."""
        p = model.evaluator.one_set(parameters)
        units = {**model.evaluator.parameter_units, **model.input_units, "t": "s"}
        if name not in (*model.parameters, *model.inputs, "t"):
            known = [*model.parameters, *model.inputs, "t"]
            fault = f"there is no tunable parameter or input {shown(name)} to be varied [E0069]"
            fixed = name in model.evaluator.fixed_parameters
            hint = "tunable = true, where the scene gives it" if fixed else nearest(name, known)
            raise UsageError(Problem(call, fault, hint or f"one of {', '.join(known[:12])}"))
        if name in model.inputs and not (u is None or isinstance(u, Mapping)):
            raise UsageError(
                Problem("u", f"{name} is varied, so the other inputs are given by name [E0070]", "u={...}")
            )
        return cls(model, name, units.get(name, ""), p, u, t)

    @property
    def shown_unit(self) -> str:
        return f" {self.unit}" if self.unit not in ("", "1") else ""

    def at(self, s: float) -> tuple[Array, float, Inputs]:
        """Return parameters, time and inputs with the number set to s."""
        p, t, u = self.at_each(s)
        return p, float(np.asarray(t)), u

    def at_each(self, s: float | Array) -> tuple[Array, ArrayLike, Inputs]:
        """Return parameters, time and inputs with the varied quantity set to s (...), the others without these axes."""
        if self.name in self.model.parameters:
            p = np.tile(self.parameters, (*np.shape(s), 1))
            p[..., list(self.model.parameters).index(self.name)] = s
            return p, self.t, self.u
        if self.name in self.model.inputs:
            inputs = dict(self.u) if isinstance(self.u, Mapping) else {}
            return self.parameters, self.t, {**inputs, self.name: s}
        return self.parameters, s, self.u


def loaded_statics(
    model: CompiledModel,
    measures: SceneMeasures,
    q: Array,
    u: Inputs,
    v: Array,
    varied: LoadParameter | None = None,
    reach: float = 1.0,
) -> LoadedStatics:
    """Return the equations of a model at rest relative to coordinates moving with v (nv,), by a load factor, base held.

    Parameters
    ----------
    q : configuration with lengths that count among the scene's
    u : inputs, if none is varied
    varied : meaning of the load factor; if None, the measures and ``u`` apply for any factor
    reach : scale of the load factor
    """
    still, holonomic, rows = np.zeros(model.nv), model.functions.sizes["holonomic"], len(model.multipliers)
    strains_at: dict[bytes, ElementStrains] = {}
    whole = model.nv + rows + model.nz <= WHOLE

    def arguments(s: float) -> dict[str, Any]:
        if varied is None:
            return {"t": measures.t, "parameters": measures.p, "base": measures.base, "u": u}
        p, t, inputs = varied.at(s)
        return {"t": t, "parameters": p, "base": held_base(model, p, t), "u": inputs}

    @lru_cache(maxsize=512)  # a path asks again for the factors of its points at its end
    def terms(s: float) -> tuple[TermsAt, TermsAt]:
        if varied is None:
            at = model.evaluator.at(**arguments(s))
            return at, at
        p, t, inputs = varied.at_each(s + _ENDS * (_STEP * reach))
        around = model.evaluator.at(t, p, inputs, held_base(model, p, t))
        return around.row(0), around

    def terms_at(s: float, *, around: bool = False) -> TermsAt:
        return terms(0.0 if varied is None else s)[around]

    known: list[tuple[LoadedState, tuple[Array, Array, Array]]] = []  # a correction asks for both

    def around(rest: LoadedState) -> tuple[Array, Array, Array]:
        """Return residual, constraint and rates at rest and at both ends of the differences by the factor."""
        if not known or not _same(known[0][0], rest):
            at, ends = terms_at(rest.s, around=True), 1 if varied is None else len(_ENDS)
            residual, constraint, rates = (np.zeros((ends, size)) for size in (model.nv, rows, model.nz))
            residual[:] = at("residual", q=rest.q, v=v, a=still, z=rest.z, lam=rest.multipliers)[0]
            if holonomic:
                constraint[:, :holonomic] = at("constraint", q=rest.q)[0]
            if model.nz:
                rates[:] = at("internal_rate", q=rest.q, v=v, z=rest.z)[0]
            known[:] = [(rest, (residual, constraint, rates))]
        return known[0][1]

    def balance(rest: LoadedState) -> Balance:
        residual, constraint, rates = around(rest)
        return Balance(residual[0], constraint[0], rates[0])

    last: list[tuple[LoadedState, Tangents]] = []  # the direction of a path and the signs of its stiffness are of one

    def tangents(rest: LoadedState) -> Tangents:
        if not last or not _same(last[0][0], rest):
            last[:] = [(rest, tangents_at(rest))]
        return last[0][1]

    def nonzeros(rest: LoadedState) -> SparsePartials:
        state = rest.q, v, still, rest.z, rest.multipliers
        return sparse_partials(model, *state, arguments(rest.s), of_velocities=False)

    def tangents_at(rest: LoadedState) -> Tangents:
        if whole:
            at = terms_at(rest.s)
            state = {"q": rest.q, "v": v, "a": still, "z": rest.z, "lam": rest.multipliers}
            return Tangents(**whole_partials(model, lambda term: at(term, **state)))
        result = nonzeros(rest)
        return Tangents(*(sparse(matrix) for matrix in (result.K, result.B, result.Rz, result.Fq, result.Fz)))

    def mass(rest: LoadedState) -> Matrix:
        if "mass" in model.functions:
            (M,) = terms_at(rest.s)("mass", q=rest.q)
            return M if whole else csc_array(M)
        return nonzeros(rest).M

    def by_factor(rest: LoadedState) -> Balance:
        if varied is None:
            return Balance(np.zeros(model.nv), np.zeros(rows), np.zeros(model.nz))
        residual, constraint, rates = ((part[1] - part[2]) / (2.0 * _STEP * reach) for part in around(rest))
        return Balance(residual, constraint, rates)

    def strains(s: float) -> ElementStrains | None:
        if not model.description.element_stiffness or "poses" not in model.functions:
            return None
        where = arguments(s)
        where.pop("u")
        key = where["parameters"].tobytes() + np.float64(where["t"]).tobytes()
        if key not in strains_at:
            before, p = model.library.kept.get(_KEPT), where["parameters"]
            now = before.at(p, where) if before and before.model is model else ElementStrains(model, p, where)
            strains_at.clear()
            strains_at[key] = model.library.kept[_KEPT] = now
        return strains_at[key]

    def follow_angles(q: Array, s: float) -> Array:
        if not model.evaluator.angles:
            return q
        where = arguments(s)
        return model.evaluator.follow_angles(q, where["t"], where["parameters"], where["base"])

    turning = np.array([unit == "rad/s" for unit in model.v_units])
    return LoadedStatics(
        factors=model.factors,
        sizes=np.where(turning, 1.0, measures.length(q)),
        reach=reach,
        balance=balance,
        tangents=tangents,
        by_factor=by_factor,
        followed=follow_angles,
        mass=mass,
        strains=strains,
    )


def _same(first: LoadedState, second: LoadedState) -> bool:
    """Return whether two states have the same arrays and the same load factor."""
    arrays = first.q is second.q and first.multipliers is second.multipliers and first.z is second.z
    return arrays and first.s == second.s


def check_partials(model: CompiledModel, call: str) -> None:
    """Raise UsageError if a model was built without the terms that equilibria need; ``call`` names the caller."""
    needed = {"residual"} | ({"constraint_jacobian"} if model.multipliers else set())
    if "iteration" in model.functions:  # contains the nonzeros of the other matrices
        needed |= {"internal_rate"} if model.nz else set()
    else:
        needed |= {"mass", "partials"} | ({"internal_rate", "internal_partials"} if model.nz else set())
    if missing := sorted(name for name in needed if name not in model.functions):
        fault = f"the terms {', '.join(missing)} are needed, and the model was built without them [E0042]"
        raise UsageError(Problem(call, fault, f"eomgen.build(scene, terms=[..., {', '.join(map(repr, missing))}])"))
