"""Claims on time derivatives along a motion: tau, the separated blocks, base, inputs and events, with gradients of
impacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Rates,
    Second,
    Space,
    Value,
    along_motion,
    constant_directions,
    jacobian,
)

#: Term, outputs, and the function and output whose derivative is the first output.
_TERMS = (
    ("rates", ("tau_dot", "tau_ddot"), ("inverse_dynamics", "tau")),
    ("mass_rates", ("M_dot", "M_ddot"), ("mass", "M")),
    ("coupling_rates", ("h_dot", "h_ddot"), ("coupling", "h")),
    ("force_rates", ("Q_dot", "Q_ddot"), ("force", "Q")),
    ("base_motion_rates", ("b_dot", "b_ddot"), ("base_motion", "b")),
    ("system_jacobian_rates", ("J_dot", "J_ddot"), ("system_jacobian", "J")),
    ("adjoints_rates", ("A_dot", "A_ddot"), ("adjoints", "A")),
    ("joint_brackets_rates", ("ad_joints_dot", "ad_joints_ddot"), ("joint_brackets", "ad_joints")),
    ("link_brackets_rates", ("ad_links_dot", "ad_links_ddot"), ("link_brackets", "ad_links")),
    ("coriolis_rates", ("C_dot", "C_ddot"), ("coriolis", "C")),
    ("coriolis_skew_rates", ("C_dot", "C_ddot"), ("coriolis_skew", "C")),
    ("forward_rates", ("vdot_dot", "vdot_ddot"), ("forward_dynamics", "vdot")),
    ("input_rates", ("u_dot", "u_ddot"), ("inputs", "u")),
)
#: Terms that another derivation has as well.
_SECOND = {"rates": "rates_closed", "mass_rates": "mass_rates_closed"}
#: Terms with an output that another term has as well; the function, output and order of the derivative for the size.
_SAME: Sequence[tuple[str, str, str, tuple[str, str, int] | None]] = (
    ("rates", "tau", "inverse_dynamics", None),
    ("forward_rates", "vdot", "forward_dynamics", None),
    ("rates_closed", "tau", "inverse_dynamics", ("inverse_dynamics", "tau", 0)),
    ("rates_closed", "tau_dot", "rates", ("inverse_dynamics", "tau", 1)),
    ("rates_closed", "tau_ddot", "rates", ("inverse_dynamics", "tau", 2)),
    ("mass_rates_closed", "M_dot", "mass_rates", ("mass", "M", 1)),
    ("mass_rates_closed", "M_ddot", "mass_rates", ("mass", "M", 2)),
)
#: Terms of the table whose rows are components of v, or pairs of components.
_OF_COMPONENTS = {term for term, _, _ in _TERMS[:5]} | {"forward_rates"}


def rate_claims(space: Space) -> list[Claim]:
    """Return the claims on time derivatives of terms, on second derivations, Coriolis matrices and laws of base and
    inputs. Claims belong to terms that the model has."""
    claims: list[Claim] = []
    for term, outputs, (function, entry) in _TERMS:
        if not space.has(term, function):
            continue
        source = ClaimOutput(function, entry)
        for order, name in enumerate(outputs, 1):
            second_term = _SECOND.get(term, "")
            also = space.has(second_term)
            claims.append(
                Claim(
                    f"{term}.{name}",
                    f"d {source.entry} / dt",
                    ClaimOutput(term, name).flat.column,
                    source=source.flat,
                    directions=_along_motion(space.engine, source.function, free=term == "forward_rates"),
                    rows=_entries(space, name) if term in _OF_COMPONENTS else (),
                    size=_rounding_of(function, entry, order, *_mass_terms(space, term, order)),
                    second=Second(second_term, ClaimOutput(second_term, name).flat.column) if also else None,
                )
            )
            source = ClaimOutput(term, name)
    for term, name, second_term, of in _SAME:
        if space.has(term, second_term):
            more = _mass_terms(space, "rates", of[2]) if of is not None and of[1] == "tau" else []
            claims.append(
                Claim(
                    f"{term}.{name}",
                    f"as {second_term}",
                    ClaimOutput(term, name).flat.column,
                    second=Second(second_term, ClaimOutput(second_term, name).flat.column),
                    rows=_entries(space, name),
                    size=None if of is None else _rounding_of(*of, *more),
                )
            )
    claims += _coriolis(space)
    return [*claims, _base_rates()] if space.has("base_rates") else claims


def _coriolis(space: Space) -> list[Claim]:
    """Return the claims on Coriolis matrices: C v = h, and C + C^T = dM/dt of the skew one, as far as there are such
    terms."""
    claims = [
        Claim(
            f"{term}.C",
            "C v = h",
            _times_velocity(term),
            second=Second("coupling", ClaimOutput("coupling", "h").flat.column),
            size=_rounding_of(term, "C", 1, *_mass_terms(space, "rates", 0)),
            rows=space.rows["v"],
        )
        for term in ("coriolis", "coriolis_skew")
        if space.has(term, "coupling")
    ]
    if space.has("coriolis_skew", "mass_rates"):
        claims.append(
            Claim(
                "coriolis_skew.C, skew",
                "C + C^T = M'",
                _symmetric,
                second=Second("mass_rates", ClaimOutput("mass_rates", "M_dot")),
                rows=space.rows["v"],
                columns=space.rows["v"],
                size=_rounding_of(
                    "coriolis_skew", "C", 0, ("mass_rates", "M_dot", 0), *_mass_terms(space, "coriolis", 0)
                ),
            )
        )
    return claims


def _mass_terms(space: Space, term: str, order: int) -> list[tuple[str, str, int]]:
    """Return M, with which tau goes as the square of the rate, and Coriolis matrices as the rate; none for other
    terms."""
    more = {"rates": 2, "coupling_rates": 2, "base_motion_rates": 2}.get(term, 1 if term.startswith("coriolis") else 0)
    return [("mass", "M", order + more)] if more and space.has("mass") else []


def _rounding_of(function: str, entry: str, order: int, *more: tuple[str, str, int]) -> Value:
    """Return a function for the size (...) below which a derivative is rounding by cancelling terms: a thousandth
    of the quantity, and 3 % of the terms. The terms are the output `entry` of a function, times the rate of the motion
    to the power of the order; ``more`` are further (function, output, order), in the same way."""
    quantities = [(ClaimOutput(of, name).flat, power) for of, name, power in ((function, entry, order), *more)]

    def size(engine: Engine, state: Blocks) -> Array:
        rate = _rate(state)
        parts = [(1e-3 + 0.03 * rate**power) * np.max(np.abs(of(engine, state)), axis=-1) for of, power in quantities]
        return np.asarray(np.max(parts, axis=0))

    return size


def _rate(state: Blocks) -> Array:
    """Return the rate of a motion, in 1/s: the ratio of derivatives from order to order."""
    powers = {"v": 1.0, "a": 0.5, "j": 1.0 / 3.0, "s": 0.25}
    sizes = [np.max(np.abs(state[name]), axis=-1) ** power for name, power in powers.items() if name in state]
    return np.asarray(np.max(sizes, axis=0))


def _times_velocity(term: str) -> Value:
    return lambda engine, state: np.asarray(engine(term, state)["C"] @ state["v"][..., np.newaxis])


def _symmetric(engine: Engine, state: Blocks) -> Array:
    C = engine("coriolis_skew", state)["C"]
    return np.asarray(C + np.swapaxes(C, -1, -2))


def _along_motion(engine: Engine, function: str, *, free: bool) -> Rates:
    """Return the direction of the motion, in all blocks of a function; with ``free``, the direction has the free
    acceleration."""
    motion = along_motion(engine, *engine.functions[function])
    if not free:
        return motion
    return lambda state: motion(state) | {"v": engine("forward_dynamics", state)["vdot"][..., np.newaxis, :]}


def _entries(space: Space, name: str) -> tuple[str, ...]:
    if name.startswith("M"):
        return tuple(f"M[{first}, {second}]" for first in space.rows["v"] for second in space.rows["v"])
    return space.rows["v"]


def _base_rates() -> Claim:
    """Return the claim on time derivatives of the prescribed motion of the base."""

    def drivers(engine: Engine, state: Blocks) -> Array:
        twist_rates, rows = engine("base", state)["base"][..., 13:], engine("base_rates", state)["base_rates"]
        return np.concatenate([twist_rates, rows.reshape(*rows.shape[:-2], -1)[..., :-6]], axis=-1)

    return Claim(
        "base_rates",
        "each row from the one before",
        ClaimOutput("base_rates", "base_rates").flat.column,
        source=drivers,
        directions=constant_directions({"t": np.ones((1, 1))}),
        functions=("base", "base_rates"),
    )


def event_claims(space: Space) -> list[Claim]:
    """Return the claims on rates of event functions, and on gradients of event functions with impacts; empty without
    events."""
    if not space.has("events"):
        return []
    events, value = space.system.events, ClaimOutput("events", "event")
    known = [number for number, row in enumerate(events) if row.has_rate]
    impacts = [number for number, row in enumerate(events) if row.action == "impact"]
    claims = []
    if known:
        claims.append(
            Claim(
                "events.event_rate",
                "d event / dt",
                ClaimOutput("events", "event_rate")[..., known].column,
                source=value[..., known],
                directions=along_motion(space.engine, "q", "v", "z"),
                rows=tuple(events[number].name for number in known),
            )
        )
    if impacts:
        claims.append(
            jacobian(
                space,
                ClaimOutput("event_impulse", "gradient"),
                value[..., impacts],
                "q",
                [events[number].name for number in impacts],
                meaning="d event / dq of impacts",
            )
        )
    return claims
