"""Initial assembly: redundant constraint equations removed, the initial state made consistent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.compiled.coordinates import coordinate_names, coordinate_units
from eomgen.compiled.initial_state import corrected_start, kept_components
from eomgen.errors import DescriptionError, Message, ModelError, Problem
from eomgen.solvers.beams import Beams, beams_of
from eomgen.solvers.consistency import assemble
from eomgen.solvers.constraint_rows import (
    EPSILON,
    REDUNDANT,
    ConstrainedSystem,
    RowsInMetric,
    constraints_named,
    elastic_components,
    split_sizes,
)
from eomgen.solvers.redundancy import Redundancy, check_left_out, left_over, redundancy
from eomgen.symbolic.evaluate import Evaluation
from eomgen.symbolic.operations import InputSymbol
from eomgen.system.terms import NONZEROS, PURPOSES

if TYPE_CHECKING:
    from eomgen.scene.joints.model import LightJoint
    from eomgen.system.description import Description
    from eomgen.system.system import System

#: Terms for finding a consistent state, and the redundant rows.
NEEDED = PURPOSES["initial_assembly"]
#: The same with the nonzeros of M and B.
SPARSE = tuple(NONZEROS.get(name, name) for name in NEEDED)


def with_initial_assembly(
    derive: Callable[[Sequence[str] | None, Sequence[int]], System],
    terms: Sequence[str] | None = None,
    description: Description | None = None,
    *,
    whole: bool = True,
    light: Sequence[LightJoint] = (),
) -> System:
    """Return a System without redundant constraint rows and with a consistent initial state, with notes and warnings on
    both.

    Parameters
    ----------
    derive : callable
        Derives the System with the given terms and without the given rows.
    terms : sequence of str, optional
        The functions wanted.
    description : Description, optional
        Units of coordinates, for the note on changes, and the geometrically exact beams.
    whole : bool
        Whether M and B are whole matrices, else sparse ones, which large systems need.
    light : sequence of LightJoint
        Joints without inertia: the motion along M's null space has to follow from the constraints.

    Raises
    ------
    ModelError
        The constraints contradict each other, or a drive has no effect.
    DescriptionError
        A motion of a joint without inertia is not determined.
    """
    beams = description is not None and bool(description.exact_beams)
    terms_of_state = NEEDED if beams or whole else SPARSE
    system = derive((*terms_of_state, *(("poses",) if beams else ())), ())
    if not system.multipliers:
        if light:
            raise DescriptionError([item.problem for item in light])
        return derive(terms, ())
    equations = constraint_equations(system, description=description)
    kept = None if description is None else kept_components(system.factors, description.starts)
    assembly = assemble(equations, np.array(system.initial_q), np.array(system.initial_v), kept=kept)
    rows = redundancy(equations, assembly.q)
    _refuse_surplus_drives(system, rows)
    _refuse_undetermined(system, equations, assembly.q, light)
    prescribed, locked = _without_freedom(system, equations, assembly.q, rows)
    undetermined = _undetermined_rows(system, equations, assembly.q, rows)
    sensitive = _sensitive(system, equations, assembly.q, assembly.v, rows.dependent)
    units = coordinate_units(system.factors, description.coordinates if description is not None else ())
    guess = np.array(system.initial_q), np.array(system.initial_v)
    freedoms = system.nv - len(system.multipliers) + len(rows.dependent)
    starts = () if description is None else description.starts
    names = coordinate_names(system.factors)
    changes = corrected_start(assembly, guess, names, units, freedoms=freedoms, starts=starts)
    corrections = [*assembly.corrections(), *changes]
    if rows.dependent:  # a small contradiction to other rows no longer prevents the solution of the rows
        assembly = assemble(equations.without(rows.dependent), assembly.q, assembly.v, kept=kept)
    left_out = _left_out(system, equations, assembly.q, rows)
    notes = [*left_out, *prescribed, *locked, *undetermined, *corrections, *assembly.deviations]
    system = derive(terms, rows.dependent)
    return replace(
        system,
        initial_q=tuple(map(float, assembly.q)),
        initial_v=tuple(map(float, assembly.v)),
        asked_q=tuple(map(float, guess[0])),
        asked_v=tuple(map(float, guess[1])),
        notes=(*system.notes, *map(Message, notes)),
        warnings=(*system.warnings, *map(Message, (*locked, *undetermined))),
        left_out=sensitive,
    )


def _refuse_surplus_drives(system: System, rows: Redundancy) -> None:
    """Raise ModelError if the row of a drive follows from earlier rows: the motion would be left out without effect."""
    surplus = [system.multipliers[row] for row in rows.dependent if _is_driven(system, row)]
    if surplus:
        fault = (
            f"the constraints before it already determine this motion, so the drive has no effect: {surplus[0]} [E2202]"
        )
        hint = "the drive removed, or a constraint less, such as another drive of the same loop"
        raise ModelError(Problem("constraints", fault, hint, data=constraints_named(surplus[:1])))


def _refuse_undetermined(system: System, equations: ConstrainedSystem, q: Array, light: Sequence[LightJoint]) -> None:
    """Raise DescriptionError if constraints leave a motion free that moves no inertia; names the joints that move most.
    No check without ``light`` joints; q is the assembled configuration."""
    if not light:
        return
    free = RowsInMetric(equations, q, 0.0).without_resistance
    places = {factor.name: factor.v for factor in system.factors}
    moved = [
        (float(np.linalg.norm(free[places[name]])), item.problem)
        for item in light
        for name in (item.joint, item.body)
        if name in places
    ]
    most = max((size for size, _ in moved), default=0.0)
    if most > REDUNDANT:
        raise DescriptionError([*dict.fromkeys(problem for size, problem in moved if size >= 0.5 * most)])
    if free.shape[1]:
        name = max(places, key=lambda name: float(np.linalg.norm(free[places[name]])))
        fault = "a motion of it moves neither mass nor inertia, and no constraint holds it [E2235]"
        raise DescriptionError(
            Problem(f"joints.{name}", fault, "inertia of its parts, or a constraint that holds them")
        )


def _left_out(system: System, equations: ConstrainedSystem, q: Array, rows: Redundancy) -> list[str]:
    """Return a note for each dependent row that is left out, with the row's violation if lengths or axes hardly fit."""
    off = left_over(equations, q, rows.dependent)
    by = {row: f", though it is off by {abs(value):.3g}" for row, value in off.items()}
    return [
        f"{system.multipliers[row]} follows from the constraints before it and is left out{by.get(row, '')} [W0274]"
        for row in rows.dependent
    ]


def _without_freedom(
    system: System, equations: ConstrainedSystem, q: Array, rows: Redundancy
) -> tuple[list[str], list[str]]:
    """Return two lists of sentences, for constraints that leave no velocity free; both empty otherwise. The first has a
    note if drives prescribe all motion, the second a warning if no part can move."""
    kept = [row for row in range(len(system.multipliers)) if row not in rows.dependent]
    if len(kept) < system.nv:
        return [], []
    undriven = [row for row in range(len(system.multipliers)) if not _is_driven(system, row)]
    if len(undriven) - len(redundancy(equations, q, rows=undriven).dependent) < system.nv:
        drivers = ", ".join(system.multipliers[row] for row in kept if _is_driven(system, row))
        return [f"all motion is prescribed: {drivers} and the constraints leave no velocity free [W0275]"], []
    almost = "; ".join(f"of {system.multipliers[row]} only {part:.1g} is new" for row, part in rows.hardly.items())
    fault = (
        f"nothing can move: {system.nv} velocities are held by as many constraint rows that do not follow from each"
        f" other{f' ({almost})' if almost else ''} [W0276]"
    )
    fewer = (
        "a constraint less, or one of fewer rows; for a motion that is prescribed, a drive or t in one of the equations"
    )
    hint = "axes and lengths that fit" if almost else fewer
    return [], [f"{fault}; try: {hint}"]


def _undetermined_rows(system: System, equations: ConstrainedSystem, q: Array, rows: Redundancy) -> list[str]:
    """Return a warning for each row that follows from other rows at the start q and hardly adds a condition nearby."""
    if not rows.hardly:
        return []
    here = RowsInMetric(equations.without(rows.dependent), q, 0.0)
    if not np.all(here.natural > 0.0):
        return []
    lengths = np.linalg.svd(here.scaled_rows / here.natural[:, np.newaxis], compute_uv=False)
    if lengths[-1] > EPSILON * len(lengths) * lengths[0]:
        return []
    return [
        f"at the start {system.multipliers[row]} follows from the other rows, and nearby only {part:.1g} of it is new:"
        " nothing determines its force, and no implicit method can start; try: another start, or a constraint"
        ' less (of a straight beam held at both ends: model = "kirchhoff", which stretches) [W0277]'
        for row, part in rows.hardly.items()
    ]


def _sensitive(
    system: System, equations: ConstrainedSystem, q: Array, v: Array, left_out: Sequence[int]
) -> tuple[str, ...]:
    """Return the names of the rows left out if these follow from other rows at the default parameters only, else ().
    Tried at nearby parameters: rows are analytic in parameters, so a dependence at arbitrary values nearby is a
    dependence everywhere. q and v are the assembled state, ``left_out`` the numbers of the rows."""
    rows = [system.functions[name] for name in ("constraint", "constraint_velocity") if name in system.functions]
    refs = [ref for function in rows for ref in function.refs]
    entering = [symbol.index for symbol in system.tape.depends_on(refs) if symbol.block == "p"] if left_out else []
    if not entering:
        return ()
    names = tuple(system.multipliers[row] for row in left_out)
    defaults = np.array([parameter.value for parameter in system.parameters])
    extent = float(np.max(equations.sizes(q, 0.0)[1], initial=0.0)) or 1.0
    generator = np.random.default_rng(3)
    for _ in range(2):
        nearby = defaults.copy()
        nearby[entering] += 1e-3 * (np.abs(defaults[entering]) + extent) * generator.uniform(0.5, 1.0, len(entering))
        nearby_equations = constraint_equations(system, nearby)
        try:
            assembly = assemble(nearby_equations.without(left_out), q, v)
            check_left_out(nearby_equations, names, assembly.q, assembly.v)
        except ModelError:
            return names
    return ()


def _is_driven(system: System, row: int) -> bool:
    """Return whether a constraint equation prescribes a motion in time, independent of the base."""
    level = row < system.holonomic
    ref = system.functions["constraint" if level else "constraint_velocity"].refs[row]
    return InputSymbol("t", 0) in system.tape.depends_on([ref])


def constraint_equations(
    system: System, parameters: Array | None = None, description: Description | None = None
) -> ConstrainedSystem:
    """Return the constraints of a System as functions of arrays, evaluated on the tape, at parameters (np,). The
    scene's parameters are the default. Geometrically exact beams are included if a description is given and the System
    has the term ``poses``; M and B are sparse if the System has their nonzeros."""
    defaults = np.array([parameter.value for parameter in system.parameters]) if parameters is None else parameters

    @cache
    def evaluation(function: str) -> Evaluation:
        return Evaluation(system.tape, system.functions[function].refs)

    def at(function: str, t: float, **state: Array) -> Array:
        inputs: dict[str, Any] = {"p": defaults, **state, "t": np.array([t])}
        with np.errstate(all="ignore"):  # values that are not finite are reported by name at use
            if "base" in system.functions[function].inputs:
                inputs["base"] = evaluation("base").on_arrays(inputs)
            return np.array(evaluation(function).on_arrays(inputs), dtype=float)

    rows, nv = len(system.multipliers), system.nv
    sparse = "mass_values" in system.functions

    def matrix(whole: str, nonzeros: str, pattern: str, shape: tuple[int, int], q: Array, t: float) -> Any:
        if not sparse:
            return at(whole, t, q=q).reshape(shape)
        from scipy.sparse import csr_matrix  # noqa: PLC0415  # small systems have whole matrices

        places = np.array(system.patterns[pattern], dtype=np.int64).reshape(-1, 2).T
        return csr_matrix((at(nonzeros, t, q=q), (places[0], places[1])), shape=shape)

    return ConstrainedSystem(
        factors=system.factors,
        names=system.multipliers,
        units=system.row_units,
        angular=np.array(system.angular, dtype=bool),
        holonomic=system.holonomic,
        constraint=lambda q, t: at("constraint", t, q=q) if system.holonomic else np.zeros(0),
        velocity=lambda q, v, t: at("constraint_velocity", t, q=q, v=v),
        jacobian=lambda q, t: matrix("constraint_jacobian", "jacobian_values", "B", (rows, nv), q, t),
        mass=lambda q: matrix("mass", "mass_values", "M_values", (nv, nv), q, 0.0),
        sizes=lambda q, t: split_sizes(at("constraint_size", t, q=q)),
        elastic=elastic_components(system.factors, [item.name for item in system.slopes]),
        beams=_beams(system, description, defaults, lambda q: at("poses", 0.0, q=q).reshape(len(q), -1, 7)),
    )


def _beams(system: System, description: Description | None, p: Array, poses: Callable[[Array], Array]) -> Beams | None:
    """Return the geometrically exact beams of a System at parameters (np,); None if the system has no beams."""
    if description is None or not description.element_stiffness:
        return None
    values = description.values({item.name: value for item, value in zip(system.parameters, p.tolist(), strict=True)})
    return beams_of(
        description.element_stiffness, values, system.bodies, system.factors, poses, absolute=bool(description.joints)
    )
