"""Scenes of the study of orders: mechanisms on R^n, SO(3), SE(3) and R^3 x SO(3) that do not touch one another, so that
each group shows an order of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import eomgen

#: Groups, and what the names of the mechanism on it begin with.
MECHANISMS: Mapping[str, str] = {"R^n": "cart", "SO(3)": "top", "SE(3)": "plate", "R^3 x SO(3)": "drone"}
#: An input that is zero. Where it comes from outside, steps of a method's own end at rows.
INPUT = "nothing"
_TURNED = [0.8, 0.36, -0.48, 0.0]


@dataclass(frozen=True)
class Kind:
    """What mechanisms have besides springs, dampers and weight.

    Attributes
    ----------
    closed : whether constraints hold them
    driven : whether these change with time
    states : whether forces depend on internal states
    base : whether the base moves and turns
    """

    name: str
    closed: bool = False
    driven: bool = False
    states: bool = False
    base: bool = False


KINDS = (
    Kind("tree"),
    Kind("tree, internal states", states=True),
    Kind("tree, moving base", base=True),
    Kind("loop", closed=True),
    Kind("loop, internal states, moving base", closed=True, states=True, base=True),
    Kind("drivers", closed=True, driven=True),
)


def joint_scene(kind: Kind) -> eomgen.Scene:
    """Return the mechanisms on R^n, SO(3) and SE(3), in joint coordinates."""
    builder = _begun(kind, "joint")
    _add_cart(builder, kind)
    _add_top(builder, kind)
    _add_flying(builder, kind, "plate")
    return builder.effort("outside", "cart_rail", INPUT).build()


def absolute_scene(kind: Kind) -> eomgen.Scene:
    """Return the mechanism on R^3 x SO(3), in absolute coordinates."""
    builder = _begun(kind, "absolute")
    _add_flying(builder, kind, "drone", group="R3xSO3")
    return builder.force("outside", "drone", force=[INPUT, 0, 0]).build()


def _begun(kind: Kind, coordinates: str) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder(coordinates, coordinates=coordinates).input(INPUT, 0)
    if kind.base:
        turns = [{"axis": [0, 0, 1], "angle": "0.4 * sin(2 * t)"}, {"axis": [1, 0, 0], "angle": "0.3 * t"}]
        builder.base(position=["0.1 * sin(5 * t)", "0.2 * t ** 2", "0.05 * cos(4 * t)"], rotation=turns)
    return builder


def _add_cart(builder: eomgen.SceneBuilder, kind: Kind) -> None:
    """Add a pole on a cart; closed, a rod ties the pole to a slide, and driven, the cart follows a law of time."""
    builder.body("cart", 2.0).body("cart_pole", 1.0, center_of_mass=[0, 0, -0.4], inertia=[0.05, 0.06, 0.01])
    law: dict[str, Any] = {"drive": "0.1 * sin(3 * t)"} if kind.driven else {"initial": {"velocity": 0.4}}
    builder.joint("cart_rail", "prismatic", "base", "cart", axis=[1, 0, 0], stiffness=200.0, **law)
    hinge = {"damping": 0.1, "initial": {"position": 0.6, "velocity": -0.8}}
    builder.joint("cart_hinge", "revolute", "cart", "cart_pole", axis=[0, 1, 0], **hinge)
    if kind.closed:
        builder.body("cart_slide", 0.7)
        builder.joint("cart_guide", "prismatic", "base", "cart_slide", axis=[0.6, 0, 0.8], stiffness=30.0)
        ends = {"body": "cart_pole", "position": [0, 0, -0.8]}, {"body": "cart_slide", "position": [0.3, 0, -0.4]}
        builder.constraint("cart_rod", "distance", *ends, length=0.7955)
    if kind.states:
        builder.state("cart_lag", "6 * (v.cart_rail - cart_lag)", initial=0.2)
        builder.effort("cart_push", "cart_rail", "-3 * cart_lag * (1 + cart_lag)")


def _add_top(builder: eomgen.SceneBuilder, kind: Kind) -> None:
    builder.body("top", 1.5, center_of_mass=[0.1, 0.05, 0.4], inertia=[0.1, 0.14, 0.08])
    start = {"position": _TURNED, "velocity": [1.2, -1.8, 2.5]}
    builder.joint("top_ball", "spherical", "base", "top", position=[3, 0, 0], initial=start)
    _add_rod_and_thrust(builder, kind, "top", [0.3, 0.0, 0.5], [3.6, 0.5, 0.9], 1.323)


def _add_flying(builder: eomgen.SceneBuilder, kind: Kind, body: str, **group: str) -> None:
    """Add a free body on a spring."""
    builder.body(body, 1.2, center_of_mass=[0.05, 0.1, -0.1], inertia=[0.06, 0.1, 0.13], **group)
    start = {"position": [-3, 0.2, 0.1], "orientation": _TURNED, "velocity": [-0.6, 0.9, 0.7, 0.5, -0.6, 0.4]}
    builder.joint(f"{body}_root", "free", "base", body, initial=start)
    builder.point(f"{body}_corner", body, [0.3, -0.1, 0.2]).point(f"{body}_anchor", "base", [-3, 0.5, 1.2])
    spring = {"stiffness": 25.0, "damping": 0.3, "length": 0.5}
    builder.spring(f"{body}_spring", f"{body}_corner", f"{body}_anchor", **spring)
    _add_rod_and_thrust(builder, kind, body, [-0.2, 0.3, 0.1], [-3.8, 0.6, -0.7], 1.0036)


def _add_rod_and_thrust(
    builder: eomgen.SceneBuilder, kind: Kind, body: str, place: Sequence[float], anchor: Sequence[float], length: float
) -> None:
    """Closed, tie a body to the base by a rod, whose length follows a law where it is driven; with states, push it by
    what follows its height late."""
    if kind.closed:
        ends = {"body": "base", "position": list(anchor)}, {"body": body, "position": list(place)}
        builder.constraint(
            f"{body}_rod", "distance", *ends, length=f"{length} + 0.1 * sin(3 * t)" if kind.driven else length
        )
    if kind.states:
        builder.point(f"{body}_nose", body, [0.1, 0.2, 0.3])
        builder.state(f"{body}_lag", f"4 * (position.{body}_nose[2] - {body}_lag)", initial=0.3)
        thrust = [f"2 * {body}_lag", 0, f"-{body}_lag ** 2"]
        builder.force(f"{body}_thrust", body, point=[0, 0.1, 0], force=thrust)
