"""Linear models of shafts whose deflections turn with the spin, in axes that stand still.

A shaft that a spin joint carries bends in coordinates q that turn. Bodies on the axis a have deflections and small
rotations D q. A quarter turn of these is a x D = D G, if there is such a matrix G; an observer sees x = exp(G psi) q.
Hence q = X x with X = 1, X' = -W G and X'' = W^2 G^2 at psi = 0, W being the speed, as of multiblade coordinates. A
rotor that is the same all round the axis has a linear model that is the same at all psi, and only then x has modes.

Blades lie off the axis. Their frequencies stay in axes that turn, in which loads that stand still have orders.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.linalg

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.messages import listed
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.lie.numeric import rotated
from eomgen.products.linear.analyses.linearize import AZIMUTHS, SAME, sizes_of_states
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.multiblade import Basis, Multiblade, in_multiblade, largest_change
from eomgen.system.description import Hinge

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


class _Turn(NamedTuple):
    """Coordinates that turn with a speed, rad/s: names of bodies on the axis, and the quarter turn G (nv, nv) of their
    deflections, zero for other coordinates; None if a quarter turn has no such coordinates."""

    bodies: list[str]
    G: Array | None
    speed: float


class StandingAxes:
    """Linear models over the speed of a rotor, in axes that stand still.

    Parameters
    ----------
    model : CompiledModel
        Of the linear models.
    speeds : components of the velocity that are given, the varied one among them; none if a parameter is varied, by
        which joints are driven
    t : time of the linear models, s
    """

    def __init__(self, model: CompiledModel, speeds: Collection[str], t: float) -> None:
        self.model, self.speeds, self.t = model, frozenset(speeds), t
        #: Warning of deflections that turn with the first rotor that is not the same all round; empty without one.
        self.warning = ""

    def transform(self, linear: Linearization, parameters: Mapping[str, float], value: float) -> Linearization:
        """Return the linear model in axes that stand still; the same model if no shaft turns, or if the rotor is not
        the same all round: then ``warning`` is set. `parameters` belong to the model, `value` is the value of the
        varied quantity."""
        model, names = self.model, linear.names
        if self._has_other_axes(linear):
            return linear
        held = {name for k, name in enumerate(names.measured) if k not in linear.free.coordinates}
        spins = self.speeds or held  # of a parameter all joints whose coordinates are held
        turning = (item for item in model.description.drawing.hinges if item.turns and not item.slides)
        for hinge in (item for item in turning if item.name in spins):
            turn = self._turn(hinge, linear, parameters)
            if turn is None or (value and not turn.speed):
                continue
            standing = None if turn.G is None or self.warning else _in_standing_axes(linear, turn.G, turn.speed, value)
            if standing is not None:
                linear = standing
            elif turn.speed and not self.warning:
                axes = f"{listed(turn.bodies)}: deflections are in axes that turn with {hinge.name}"
                orders = "orders are of loads that stand still, such as weight, and unbalance has order 0"
                hint = f"equal stiffness and inertia across {hinge.name}, or, for unbalance, the border of stability"
                reason = "the rotor is not the same all round, so frequencies belong to these axes"
                self.warning = f"campbell: {axes}, and {reason}: {orders}; try: {hint} [W0308]"
        return linear

    def _has_other_axes(self, linear: Linearization) -> bool:
        """Return whether a linear model has coordinates, states or functions for which axes cannot be made to stand."""
        names, functions = linear.names, self.model.functions.names
        unsuitable = linear.multiblade is not None or linear.sampled is not None or names.components != names.measured
        moving = self.model.library.layout["facts"]["moving_base"]
        return bool(unsuitable or {"poses", "twists"} - set(functions) or moving)

    def _turn(self, hinge: Hinge, linear: Linearization, parameters: Mapping[str, float]) -> _Turn | None:
        """Return the turn of the coordinates, carried by a spin joint, that move bodies on its axis in two
        directions across it; None without such coordinates, as for blades."""
        model, q, v = self.model, linear.reference.q, linear.reference.v
        measures = SceneMeasures(model, model.evaluator.one_set(parameters), self.t, None)
        arguments: dict[str, Any] = {"t": self.t, "parameters": measures.p}
        poses = {name: (turn[0], position[0]) for name, (turn, position) in measures.poses(q[np.newaxis]).items()}
        moving = model.evaluate("twists", q, np.eye(model.nv), **arguments)["twist"]
        still = model.evaluate("twists", q, np.zeros(model.nv), **arguments)["twist"]
        by_v = {name: (moving - still)[:, k] for k, name in enumerate(model.bodies)}
        now = model.evaluate("twists", q, v, **arguments)["twist"]
        omega = {name: rotated(poses[name][0], now[k, :3]) for k, name in enumerate(model.bodies)}
        carried, columns = _carried_bodies(model, hinge)
        axis = rotated(poses[hinge.parent][0], np.array(hinge.axis))
        speed = float(axis @ (omega[hinge.child] - omega.get(hinge.parent, np.zeros(3))))
        center, length = poses[hinge.child][1], measures.length(q)
        bodies: list[str] = []
        stations: list[Array] = []
        for solid in model.description.drawing.solids:
            turn, origin = poses[solid.name]
            middle = origin + rotated(turn, measures.vector(solid.center_of_mass))
            off = max(float(np.linalg.norm(np.cross(axis, point - center))) for point in (origin, middle))
            if solid.name in carried and measures.number(solid.mass) > 0.0 and off <= SAME * length:
                bodies.append(solid.name)
                stations += _stations(model, solid.name, turn, by_v[solid.name])
        if not stations or not columns:
            return None
        vectors = np.array([part[columns].T for part in stations])
        across = vectors - np.einsum("i,j,kjn->kin", axis, axis, vectors)
        if max(np.linalg.matrix_rank(part, tol=SAME * np.abs(part).max()) for part in across) < 2:
            return None
        quarter = _quarter_turn(vectors, axis)
        if quarter is None:
            return _Turn(bodies, None, speed)
        G = np.zeros((model.nv, model.nv))
        G[np.ix_(columns, columns)] = quarter
        return _Turn(bodies, G, speed)


def _quarter_turn(vectors: Array, axis: Array) -> Array | None:
    """Return the matrix G (n, n) by which all vectors D q, (k, 3, n) for n coordinates, turn: a x D = D G. None
    without such a matrix, or with more than one."""
    D, turned = (part.reshape(-1, part.shape[2]) for part in (vectors, np.cross(axis, vectors, axisb=1, axisc=1)))
    sizes = np.linalg.norm(D, axis=0) + (np.abs(D).max(axis=0) == 0.0)
    by_size, _, rank, _ = np.linalg.lstsq(D / sizes, turned, rcond=None)
    G = np.asarray(by_size / sizes[:, np.newaxis])
    exact = rank == len(G) and np.abs(D @ G - turned).max() <= SAME * np.abs(D).max()
    return G if exact else None


def _carried_bodies(model: CompiledModel, hinge: Hinge) -> tuple[set[str], list[int]]:
    """Return the bodies that a joint carries, and the components of v of their joints and bends."""
    carried = {hinge.child}
    for item in model.description.drawing.hinges:  # parents before their children
        carried |= {item.child} if item.parent in carried else set()
    inner = {item.name for item in model.description.drawing.hinges if item.parent in carried} | carried
    return carried, [k for of in model.factors if of.name in inner for k in range(of.v.start, of.v.stop)]


def _stations(model: CompiledModel, body: str, turn: Array, twists: Array) -> list[Array]:
    """Return small rotations and displacements (nv, 3) of a body, in world axes, or of the sections of a beam along its
    axis. `twists` (nv, 6) are of the body's frame by each component, in its own axes; `turn` is its quaternion."""
    beam = next((item for item in model.library.layout["axes"] if item["name"] == body), None)
    angles, shifts = twists[:, :3], twists[:, 3:]
    if beam is None:
        return [rotated(turn, angles), rotated(turn, shifts)]
    components = next(factor.v for factor in model.factors if factor.name == body)
    result = []
    for x, deflection, rotation in zip(beam["x"], beam["deflections"], beam["rotations"], strict=True):
        there, shifted = angles.copy(), shifts + np.cross(angles, [x, 0.0, 0.0])
        there[components] += np.array(rotation).T
        shifted[components] += np.array(deflection).T
        result += [rotated(turn, there), rotated(turn, shifted)]
    return result


def _in_standing_axes(linear: Linearization, G: Array, speed: float, value: float) -> Linearization | None:
    """Return a linear model in axes that stand still; None if its coefficients change with the turn of these axes.
    The sense of whirl is the sense of the turn at a positive or negative `value` of the varied quantity."""
    names = linear.names
    kept, bound = np.ix_(linear.free.coordinates, linear.free.coordinates), G.copy()
    bound[kept] = 0.0  # of coordinates that depend on others
    if linear.free.coordinates != linear.free.velocities or np.abs(bound).max() > SAME * np.abs(G).max():
        return None
    A, part = linear.state_space().A, G[kept]
    others: list[Array] = []
    for azimuth in AZIMUTHS:
        X = scipy.linalg.block_diag(*[scipy.linalg.expm(-2.0 * np.pi * azimuth * part)] * 2)
        X = scipy.linalg.block_diag(X, np.eye(len(A) - len(X)))
        others.append(np.asarray(np.linalg.solve(X, A @ X)))
    if not largest_change(A, others, sizes_of_states(linear), speed**2)[0] <= SAME:
        return None
    of = {kind: Basis.of(getattr(names, kind), ()) for kind in ("states", "inputs", "disturbances", "outputs")}
    still = Basis.of(names.measured, ())
    of["components"] = basis = replace(still, rate=-speed * G, second=speed**2 * G @ G)
    partials, free = in_multiblade(linear.partials, linear.free, of, basis)
    pairs = _pairs(-G if speed * value < 0.0 else G, names.measured)
    before = () if linear.multiblade is None else linear.multiblade.pairs
    multiblade = Multiblade((), basis.matrix, tuple(dict.fromkeys((*before, *pairs))))
    return replace(linear, partials=partials, free=free, multiblade=multiblade)


def _pairs(G: Array, names: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return pairs of coordinates, the second a quarter turn from the first in the sense of the turn G."""
    largest, least = np.argmax(np.abs(G), axis=0).tolist(), SAME * np.abs(G).max()
    return tuple((names[first], names[second]) for first, second in enumerate(largest) if G[second, first] > least)
