"""Claims of partials: K, C, M, internal states and constraints, the packed matrices of implicit steps, and second
derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from eomgen.lie.product import Factor
from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Second,
    Space,
    Value,
    along_motion,
    constant_directions,
    jacobian,
    move_state,
    spread,
)
from eomgen.system.system import System
from eomgen.system.terms import DIFFERENTIATED

#: Matrices of the residual's partials, with their blocks.
_MATRICES = (("K", "q"), ("C", "v"), ("M", "a"))
_RESIDUAL = ClaimOutput("residual", "r")


def partial_claims(space: Space) -> list[Claim]:
    """Return the claims that K, C and M, and the matrices of internal states, are derivatives of residual and rates.
    Claims belong to terms that the model has."""
    rows = space.rows["v"]
    claims: list[Claim] = []
    if space.has("partials"):
        claims += [
            jacobian(space, ClaimOutput("partials", name), _RESIDUAL, block, rows, meaning=f"d residual / d{block}")
            for name, block in _MATRICES
        ]
    if space.has("internal_partials"):
        term, rate = "internal_partials", ClaimOutput("internal_rate", "zdot")
        claims.append(jacobian(space, ClaimOutput(term, "Rz"), _RESIDUAL, "z", rows, meaning="d residual / dz"))
        claims += [jacobian(space, ClaimOutput(term, f"F{block}"), rate, block, space.rows["z"]) for block in "qvz"]
    return claims


def constraint_claims(space: Space) -> list[Claim]:
    """Return the claims that Jacobian, rates and accelerations of constraints are derivatives of the constraint rows.
    Rows at velocity level come after the holonomic rows. Empty without constraints."""
    if not space.has("constraint_jacobian"):
        return []
    first, rows = space.system.holonomic, space.rows["lam"]
    along_q = along_motion(space.engine, "q")
    B, w = ClaimOutput("constraint_jacobian", "B"), ClaimOutput("constraint_velocity", "w")
    of_velocities = ("velocity_partials", "Z", "v")
    claims = []
    if first:
        Phi = ClaimOutput("constraint", "Phi")
        claims += [
            jacobian(space, B[..., :first, :], Phi, "q", rows[:first]),
            Claim(
                "constraint_velocity.w",
                "d Phi / dt",
                w[..., :first].column,
                source=Phi,
                directions=along_q,
                rows=rows[:first],
                size=_before_cancelling(("constraint_jacobian", "B", "v")),
                at=_violating(space, "v"),
            ),
        ]
    second = Second("d residual / d lam", _by_multipliers)
    claims += [
        jacobian(space, B, w, "v", rows, name="constraint_jacobian.B by w", second=second),
        Claim(
            "constraint_bias.g",
            "d w / dt at vdot = 0",
            ClaimOutput("constraint_bias", "g").column,
            source=w,
            directions=along_q,
            rows=rows,
            size=_before_cancelling(of_velocities),
        ),
    ]
    if space.has("constraint_acceleration"):
        claims.append(
            Claim(
                "constraint_acceleration.w_dot",
                "d w / dt",
                ClaimOutput("constraint_acceleration", "w_dot").column,
                source=w,
                directions=along_motion(space.engine, "q", "v"),
                rows=rows,
                size=_before_cancelling(of_velocities, ("constraint_jacobian", "B", "a")),
                at=_violating(space, "a"),
            )
        )
    return [*claims, jacobian(space, ClaimOutput("velocity_partials", "Z"), w, "q", rows)]


def _violating(space: Space, *blocks: str) -> Callable[[Engine, Blocks], dict[str, Array]]:
    """Return a function to states with velocities, accelerations or multipliers that violate the constraints, unless
    the rates of the rows vanish: the numbers of each block are changed by their own sizes and by the scale of the
    block."""

    def violating(engine: Engine, state: Blocks) -> dict[str, Array]:
        away = {name: state[name] + np.abs(state[name]) + _scale(space, name) for name in blocks if name in state}
        return {**state, **away}

    return violating


def _scale(space: Space, block: str) -> Array:
    """Return the scale of each component of a block, (size,)."""
    return np.asarray(np.abs(space.along[block].matrix).max(axis=1))


def _before_cancelling(*products: tuple[str, str, str]) -> Value:
    """Return a function for the size of a sum of matrices times blocks before the summands cancel, as on the
    constraints. `products` are function and entry of a matrix, and block."""

    def size(engine: Engine, state: Blocks) -> Array:
        sizes = [
            np.abs(engine(function, state)[entry]) @ np.abs(state[of])[..., np.newaxis]
            for function, entry, of in products
        ]
        return np.asarray(np.max(np.sum(sizes, axis=0), axis=(-2, -1)))

    return size


def _by_multipliers(engine: Engine, state: Blocks) -> Array:
    """Return the transpose of d residual / d lam, (..., rows, nv): the residual is linear in the multipliers.

    Multipliers of 2^40, a power of two, hide the rounding of other forces, for instance of stiff beams.
    """
    large = 2.0**40 * np.eye(state["lam"].shape[-1])
    around = spread(state)
    forth, back = (engine("residual", {**around, "lam": around["lam"] + by})["r"] for by in (large, -large))
    return np.asarray((forth - back) / 2.0**41)


#: Terms with the rows and matrices that functions of implicit steppers pack.
_OF_ROWS = {"r": ("residual", "v"), "Phi": ("constraint", "lam"), "w": ("constraint_velocity", "lam"),
            "zdot": ("internal_rate", "z")}  # fmt: skip  # a table
_OF_MATRICES = {
    **dict.fromkeys("KCM", "partials"),
    **dict.fromkeys(("Rz", "Fq", "Fv", "Fz"), "internal_partials"),
    **{"B": "constraint_jacobian", "Z": "velocity_partials"},
}


def packed_claims(space: Space) -> list[Claim]:
    """Return the claims that the functions of implicit steppers give the same rows and matrices as the separate terms.
    Matrices are packed as their nonzeros."""
    system = space.system
    claims: list[Claim] = []
    if space.has("equations"):
        claims += [
            _same(space, block.name, *_OF_ROWS[block.name])
            for block in system.functions["equations"].outputs
            if space.has(_OF_ROWS[block.name][0]) and block.refs
        ]
    if space.has("iteration"):
        blocks = [block.name for block in system.functions["iteration"].outputs]
        if "X" in blocks:
            claims += _elimination_claims(space)
        else:
            sources = {name: _OF_MATRICES[name] for name in blocks}
            claims += [_nonzeros_claim("iteration", name, of, system) for name, of in sources.items() if space.has(of)]
    if space.has("jacobian_values"):
        claims.append(_nonzeros_claim("jacobian_values", "B", "constraint_jacobian", system))
    if space.has("mass_values"):
        claims.append(_nonzeros_claim("mass_values", "M", "mass", system, "M_values"))
    return claims


def _same(space: Space, entry: str, second_entry: str, rows: str) -> Claim:
    """Return the claim that ``equations`` and the function `second_entry` give the same output `entry`. Both are
    compared off the motion, unless the rows vanish there; `rows` is the block that names the rows."""

    def off_motion(engine: Engine, state: Blocks) -> dict[str, Array]:
        away = move_state(engine, state, {"q": np.broadcast_to(_scale(space, "q"), state["v"].shape)}, 0.1)
        return _violating(space, "v", "a", "lam")(engine, away)

    return Claim(
        f"equations.{entry}",
        f"as {second_entry}",
        ClaimOutput("equations", entry).column,
        second=Second(second_entry, ClaimOutput(second_entry, entry).column),
        rows=space.rows[rows],
        at=off_motion,
    )


def _nonzeros_claim(function: str, name: str, dense_function: str, system: System, packed: str = "") -> Claim:
    """Return the claim that a function's output of nonzeros equals the matrix `name` of another function. `packed` is
    the output's name, if different from `name`."""
    packed = packed or name
    shape = next(block.shape for block in system.functions[dense_function].outputs if block.name == name)

    return Claim(
        f"{function}.{packed}",
        f"nonzeros of {name}",
        _dense_output(system, function, packed, shape),
        second=Second(dense_function, ClaimOutput(dense_function, name)),
    )


def _dense_output(system: System, function: str, name: str, shape: Sequence[int]) -> Value:
    """Return a function for the matrix with the nonzeros that are an output of a function."""

    def value(engine: Engine, state: Blocks) -> Array:
        if not system.patterns[name]:  # empty, without an output of the function in C
            return np.zeros((*state["q"].shape[:-1], *shape))
        return _dense(engine(function, state)[name], system.patterns[name], shape)

    return value


def _dense(values: Array, places: Sequence[tuple[int, int]], shape: Sequence[int]) -> Array:
    full = np.zeros((*values.shape[:-1], *shape), values.dtype)
    if places:
        full[(..., *np.transpose(places))] = values
    return full


def _elimination_claims(space: Space) -> list[Claim]:
    """Return the claims on K, C and M of a long tree's extended system, with inner unknowns eliminated. Compared are
    derivatives of the residual, and the term ``partials`` if present."""
    from scipy.sparse import csc_array  # noqa: PLC0415  # slow to import, and only long trees need it
    from scipy.sparse.linalg import splu  # noqa: PLC0415

    system = space.system
    nv, inner = system.nv, len(system.inner_owners)

    def elimination(name: str, W: Array) -> Value:
        def value(engine: Engine, state: Blocks) -> Array:
            blocks = engine("iteration", state)
            outer = _dense(blocks[name], system.patterns[name], (nv + inner, nv)) @ W
            result = np.array(outer[..., :nv, :])
            if not inner:  # beams alone, whose elements enter K without inner unknowns
                return result
            for sample in np.ndindex(outer.shape[:-2]):
                rows, columns = np.transpose(system.patterns["X"])
                X = csc_array((blocks["X"][sample], (rows, columns)), shape=(nv + inner, inner))
                result[sample] -= X[:nv] @ splu(csc_array(X[nv:])).solve(np.ascontiguousarray(outer[sample][nv:]))
            return result

        return value

    also = space.has("partials")
    return [
        Claim(
            f"iteration.{name}",
            f"d residual / d{block}",
            elimination(name, space.along[block].matrix),
            source=_RESIDUAL,
            directions=constant_directions({block: space.along[block].matrix.T}),
            second=Second("partials", ClaimOutput("partials", name) @ space.along[block].matrix) if also else None,
            rows=space.rows["v"],
            columns=space.along[block].names,
        )
        for name, block in _MATRICES
    ]


#: Terms used by the gradient, if present.
FIRST = (
    *("partials", "internal_partials", "constraint_jacobian", "velocity_partials", "acceleration_partials"),
    *("output_partials", "parameter_partials", "output_parameter_partials", "linearization"),
)


def second_claims(space: Space) -> list[Claim]:
    """Return the claim that ``second_partials`` is the directional derivative of the gradient of weighted equations.
    The gradient is made of first partials. Empty if the model lacks one of both terms."""
    if not space.has("second_partials", "partials"):
        return []
    rows, system = space.rows, space.system
    blocks = system.second_blocks
    sizes, of_weights = blocks.direction, blocks.places("weights")
    prescribed = [item.given for item in space.description.inputs]

    def gradient(engine: Engine, state: Blocks) -> Array:
        """Return the gradient in q (left-trivialised), v, a, z, lam, p and u, (..., components)."""
        partials = {name: array for term in FIRST if term in engine for name, array in engine(term, state).items()}
        partials |= _by_inputs(partials, prescribed)
        of = {name: state["weights"][..., columns] for name, columns in of_weights.items()}
        batch = state["weights"].shape[:-1]
        parts = []
        for block, size in sizes.items():
            total = np.zeros((*batch, size))
            for weight, matrix in _rows(block, partials, system.holonomic):
                total = total + (of[weight][..., np.newaxis, :] @ matrix)[..., 0, :]
            parts.append(total)
        return np.concatenate(parts, axis=-1)

    def direction(state: Blocks) -> dict[str, Array]:
        parts = {block: state["direction"][..., columns] for block, columns in blocks.places("direction").items()}
        return {block: part[..., np.newaxis, :] for block, part in parts.items() if sizes[block]}

    of_state = [f"{block} {name}" for block in ("q", "v", "a") for name in rows["v"]]
    names = (
        *of_state,
        *rows.get("z", ()),
        *rows.get("lam", ()),
        *(item.name for item in (*system.parameters, *system.inputs)),
    )
    return [
        Claim(
            "second_partials.Hd",
            "d gradient / d direction",
            ClaimOutput("second_partials", "Hd").column,
            source=gradient,
            directions=direction,
            rows=names,
            functions=("partials",),
            sided=True,
        )
    ]


def argument_claims(space: Space) -> list[Claim]:
    """Return the claims of first and second derivatives of terms in all arguments.

    Tunable parameters and time are held if inputs follow them by a law, since inputs are arguments of their own.
    """
    system = space.system
    sizes = system.argument_sizes
    moving = [block for block, size in sizes.items() if size]
    parts = {name: space.along[name].matrix if name in space.along else np.eye(sizes[name]) for name in moving}
    if "inputs" in system.functions and "p" in parts:
        read = system.tape.depends_on(system.functions["inputs"].refs)
        if not any(symbol.block == "p" for symbol in read):  # without p among the directions inputs are held
            del parts["p"]
        for block in (block for block in ("p", "t") if "p" in parts):
            followed = [symbol.index for symbol in read if symbol.block == block]
            parts[block] = parts[block][:, ~np.any(parts[block][followed] != 0.0, axis=0)]
    count, first = sum(part.shape[1] for part in parts.values()), 0
    rates = {block: np.zeros((count, size)) for block, size in sizes.items()}
    for name, part in parts.items():
        rates[name][first : first + part.shape[1]] = part.T
        first += part.shape[1]
    whole = np.concatenate(list(rates.values()), axis=1).T
    rates = {name: rates[name] for name in parts}
    claims = []
    for term in DIFFERENTIATED:
        names = f"{term}_derivatives", f"{term}_hessian"
        if space.has(term, *names):
            claims += _argument_claims(system, term, names, whole, rates)
    return claims


def _argument_claims(
    system: System, term: str, names: tuple[str, str], whole: Array, rates: dict[str, Array]
) -> list[Claim]:
    """Return the claims on a term's Jacobian and Hessian along the columns of ``whole`` (arguments, directions).
    `names` are the functions of Jacobian and Hessian, `rates` the directions by block."""
    height, width = len(system.functions[term].refs), len(whole)

    heights = zip(names, (height, width), strict=True)
    jacobian_of, hessian_of = (_dense_output(system, name, name, (rows, width)) for name, rows in heights)

    def values(engine: Engine, state: Blocks) -> Array:
        blocks = engine(term, state)
        results = [blocks[block.name] for block in system.functions[term].outputs]
        return np.concatenate([x.reshape(*x.shape[: state["q"].ndim - 1], -1) for x in results], axis=-1)

    def gradient(engine: Engine, state: Blocks) -> Array:
        weights = state["weights"][..., np.newaxis, :height]
        return np.asarray((weights @ jacobian_of(engine, state))[..., 0, :])

    def changes(engine: Engine, state: Blocks) -> Array:
        """Return left derivatives of the gradient: the Hessian, and in a rotation half a bracket more."""
        low = hessian_of(engine, state)
        both = low + np.swapaxes(low, -1, -2) - low * np.eye(width)
        return np.asarray((both + _half_brackets(system.factors, gradient(engine, state))) @ whole)

    return [
        Claim(
            f"{names[0]}.{names[0]}",
            f"d {term} / d arguments",
            lambda engine, state: np.asarray(jacobian_of(engine, state) @ whole),
            source=values,
            directions=constant_directions(rates),
            functions=(term,),
        ),
        Claim(
            f"{names[1]}.{names[1]}",
            "d gradient / d arguments",
            changes,
            source=gradient,
            directions=constant_directions(rates),
            functions=(names[0],),
            sided=True,
        ),
    ]


def _half_brackets(factors: Sequence[Factor], gradient: Array) -> Array:
    """Return 1/2 [e_j, e_i] . gradient at (..., i, j), for directions of one factor on a group: X_j X_i f less the
    symmetric part. `gradient` is (..., n); entries of factors R^n are zero."""
    result = np.zeros((*gradient.shape, gradient.shape[-1]), gradient.dtype)
    cross = np.cross(np.eye(3)[:, np.newaxis], np.eye(3)[np.newaxis])  # (i, j, component)
    for factor in factors:
        if factor.group == "R":
            continue
        turns, travels = (slice(factor.v_start + k, factor.v_start + k + 3) for k in (0, 3))
        of_turns = np.einsum("ijk,...k->...ji", cross, gradient[..., turns])
        result[..., turns, turns] += 0.5 * of_turns
        if factor.group == "SE3":
            of_travels = 0.5 * np.einsum("ijk,...k->...ji", cross, gradient[..., travels])
            result[..., turns, travels] += of_travels
            result[..., travels, turns] += of_travels
    return result


def _by_inputs(partials: Blocks, prescribed: Sequence[bool]) -> dict[str, Array]:
    """Return partials in all inputs, in their order, from partials in driven and in prescribed inputs. The keys are
    ``Ru`` (residual), ``Zu`` (internal rates) and ``Uy`` (outputs), as far as there are such partials. `prescribed` is
    whether each input has a law."""
    made = {}
    for name, driven_name, given_name, sign in (
        ("Ru", "B0", "E0", -1.0),
        ("Zu", "Fu", "Fw", 1.0),
        ("Uy", "Yu", "Yw", 1.0),
    ):
        parts = {False: partials.get(driven_name), True: partials.get(given_name)}
        there = [part for part in parts.values() if part is not None]
        if not there or not prescribed:
            continue
        shape = np.broadcast_shapes(*(part.shape[:-1] for part in there))
        matrix = np.zeros((*shape, len(prescribed)), dtype=np.result_type(*there))
        for kind, part in parts.items():
            places = [number for number, is_given in enumerate(prescribed) if is_given is kind]
            if part is not None and places:
                matrix[..., places] = sign * part[..., : len(places)]
        made[name] = matrix
    return made


def _rows(block: str, partials: Blocks, holonomic: int) -> Iterator[tuple[str, Array]]:
    """Yield the name of each weighted quantity (residual ``r``, ``Phi``, ``w``, ...) and its partials in a block.
    `holonomic` is the number of constraint rows at position level."""
    places = {
        "q": {"r": "K", "zdot": "Fq", "w": "Z", "wdot": "Aq", "y": "Yq"},
        "v": {"r": "C", "zdot": "Fv", "w": "B", "wdot": "Av", "y": "Yv"},
        "a": {"r": "M", "wdot": "B", "y": "Ya"},
        "z": {"r": "Rz", "zdot": "Fz", "y": "Yz"},
        "lam": {"y": "Ylam"},
        "u": {"r": "Ru", "zdot": "Zu", "y": "Uy"},
        "p": {"r": "Rp", "zdot": "Fp", "Phi": "Phip", "w": "Zp", "wdot": "Ap", "y": "Yp"},
    }
    for weight, name in places[block].items():
        if name in partials:
            yield weight, partials[name]
    if "B" in partials and block == "q":
        yield "Phi", partials["B"][..., :holonomic, :]
    if "B" in partials and block == "lam":
        yield "r", np.swapaxes(partials["B"], -1, -2)
