"""Beams by EXUDYN's geometrically exact, shear-deformable elements: spin-up in the plane, an elastic pendulum in space.

`python -m tests.oracles.exudyn_beams` prints the pendulum's converged positions, which tests hold as numbers (half a
minute).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from tests.oracles.spin_up_beam import Beam


@dataclass(frozen=True)
class History:
    """Times (n) and positions of a point (n, 3), m, in the frame each function names."""

    t: np.ndarray
    position: np.ndarray

    def at(self, times: Sequence[float]) -> np.ndarray:
        """Return positions at times; rows are not always equally spaced, for EXUDYN halves steps."""
        found: np.ndarray = CubicSpline(self.t, self.position)(times)
        return found


def _modules() -> tuple[ModuleType, ModuleType]:
    return import_module("exudyn"), import_module("exudyn.itemInterface")


def _solve(exudyn: ModuleType, system: Any, end: float, steps: int, nodes: Sequence[int]) -> list[np.ndarray]:
    """Run generalized-alpha (rho_inf = 0.9) and return the positions of nodes, each (n, 4) with time first.

    Residuals are forces. The default tolerance of 1e-10 N is below the round-off of axial forces: steps would be
    repeated a thousand times.
    """
    what = {"outputVariableType": exudyn.OutputVariableType.Position, "storeInternal": True}
    sensors = [
        system.AddSensor(import_module("exudyn.itemInterface").SensorNode(nodeNumber=node, **what)) for node in nodes
    ]
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.endTime = end
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.absoluteTolerance = 1e-6
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = end / steps
    system.SolveDynamic(settings)
    return [np.array(system.GetSensorStoredData(sensor)) for sensor in sensors]


def spin_up(beam: Beam, elements: int, *, end: float = 18.0, steps: int = 1800) -> History:
    """Return the tip of set A in the rotating frame: (x - L, deflection, 0)."""
    exudyn, items = _modules()
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    L = beam.length
    places = np.linspace(0.0, L, elements + 1)
    nodes = [system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x, 0.0, 0.0])) for x in places]
    for pair in pairwise(nodes):
        element = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=list(pair),
            length=L / elements,
            massPerLength=beam.mass,
            crossSectionInertia=6e-4,
            bendingStiffness=beam.bending,
            axialStiffness=2.8e7,
            shearStiffness=1.0e7,
        )
        system.AddObject(element)
    ground = system.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.NodePointGround()), coordinate=0)
    )

    def angle(_: Any, t: float, __: int, ___: float) -> float:
        return float(beam.angle(t))

    for coordinate in range(3):
        marker = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        law: dict[str, Callable[..., float]] = {"offsetUserFunction": angle} if coordinate == 2 else {}
        system.AddObject(items.CoordinateConstraint(markerNumbers=[ground, marker], **law))
    (stored,) = _solve(exudyn, system, end, steps, [nodes[-1]])
    t, turn = stored[:, 0], beam.angle(stored[:, 0])
    x, y = stored[:, 1], stored[:, 2]
    along, across = np.cos(turn) * x + np.sin(turn) * y - L, np.cos(turn) * y - np.sin(turn) * x
    return History(t, np.stack([along, across, np.zeros_like(t)], axis=1))


@dataclass(frozen=True)
class Pendulum:
    """A slender steel rod on a rigid hub that turns about its centre in all directions, with a small heavy ball at the
    tip.

    At the start the rod is straight along x and turns as a rigid body. SI units.
    """

    length: float = 2.0
    diameter: float = 0.007
    modulus: float = 2.1e11
    poisson: float = 0.3
    density: float = 7850.0
    hub_inertia: float = 0.05
    tip_mass: float = 0.3
    tip_inertia: float = 1.2e-4
    gravity: tuple[float, float, float] = (4.905, 0.0, -8.495709211124343)  # 9.81, the rod 60 degrees from hanging
    rate: tuple[float, float, float] = (0.0, 0.0, 1.2)

    @property
    def area(self) -> float:
        return float(np.pi * self.diameter**2 / 4)

    @property
    def second_moment(self) -> float:
        return float(np.pi * self.diameter**4 / 64)


def swing(pendulum: Pendulum, elements: int, *, end: float = 3.0, steps: int = 3000) -> tuple[History, History]:
    """Return the paths of the rod's middle and of its tip in the inertial frame; `elements` is even."""
    exudyn, items = _modules()
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    p, L = pendulum, pendulum.length
    shear = p.modulus / (2 * (1 + p.poisson))
    section = exudyn.BeamSection()
    section.massPerLength = p.density * p.area
    section.inertia = p.density * p.second_moment * np.diag([2.0, 1.0, 1.0])
    lateral = 0.9 * shear * p.area
    bending = p.modulus * p.second_moment
    section.stiffnessMatrix = np.diag(
        [p.modulus * p.area, lateral, lateral, 2 * shear * p.second_moment, bending, bending]
    )
    omega = np.array(p.rate)
    nodes = []
    for x in np.linspace(0.0, L, elements + 1):
        velocity = [*np.cross(omega, [x, 0.0, 0.0]), *omega]
        place = [x, 0.0, 0.0, 0.0, 0.0, 0.0]
        nodes.append(
            system.AddNode(items.NodeRigidBodyRotVecLG(referenceCoordinates=place, initialVelocities=velocity))
        )
    for pair in pairwise(nodes):
        beam = items.ObjectBeamGeometricallyExact(nodeNumbers=list(pair), length=L / elements, sectionData=section)
        element = system.AddObject(beam)
        marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=element))
        system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(p.gravity)))
    for node, mass, inertia in ((nodes[0], 1.0, p.hub_inertia), (nodes[-1], p.tip_mass, p.tip_inertia)):
        body = system.AddObject(items.ObjectRigidBody(nodeNumber=node, mass=mass, inertia=[inertia] * 3 + [0.0] * 3))
        marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(p.gravity)))
    ground = system.AddMarker(items.MarkerBodyPosition(bodyNumber=system.AddObject(items.ObjectGround())))
    hub = system.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[0]))
    system.AddObject(items.SphericalJoint(markerNumbers=[ground, hub]))
    watched = (nodes[elements // 2], nodes[-1])
    middle, tip = (History(stored[:, 0], stored[:, 1:]) for stored in _solve(exudyn, system, end, steps, watched))
    return middle, tip


def converged(times: Sequence[float]) -> np.ndarray:
    """Return middle and tip at times, shape (2, times, 3), extrapolated to the limit of 16 and 32 elements (order
    2)."""
    coarse, fine = (
        np.array([path.at(times) for path in swing(Pendulum(), n, end=times[-1], steps=8000)]) for n in (16, 32)
    )
    extrapolated: np.ndarray = fine + (fine - coarse) / 3.0
    return extrapolated


if __name__ == "__main__":
    print(np.array2string(converged([0.5, 1.0, 1.5, 2.0]), precision=5, separator=", "))
