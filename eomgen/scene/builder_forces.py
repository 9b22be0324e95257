"""The forces of a scene from Python: springs, bushings, tyres, forces and efforts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

from eomgen.scene.builder_entries import Entries, Rotations, Value


class Forces(Entries):
    """Entries of what pushes."""

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
            "springs", name, first=first, second=second, stiffness=stiffness, damping=damping, length=length, force=force
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

        Stiffnesses and dampings are given along and about x, y, z, or as 6 x 6 matrices, rotations first. At ``rest`` and
        ``rest_rotation``, the second frame's place in the first, only the preload acts on the second frame.
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

        ``road`` is the height of the road, a formula of time, inputs and the centre's x and y. ``slip`` has the keys stiffness
        (per load, one value or longitudinal and lateral) and where wanted axis, friction and velocity.
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
