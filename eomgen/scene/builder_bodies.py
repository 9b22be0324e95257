"""What a scene from Python is made of: base, bodies, beams and points, and the joints and constraints between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

from eomgen.scene.builder_entries import Entries, Rotations, Value


class Bodies(Entries):
    """Entries of what moves, and of what holds it together."""

    def base(self, position: Sequence[Value] = (0.0, 0.0, 0.0), rotation: Rotations = ()) -> Self:
        """Prescribe the motion of the base: position in world axes, intrinsic rotations (axis, angle); of time and parameters."""
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

        ``group`` is for absolute coordinates: SE3 (the default) suits bodies jointed to the ground or to slow bodies, R3xSO3
        those that spin fast and freely.
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

        Each way to deform is a table with the keys modes, stiffness and where wanted shapes, ends, elements, damping_ratio,
        initial and others, as in a scene file; those that are not given do not happen. Joints carry a beam as any body.
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

        ``limits`` are compliant stops, with the keys lower, upper, stiffness and where wanted damping and onset; ``friction``
        is dry friction with coulomb, velocity and where wanted static and stribeck. ``mimic`` makes the coordinate follow
        another, with the keys joint and where wanted multiplier and offset.
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
        too where the angle about it matters), or rotation. Types: spherical, revolute, universal, cylindrical, helical (with
        pitch), prismatic, planar, fixed, distance (with length), point_on_line, rolling (with radius, and shape disc or
        sphere). ``drive``, a formula of time and parameters, prescribes the angle of revolute, or the travel of prismatic
        and cylindrical.
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
