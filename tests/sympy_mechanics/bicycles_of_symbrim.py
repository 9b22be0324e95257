"""Models of SymBRiM 0.1.0, of which the corpus takes the equations: the Carvallo-Whipple bicycle with knife-edge and
toroidal wheels, with a suspension fork; the stationary bicycle; the rolling disc."""

from symbrim import (
    FlatGround,
    KnifeEdgeWheel,
    NonHolonomicTire,
    RigidFrontFrame,
    RigidRearFrame,
    StationaryBicycle,
    SuspensionRigidFrontFrame,
    ToroidalWheel,
    WhippleBicycle,
)
from symbrim.other.rolling_disc import RollingDisc
from sympy import Symbol

g = Symbol("g")


def whipple(front, wheel, tire=NonHolonomicTire):
    bike = WhippleBicycle("bike")
    bike.ground, bike.rear_frame, bike.front_frame = FlatGround("ground"), RigidRearFrame("rear"), front("front")
    bike.rear_wheel, bike.front_wheel = wheel("rear_wheel"), wheel("front_wheel")
    bike.rear_tire, bike.front_tire = tire("rear_tire"), tire("front_tire")
    bike.define_all()
    system = bike.to_system()
    system.apply_uniform_gravity(-g * bike.ground.get_normal(bike.ground.origin))
    further = [item for item in system.q if item not in list(bike.q)]
    speeds = [item for item in system.u if item not in list(bike.u)]
    system.q_ind, system.q_dep = [*bike.q[:4], *bike.q[5:], *further], [bike.q[4]]
    system.u_ind, system.u_dep = [bike.u[3], *bike.u[5:7], *speeds], [*bike.u[:3], bike.u[4], bike.u[7]]
    return system


for front in (RigidFrontFrame, SuspensionRigidFrontFrame):
    for wheel in (KnifeEdgeWheel, ToroidalWheel):
        whipple(front, wheel).form_eoms(constraint_solver="CRAMER")

bike = StationaryBicycle("bike")
bike.rear_frame, bike.front_frame = RigidRearFrame("rear"), RigidFrontFrame("front")
bike.rear_wheel, bike.front_wheel = KnifeEdgeWheel("rear_wheel"), KnifeEdgeWheel("front_wheel")
bike.define_all()
system = bike.to_system()
system.q_ind, system.u_ind = [*bike.q], [*bike.u]
system.form_eoms()

disc = RollingDisc("disc")
disc.disc, disc.ground, disc.tire = KnifeEdgeWheel("wheel"), FlatGround("ground"), NonHolonomicTire("tire")
disc.define_all()
system = disc.to_system()
system.apply_uniform_gravity(-g * disc.ground.get_normal(disc.ground.origin))
system.q_ind, system.u_ind, system.u_dep = [*disc.q], [*disc.u[2:]], [*disc.u[:2]]
system.form_eoms()
