"""Equations of a step and outputs with their partials at rows of a run, evaluated in batches by compiled terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.constraints import accelerations
from eomgen.compiled.functions import Functions
from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem
from eomgen.simulation.stepping.states import PrescribedInputs, States
from eomgen.system.system import second_blocks

#: Terms for the partials, if present in a scene.
_TERMS = (
    *("mass", "residual", "partials", "internal_rate", "internal_partials", "constraint_jacobian"),
    *("constraint", "constraint_velocity", "constraint_bias", "velocity_partials", "acceleration_partials"),
    *("reaction_partials", "outputs", "output_partials", "parameter_partials", "output_parameter_partials"),
)


@dataclass(frozen=True)
class EquationPartials:
    """Partials of the equations e at n rows of a run, each (n, equations, variables).

    The equations in order: residual (nv), minus the rates of internal states (nz), holonomic constraints on positions,
    constraints on velocities (all rows of B).

    Attributes
    ----------
    Jq, Jv, Ja : in q (left-trivialised), v and vdot, nv columns each
    Jz, Jlam : in internal states and multipliers
    P : in the chosen parameters, then along the directions of inputs
    """

    Jq: Array
    Jv: Array
    Ja: Array
    Jz: Array
    Jlam: Array
    P: Array


@dataclass(frozen=True)
class EquationBlocks:
    """Partials of the equations at n rows, one dense block per kind of equation.

    Attributes
    ----------
    Rq, Rv, Ra, Rz : of the residual in q, v, vdot and internal states
    Fq, Fv, Fz : of the rates of internal states
    B : of the rates of all constraints in v, (n, nl, nv); its transpose is of the residual in multipliers, its first
        rows are of the constraints on positions in q
    Z : of the rates of all constraints in q
    Rp, Fp, Hp, Zp : of residual, rates of internal states, constraints on positions, rates of constraints in the chosen
        parameters, then along the directions of inputs
    """

    Rq: Array
    Rv: Array
    Ra: Array
    Rz: Array
    Fq: Array
    Fv: Array
    Fz: Array
    B: Array
    Z: Array
    Rp: Array
    Fp: Array
    Hp: Array
    Zp: Array

    def at(self, rows: slice) -> EquationBlocks:
        """Return the partials at some of the rows."""
        return EquationBlocks(*(block[rows] for block in vars(self).values()))


def rows_of(blocks: Mapping[str, Array], rows: slice | int | NDArray[Any]) -> dict[str, Array]:
    """Return input blocks at some rows; parameters may be the same at all rows."""
    return {name: array if name == "p" and array.ndim == 1 else array[rows] for name, array in blocks.items()}


def bordered_matrix(M: Array, B: Array, across: Array | None = None) -> Array:
    """Return M (..., nv, nv) with B below and ``across``, or the transposed B, to the right."""
    across = np.swapaxes(B, -1, -2) if across is None else across
    below = np.concatenate([B, np.zeros((*B.shape[:-1], B.shape[-2]))], axis=-1)
    return np.concatenate([np.concatenate([M, across], axis=-1), below], axis=-2)


def solve(matrix: Array, right: Array, times: Array) -> Array:
    """Return -matrix^-1 right for n steps or rows, (n, size, columns). Raises NumericalError, with the time of `times`
    (n,), if a matrix is singular."""
    try:
        return np.asarray(-np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        number = next((k for k, block in enumerate(matrix) if np.linalg.matrix_rank(block) < len(block)), 0)
        fault = f"the equations near t = {times[number]:.9g} s, made linear, have no solution [E0637]"
        hint = "a smaller step, or constraints that do not repeat"
        raise NumericalError(Problem("sensitivities", fault, hint)) from None


class StepEquations:
    """The equations e of a step and the outputs of a model, with their partials at rows of a run.

    Parameters
    ----------
    p : (np,) of the run
    chosen : columns of the parameters that derivatives are taken by
    outputs : rows of the outputs that derivatives are taken of
    holonomic : rows of constraints on positions
    driven : directions of inputs, which are further parameters after the chosen parameters: the change of inputs along
        these directions differs from row to row: block ``du`` of the values, (n, nu, driven)
    """

    def __init__(
        self,
        model: CompiledModel,
        p: Array,
        chosen: Sequence[int],
        outputs: Sequence[int],
        holonomic: int,
        driven: int = 0,
    ) -> None:
        """Collect the terms of a model at parameters p, with partials in the ``chosen`` parameters and in the
        drives."""
        self.model, self.p = model.having(_TERMS), p
        self.chosen, self.outputs, self.holonomic = list(chosen), list(outputs), holonomic
        self.nv, self.nz, self.nl, self.driven = model.nv, model.nz, len(model.multipliers), driven
        self.parameters = len(self.chosen) + driven
        places = second_blocks(
            nv=self.nv,
            nz=self.nz,
            nu=model.nu,
            holonomic=holonomic,
            rows=self.nl,
            outputs=sum(int(item["size"]) for item in model.library.layout["outputs"]),
            parameters=len(model.parameters),
        )
        self._later: dict[str, CompiledModel] = {}
        self._known_zeros: dict[tuple[int, ...], Array] = {}
        self._weighted, self._along = places.places("weights"), places.places("direction")

    def _functions(self, term: str) -> Functions:
        """Return the evaluation of a term; partials in inputs and second derivatives are compiled at first use."""
        if term not in ("linearization", "second_partials"):
            return self.model.functions
        if term not in self._later:
            self._later[term] = self.model.having((term,))
        return self._later[term].functions

    def values(self, states: States, prescribed: PrescribedInputs, du: Array | None = None) -> dict[str, Array]:
        """Return the input blocks of compiled functions at n rows, by name: p, t, q, v, a, z, lam, u, base and du.
        ``du`` (n, nu, driven) are changes of inputs along directions; None for zeros."""
        values = {"p": self.p, "t": states.t, "q": states.q, "v": states.v, "a": states.a, "z": states.z}
        values["lam"] = states.multipliers
        if prescribed.u is not None:
            values["u"] = prescribed.u
        if prescribed.base is not None:
            values["base"] = prescribed.base
        if self.driven:
            none = np.zeros((len(states.t), self.model.nu, self.driven))
            values["du"] = none if du is None else du
        return values

    def of(self, term: str, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return the outputs of a compiled term at n rows, (n, ...) by name; an empty mapping if the scene has no such
        term."""
        functions = self._functions(term)
        if term not in functions:
            return {}
        count = len(values["t"])
        if count == 1:  # without the bookkeeping of batches
            results = functions(term, rows_of({name: values[name] for name in functions.inputs(term)}, 0))
            return {name: array[np.newaxis] for name, array in zip(functions.output_names(term), results, strict=True)}
        results = functions(term, values)
        by_name = dict(zip(functions.output_names(term), results, strict=True))
        if all(len(array) == count for array in results) and set(functions.inputs(term)) - {"p"}:
            return by_name
        dimensions = zip(by_name.items(), _dimensions(functions, term), strict=True)
        return {
            name: np.broadcast_to(array, (count, *array.shape[array.ndim - n :])) for (name, array), n in dimensions
        }

    @property
    def driven_by(self) -> set[str]:
        """Arguments of e besides the state and parameters: some of ``t``, ``u`` and ``base``."""
        functions = self.model.functions
        terms = [name for name in ("residual", "internal_rate") if name in functions]
        return {"t", "u", "base"} & {block for name in terms for block in functions.inputs(name)}

    @property
    def outputs_accelerate(self) -> bool:
        """Whether outputs depend on accelerations."""
        return "a" in self.model.functions.inputs("outputs")

    @property
    def record_size(self) -> int:
        """Rows of the record of a state: q, v, vdot, z and multipliers."""
        return 3 * self.nv + self.nz + self.nl

    @property
    def _output_columns(self) -> dict[str, slice]:
        """Columns of the partials of outputs in a record, by name of the block."""
        sizes = {"Yq": self.nv, "Yv": self.nv, "Ya": self.nv, "Yz": self.nz, "Ylam": self.nl}
        ends = np.cumsum(list(sizes.values())).tolist()
        return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}

    def residuals(self, values: Mapping[str, Array]) -> Array:
        """Return e, (n, rows), of scenes without constraints."""
        (r,) = self.of("residual", values).values()
        return np.concatenate([r, -self.of("internal_rate", values)["zdot"]], axis=1) if self.nz else r

    def with_accelerations(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return input blocks with the accelerations and multipliers of their states; ``values`` have zeros instead."""
        if self.nl and len(values["t"]) == 1:  # without the bookkeeping of batches
            vdot, lam = (array[np.newaxis] for array in accelerations(self.model.functions, rows_of(values, 0)))
        elif self.nl:
            vdot, lam = accelerations(self.model.functions, values)
        else:
            (residual,), (M,) = self.of("residual", values).values(), self.of("mass", values).values()
            vdot, lam = solve(M, residual[..., np.newaxis], values["t"])[..., 0], values["lam"]
        return {**values, "a": vdot, "lam": lam}

    def partials(self, values: Mapping[str, Array], *, parameters: bool = True) -> EquationPartials:
        """Return the partials of the equations e at n rows; partials in the parameters are 0 unless ``parameters``."""
        nv, nz, nl, nh, count = self.nv, self.nz, self.nl, self.holonomic, len(values["t"])
        of = self.blocks(values, parameters=parameters)
        if not nz and not nl:
            none = np.zeros((count, nv, 0))
            return EquationPartials(of.Rq, of.Rv, of.Ra, none, none, of.Rp)
        rows = nv + nz + nh + nl
        Jq, Jv, Ja = (np.zeros((count, rows, nv)) for _ in range(3))
        Jz, Jlam, Jp = (np.zeros((count, rows, size)) for size in (nz, nl, of.Rp.shape[2]))
        Jq[:, :nv], Jv[:, :nv], Ja[:, :nv], Jp[:, :nv] = of.Rq, of.Rv, of.Ra, of.Rp
        if nz:
            state_rows = slice(nv, nv + nz)
            Jz[:, :nv] = of.Rz
            Jq[:, state_rows], Jv[:, state_rows], Jz[:, state_rows], Jp[:, state_rows] = -of.Fq, -of.Fv, -of.Fz, -of.Fp
        if nl:
            state_rows, rates = slice(nv + nz, nv + nz + nh), slice(nv + nz + nh, rows)
            Jlam[:, :nv] = np.swapaxes(of.B, 1, 2)
            Jq[:, state_rows], Jp[:, state_rows] = of.B[:, :nh], of.Hp
            Jq[:, rates], Jv[:, rates], Jp[:, rates] = of.Z, of.B, of.Zp
        return EquationPartials(Jq, Jv, Ja, Jz, Jlam, Jp)

    def blocks(self, values: Mapping[str, Array], *, parameters: bool = True) -> EquationBlocks:
        """Return the partials of e at n rows by kinds of equations; partials in the parameters are 0 unless
        ``parameters``."""
        nv, nz, nl, nh, count = self.nv, self.nz, self.nl, self.holonomic, len(values["t"])
        of_residual = self.of("partials", values)
        of_rates = self.of("internal_partials", values) if nz else {}
        by_parameters = self.of("parameter_partials", values) if self.chosen and parameters else {}
        names = {"Rp": nv, "Fp": nz, "Phip": nh, "Zp": nl}
        by = [self._parameters(by_parameters, name, size, count) for name, size in names.items()]
        if self.driven and parameters:
            of_inputs = self.input_partials(values)[0] @ values["du"]
            places = np.cumsum([0, nv, nz, nh, nl])
            for k, (first, last, sign) in enumerate(zip(places[:-1], places[1:], (1.0, -1.0, 1.0, 1.0), strict=True)):
                by[k] = np.concatenate([by[k], sign * of_inputs[:, first:last]], axis=2)

        def block(blocks: Mapping[str, Array], name: str, rows: int, columns: int) -> Array:
            return blocks[name] if name in blocks else self._zeros(count, rows, columns)

        B = self.of("constraint_jacobian", values)["B"] if nl else self._zeros(count, 0, nv)
        Z = self.of("velocity_partials", values)["Z"] if nl else B
        Rq, Rv, Ra = (of_residual[name] for name in "KCM")
        Fq, Fv, Fz = (block(of_rates, name, nz, size) for name, size in (("Fq", nv), ("Fv", nv), ("Fz", nz)))
        return EquationBlocks(Rq, Rv, Ra, block(of_rates, "Rz", nv, nz), Fq, Fv, Fz, B, Z, *by)

    def _zeros(self, *shape: int) -> Array:
        """Return zeros in the memory of one zero."""
        zeros = self._known_zeros.get(shape)
        if zeros is None:
            zeros = self._known_zeros[shape] = np.broadcast_to(np.zeros(()), shape)
        return zeros

    def forced_changes(self, blocks: Mapping[str, Array], partials: EquationPartials) -> Array:
        """Return changes of accelerations and multipliers with q, v, z and parameters at n states, (n, nv + nl, size +
        parameters). `blocks` are input blocks with these accelerations and multipliers, `partials` the partials of e
        there."""
        e, nv, nl, count = partials, self.nv, self.nl, len(partials.Jq)
        right = np.concatenate([e.Jq, e.Jv, e.Jz, e.P], axis=2)[:, :nv]
        if not nl:
            return solve(e.Ja[:, :nv], right, blocks["t"])
        by_state = self.of("acceleration_partials", blocks)
        none = np.zeros((count, nl, self.nz))
        below = np.concatenate([by_state["Aq"], by_state["Av"], none, self.acceleration_parameters(blocks)], axis=2)
        matrix = bordered_matrix(e.Ja[:, :nv], e.Jv[:, -nl:])
        return solve(matrix, np.concatenate([right, below], axis=1), blocks["t"])

    def output_partials(self, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Return the partials of the chosen outputs at n rows of a run.

        Parameters
        ----------
        values : arguments of the compiled terms by name (``t``, ``q``, ...), n rows each

        Returns
        -------
        Y : (n, outputs, 3 nv + nz + nl) in q (left-trivialised), v, vdot, z and the multipliers
        Yp : (n, outputs, ...) in the chosen parameters, then along the directions of inputs
        """
        count, rows = len(values["t"]), len(self.outputs)
        partials = self.of("output_partials", values)
        Y = np.zeros((count, rows, self.record_size))
        for name, output_columns in self._output_columns.items():
            if name in partials:
                Y[:, :, output_columns] = self._rows(partials[name])
        by_parameters = self.of("output_parameter_partials", values) if self.chosen else {}
        Yp = self._parameters({name: self._rows(array) for name, array in by_parameters.items()}, "Yp", rows, count)
        return Y, self._with_inputs(Yp, values)

    def weighed_outputs(self, values: Mapping[str, Array], weights: Array) -> tuple[Array, Array]:
        """Return derivatives of sums of outputs by each of n rows.

        Parameters
        ----------
        values : as of ``output_partials``
        weights : (n, outputs, functionals)

        Returns
        -------
        by_state : (n, 3 nv + nz + nl, functionals)
        by_parameters : (parameters, functionals), of all rows together
        """
        used = np.flatnonzero(weights.any(axis=(0, 2)))
        partials = self.of("output_partials", values)
        by_parameters = self.of("output_parameter_partials", values) if self.chosen else {}
        of_state = np.zeros((len(weights), self.record_size, weights.shape[2]))
        of_parameters = np.zeros((self.parameters, weights.shape[2]))
        for name, rows in self._output_columns.items():
            for column in used.tolist() if name in partials and rows.stop > rows.start else ():
                row = partials[name][:, self.outputs[column], :, np.newaxis]
                of_state[:, rows] += row * weights[:, column, np.newaxis]
        for column in used.tolist() if "Yp" in by_parameters else ():
            of_parameters[: len(self.chosen)] += (
                by_parameters["Yp"][:, self.outputs[column], self.chosen].T @ weights[:, column]
            )
        if self.driven and len(used):
            by_inputs = self.input_partials(values)[1] @ values["du"]
            of_parameters[len(self.chosen) :] = np.einsum("nod,nof->df", by_inputs[:, used], weights[:, used])
        return of_state, of_parameters

    def input_partials(self, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Return partials of e in the inputs, (n, rows, nu), and of the chosen outputs, (n, outputs, nu), at n rows."""
        inputs, count = self.model.description.inputs, len(values["t"])
        driven = [number for number, item in enumerate(inputs) if not item.given]
        prescribed = [number for number, item in enumerate(inputs) if item.given]
        of_e = np.zeros((count, self.nv + self.nz + self.holonomic + self.nl, len(inputs)))
        of_outputs = np.zeros((count, len(self.outputs), len(inputs)))
        linear, outputs = self.of("linearization", values), self.of("output_partials", values)
        for columns, names in ((driven, ("B0", "Fu", "Yu")), (prescribed, ("E0", "Fw", "Yw"))):
            rows = (of_e[:, : self.nv], of_e[:, self.nv : self.nv + self.nz], of_outputs)
            for target, name in zip(rows, names, strict=True):
                matrix = (linear | outputs).get(name)
                if matrix is not None:
                    picked = matrix[:, self.outputs] if target is of_outputs else -matrix
                    target[:, :, columns] = picked[:, :, : len(columns)]
        return of_e, of_outputs

    def second_partials(
        self,
        values: Mapping[str, Array],
        multipliers: Array,
        along: Array,
        weights: Array | None = None,
        of_accelerations: Array | None = None,
    ) -> Array:
        """Return changes of the gradient of weights . outputs - multipliers . e along directions.

        Parameters
        ----------
        multipliers : (n, rows) of e
        along : (n, 3 nv + nz + nl + parameters, directions) changes of q, v, vdot, z, multipliers and parameters
        weights : (n, outputs)
        of_accelerations : (n, nl), multipliers of the constraints' accelerations

        Returns
        -------
        (n, 3 nv + nz + nl + parameters, directions)
        """
        functions, output_slice = self._functions("second_partials"), self._weighted
        count, _, directions = along.shape
        weighted = np.zeros((count, 1, functions.sizes["weights"]))
        weighted[:, 0, : output_slice["w"].stop] = -multipliers
        weighted[:, 0, output_slice["zdot"]] *= -1.0  # e has minus the rates
        if of_accelerations is not None:
            weighted[:, 0, output_slice["wdot"]] = -of_accelerations
        if weights is not None:
            weighted[:, 0, output_slice["y"].start + np.array(self.outputs, dtype=int)] = weights
        state, of_inputs = self._along["p"].start, self._along["u"]
        chosen = state + np.array(self.chosen, dtype=int)
        of_state, of_parameters, driven = np.split(along, [state, state + len(chosen)], axis=1)
        changes = np.zeros((count, directions, functions.sizes["direction"]))
        changes[:, :, :state] = np.swapaxes(of_state, 1, 2)
        changes[:, :, chosen] = np.swapaxes(of_parameters, 1, 2)
        if self.driven:
            changes[:, :, of_inputs] = np.swapaxes(values["du"] @ driven, 1, 2)
        at_rows = {name: array if name == "p" else array[:, np.newaxis] for name, array in values.items()}
        (result,) = functions("second_partials", {**at_rows, "weights": weighted, "direction": changes})
        result = np.swapaxes(np.broadcast_to(result, changes.shape), 1, 2)
        kept = np.ascontiguousarray(result[:, [*range(state), *chosen]])
        if not self.driven:
            return kept
        return np.concatenate([kept, np.swapaxes(values["du"], 1, 2) @ result[:, of_inputs]], axis=1)

    def second_reactions(
        self, values: Mapping[str, Array], eta: Array, weights: Array, along: Array
    ) -> tuple[Array, Array, Array]:
        """Return changes of the gradient of weights . B^T eta, holonomic rows alone, in q, eta and the parameters.

        Parameters
        ----------
        eta : (n, holonomic)
        weights : (n, nv)
        along : (n, nv + holonomic + parameters, directions), of q, eta and parameters

        Returns
        -------
        (n, nv, directions), (n, holonomic, directions), (n, parameters, directions)
        """
        nv, nh, first = self.nv, self.holonomic, 3 * self.nv + self.nz
        still = {**values, "v": np.zeros_like(values["v"]), "a": np.zeros_like(values["a"])}
        lam = np.zeros_like(values["lam"])
        multipliers = np.zeros((len(eta), nv + self.nz + nh + self.nl))
        multipliers[:, :nv] = -weights
        d = np.zeros((len(eta), first + self.nl + self.parameters, along.shape[2]))
        d[:, :nv], d[:, first + self.nl :] = along[:, :nv], along[:, nv + nh :]
        without = self.second_partials({**still, "lam": lam.copy()}, multipliers, d)
        lam[:, :nh], d[:, first : first + nh] = eta, along[:, nv : nv + nh]
        whole = self.second_partials({**still, "lam": lam}, multipliers, d)
        change = whole - without
        return change[:, :nv], whole[:, first : first + nh], change[:, first + self.nl :]

    def acceleration_parameters(self, values: Mapping[str, Array]) -> Array:
        """Return the partials of the constraints' accelerations in the parameters, (n, rows, parameters)."""
        result = self.parameter_rows(values, "Ap", self.nl)
        return np.concatenate([result, np.zeros((len(result), self.nl, self.driven))], axis=2)

    def parameter_rows(self, values: Mapping[str, Array], name: str, rows: int) -> Array:
        """Return a block of ``parameter_partials`` in the chosen parameters, (n, rows, parameters)."""
        partials = self.of("parameter_partials", values) if self.chosen else {}
        return self._parameters(partials, name, rows, len(values["t"]))

    def reaction_partials(self, values: Mapping[str, Array], eta: Array) -> tuple[Array, Array]:
        """Return partials of B^T eta, holonomic rows alone, at n rows for eta (n, holonomic). The first array is in q,
        (n, nv, nv), the second in the parameters, (n, nv, parameters)."""
        lam = np.zeros_like(values["lam"])
        lam[:, : self.holonomic] = eta
        forces = self.of("reaction_partials", {**values, "lam": lam})
        of_parameters = self._parameters(forces, "Np", self.nv, len(eta))
        if self.driven and any(of_parameters.strides):
            none = self._zeros(len(eta), self.nv, self.driven)
            of_parameters = np.concatenate([of_parameters, none], axis=2)
        elif self.driven:
            of_parameters = self._zeros(len(eta), self.nv, self.parameters)
        return forces["N"], of_parameters

    def output_values(self, values: Mapping[str, Array]) -> Array:
        """Return the outputs, (n, outputs)."""
        return self.of("outputs", values)["y"][:, self.outputs]

    def _with_inputs(self, by_parameters: Array, values: Mapping[str, Array]) -> Array:
        """Return partials of outputs, followed by the partials along the directions of inputs."""
        if not self.driven:
            return by_parameters
        return np.concatenate([by_parameters, self.input_partials(values)[1] @ values["du"]], axis=2)

    def _rows(self, of_outputs: Array) -> Array:
        """Return the rows of the chosen outputs, (n, outputs, ...)."""
        return of_outputs if self.outputs == list(range(of_outputs.shape[1])) else of_outputs[:, self.outputs]

    def _parameters(self, partials: Mapping[str, Array], name: str, rows: int, count: int) -> Array:
        if name not in partials:
            return self._zeros(count, rows, len(self.chosen))
        whole = self.chosen == list(range(partials[name].shape[2]))
        return partials[name] if whole else partials[name][:, :, self.chosen]


def _dimensions(functions: Functions, term: str) -> list[int]:
    """Return the number of axes of each output of a term."""
    layouts = functions.library.layout["functions"]
    outputs = next(item["outputs"] for item in layouts if item["name"] == term)
    return [len(item["shape"]) for item in outputs]
