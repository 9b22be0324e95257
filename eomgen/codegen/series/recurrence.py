"""Taylor recurrence of a System: functions for order 0 and for order k, evaluated by the Taylor stepper.

Accelerations come from inverse dynamics, which is affine in them: the coefficient k of the residual with a_k = 0 is
-M_0 a_k, and M_0 is eliminated once, at order 0. So elimination is never differentiated, and inverse dynamics has about
a third of the products of forward dynamics. If inverse dynamics is not available, or if the elimination of M loses
digits, the recurrence differentiates forward dynamics.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.calculus.configuration import rotation
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.series import LEFT, RIGHT, Series, SeriesTerm, record_series
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape, dot
from eomgen.system.system import System

#: Blocks of coefficient k, by the blocks of order 0.
NEXT = {"t": "t_k", "q": "q_k", "v": "v_k", "z": "z_k"}


def inverse_serves(system: System) -> bool:
    """Return whether inverse dynamics and M exist, and the elimination of M is accurate."""
    loses_digits = system.facts.ill_scaled and "forward_dynamics" in system.functions
    return {"mass", "residual"} <= set(system.functions) and not loses_digits


class Recurrence:
    """Records both functions of a System.

    Attributes
    ----------
    series : Series
    rates : mapping from q, v, z to Terms
        Time derivatives of q, v, z: coefficient k is (k + 1) times coefficient k + 1 of the quantity.
    by_inverse : bool
        Whether accelerations come from inverse dynamics.
    """

    def __init__(self, system: System, *, by_inverse: bool) -> None:
        """Record the recurrence of the Taylor coefficients of q, v and z on a tape."""
        self.system = system
        self.by_inverse = by_inverse
        tape, self.source = Tape(), Tape()
        self.series = Series(tape, time=tape.input(NEXT["t"], 0))
        self._bindings = self._time_functions()
        sizes = {"t": 1, "q": system.nq, "v": system.nv, "z": system.nz}
        self._given = {
            InputSymbol(block, index): SeriesTerm(tape.input(block, index), tape.input(NEXT[block], index))
            for block, size in sizes.items()
            for index in range(size)
        }
        self._known: dict[int, SeriesTerm] = {}
        self.rates: dict[str, list[SeriesTerm]] = {"q": self._terms(self._kinematic_rates())}
        if system.nz:
            self.rates["z"] = self._terms(self._copy("internal_rate"))
        if by_inverse:
            self.rates["v"] = _AffineAccelerations(
                self.series, self.source, self._copy("residual"), self._given, self._known
            ).solve(splice(self.series.tape, self.source, self._copy("mass"), {}), system.dof_parent)
        else:
            self.rates["v"] = self._terms(self._copy("forward_dynamics"))

    def _time_functions(self) -> dict[InputSymbol, Ref]:
        """Return references on the source tape for base motion, if any, and all inputs as functions of time, by input
        symbol. An input is ``u`` + ``followed`` times its formula, so that a driver can hold a value instead; without a
        formula it is ``u``."""
        functions, source = self.system.functions, self.source
        bindings: dict[InputSymbol, Ref] = {}
        if "base" in functions:
            refs = splice(source, self.system.tape, functions["base"].refs, {}, unrolled=True)
            bindings |= {InputSymbol("base", index): ref for index, ref in enumerate(refs)}
        formulas = [ZERO] * self.system.nu
        if "inputs" in functions:
            formulas = splice(source, self.system.tape, functions["inputs"].refs, {}, unrolled=True)
        for index, formula in enumerate(formulas):
            followed = source.mul(source.input("followed", index), formula)
            bindings[InputSymbol("u", index)] = source.add(source.input("u", index), followed)
        return bindings

    def _copy(self, name: str) -> list[Ref]:
        return splice(self.source, self.system.tape, self.system.functions[name].refs, self._bindings, unrolled=True)

    def _terms(self, refs: Sequence[Ref]) -> list[SeriesTerm]:
        return record_series(self.series, self.source, refs, self._given, self._known)

    def _kinematic_rates(self) -> list[Ref]:
        """Return references of dq/dt on the source tape, (nq,): v, 1/2 q (0, omega) for quaternions, R(q) v for
        poses."""
        tape = self.source
        rates = [ZERO] * sum(factor.q_size for factor in self.system.factors)
        half = tape.constant(0.5)
        for factor in self.system.factors:
            q = [tape.input("q", factor.q_start + k) for k in range(factor.q_size)]
            v = [tape.input("v", factor.v_start + k) for k in range(factor.v_size)]
            if factor.group == "R":
                rates[factor.q] = v
                continue
            w, x, y, z = q[:4]
            products = ((-x, -y, -z), (w, -z, y), (z, w, -x), (-y, x, w))
            of_pose = [tape.mul(half, dot(tape, row, v[:3])) for row in products]
            if factor.group == "SE3":
                of_pose += [dot(tape, row, v[3:]) for row in rotation(tape, q[:4])]
            rates[factor.q] = of_pose
        return rates


class _AffineAccelerations:
    """Taylor terms of accelerations from a residual that is affine in the accelerations. The constructor records all
    terms with the newest coefficient a_k = 0; ``solve`` then adds the contribution of a_k."""

    def __init__(
        self,
        series: Series,
        source: Tape,
        residual: Sequence[Ref],
        input_series: dict[InputSymbol, SeriesTerm],
        node_series: dict[int, SeriesTerm],
    ) -> None:
        """Record the residual as a series, with the newest coefficient of the accelerations set to zero. ``residual``
        are references on ``source``; ``input_series`` has the series of the input symbols t, q, v, z; ``node_series``
        the series of nodes recorded before, and is extended."""
        self.series, self.source, self.residual = series, source, residual
        self.moved: set[int] = set()  # nodes that accelerations are in
        live = source.live(residual)
        for node in live:
            symbol = source.symbol(node)
            if (symbol is not None and symbol.block == "a") or any(
                abs(ref) in self.moved for ref in source.operands(node)
            ):
                self.moved.add(node)
        self.order = [node for node in live if node in self.moved]
        still = sorted({abs(ref) for node in self.order for ref in source.operands(node) if abs(ref) not in self.moved})
        still += [abs(ref) for ref in residual if abs(ref) not in self.moved]
        record_series(series, source, still, input_series, node_series)
        self.known = node_series
        self.numbers: dict[int, int] = {}
        for node in self.order:
            self.known[node] = self._without(node)

    def _term(self, ref: Ref) -> SeriesTerm:
        return self.known[abs(ref)] if ref > 0 else self.series.negative(self.known[abs(ref)])

    def _without(self, node: int) -> SeriesTerm:
        """Return the series term of a node of the residual as if the newest coefficient of the accelerations were zero.
        Earlier coefficients enter through the inner sums of products and through row 0. Raises ValueError for a
        residual that is not affine in the accelerations."""
        source, series, tape = self.source, self.series, self.series.tape
        op = source.op[node]
        if op is Op.INPUT:
            return SeriesTerm(ZERO, ZERO)
        first, second = (self._term(ref) for ref in source.operands(node))
        if op in (Op.ADD, Op.SUB):
            return series.add(first, second if op is Op.ADD else series.negative(second))
        carried, steady = self._split(node, first, second)
        if steady.next == ZERO:
            return series.scale(tape.div(ONE, steady.value) if op is Op.DIV else steady.value, carried)
        number = self.numbers[node] = series.open_product()
        at = [tape.input(LEFT, number), tape.input(RIGHT, number)]
        if op is Op.DIV:  # z y = x, with y left and z right
            reciprocal = series.keep(tape.div(ONE, steady.value))
            last = tape.add(series.inner(number), tape.mul(steady.next, at[1]))
            return SeriesTerm(tape.div(carried.value, steady.value), tape.mul(reciprocal, tape.sub(carried.next, last)))
        rest = tape.add(tape.mul(at[0], steady.next), tape.mul(at[1], carried.next))
        return SeriesTerm(tape.mul(carried.value, steady.value), tape.add(series.inner(number), rest))

    def _split(self, node: int, first: SeriesTerm, second: SeriesTerm) -> tuple[SeriesTerm, SeriesTerm]:
        """Return the terms of the two operands of a product or quotient: first the one with accelerations, then the
        other. Raises ValueError for any other operation, for accelerations in both operands, or in a divisor."""
        left, right = (abs(ref) in self.moved for ref in self.source.operands(node))
        if self.source.op[node] not in (Op.MUL, Op.DIV) or left == right or (right and self.source.op[node] is Op.DIV):
            raise ValueError("the residual is not affine in the accelerations")
        return (first, second) if left else (second, first)

    def solve(self, mass: Sequence[Ref], parents: Sequence[int]) -> list[SeriesTerm]:
        """Return the series terms of the accelerations, (nv,), and complete the open products with the accelerations.
        ``mass`` are the references of M at order 0, row by row, on the tape of the series; ``parents`` the parent of
        each velocity component."""
        series = self.series
        solve = _TreeSolver(series, mass, parents)
        right = [series.negative(self._term(ref)) for ref in self.residual]
        accelerations = [
            SeriesTerm(*pair)
            for pair in zip(
                solve([term.value for term in right], kept=False),
                solve([term.next for term in right], kept=True),
                strict=True,
            )
        ]
        added: dict[int, SeriesTerm] = {}
        for node in self.order:
            added[node] = self._contribution(node, accelerations, added)
        for node, number in self.numbers.items():
            operands = [abs(ref) for ref in self.source.operands(node)]
            signs = [1 if ref > 0 else -1 for ref in self.source.operands(node)]
            if self.source.op[node] is Op.DIV:
                whole = series.add(self.known[node], added[node])
                series.close_product(number, self._with_sign(signs[1], self.known[operands[1]]), whole)
                continue
            carried, steady = (0, 1) if operands[0] in self.moved else (1, 0)
            whole = series.add(self.known[operands[carried]], added[operands[carried]])
            left, right_factor = (
                self._with_sign(signs[carried], whole),
                self._with_sign(signs[steady], self.known[operands[steady]]),
            )
            series.close_product(number, left, right_factor)
        return accelerations

    def _with_sign(self, sign: int, term: SeriesTerm) -> SeriesTerm:
        return term if sign > 0 else self.series.negative(term)

    def _contribution(self, node: int, accelerations: Sequence[SeriesTerm], added: dict[int, SeriesTerm]) -> SeriesTerm:
        """Return the contribution of the newest coefficient of the accelerations to a node of the residual, as a series
        term. ``added`` has the contributions to the nodes before."""
        source, series, tape = self.source, self.series, self.series.tape
        op = source.op[node]
        if op is Op.INPUT:
            return accelerations[source.inputs[source.a[node]].index]
        zero = SeriesTerm(ZERO, ZERO)
        terms = [self._with_sign(1 if ref > 0 else -1, added.get(abs(ref), zero)) for ref in source.operands(node)]
        if op in (Op.ADD, Op.SUB):
            return series.add(terms[0], terms[1] if op is Op.ADD else series.negative(terms[1]))
        steady = self._split(node, *(self._term(ref) for ref in source.operands(node)))[1]
        change = terms[0] if abs(source.operands(node)[0]) in self.moved else terms[1]
        if op is Op.DIV:
            factor = tape.div(ONE, steady.value)
            return SeriesTerm(tape.mul(factor, change.value), tape.mul(series.keep(factor), change.next))
        factor = steady.value if node not in self.numbers else tape.input(RIGHT, self.numbers[node])
        factor = series.keep(factor) if node not in self.numbers else factor
        return SeriesTerm(tape.mul(steady.value, change.value), tape.mul(factor, change.next))


class _TreeSolver:
    """M = L^T D L from the tips to the root at order 0, and substitutions of right sides of any order."""

    def __init__(self, series: Series, mass: Sequence[Ref], parents: Sequence[int]) -> None:
        """Record the factorization of an inertia matrix with the sparsity of a tree."""
        tape, size = series.tape, len(parents)
        A = [list(mass[row * size : (row + 1) * size]) for row in range(size)]
        self.series = series
        self.factors: list[dict[int, Ref]] = [{} for _ in range(size)]
        self.inverse = [ZERO] * size
        for k in reversed(range(size)):
            self.inverse[k] = tape.div(ONE, A[k][k])
            above, i = [], parents[k]
            while i >= 0:
                above.append(i)
                i = parents[i]
            for position, i in enumerate(above):
                factor = self.factors[k][i] = tape.mul(A[k][i], self.inverse[k])
                for j in above[position:]:
                    A[i][j] = A[j][i] = tape.sub(A[i][j], tape.mul(factor, A[k][j]))

    def __call__(self, right: Sequence[Ref], *, kept: bool) -> list[Ref]:
        """Return references of M^-1 right, (nv,), for a right side of references. ``kept`` is true for systems of order
        k, which read the factors as values kept since order 0."""
        tape, read = self.series.tape, self.series.keep if kept else (lambda ref: ref)
        x = list(right)
        for k in reversed(range(len(x))):
            for i, factor in self.factors[k].items():
                x[i] = tape.sub(x[i], tape.mul(read(factor), x[k]))
        x = [tape.mul(read(inverse), value) for inverse, value in zip(self.inverse, x, strict=True)]
        for k in range(len(x)):
            for i, factor in self.factors[k].items():
                x[k] = tape.sub(x[k], tape.mul(read(factor), x[i]))
        return x
