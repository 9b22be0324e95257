"""Claims of time derivatives along a motion: of tau, of the separated blocks, of the base, of the inputs and of
events, with gradients of impacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eomgen.products.studies.verification.claims.claim import Array, Blocks, Claim, Engine, Space, Value, column
from eomgen.system.system import System

FAMILY = "rates"
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
)
#: Terms that another derivation has as well.
_SECOND = {"rates": "rates_closed", "mass_rates": "mass_rates_closed"}
#: Terms of the table whose rows are components of v, or pairs of components.
_OF_COMPONENTS = {term for term, _, _ in _TERMS[:5]} | {"forward_rates"}
#: Each block with the block of rates along a motion.
_CHANGES = {"q": "v", "v": "a", "a": "j", "j": "s", "u": "u_dot", "u_dot": "u_ddot"}
#: Size of a derivative's terms, as a part of the quantity, and of the quantity times the rate of the motion, up to
#: which the terms may cancel.
_PART, _PART_OF_TERMS = 1e-3, 0.03


def rate_claims(space: Space, engine: Engine) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    claims: list[Claim] = []
    for term, outputs, (function, entry) in _TERMS:
        if term not in engine or function not in engine:
            continue
        source = (function, entry)
        for order, name in enumerate(outputs, 1):
            names = _entries(space, name) if term in _OF_COMPONENTS else ()
            other = _SECOND.get(term, "")
            second = _column_of(other, name) if other in engine else None
            claims.append(
                Claim(
                    f"{term}.{name}",
                    f"d {source[1]} / dt",
                    FAMILY,
                    _column_of(term, name),
                    source=_vector_of(*source),
                    directions=along_motion(engine, source[0], free=term == "forward_rates"),
                    rows=names,
                    functions=(source[0],),
                    size=_rounding_of(function, entry, order, *_of_mass(engine, term, order)),
                    second=second,
                    second_name=other if second is not None else "",
                )
            )
            source = (term, name)
    claims += [
        _same(term, entry, other, space.rows["v"])
        for term, entry, other in (("rates", "tau", "inverse_dynamics"), ("forward_rates", "vdot", "forward_dynamics"))
        if term in engine
    ]
    return claims + _closed(space, engine) + _drivers(engine)


def _closed(space: Space, engine: Engine) -> list[Claim]:
    """Return the claims of the closed matrix form: tau once more, C v = h, and M' - 2 C skew."""
    claims = []
    of_tau = [_rounding_of("inverse_dynamics", "tau", order, *_of_mass(engine, "rates", order)) for order in range(3)]
    if "rates_closed" in engine and "inverse_dynamics" in engine:
        claims.append(_same("rates_closed", "tau", "inverse_dynamics", space.rows["v"], of_tau[0]))
        claims += [
            _same("rates_closed", name, "rates", space.rows["v"], of_tau[order])
            for order, name in ((1, "tau_dot"), (2, "tau_ddot"))
            if "rates" in engine
        ]
    if "mass_rates_closed" in engine and "mass_rates" in engine:
        claims += [
            _same("mass_rates_closed", name, "mass_rates", _entries(space, name), _rounding_of("mass", "M", order))
            for order, name in ((1, "M_dot"), (2, "M_ddot"))
        ]
    for term in ("coriolis", "coriolis_skew"):
        if term in engine and "coupling" in engine:
            claims.append(
                Claim(
                    f"{term}.C",
                    "C v = h",
                    FAMILY,
                    _turned(term),
                    second=_column_of("coupling", "h"),
                    second_name="coupling",
                    size=_rounding_of(term, "C", 1, *_of_mass(engine, "rates", 0)),
                    rows=space.rows["v"],
                )
            )
    if "coriolis_skew" in engine and "mass_rates" in engine:
        claims.append(
            Claim(
                "coriolis_skew.C, skew",
                "C + C^T = M'",
                FAMILY,
                _symmetric,
                second=lambda engine, state: np.asarray(engine("mass_rates", state)["M_dot"]),
                second_name="mass_rates",
                rows=space.rows["v"],
                columns=space.rows["v"],
                size=_rounding_of(
                    "coriolis_skew", "C", 0, ("mass_rates", "M_dot", 0), *_of_mass(engine, "coriolis", 0)
                ),
            )
        )
    return claims


def _of_mass(engine: Engine, term: str, order: int) -> list[tuple[str, str, int]]:
    """Return M, with which tau goes as the square of the rate, and Coriolis matrices as the rate; none for other
    terms."""
    more = {"rates": 2, "coupling_rates": 2, "base_motion_rates": 2}.get(term, 1 if term.startswith("coriolis") else 0)
    return [("mass", "M", order + more)] if more and "mass" in engine else []


def _rounding_of(function: str, entry: str, order: int, *more: tuple[str, str, int]) -> Value:
    """Return the size below which a derivative is rounding of cancelling terms.

    The terms are the quantity, times the rate of the motion to the power of the order; ``more`` are further quantities,
    in the same way.
    """
    quantities = [(_vector_of(of, name), power) for of, name, power in ((function, entry, order), *more)]

    def size(engine: Engine, state: Blocks) -> Array:
        rate = _rate(state)
        parts = [
            (_PART + _PART_OF_TERMS * rate**power) * np.max(np.abs(of(engine, state)), axis=-1)
            for of, power in quantities
        ]
        return np.asarray(np.max(parts, axis=0))

    return size


def _rate(state: Blocks) -> Array:
    """Return the rate of a motion, in 1/s: the ratio of derivatives from order to order."""
    powers = {"v": 1.0, "a": 0.5, "j": 1.0 / 3.0, "s": 0.25}
    sizes = [np.max(np.abs(state[name]), axis=-1) ** power for name, power in powers.items() if name in state]
    return np.asarray(np.max(sizes, axis=0))


def _same(term: str, name: str, other: str, rows: tuple[str, ...], size: Value | None = None) -> Claim:
    """Return the claim that two terms give the same output."""
    return Claim(
        f"{term}.{name}",
        f"as {other}",
        FAMILY,
        _column_of(term, name),
        second=_column_of(other, name),
        second_name=other,
        rows=rows,
        size=size,
    )


def _turned(term: str) -> Value:
    return lambda engine, state: np.asarray(engine(term, state)["C"] @ state["v"][..., np.newaxis])


def _symmetric(engine: Engine, state: Blocks) -> Array:
    C = engine("coriolis_skew", state)["C"]
    return np.asarray(C + np.swapaxes(C, -1, -2))


def along_motion(engine: Engine, function: str, *, free: bool = False) -> Callable[[Blocks], dict[str, Array]]:
    """Return the direction of the motion, in all blocks of a function; with ``free``, the direction has the free
    acceleration."""
    taken = set(engine.functions[function])

    def directions(state: Blocks) -> dict[str, Array]:
        rates = {block: state[rate] for block, rate in _CHANGES.items() if block in taken and rate in state}
        if free:
            rates["v"] = engine("forward_dynamics", state)["vdot"]
        if "z" in taken and "z" in state:
            rates["z"] = engine("internal_rate", state)["zdot"]
        result = {block: rate[..., np.newaxis, :] for block, rate in rates.items()}
        if "base" in taken or "t" in taken:
            result["t"] = np.ones((1, 1))
        return result

    return directions


def _entries(space: Space, name: str) -> tuple[str, ...]:
    if name.startswith("M"):
        return tuple(f"M[{first}, {second}]" for first in space.rows["v"] for second in space.rows["v"])
    return space.rows["v"]


def _vector_of(function: str, entry: str) -> Value:
    def value(engine: Engine, state: Blocks) -> Array:
        result = engine(function, state)[entry]
        batch = np.broadcast_shapes(*(state[block].shape[:-1] for block in engine.functions[function]))
        return result.reshape(*batch, -1)

    return value


def _column_of(function: str, entry: str) -> Value:
    of = _vector_of(function, entry)
    return lambda engine, state: column(of(engine, state))


def _drivers(engine: Engine) -> list[Claim]:
    """Return the claims of derivatives of prescribed laws, functions of time alone."""
    claims = []
    time = {"t": np.ones((1, 1))}
    if "base_rates" in engine:

        def of_base(engine: Engine, state: Blocks) -> Array:
            twist_rates = engine("base", state)["base"][..., 13:]
            rows = engine("base_rates", state)["base_rates"]
            return np.concatenate([twist_rates, rows.reshape(*rows.shape[:-2], -1)[..., :-6]], axis=-1)

        def rates(engine: Engine, state: Blocks) -> Array:
            rows = engine("base_rates", state)["base_rates"]
            return column(rows.reshape(*rows.shape[:-2], -1))

        claims.append(
            Claim(
                "base_rates",
                "each row from the one before",
                FAMILY,
                rates,
                source=of_base,
                directions=lambda _: time,
                functions=("base", "base_rates"),
            )
        )
    if "input_rates" in engine:
        for name, source in (("u_dot", ("inputs", "u")), ("u_ddot", ("input_rates", "u_dot"))):
            claims.append(
                Claim(
                    f"input_rates.{name}",
                    f"d {source[1]} / dt",
                    FAMILY,
                    _column_of("input_rates", name),
                    source=_vector_of(*source),
                    directions=lambda _: time,
                    functions=(source[0],),
                )
            )
    return claims


_EVENTS = "events"


def event_claims(space: Space, engine: Engine, system: System) -> list[Claim]:
    """Return the claims of the terms ``events`` and ``event_impulse``."""
    if "events" not in engine:
        return []
    known = [number for number, row in enumerate(system.events) if row.has_rate]
    impacts = [number for number, row in enumerate(system.events) if row.action == "impact"]
    names, along_q = [row.name for row in system.events], space.along["q"]

    def along_motion(state: Blocks) -> dict[str, Array]:
        rates = {"q": state["v"], "v": state["a"]}
        if "z" in state:
            rates["z"] = engine("internal_rate", state)["zdot"]
        result = {block: rate[..., np.newaxis, :] for block, rate in rates.items()}
        return result | ({"t": np.ones((1, 1))} if "t" in state else {})

    claims = []
    if known:
        claims.append(
            Claim(
                "events.event_rate",
                "d event / dt",
                _EVENTS,
                lambda engine, state: column(engine("events", state)["event_rate"][..., known]),
                source=lambda engine, state: engine("events", state)["event"][..., known],
                directions=along_motion,
                rows=tuple(names[number] for number in known),
                functions=("events",),
            )
        )
    if impacts:
        claims.append(
            Claim(
                "event_impulse.gradient",
                "d event / dq of impacts",
                _EVENTS,
                lambda engine, state: np.asarray(engine("event_impulse", state)["gradient"] @ along_q.matrix),
                source=lambda engine, state: engine("events", state)["event"][..., impacts],
                directions=lambda _: {"q": along_q.matrix.T},
                rows=tuple(names[number] for number in impacts),
                columns=along_q.names,
                functions=("events",),
            )
        )
    return claims
