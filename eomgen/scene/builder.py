"""SceneBuilder: a scene from Python calls, with the data and the validation of a scene file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack

from eomgen.calls import checked_calls, unknown_attribute
from eomgen.errors import Problem
from eomgen.scene.builder_methods import Rotations, Value, enters
from eomgen.scene.load import from_data
from eomgen.scene.scene import GRAVITY, Scene
from eomgen.text import key_of

if TYPE_CHECKING:
    from eomgen.scene.builder_keys import (
        BaseKeys,
        BeamKeys,
        BodyKeys,
        BushingKeys,
        ConstraintKeys,
        ControllerKeys,
        CurveKeys,
        DistributedLoadKeys,
        EffortKeys,
        EventKeys,
        ForceKeys,
        FrameKeys,
        HullKeys,
        IncludeKeys,
        InputKeys,
        JointKeys,
        ModeKeys,
        OutputKeys,
        ParameterKeys,
        PointKeys,
        RandomKeys,
        ReactionKeys,
        ReferenceKeys,
        SimulationKeys,
        SpringKeys,
        StateKeys,
        TorsionSpringKeys,
        TyreKeys,
        WavesKeys,
    )

_PACKAGE = __name__.partition(".")[0]


@checked_calls(
    'a name, eomgen.SceneBuilder("pendulum")',
    com="center_of_mass",
    mass_center="center_of_mass",
    origin="position",
    k="stiffness",
    c="damping",
    l0="length",
    rest_length="length",
    free_length="length",
    kp="proportional",
    ki="integral",
    kd="derivative",
    rpy="rotation",
    pos="position",
    q0="initial",
    damping_ratio="damping (of joints and springs), or stiffness_damping = 2 ratio / w (of beams, s)",
    mass_damping="stiffness_damping (of beams, s): none goes with the mass",
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
    task_frames : sequence of str
        Bodies and frames that the terms of frames give; none means all.

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
        gravity: Sequence[Value] = GRAVITY,
        terms: Sequence[str] = (),
        coordinates: str = "joint",
        task_frames: Sequence[str] = (),
    ) -> None:
        settings = {
            "name": name,
            "description": description,
            "gravity": gravity,
            "terms": terms,
            "coordinates": coordinates,
            "task_frames": task_frames,
        }
        self._data: dict[str, Any] = {"format": 1, **{key: _plain(value) for key, value in settings.items()}}
        self._lines: dict[str, str] = dict.fromkeys((key for key in settings if key != "description"), _caller())
        self._problems: list[Problem] = []

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)

    @enters("include", others=True)
    def include(self, name: str, file: str | Path, **keys: Unpack[IncludeKeys]) -> Self:
        """Put another scene file, or a URDF, into the scene: its names after ``prefix``, its base on ``parent``.

        The path starts in the current folder; ``prefix`` is the name and ``_`` by default. Options of the file's
        source are keys, too.
        """
        return self._enter("include", name, file=file, **keys)

    @enters("simulation")
    def simulation(self, **keys: Unpack[SimulationKeys]) -> Self:
        """Set the defaults of ``simulate`` (steps and durations in seconds)."""
        return self._enter("simulation", "", **keys)

    @enters("base")
    def base(
        self, position: Sequence[Value] = (0.0, 0.0, 0.0), rotation: Rotations = (), **keys: Unpack[BaseKeys]
    ) -> Self:
        """Prescribe the motion of the base: position in world axes, intrinsic rotations (axis, angle); of time and
        parameters. ``follow`` waves to go with their surface.
        """
        return self._enter("base", "", position=position, rotation=rotation, **keys)

    @enters("bodies")
    def body(self, name: str, mass: Value, **keys: Unpack[BodyKeys]) -> Self:
        """Add a rigid body: mass (kg), centre of mass in its frame (m), inertia about it (kg m^2; 3, 6, table or 3x3).

        ``group`` is for absolute coordinates: SE3 (the default) suits bodies jointed to the ground or to slow bodies,
        R3xSO3 those that spin fast and freely.
        """
        return self._enter("bodies", name, mass=mass, **keys)

    @enters("beams")
    def beam(self, name: str, length: Value | None = None, **keys: Unpack[BeamKeys]) -> Self:
        """Add an elastic beam along x of its frame, from ``start`` on (m), with mass_per_length (kg/m) or a section.

        Each way to deform is a table; those that are not given do not happen. Joints carry a beam as any body.
        """
        return self._enter("beams", name, length=length, **keys)

    @enters("joints")
    def joint(self, name: str, type: str, parent: str, child: str, **keys: Unpack[JointKeys]) -> Self:
        """Add a joint of type fixed, revolute, prismatic, helical, cylindrical, universal, planar, spherical or free.

        Its placement is in the parent's frame; what joints of several coordinates have in each is a list, angles first.
        """
        return self._enter("joints", name, type=type, parent=parent, child=child, **keys)

    @enters("constraints")
    def constraint(
        self,
        name: str,
        type: str,
        first: str | Mapping[str, Any],
        second: str | Mapping[str, Any],
        **keys: Unpack[ConstraintKeys],
    ) -> Self:
        """Add a constraint that closes a loop between two frames.

        A frame is a point's name, or a table with body and position (or point) and with axis, the frame's z (x_axis
        too where the angle about it matters), or rotation. Types: spherical, revolute, universal, cylindrical, helical
        (with pitch), prismatic, planar, fixed, distance (with length), point_on_line, rolling (with radius, and shape
        disc or sphere).
        """
        return self._enter("constraints", name, type=type, first=first, second=second, **keys)

    @enters("reactions")
    def reaction(self, name: str, **keys: Unpack[ReactionKeys]) -> Self:
        """Say where, and in which axes, ``reaction.NAME`` is told: of a joint or of a constraint."""
        return self._enter("reactions", name, **keys)

    @enters("points")
    def point(
        self, name: str, body: str, position: Sequence[Value] = (0.0, 0.0, 0.0), **keys: Unpack[PointKeys]
    ) -> Self:
        """Add a point fixed in a body, in the ``base``, or in the ``world`` (what rests while the base moves)."""
        return self._enter("points", name, body=body, position=position, **keys)

    @enters("frames")
    def frame(
        self, name: str, body: str, position: Sequence[Value] = (0.0, 0.0, 0.0), **keys: Unpack[FrameKeys]
    ) -> Self:
        """Add a frame fixed in a body, in the ``base`` or in the ``world``; its origin is a point of that name."""
        return self._enter("frames", name, body=body, position=position, **keys)

    @enters("parameters")
    def parameter(self, name: str, value: Value, **keys: Unpack[ParameterKeys]) -> Self:
        """Add a named number, or a text of a number and its unit; a tunable one can be changed without recompiling."""
        return self._enter("parameters", name, value=value, **keys)

    @enters("inputs")
    def input(self, name: str, formula: Value | None = None, **keys: Unpack[InputKeys]) -> Self:
        """Add an input; the given formula is its value unless the caller specifies another.

        ``formula`` is of time and parameters; ``road`` has the keys speed (m/s), where needed offset (m), and one of
        class (A to H, ISO 8608), table, points and bump; besides, one of table, points and wave says its shape.
        """
        return self._enter("inputs", name, formula=formula, **keys)

    @enters("random")
    def random(self, name: str, type: str | None = None, **keys: Unpack[RandomKeys]) -> Self:
        """Add a stationary random process, which formulas use by its name; its standard normal variables are tunable
        parameters. ``road_class`` is a scene file's ``class``.
        """
        values: dict[str, Any] = dict(keys)
        return self._enter("random", name, type=type, **{"class": values.pop("road_class", None)}, **values)

    @enters("waves")
    def waves(self, name: str, **keys: Unpack[WavesKeys]) -> Self:
        """Add waves, of a ``spectrum`` or ``regular`` ones, which formulas ask for elevation, slope, velocity and
        acceleration of the water.
        """
        return self._enter("waves", name, **keys)

    @enters("curves")
    def curve(self, name: str, **keys: Unpack[CurveKeys]) -> Self:
        """Add a function of one number: table, points, wave, bump or road as in a scene file, interpolation and
        outside.
        """
        return self._enter("curves", name, **keys)

    @enters("states")
    def state(self, name: str, rate: Value | None = None, **keys: Unpack[StateKeys]) -> Self:
        """Add an internal state: ``rate``, a formula of everything but accelerations, is its time derivative; or
        ``sample`` in s and ``formula`` of one that is sampled.
        """
        return self._enter("states", name, rate=rate, **keys)

    @enters("controllers")
    def controller(self, name: str, type: str, signal: Value | None = None, **keys: Unpack[ControllerKeys]) -> Self:
        """Add a controller, filter or actuator of type pi, pid, low_pass, lead_lag, state_feedback, skyhook or sampled.

        Formulas use its output by its name.
        """
        return self._enter("controllers", name, type=type, signal=signal, **keys)

    @enters("references")
    def reference(self, name: str, **keys: Unpack[ReferenceKeys]) -> Self:
        """Add a reference motion of joints, for which formulas ask the inverse dynamics: ``tau.elbow(name)``."""
        return self._enter("references", name, **keys)

    @enters("outputs")
    def output(self, name: str, **keys: Unpack[OutputKeys]) -> Self:
        """Add an output: formulas, a point's position, velocity or acceleration (world axes), or an energy."""
        return self._enter("outputs", name, **keys)

    @enters("modes")
    def mode(self, name: str, value: float, **keys: Unpack[ModeKeys]) -> Self:
        """Add a number that only events change, ``mode.name`` in formulas."""
        return self._enter("modes", name, value=value, **keys)

    @enters("events")
    def event(self, name: str, when: Value, **keys: Unpack[EventKeys]) -> Self:
        """Add an event at the roots of a formula."""
        return self._enter("events", name, when=when, **keys)

    @enters("springs")
    def spring(self, name: str, first: str, second: str, **keys: Unpack[SpringKeys]) -> Self:
        """Add a spring, damper or actuator along the line between two points; ``force`` is a tension."""
        return self._enter("springs", name, first=first, second=second, **keys)

    @enters("torsion_springs")
    def torsion_spring(self, name: str, first: str, second: str = "", **keys: Unpack[TorsionSpringKeys]) -> Self:
        """Add a torsion spring between two joints' angles, or between one and its rest angle."""
        return self._enter("torsion_springs", name, first=first, second=second, **keys)

    @enters("bushings")
    def bushing(
        self, name: str, first: str | Mapping[str, Any], second: str | Mapping[str, Any], **keys: Unpack[BushingKeys]
    ) -> Self:
        """Add a spring and damper in six directions between two frames (as of constraints), in the first one's axes.

        Stiffnesses and dampings are given along and about x, y, z, or as 6 x 6 matrices, rotations first. At ``rest``
        and ``rest_rotation``, the second frame's place in the first, only the preload acts on the second frame.
        """
        return self._enter("bushings", name, first=first, second=second, **keys)

    @enters("hulls")
    def hull(self, name: str, body: str, **keys: Unpack[HullKeys]) -> Self:
        """Add a slender part of a rigid body in water: buoyancy, added mass and drag."""
        return self._enter("hulls", name, body=body, **keys)

    @enters("tyres")
    def tyre(self, name: str, center: str, **keys: Unpack[TyreKeys]) -> Self:
        """Add a tyre, a point contact below a wheel's centre that can lift off.

        ``road`` is the height of the road, a formula of time, inputs and the centre's x and y; stiffnesses of ``slip``
        are per load, one value or longitudinal and lateral.
        """
        return self._enter("tyres", name, center=center, **keys)

    @enters("forces")
    def force(self, name: str, body: str, **keys: Unpack[ForceKeys]) -> Self:
        """Add a force (N) and torque (N m) on a body at a point of its frame, in ``world`` or ``body`` axes."""
        return self._enter("forces", name, body=body, **keys)

    @enters("distributed_loads")
    def distributed_load(
        self, name: str, beam: str, force: Sequence[Value], **keys: Unpack[DistributedLoadKeys]
    ) -> Self:
        """Add a force per length (N/m) on a beam, times a polynomial along it, in ``world`` or ``beam`` axes."""
        return self._enter("distributed_loads", name, beam=beam, force=force, **keys)

    @enters("efforts")
    def effort(self, name: str, joint: str, effort: Value, **keys: Unpack[EffortKeys]) -> Self:
        """Add a generalized force on one component of a joint."""
        return self._enter("efforts", name, joint=joint, effort=effort, **keys)

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
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
