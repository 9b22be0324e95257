"""Inverse dynamics, mass matrix and two Coriolis matrices with first and second time derivatives, in closed form on
the Lie group.

    V = A (X v + E V_B),   M = J^T M J,   C = J^T (M J' - b^T M J),   C_skew = C + J^T M b J

C is Mueller and Kumar's (2021), with J' in full so that it holds for joints of several degrees of freedom. b V = 0, so
both give C v = h; M' - 2 C_skew is skew because M J' enters M' twice and M b - b^T M is skew. See ``system_matrices``
for the rules.

The same by products with the system matrices of all links, and their time derivatives:

    V = J v + U V_B,   J = A X,   A' = A a - A a A,   tau = J^T (M V' - b^T M V - wrenches)

X holds the motion subspaces, A the adjoint transforms from every link to every link after it, M the links' spatial
inertias; a = diag ad(X v) belongs to the joints, b = diag ad(V) to the links (Mueller and Kumar, Multibody Syst. Dyn.
53 (2021) 257). There a X = 0, which holds for joints of one degree of freedom only; it is kept here, so J' = A a (X -
J) holds for balls too. A is applied, outwards along the tree, and A^T inwards; both have rules for derivatives:

    (A y)' = A (y' + a (y - A y)),      (A^T x)' = A^T (x' - a^T A^T x) + a^T A^T x

The joints' poses are all that is shared with the recursion of ``rates.recursion``, so each is the other's check.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from eomgen.mechanics.kinematics.fields import Pair, carry, moved_load, pair_dot, pair_minus, pair_plus, pair_scaled
from eomgen.mechanics.tree.inertia import wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.scalar import Scalar, Vector, all_zero, cross, negative, plus
from eomgen.symbolic.scalar import skew as skew_of
from eomgen.symbolic.tape import ZERO

#: One pair for each link and column.
Columns = list[list[Pair]]


def bracket(x: Pair, y: Pair) -> Pair:
    """Return ad(x) y of twists, with the sum in the order of this form's operations."""
    return cross(x[0], y[0]), plus(cross(x[1], y[0]), cross(x[0], y[1]))


def bracket_transposed(x: Pair, load: Pair) -> Pair:
    """Return ad(x)^T load of a wrench (moment, force)."""
    moment, force = moved_load(x, load)
    return negative(moment), negative(force)


def combine(x: Columns, y: Columns, operation: Callable[[Pair, Pair], Pair] = pair_plus) -> Columns:
    return [[operation(p, q) for p, q in zip(first, second, strict=True)] for first, second in zip(x, y, strict=True)]


def by_link(
    operators: Sequence[Pair], x: Columns, operation: Callable[[Pair, Pair], Pair] = bracket, factor: float = 1.0
) -> Columns:
    """Return the product of a block diagonal matrix and columns ``x``, times ``factor``. The block of a link is
    ``operation(operator, .)``, by default ad of the link's twist."""
    rows = [
        [pair if all_zero(*pair) else operation(operator, pair) for pair in row]
        for operator, row in zip(operators, x, strict=True)
    ]
    return rows if factor == 1.0 else [[pair_scaled(factor, pair) for pair in row] for row in rows]


class SystemMatrices:
    """System matrices of one tree and the time derivatives along a motion, each quantity recorded at the first use.

    Parameters
    ----------
    tree : with the links' own inertia, not grouped
    velocities : for each velocity component v, a, j, s, as far as required by derivatives
    """

    def __init__(self, tree: Tree, velocities: Sequence[Sequence[Scalar]]) -> None:
        self.tree = tree
        self.velocities = velocities
        zero = tree.algebra.zero_vector
        self.zero: Pair = (zero, zero)
        self.X = self._subspaces()
        self._J = Image(self, self.X)
        self._joint_twists: dict[int, list[Pair]] = {}

    def _subspaces(self) -> Columns:
        columns: Columns = [[self.zero] * self.tree.nv for _ in self.tree.links]
        for row, link in zip(columns, self.tree.links, strict=True):
            for column, dof in zip(link.columns, link.dofs, strict=True):
                twist = pair_scaled(link.coordinates.ratio, (column.angular, column.linear))
                row[dof] = pair_plus(row[dof], twist)
        return columns

    def joint_twists(self, order: int) -> list[Pair]:
        """Return the ``order``-th time derivative of the joint twists X v, one for each link in link axes: the
        operators a, a', ..."""
        if order not in self._joint_twists:
            self._joint_twists[order] = [self._times(row, order) for row in self.X]
        return self._joint_twists[order]

    def _times(self, row: Sequence[Pair], order: int) -> Pair:
        total = self.zero
        for pair, path in zip(row, self.velocities, strict=True):
            if not all_zero(*pair):
                total = pair_plus(total, pair_scaled(path[order], pair))
        return total

    # -- A and its transpose, applied ---------------------------------------------------------------------------------

    def outwards(self, x: Columns) -> Columns:
        """Return A x: for each link the sum of x over the links from the root to this link, in its axes at its
        origin."""
        sums: Columns = []
        for link, row in zip(self.tree.links, x, strict=True):
            above = sums[link.parent] if link.parent != ROOT else [self.zero] * len(row)
            pairs = zip(row, above, strict=True)
            sums.append([p if all_zero(*q) else pair_plus(p, to_link(link, q)) for p, q in pairs])
        return sums

    def inwards(self, x: Columns) -> Columns:
        """Return A^T x, for wrenches x: for each link the sum over this and all outward links, in the link's axes."""
        total = [list(row) for row in x]
        for index, link in self.tree.inward():
            above = total[link.parent]
            total[link.parent] = [
                p if all_zero(*q) else pair_plus(p, carry(link, q)) for p, q in zip(above, total[index], strict=True)
            ]
        return total

    def inertia(self, x: Columns) -> Columns:
        """Return M x per link, spatial inertia times each column, in link axes."""
        algebra = self.tree.algebra
        return [
            [pair if all_zero(*pair) else wrench(algebra, link.inertia, pair[1], pair[0]) for pair in row]
            for link, row in zip(self.tree.links, x, strict=True)
        ]

    def project(self, x: Columns) -> list[list[Scalar]]:
        """Return X^T x, (nv, columns), row by row, for wrenches x by link and column."""
        rows: list[list[Scalar]] = []
        for dof in range(self.tree.nv):
            row = [self.tree.algebra.zero] * len(x[0])
            for subspace, loads in zip(self.X, x, strict=True):
                if not all_zero(*subspace[dof]):
                    row = [total + pair_dot(subspace[dof], load) for total, load in zip(row, loads, strict=True)]
            rows.append(row)
        return rows

    # -- derivatives ---------------------------------------------------------------------------------------------------

    def jacobian(self, order: int) -> Columns:
        """Return a time derivative of the system Jacobian J = A X."""
        return self._J.derivative(order)

    def adjoints(self) -> Image:
        """Return A and the time derivatives, six columns for each link, as the image of the unit twists."""
        zero, units = self.tree.algebra.zero_vector, self.tree.algebra.identity
        basis: list[Pair] = [(unit, zero) for unit in units] + [(zero, unit) for unit in units]
        links = range(len(self.tree.links))
        return Image(self, [[unit if row == at else self.zero for at in links for unit in basis] for row in links])

    def twists(self, order: int, first: int = 0) -> list[Pair]:
        """Return the derivative of the link twists J v, one for each link in link axes, for a base at rest: b, b', b''.
        ``order`` counts derivatives of the product; ``first`` is the derivative of v to begin with (0: velocities)."""
        total = [self.zero] * len(self.tree.links)
        for k in range(order + 1):
            part = [self._times(row, first + order - k) for row in self.jacobian(k)]
            total = [pair_plus(x, pair_scaled(math.comb(order, k), y)) for x, y in zip(total, part, strict=True)]
        return total

    def with_transpose(self, paths: Sequence[Columns]) -> list[Columns]:
        """Return A^T x and the first and second time derivatives, as many as there are entries in ``paths``. ``paths``
        holds x and the time derivatives, wrenches by link and column."""
        z = [self.inwards(paths[0])]
        if len(paths) == 1:
            return z
        a = self.joint_twists(0)
        inner = combine(paths[1], by_link(a, z[0], bracket_transposed), pair_minus)
        carried = self.inwards(inner)
        z.append(combine(carried, by_link(a, z[0], bracket_transposed)))
        if len(paths) == 2:
            return z
        a_dot = self.joint_twists(1)
        inner_dot = combine(paths[2], by_link(a_dot, z[0], bracket_transposed), pair_minus)
        inner_dot = combine(inner_dot, by_link(a, z[1], bracket_transposed), pair_minus)
        carried_dot = self.inwards(combine(inner_dot, by_link(a, carried, bracket_transposed), pair_minus))
        carried_dot = combine(carried_dot, by_link(a, carried, bracket_transposed))
        total = combine(carried_dot, by_link(a_dot, z[0], bracket_transposed))
        z.append(combine(total, by_link(a, z[1], bracket_transposed)))
        return z


class Image:
    """The product A x and the time derivatives, for columns x, whose time derivatives ``changes`` gives by order.
    Without ``changes`` x is constant. A accumulates columns along the tree, and A' = A a - A a A. The n-th derivative
    of A x is A y_n, with y_0 = x and y_(n+1) = y_n' + a (y_n - A y_n)."""

    def __init__(self, system: SystemMatrices, x: Columns, changes: Callable[[int], Columns] | None = None) -> None:
        self.system = system
        nothing = [[system.zero] * len(row) for row in x]
        self.changes = changes if changes is not None else lambda order: nothing
        self._derivatives: list[Columns] = []
        self._sources: dict[tuple[int, int], Columns] = {(0, 0): x}

    def derivative(self, order: int) -> Columns:
        """Return the time derivative of A x of the given order, 0 for A x, by link and column, in link axes."""
        while len(self._derivatives) <= order:
            self._derivatives.append(self.system.outwards(self._source(len(self._derivatives), 0)))
        return self._derivatives[order]

    def _source(self, n: int, m: int) -> Columns:
        """Return the m-th derivative of y_n."""
        if (n, m) in self._sources:
            return self._sources[n, m]
        if n == 0:
            total = self.changes(m)
        else:
            total = self._source(n - 1, m + 1)
            for i in range(m + 1):
                difference = combine(self._source(n - 1, m - i), self.derivative(n - 1 + m - i), pair_minus)
                total = combine(total, by_link(self.system.joint_twists(i), difference, bracket, math.comb(m, i)))
        self._sources[n, m] = total
        return total


def to_link(link: Link, twist: Pair) -> Pair:
    """Return Ad of a twist: from the parent's frame to the link's frame, as of one rigid body."""
    angular, linear = twist
    carried = link.rotation.rotate_back(plus(linear, cross(angular, link.position)))
    return link.rotation.rotate_back(angular), carried


Rows = list[list[Scalar]]


def matrix_path(system: SystemMatrices, name: str, order: int) -> tuple[str, tuple[int, ...], str, list[list[Scalar]]]:
    """Return symbol, shape, meaning, and the entries of a closed-form matrix, row by row, for each derivative 0 to
    ``order``. ``name`` is "system_jacobian", "adjoints", "joint_brackets", "link_brackets", "mass", "coriolis" or
    "coriolis_skew"."""
    nv, links = system.tree.nv, len(system.tree.links)
    rows = ", ".join(link.name for link in system.tree.links)
    match name:
        case "system_jacobian":
            values = [_six_rows(system.jacobian(k)) for k in range(order + 1)]
            return "J", (6 * links, nv), f"six rows for each link, angular first, in its axes: {rows}", values
        case "adjoints":
            A = system.adjoints()
            values = [_six_rows(A.derivative(k)) for k in range(order + 1)]
            return "A", (6 * links, 6 * links), f"six rows and columns for each link: {rows}", values
        case "joint_brackets" | "link_brackets":
            twists = system.joint_twists if name == "joint_brackets" else system.twists
            values = [[entry for twist in twists(k) for entry in _bracket_matrix(twist)] for k in range(order + 1)]
            return f"ad_{name.removesuffix('_brackets')}s", (links, 6, 6), f"one matrix for each link: {rows}", values
        case "mass":
            return "M", (nv, nv), "inertia matrix", [_flat(M) for M in mass_path(system, order)]
        case _:
            skew = name == "coriolis_skew"
            meaning = "Coriolis matrix" + (", M' - 2 C skew" if skew else "")
            return "C", (nv, nv), meaning, [_flat(C) for C in coriolis_path(system, order, skew)]


def _flat(rows: Rows) -> list[Scalar]:
    return [value for row in rows for value in row]


def _six_rows(columns: Columns) -> list[Scalar]:
    """Return the entries of a matrix of twists, row by row."""
    return [pair[part][k] for row in columns for part in (0, 1) for k in range(3) for pair in row]


def _bracket_matrix(twist: Pair) -> list[Scalar]:
    """Return the entries of ad(twist), row by row."""
    zero = Scalar(twist[0][0].tape, ZERO)
    turning, passing = skew_of(twist[0]), skew_of(twist[1])
    above = [entry for row in turning for entry in (*row, zero, zero, zero)]
    return above + [entry for row, turned in zip(passing, turning, strict=True) for entry in (*row, *turned)]


def mass_path(system: SystemMatrices, order: int) -> list[Rows]:
    """Return M, (nv, nv), and the time derivatives up to ``order`` (at most 2), rotor inertias included."""
    path = [
        system.project(z) for z in system.with_transpose([system.inertia(system.jacobian(k)) for k in range(order + 1)])
    ]
    for dof, rotor in system.tree.rotors():
        path[0][dof][dof] = path[0][dof][dof] + rotor
    return path


def coriolis_path(system: SystemMatrices, order: int, skew: bool) -> list[Rows]:
    """Return a Coriolis matrix C, (nv, nv), and the time derivatives up to ``order`` (at most 2). With ``skew`` it is
    the matrix for which M' - 2 C is skew-symmetric."""
    paths: list[Columns] = []
    for n in range(order + 1):
        total = system.inertia(system.jacobian(n + 1))
        for k in range(n + 1):
            b = system.twists(n - k)
            momentum = system.inertia(system.jacobian(k))
            total = combine(total, by_link(b, momentum, bracket_transposed, math.comb(n, k)), pair_minus)
            if skew:
                total = combine(total, system.inertia(by_link(b, system.jacobian(k), bracket, math.comb(n, k))))
        paths.append(total)
    return [system.project(z) for z in system.with_transpose(paths)]


def inverse_dynamics_closed(
    system: SystemMatrices,
    base_twist: Sequence[Pair],
    fall: Sequence[Vector],
    loads: Sequence[Sequence[Pair] | None],
    order: int,
) -> list[list[Scalar]]:
    """Return inverse dynamics tau, (nv,), and the time derivatives up to ``order`` (at most 2), without joint efforts.

    Parameters
    ----------
    base_twist : the base's twist in base axes and the time derivatives, up to order + 1
    fall : gravity in base axes and the time derivatives, m/s^2
    loads : by link, the applied wrench and the time derivatives; None for links without one
    """
    zero = system.tree.algebra.zero_vector
    joints = [[[pair] for pair in system.joint_twists(k)] for k in range(order + 2)]
    V = _link_twist_derivatives(system, base_twist, joints)
    falling = _link_twist_derivatives(system, [(zero, value) for value in fall], [])
    momenta = [system.inertia(value) for value in V]
    paths: list[Columns] = []
    for n in range(order + 1):
        total = combine(momenta[n + 1], system.inertia(falling[n]), pair_minus)
        for k in range(n + 1):
            operators = [row[0] for row in V[n - k]]
            total = combine(total, by_link(operators, momenta[k], bracket_transposed, math.comb(n, k)), pair_minus)
        paths.append(
            [row if load is None else [pair_minus(row[0], load[n])] for row, load in zip(total, loads, strict=True)]
        )
    tau = [[row[0] for row in system.project(z)] for z in system.with_transpose(paths)]
    for dof, rotor in system.tree.rotors():
        for n in range(order + 1):
            tau[n][dof] = tau[n][dof] + rotor * system.velocities[dof][n + 1]
    return tau


def _link_twist_derivatives(system: SystemMatrices, path: Sequence[Pair], joints: Sequence[Columns]) -> list[Columns]:
    """Return the link twists A (x + E w) and the time derivatives, one column each, as many as ``path`` has entries.
    ``joints`` are joint twists x and derivatives, or empty; ``path`` are base twists w and derivatives; E' = -a E."""
    tree, sources = system.tree, dict[tuple[int, int], Columns]()
    for k, twist in enumerate(path):
        sources[k, 0] = [[to_link(link, twist) if link.parent == ROOT else system.zero] for link in tree.links]

    def entering(k: int, m: int) -> Columns:
        """Return the m-th derivative of E w^(k)."""
        if (k, m) not in sources:
            total = entering(k + 1, m - 1)
            for i in range(m):
                factor = math.comb(m - 1, i)
                total = combine(
                    total, by_link(system.joint_twists(i), entering(k, m - 1 - i), bracket, factor), pair_minus
                )
            sources[k, m] = total
        return sources[k, m]

    def both(order: int) -> Columns:
        return combine(entering(0, order), joints[order]) if joints else entering(0, order)

    image = Image(system, both(0), both)
    return [image.derivative(n) for n in range(len(path))]
