"""Closed forms that are time derivatives along a motion: of tau, of the separated blocks, of the base and of the inputs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eomgen.studies.engines import Array, Blocks, Engine
from eomgen.studies.forms import Form, Space, Value, column
from eomgen.system import RATE_BLOCKS

FAMILY = "rates"
#: Term, its outputs, and the function and output that the first of them is the derivative of.
_TERMS = (
    ("rates", ("tau_dot", "tau_ddot"), ("inverse_dynamics", "tau")),
    ("mass_rates", ("M_dot", "M_ddot"), ("mass", "M")),
    ("coupling_rates", ("h_dot", "h_ddot"), ("coupling", "h")),
    ("force_rates", ("Q_dot", "Q_ddot"), ("force", "Q")),
    ("base_motion_rates", ("b_dot", "b_ddot"), ("base_motion", "b")),
)
#: Each block with what it changes by along a motion.
_CHANGES = {"q": "v", "v": "a", "a": "j", "j": "s", "u": "u_dot", "u_dot": "u_ddot"}
#: What is given beside a state, to size it by.
MOTION_BLOCKS = ((*RATE_BLOCKS["a"][:2], "v"), (*RATE_BLOCKS["u"][:2], "u"))


def rate_forms(space: Space, engine: Engine) -> list[Form]:
    """Return the forms of the terms that ``engine`` has."""
    forms: list[Form] = []
    for term, outputs, (function, entry) in _TERMS:
        if term not in engine or function not in engine:
            continue
        source = (function, entry)
        for name in outputs:
            names = _entries(space, name)
            forms.append(Form(
                f"{term}.{name}", f"d {source[1]} / dt", FAMILY, _column_of(term, name), source=_vector_of(*source),
                directions=along_motion(engine, source[0]), rows=names, functions=(source[0],),
            ))  # fmt: skip
            source = (term, name)
    if "rates" in engine:
        forms.append(Form(
            "rates.tau", "as inverse_dynamics", FAMILY, _column_of("rates", "tau"),
            second=_column_of("inverse_dynamics", "tau"), second_name="inverse_dynamics", rows=space.rows["v"],
        ))  # fmt: skip
    return forms + _drivers(engine)


def along_motion(engine: Engine, function: str) -> Callable[[Blocks], dict[str, Array]]:
    """Return the direction of the motion, in all blocks that a function takes."""
    taken = set(engine.functions[function])

    def directions(state: Blocks) -> dict[str, Array]:
        rates = {block: state[rate] for block, rate in _CHANGES.items() if block in taken and rate in state}
        if "z" in taken and "z" in state:
            rates["z"] = engine("internal_rate", state)["zdot"]
        found = {block: rate[..., np.newaxis, :] for block, rate in rates.items()}
        if "base" in taken or "t" in taken:
            found["t"] = np.ones((1, 1))
        return found

    return directions


def _entries(space: Space, name: str) -> tuple[str, ...]:
    if name.startswith("M"):
        return tuple(f"M[{first}, {second}]" for first in space.rows["v"] for second in space.rows["v"])
    return space.rows["v"]


def _vector_of(function: str, entry: str) -> Value:
    matrix = entry.startswith("M")

    def value(engine: Engine, state: Blocks) -> Array:
        found = engine(function, state)[entry]
        return found.reshape(*found.shape[:-2], -1) if matrix else found

    return value


def _column_of(function: str, entry: str) -> Value:
    of = _vector_of(function, entry)
    return lambda engine, state: column(of(engine, state))


def _drivers(engine: Engine) -> list[Form]:
    """Return the forms of derivatives of what is prescribed, functions of time alone."""
    forms = []
    time = {"t": np.ones((1, 1))}
    if "base_rates" in engine:

        def of_base(engine: Engine, state: Blocks) -> Array:
            twist_rates = engine("base", state)["base"][..., 13:]
            rows = engine("base_rates", state)["base_rates"]
            return np.concatenate([twist_rates, rows.reshape(*rows.shape[:-2], -1)[..., :-6]], axis=-1)

        def rates(engine: Engine, state: Blocks) -> Array:
            rows = engine("base_rates", state)["base_rates"]
            return column(rows.reshape(*rows.shape[:-2], -1))

        forms.append(Form("base_rates", "each row from the one before", FAMILY, rates, source=of_base,
                          directions=lambda _: time, functions=("base", "base_rates")))  # fmt: skip
    if "input_rates" in engine:
        for name, source in (("u_dot", ("inputs", "u")), ("u_ddot", ("input_rates", "u_dot"))):
            forms.append(Form(f"input_rates.{name}", f"d {source[1]} / dt", FAMILY, _column_of("input_rates", name),
                              source=_vector_of(*source), directions=lambda _: time, functions=(source[0],)))  # fmt: skip
    return forms
