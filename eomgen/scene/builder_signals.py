"""The signals of a scene from Python: parameters, inputs, curves, states, controllers and outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

from eomgen.scene.builder_entries import Entries, Value


class Signals(Entries):
    """Entries of numbers and signals: what goes in, what is kept beside the motion, what comes out."""

    def parameter(self, name: str, value: Value, *, tunable: bool = False, unit: str = "", description: str = "") -> Self:
        """Add a named number, or a text of a number and its unit; a tunable one can be changed without recompiling."""
        return self._enter("parameters", name, value=value, tunable=tunable, unit=unit, description=description)

    def input(
        self,
        name: str,
        formula: Value | None = None,
        *,
        road: Mapping[str, Any] | None = None,
        unit: str = "",
        description: str = "",
        **shape: Any,
    ) -> Self:
        """Add an input; what is said of it is its value unless the caller hands in another.

        ``formula`` is of time and parameters; ``road`` has the keys speed (m/s), where needed offset (m), and one of class (A to
        H, ISO 8608), table, points and bump; ``shape`` is one of table, points and wave, with interpolation and outside.
        """
        return self._enter("inputs", name, formula=formula, road=road, unit=unit, description=description, **shape)

    def curve(self, name: str, **shape: Any) -> Self:
        """Add a function of one number: table, points, wave, bump or road as in a scene file, interpolation and outside."""
        return self._enter("curves", name, **shape)

    def state(
        self, name: str, rate: Value, *, initial: Value = 0.0, unit: str = "", description: str = ""
    ) -> Self:
        """Add an internal state: ``rate``, a formula of everything but accelerations, is its time derivative."""
        return self._enter("states", name, rate=rate, initial=initial, unit=unit, description=description)

    def controller(
        self,
        name: str,
        type: str,
        signal: Value | None = None,
        *,
        proportional: Value | None = None,
        integral: Value | None = None,
        derivative: Value | None = None,
        gain: Value | None = None,
        time_constant: Value | None = None,
        lead: Value | None = None,
        minimum: Value | None = None,
        maximum: Value | None = None,
        tracking: Value | None = None,
        initial: Value = 0.0,
        initial_filtered: Value | None = None,
        unit: str = "",
        description: str = "",
        **feedback: Any,
    ) -> Self:
        """Add a controller, filter or actuator of type pi, pid, low_pass, lead_lag, state_feedback or skyhook.

        Formulas use its output by its name. ``feedback`` holds the keys of the last two types as a scene file has them:
        coordinates, signals, gains, calibration, ...; spring, damping, clipped, ....
        """
        return self._enter(
            "controllers", name, type=type, signal=signal, proportional=proportional, integral=integral, derivative=derivative,
            gain=gain, time_constant=time_constant, lead=lead, minimum=minimum, maximum=maximum, tracking=tracking,
            initial=initial, initial_filtered=initial_filtered, unit=unit, description=description, **feedback,
        )  # fmt: skip

    def output(
        self,
        name: str,
        *,
        formula: Value | Sequence[Value] | None = None,
        position: str | None = None,
        velocity: str | None = None,
        acceleration: str | None = None,
        energy: str | None = None,
        unit: str = "",
        description: str = "",
    ) -> Self:
        """Add an output: formulas, a point's position, velocity or acceleration (world axes), or an energy."""
        return self._enter(
            "outputs",
            name,
            formula=formula,
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            energy=energy,
            unit=unit,
            description=description,
        )
