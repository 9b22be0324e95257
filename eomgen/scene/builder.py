"""SceneBuilder: a scene from Python calls, with the data and the validation of a scene file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from eomgen.calls import checked_calls, unknown_attribute
from eomgen.errors import Problem
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.text import key_of

Value = float | str
_PACKAGE = __name__.partition(".")[0]
Rotations = Sequence[tuple[Sequence[Value], Value]]


@checked_calls(
    'a name, eomgen.SceneBuilder("pendulum")', com="center_of_mass", mass_center="center_of_mass", origin="position"
)
class SceneBuilder:
    """Collects the entries of a scene; ``build`` checks them all at once.

    Every method returns the builder. Numbers may be formulas, or texts with a unit such as "250 mm", wherever a scene
    file takes them; plain numbers are in SI, and the meaning of each key is that of the scene file.

    Parameters
    ----------
    name : str
        Name of the scene, which prefixes its C functions.
    description : str
    gravity : sequence of 3 values
        In world axes, m/s^2.
    terms : sequence of str
        The terms wanted; none means all that are needed.
    coordinates : str
        ``joint``, or ``absolute`` where every body moves on its own and joints become constraints.

    Examples
    --------
    >>> builder = SceneBuilder("pendulum").body("link", mass=1.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.01])
    >>> builder.joint("hinge", "revolute", "base", "link", axis=[0, 1, 0]).build().joints[0].name
    'hinge'
    """

    def __init__(
        self,
        name: str,
        *,
        description: str = "",
        gravity: Sequence[Value] = (0.0, 0.0, -9.81),
        terms: Sequence[str] = (),
        coordinates: str = "joint",
    ) -> None:
        settings = {
            "name": name,
            "description": description,
            "gravity": gravity,
            "terms": terms,
            "coordinates": coordinates,
        }
        self._data: dict[str, Any] = {"format": 1, **{key: _plain(value) for key, value in settings.items()}}
        self._lines: dict[str, str] = dict.fromkeys(("name", "gravity", "terms", "coordinates"), _caller())
        self._problems: list[Problem] = []

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)

    def include(
        self,
        name: str,
        file: str | Path,
        *,
        prefix: str | None = None,
        parent: str = "base",
        position: Sequence[Value] = (0.0, 0.0, 0.0),
        rotation: Rotations | None = None,
        parameters: Mapping[str, Value] | None = None,
        root: str | None = None,
        lock: Sequence[str] | None = None,
        limits: bool | None = None,
    ) -> Self:
        """Put another scene file, or a URDF, into the scene: its names after ``prefix``, its base on ``parent``.

        The path starts in the current folder; ``prefix`` is the name and ``_`` by default. ``parameters`` go in
        place of those of the file. ``root``, ``lock`` and ``limits`` are for URDF.
        """
        return self._enter(
            "include",
            name,
            file=str(file),
            prefix=prefix,
            parent=parent,
            position=position,
            rotation=rotation,
            parameters=parameters,
            root=root,
            lock=lock,
            limits=limits,
        )

    def simulation(
        self,
        *,
        method: str | None = None,
        step: Value | None = None,
        duration: Value | None = None,
        rho_inf: float | None = None,
        alpha: float | None = None,
        beta: float | None = None,
        gamma: float | None = None,
        tolerance: float | None = None,
        order: int | None = None,
        record_every: int | None = None,
        start: str | None = None,
    ) -> Self:
        """Set the defaults of ``simulate`` (steps and durations in seconds)."""
        return self._enter(
            "simulation",
            "",
            method=method,
            step=step,
            duration=duration,
            rho_inf=rho_inf,
            alpha=alpha,
            beta=beta,
            gamma=gamma,
            tolerance=tolerance,
            order=order,
            record_every=record_every,
            start=start,
        )

    def base(self, position: Sequence[Value] = (0.0, 0.0, 0.0), rotation: Rotations = ()) -> Self:
        """Prescribe the motion of the base: position in world axes, intrinsic rotations (axis, angle); of time and
        parameters."""
        return self._enter("base", "", position=position, rotation=rotation)

    def body(
        self,
        name: str,
        mass: Value,
        *,
        center_of_mass: Sequence[Value] = (0.0, 0.0, 0.0),
        inertia: Sequence[Any] | Mapping[str, Value] = (0.0, 0.0, 0.0),
        group: str | None = None,
    ) -> Self:
        """Add a rigid body: mass (kg), centre of mass in its frame (m), inertia about it (kg m^2; 3, 6, table or 3x3).

        ``group`` is for absolute coordinates: SE3 (the default) suits bodies jointed to the ground or to slow bodies,
        R3xSO3 those that spin fast and freely.
        """
        return self._enter("bodies", name, mass=mass, center_of_mass=center_of_mass, inertia=inertia, group=group)

    def beam(
        self,
        name: str,
        length: Value,
        *,
        start: Value = 0.0,
        mass_per_length: Value | None = None,
        polar_inertia: Value | None = None,
        section: Mapping[str, Any] | None = None,
        mass_profile: Sequence[Value] = (1.0,),
        polar_profile: Sequence[Value] = (1.0,),
        bending_y: Mapping[str, Any] | None = None,
        bending_z: Mapping[str, Any] | None = None,
        stretch: Mapping[str, Any] | None = None,
        torsion: Mapping[str, Any] | None = None,
        order: int = 1,
        stiffening: bool = True,
    ) -> Self:
        """Add an elastic beam along x of its frame, from ``start`` on (m), with mass_per_length (kg/m) or a section.

        Each way to deform is a table with the keys modes, stiffness and where wanted shapes, ends, elements,
        damping_ratio, initial and others, as in a scene file; those that are not given do not happen. Joints carry a
        beam as any body.
        """
        return self._enter(
            "beams",
            name,
            length=length,
            start=start,
            mass_per_length=mass_per_length,
            polar_inertia=polar_inertia,
            section=section,
            mass_profile=mass_profile,
            polar_profile=polar_profile,
            bending_y=bending_y,
            bending_z=bending_z,
            stretch=stretch,
            torsion=torsion,
            order=order,
            stiffening=stiffening,
        )

    def joint(
        self,
        name: str,
        type: str,
        parent: str,
        child: str,
        *,
        axis: Sequence[Value] | None = None,
        second_axis: Sequence[Value] | None = None,
        x_axis: Sequence[Value] | None = None,
        pitch: Value | None = None,
        position: Sequence[Value] = (0.0, 0.0, 0.0),
        rotation: Rotations | None = None,
        orientation: Sequence[Sequence[float]] | None = None,
        stiffness: Value | Sequence[Value] | None = None,
        damping: Value | Sequence[Value] | None = None,
        rest: Value | Sequence[Value] | None = None,
        rotor_inertia: Value | Sequence[Value] | None = None,
        limits: Mapping[str, Value] | None = None,
        friction: Mapping[str, Value] | None = None,
        mimic: Mapping[str, Value] | None = None,
        initial: Mapping[str, Any] | None = None,
    ) -> Self:
        """Add a joint of type fixed, revolute, prismatic, helical, cylindrical, universal, planar, spherical or free.

        Its placement is in the parent's frame; what joints of several coordinates have in each is a list, angles first.

        ``limits`` are compliant stops, with the keys lower, upper, stiffness and where wanted damping and onset;
        ``friction`` is dry friction with coulomb, velocity and where wanted static and stribeck. ``mimic`` makes the
        coordinate follow another, with the keys joint and where wanted multiplier and offset.
        """
        return self._enter(
            "joints",
            name,
            type=type,
            parent=parent,
            child=child,
            axis=axis,
            second_axis=second_axis,
            x_axis=x_axis,
            pitch=pitch,
            position=position,
            rotation=rotation,
            orientation=orientation,
            stiffness=stiffness,
            damping=damping,
            rest=rest,
            rotor_inertia=rotor_inertia,
            limits=limits,
            friction=friction,
            mimic=mimic,
            initial=initial,
        )

    def constraint(
        self,
        name: str,
        type: str,
        first: str | Mapping[str, Any],
        second: str | Mapping[str, Any],
        *,
        drive: Value | None = None,
        length: Value | None = None,
        radius: Value | None = None,
        shape: str | None = None,
        pitch: Value | None = None,
    ) -> Self:
        """Add a constraint that closes a loop between two frames.

        A frame is a point's name, or a table with body and position (or point) and with axis, the frame's z (x_axis
        too where the angle about it matters), or rotation. Types: spherical, revolute, universal, cylindrical, helical
        (with pitch), prismatic, planar, fixed, distance (with length), point_on_line, rolling (with radius, and shape
        disc or sphere). ``drive``, a formula of time and parameters, prescribes the angle of revolute, or the travel of
        prismatic and cylindrical.
        """
        return self._enter(
            "constraints",
            name,
            type=type,
            first=first,
            second=second,
            drive=drive,
            length=length,
            radius=radius,
            shape=shape,
            pitch=pitch,
        )

    def point(self, name: str, body: str, position: Sequence[Value] = (0.0, 0.0, 0.0)) -> Self:
        """Add a point fixed in a body, in the ``base``, or in the ``world`` (what rests while the base moves)."""
        return self._enter("points", name, body=body, position=position)

    def parameter(
        self, name: str, value: Value, *, tunable: bool = False, unit: str = "", description: str = ""
    ) -> Self:
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
        """Add an input; the given formula is its value unless the caller specifies another.

        ``formula`` is of time and parameters; ``road`` has the keys speed (m/s), where needed offset (m), and one of
        class (A to H, ISO 8608), table, points and bump; ``shape`` is one of table, points and wave, with interpolation
        and outside.
        """
        return self._enter("inputs", name, formula=formula, road=road, unit=unit, description=description, **shape)

    def curve(self, name: str, **shape: Any) -> Self:
        """Add a function of one number: table, points, wave, bump or road as in a scene file, interpolation and
        outside."""
        return self._enter("curves", name, **shape)

    def state(self, name: str, rate: Value, *, initial: Value = 0.0, unit: str = "", description: str = "") -> Self:
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
            "controllers",
            name,
            type=type,
            signal=signal,
            proportional=proportional,
            integral=integral,
            derivative=derivative,
            gain=gain,
            time_constant=time_constant,
            lead=lead,
            minimum=minimum,
            maximum=maximum,
            tracking=tracking,
            initial=initial,
            initial_filtered=initial_filtered,
            unit=unit,
            description=description,
            **feedback,
        )

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

    def spring(
        self,
        name: str,
        first: str,
        second: str,
        *,
        stiffness: Value = 0.0,
        damping: Value = 0.0,
        length: Value = 0.0,
        force: Value = 0.0,
    ) -> Self:
        """Add a spring, damper or actuator along the line between two points; ``force`` is a tension."""
        return self._enter(
            "springs",
            name,
            first=first,
            second=second,
            stiffness=stiffness,
            damping=damping,
            length=length,
            force=force,
        )

    def torsion_spring(
        self,
        name: str,
        first: str,
        second: str = "",
        *,
        stiffness: Value = 0.0,
        damping: Value = 0.0,
        rest: Value = 0.0,
        first_index: int = 0,
        second_index: int = 0,
    ) -> Self:
        """Add a torsion spring between two joints' angles, or between one and its rest angle."""
        return self._enter(
            "torsion_springs",
            name,
            first=first,
            second=second,
            stiffness=stiffness,
            damping=damping,
            rest=rest,
            first_index=first_index,
            second_index=second_index,
        )

    def bushing(
        self,
        name: str,
        first: str | Mapping[str, Any],
        second: str | Mapping[str, Any],
        *,
        stiffness: Sequence[Value] | None = None,
        damping: Sequence[Value] | None = None,
        rotational_stiffness: Sequence[Value] | None = None,
        rotational_damping: Sequence[Value] | None = None,
        stiffness_matrix: Sequence[Sequence[float]] | None = None,
        damping_matrix: Sequence[Sequence[float]] | None = None,
        rest: Sequence[Value] = (0.0, 0.0, 0.0),
        rest_rotation: Rotations = (),
        preload: Sequence[Value] = (0.0, 0.0, 0.0),
        rotational_preload: Sequence[Value] = (0.0, 0.0, 0.0),
    ) -> Self:
        """Add a spring and damper in six directions between two frames (as of constraints), in the first one's axes.

        Stiffnesses and dampings are given along and about x, y, z, or as 6 x 6 matrices, rotations first. At ``rest``
        and ``rest_rotation``, the second frame's place in the first, only the preload acts on the second frame.
        """
        return self._enter(
            "bushings",
            name,
            first=first,
            second=second,
            stiffness=stiffness,
            damping=damping,
            rotational_stiffness=rotational_stiffness,
            rotational_damping=rotational_damping,
            stiffness_matrix=stiffness_matrix,
            damping_matrix=damping_matrix,
            rest=rest,
            rest_rotation=rest_rotation,
            preload=preload,
            rotational_preload=rotational_preload,
        )

    def tyre(
        self,
        name: str,
        center: str,
        *,
        radius: Value,
        stiffness: Value,
        damping: Value = 0.0,
        onset: Value = 1e-3,
        road: Value = 0.0,
        road_rate: Value | None = None,
        slip: Mapping[str, Any] | None = None,
    ) -> Self:
        """Add a tyre, a point contact below a wheel's centre that can lift off.

        ``road`` is the height of the road, a formula of time, inputs and the centre's x and y. ``slip`` has the keys
        stiffness (per load, one value or longitudinal and lateral) and where wanted axis, friction and velocity.
        """
        return self._enter(
            "tyres",
            name,
            center=center,
            radius=radius,
            stiffness=stiffness,
            damping=damping,
            onset=onset,
            road=road,
            road_rate=road_rate,
            slip=slip,
        )

    def force(
        self,
        name: str,
        body: str,
        *,
        point: Sequence[Value] = (0.0, 0.0, 0.0),
        force: Sequence[Value] = (0.0, 0.0, 0.0),
        torque: Sequence[Value] = (0.0, 0.0, 0.0),
        axes: str = "world",
    ) -> Self:
        """Add a force (N) and torque (N m) on a body at a point of its frame, in ``world`` or ``body`` axes."""
        return self._enter("forces", name, body=body, point=point, force=force, torque=torque, axes=axes)

    def effort(self, name: str, joint: str, effort: Value, *, index: int = 0) -> Self:
        """Add a generalized force on one component of a joint."""
        return self._enter("efforts", name, joint=joint, effort=effort, index=index)

    def build(self) -> Scene:
        """Return the checked scene.

        Raises
        ------
        DescriptionError
            With everything that is wrong, and the lines of the calls.
        """
        return from_data(
            self._data, file=f"scene {key_of(str(self._data['name']))}", lines=self._lines, problems=self._problems
        )

    def _enter(self, section: str, name: str, /, **values: Any) -> Self:
        """Store an entry of a section (or the section itself, where it has no named entries), and the caller's line."""
        place = _caller()
        key = key_of(section, str(name)) if name != "" or section not in ("base", "simulation") else section
        entry = {field: _plain(value) for field, value in values.items() if value is not None}
        entries = self._data if key == section else self._data.setdefault(section, {})
        entry_name = section if key == section else str(name)
        if entry_name in entries:
            hint = "another name" if key != section else "one call"
            self._problems.append(Problem(f"{place} ({key})", f"this was given before, at {self._lines[key]}", hint))
        else:
            entries[entry_name] = entry
            self._lines[key] = place
        return self


def _caller() -> str:
    """Return ``file:line`` of the call that came from outside the package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__package__")).partition(".")[0] == _PACKAGE:
        frame = frame.f_back
    return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"


def _plain(value: Any) -> Any:
    """Return plain numbers, lists and tables for arrays, tuples and (axis, angle) pairs."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if (
        isinstance(value, tuple)
        and len(value) == 2
        and isinstance(value[0], Sequence)
        and not isinstance(value[0], str)
    ):
        return {"axis": _plain(value[0]), "angle": _plain(value[1])}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
