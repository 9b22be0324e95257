"""Controllers and state feedback of a Scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from eomgen.base.data import dataclass, field
from eomgen.formula.nodes import Formula


@dataclass(frozen=True)
class Calibration:
    """Method by which the gains of a state feedback are found, see ``control.schema.CalibrationEntry``; weights by the
    name of joint, signal or output."""

    method: Literal["lqr", "imsc", "pole_placement"]
    at: Literal["equilibrium", "initial"] = "equilibrium"
    position_weights: Mapping[str, float] = field(default_factory=dict)
    velocity_weights: Mapping[str, float] = field(default_factory=dict)
    signal_weights: Mapping[str, float] = field(default_factory=dict)
    output_weights: Mapping[str, float] = field(default_factory=dict)
    effort_weights: tuple[float, ...] = ()
    modes: tuple[int, ...] = ()
    frequencies: tuple[float, ...] = ()
    damping_ratios: tuple[float, ...] = ()
    poles: tuple[complex, ...] = ()


@dataclass(frozen=True)
class StateFeedback:
    """Controllers u = -G (y - y_ref) of signals y, whose gains are tunable parameters.

    Attributes
    ----------
    name : of the entry in the scene.
    outputs : (m,) names of the controllers of the feedback.
    signals : (r,) formulas y; positions of ``coordinates``, their rates, then the user's signals.
    labels : (r,) ``q.body``, ``v.body`` or the user's name of each signal.
    gains : (m, r) names of parameters.
    references : (r,) names of the parameters y_ref that a calibration fills; empty names without one.
    calibration : method of the gains; None if the user gives the gains.
    """

    name: str
    outputs: tuple[str, ...]
    signals: tuple[Formula, ...]
    labels: tuple[str, ...]
    gains: tuple[tuple[str, ...], ...]
    references: tuple[str, ...]
    calibration: Calibration | None = None

    @property
    def calibrated_parameters(self) -> tuple[str, ...]:
        """Names of the parameters that the calibration fills; none without one."""
        gains = (name for row in self.gains for name in row)
        return () if self.calibration is None else (*gains, *filter(None, self.references))


@dataclass(frozen=True)
class Controller:
    """Output of a controller, by name: a formula of states and signal."""

    name: str
    output: Formula
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Reference:
    """A reference motion: position, velocity and acceleration as pairs of a joint with one coordinate and a formula of
    state and time."""

    name: str
    position: tuple[tuple[str, Formula], ...] = ()
    velocity: tuple[tuple[str, Formula], ...] = ()
    acceleration: tuple[tuple[str, Formula], ...] = ()

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """All formulas of the entry."""
        return tuple(formula for part in (self.position, self.velocity, self.acceleration) for _, formula in part)
