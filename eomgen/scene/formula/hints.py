"""Hints for names, functions and signs of other languages in formulas."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

from eomgen.base.text import is_legal, nearest
from eomgen.scene.formula.scope import Names, Scope

_STEP = "1 if t > 1 else 0"
_LIMITS = "min(max(x, low), high)"
_TABLE = "a curve through points: [curves.NAME], and NAME(x)"
_RATE = "v.joint of a coordinate, or derivative.curve(t) of a curve"
#: Functions of other languages, with the expression for each.
_FUNCTIONS: Mapping[str, str] = {
    **dict.fromkeys(("step", "heaviside", "unit_step"), _STEP),
    **dict.fromkeys(("where", "ifelse", "iif", "select"), "a if x > 0 else b"),
    **dict.fromkeys(("saturate", "saturation", "sat", "clip", "clamp", "limit"), _LIMITS),
    **dict.fromkeys(("integral", "integrate", "integ"), 'a state of its own: [states] and NAME = { rate = "..." }'),
    **dict.fromkeys(("der", "diff", "ddt", "dt", "gradient"), _RATE),
    **dict.fromkeys(("delay", "lag"), "a sampled state: [states.NAME] with sample, formula and delay"),
    **dict.fromkeys(("interp", "interp1", "lookup", "table", "spline"), _TABLE),
    **dict.fromkeys(("random", "rand", "randn", "noise"), "an input with a table of random numbers, or a road"),
    **dict.fromkeys(("sgn", "signum"), "sign"),
    **dict.fromkeys(("ln",), "log"),
    **dict.fromkeys(("log10", "log2"), "log(x) / log(10), where log is the natural logarithm"),
    **dict.fromkeys(("pow", "power"), "x ** y"),
    **dict.fromkeys(("square", "sqr"), "x ** 2"),
    **dict.fromkeys(("fabs",), "abs"),
    **{f"arc{name}": f"a{name}" for name in ("sin", "cos", "tan", "tan2")},
    **{f"{name}d": f"{name}(x * pi / 180): angles are in radians" for name in ("sin", "cos", "tan")},
}
#: Kinds of quantities by other names.
_KINDS: Mapping[str, str] = {
    **dict.fromkeys(("qd", "qdot", "dq", "q_dot", "qvel", "omega", "w", "speed", "rate", "dot"), "v"),
    **dict.fromkeys(("qdd", "ddq", "qddot", "q_ddot", "qacc", "alpha", "vdot"), "a"),
    **dict.fromkeys(("qpos", "angle", "theta", "phi", "joint"), "q"),
    **dict.fromkeys(("pos", "point", "x", "p", "r"), "position"),
    "vel": "velocity",
    "acc": "acceleration",
}
_AXES = "xyz"


def of_function(name: str, curves: Iterable[str], functions: Iterable[str]) -> str:
    """Return the expression in place of a function that formulas do not have."""
    known = [*curves, *functions]
    return name.lower() if name.lower() in known else _FUNCTIONS.get(name.lower()) or nearest(name, known)


def of_kind(kind: str, name: str, names: Names, kinds: Iterable[str]) -> str:
    """Return a hint in place of ``kind.name`` if no quantity has this kind."""
    every = list(kinds)
    if name in every and (kind in names.joints or kind in names.beams or kind in names.points):
        return f"{name}.{kind}"
    if kind in ("effort", "torque", "force") and is_legal(name):
        return f"drive_effort.{name[:64]} of a driven joint; of an entry of [efforts] its own formula, written again"
    swapped = _KINDS.get(name, "")
    if swapped and (kind in names.joints or kind in names.points):
        return f"{swapped}.{kind}"
    return f"{_KINDS[kind]}.{name[:64]}" if kind in _KINDS and is_legal(name) else nearest(kind, every)


def of_name(name: str, names: Names, scope: Scope, known: Iterable[str]) -> str:
    """Return a hint for a name that does not exist."""
    every = list(known)
    if name.lower() in ("time", "seconds"):
        return "t"
    if name in ("g", "gravity"):
        return f'9.81, or a parameter: {name} = {{ value = 9.81, unit = "m/s^2" }}'
    if name in names.points and "position" in scope.kinds:
        return f"position.{name}[0]"
    joined = re.fullmatch(r"([A-Za-z]+)_(\w+)", name)
    if joined and joined[2] in names.joints:
        return f"{_KINDS.get(joined[1], joined[1] if joined[1] in ('q', 'v', 'a') else 'q')}.{joined[2]}"
    hint = nearest(name, every)
    moving = next(iter(names.joints), "")
    if moving and "q" in scope.kinds and not get_close_matches(name, every):
        return f"q.{moving} or v.{moving}, a coordinate or a velocity, or {hint}"
    return hint


def of_parts(names: Names, word: str, part: str) -> str:
    """Return a hint in place of parts such as ``position.tip.x`` and ``q[0]``, from the word before them."""
    if part and part in _AXES and word:
        return f"{word}[{_AXES.index(part)}]"
    if word in names.points:
        return f"position.{word}[{part or 0}]"
    moving = next(iter(names.joints), "joint")
    return f"{word}.{moving}" if word in ("q", "v", "a") else ""
