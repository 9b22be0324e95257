"""Failure catalogue: state feedback, calibrations and skyhook."""

from __future__ import annotations

from tests.failures.failure import Failure

#: Parts of scenes that several entries have.
_HOLD = '[controllers.hold]\ntype = "state_feedback"\n'
_SHOULDER = _HOLD + 'coordinates = ["shoulder"]\n'
_CALIBRATION = _SHOULDER + "\n[controllers.hold.calibration]\n"
_WEIGHTS = 'method = "lqr"\nposition_weights = { shoulder = 10 }\neffort_weights = 0.1'
_LQR = _CALIBRATION + _WEIGHTS
_PLACED = _CALIBRATION + 'method = "pole_placement"\n'
_EFFORT = '\n\n[efforts.hold]\njoint = "shoulder"\neffort = "hold"'
_MAST = """\
[beams.mast]
length = 2.0
mass_per_length = 1.5
bending_y = { modes = 2, stiffness = 100.0 }
[joints.foot]
type = "fixed"
parent = "base"
child = "mast"
"""
_SKY = """\
[points.mount]
body = "base"
position = [0.3, 0, 0]

[springs.strut]
first = "mount"
second = "tip"

[controllers.sky]
type = "skyhook"
spring = "strut"
damping = 100
clipped = true"""

FAILURES = [
    Failure("State feedback without gains", 3, more=_HOLD + 'coordinates = ["shoulder"]'),
    Failure("State feedback of nothing", 3, more=_HOLD + "\n[controllers.hold.calibration]\n" + _WEIGHTS),
    Failure(
        "State feedback of a joint that there is not",
        3,
        more=_HOLD + 'coordinates = ["sholder"]\nposition_gains = { sholder = 1 }',
    ),
    Failure(
        "State feedback of a beam as if it were a joint",
        3,
        "description error: scene.toml:43 (controllers.hold.coordinates[0]): 'mast' is a beam: signals name its"
        ' elastic coordinates; try: signals = { mast_0 = "q.mast[0]", mast_0_rate = "v.mast[0]", ... } [E1432]',
        more=_MAST + _HOLD + 'coordinates = ["mast"]\nposition_gains = { mast = 1 }',
    ),
    Failure(
        "A weight on a beam as if it were a joint",
        3,
        "description error: scene.toml:45 (controllers.hold.calibration.position_weights.mast): 'mast' is a beam, not"
        ' a joint; try: a signal "q.mast[0]", or "v.mast[0]", and its weight in signal_weights [E1449]',
        more=_MAST
        + _SHOULDER
        + '[controllers.hold.calibration]\nposition_weights = { mast = 10 }\nmethod = "lqr"\neffort_weights = 0.1',
    ),
    Failure(
        "Gains of another number than outputs",
        3,
        more=_SHOULDER + 'outputs = ["up", "down"]\nposition_gains = { shoulder = 1 }',
    ),
    Failure(
        "Gains, and a calibration that would find them",
        3,
        more=_SHOULDER + "position_gains = { shoulder = 1 }\n[controllers.hold.calibration]\n" + _WEIGHTS,
    ),
    Failure(
        "A negative weight",
        3,
        more=_CALIBRATION + 'method = "lqr"\nposition_weights = { shoulder = -10 }\neffort_weights = 0.1',
    ),
    Failure(
        "A list of weights of the wrong length",
        3,
        more=_CALIBRATION + 'method = "lqr"\nposition_weights = { shoulder = 10 }\neffort_weights = [0.1, 0.2]',
    ),
    Failure(
        "A mode that nothing stabilises",
        4,
        "note: the controller hold changes nothing: no formula mentions what it gives [W0103]\n"
        "model error: scene.toml:38 (controllers.hold.calibration): the mode of v.shoulder and shoulder that "
        "grows at 5.625 1/s without oscillating cannot be stabilised: no actuator moves it; try: an actuator that "
        "works on it, or a spring, a damper or a filter that makes it decay [E0378]",
        command="generate scene.toml --out c",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\ninitial = { position = 3.1416 }",
        more=_LQR,
    ),
    Failure(
        "Efforts that cost nothing",
        3,
        "description error: scene.toml:37 (controllers.hold.calibration): some effort has zero weight, so the optimal "
        "gain is unbounded; try: a positive weight for every effort, or for accelerations that they give [E0409]",
        command="generate scene.toml --out c",
        more=_CALIBRATION + 'method = "lqr"\nposition_weights = { shoulder = 10 }\neffort_weights = 0' + _EFFORT,
    ),
    Failure(
        "Poles without their conjugates",
        3,
        command="generate scene.toml --out c",
        more=_PLACED + "poles = [[-1, 2], [-1, 2]]" + _EFFORT,
    ),
    Failure(
        "More poles than the model has",
        3,
        command="generate scene.toml --out c",
        more=_PLACED + "poles = [[-1, 2], [-1, -2], [-5, 0]]" + _EFFORT,
    ),
    Failure(
        "More modes to place than actuators",
        4,
        "model error: scene.toml:44 (controllers.hold.calibration): the modes 2, 3 cannot be placed each by itself:"
        " hold acts on them in 1 independent way only; try: 1 of the modes, an output more, all poles in place of"
        " modes, or lqr [E0517]",
        command="generate scene.toml --out c",
        more=_MAST
        + _HOLD
        + 'signals = { b0 = "q.mast[0]", b1 = "q.mast[1]", b0_rate = "v.mast[0]", b1_rate = "v.mast[1]" }\n'
        + '[controllers.hold.calibration]\nmethod = "pole_placement"\nmodes = [2, 3]\ndamping_ratios = 0.3\n'
        + '[forces.push]\nbody = "mast"\npoint = [1.5, 0, 0]\nforce = [0, "hold", 0]',
    ),
    Failure(
        "A mode beyond the model",
        3,
        command="generate scene.toml --out c",
        more=_CALIBRATION + 'method = "imsc"\nmodes = [2]\neffort_weights = 0.1' + _EFFORT,
    ),
    Failure(
        "Signals that do not determine the state",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): the feedback needs v.shoulder, which the "
        "coordinates and signals of hold do not determine; try: v.shoulder among its signals, or its joint among its "
        "coordinates [E0521]",
        command="generate scene.toml --out c",
        more=_HOLD + 'signals = { angle = "q.shoulder" }\n\n[controllers.hold.calibration]\n' + _WEIGHTS + _EFFORT,
    ),
    Failure(
        "A calibration at a state that is not in balance",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): the initial state is not in balance: it "
        'accelerates with 9.68 m/s^2 or rad/s^2; try: at = "equilibrium", or an initial state of rest or of steady '
        "motion [E0518]",
        command="generate scene.toml --out c",
        more=_LQR
        + '\nat = "initial"'
        + _EFFORT
        + '\n\n[forces.push]\nbody = "upper"\npoint = [0, 0, "-length"]\nforce = [3, 0, 0]',
    ),
    Failure(
        "Modal control of forces that lag",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): forces depend on the internal states lag, and "
        "modes belong to models of second order; try: lqr, or all poles; a controller without memory between, or "
        "gains of your own [E0519]",
        command="generate scene.toml --out c",
        more=_CALIBRATION
        + 'method = "imsc"\neffort_weights = 0.1\n\n[states.lag]\nrate = "10 * (hold - lag)"'
        + _EFFORT.replace('"hold"', '"lag"'),
    ),
    Failure("A clipped skyhook without its hardest damper", 3, more=_SKY),
    Failure(
        "A clipped skyhook whose limits cross",
        3,
        "description error: scene.toml:46 (controllers.sky.minimum_damping): the range is empty: "
        "minimum_damping 300 is not below maximum_damping 200; try: a smaller minimum_damping [E1790]",
        more=_SKY + "\nminimum_damping = 300\nmaximum_damping = 200",
    ),
    Failure(
        "Poles that do not decay",
        3,
        "description error: 2 problems\n"
        "  1. scene.toml:39 (controllers.hold.calibration.poles[0]): the pole [1, 0] does not decay: its real part is "
        "not below 0; try: [-1, 0] [E1439]\n"
        "  2. scene.toml:39 (controllers.hold.calibration.poles[1]): the pole [0, 0] does not decay: its real part is "
        "not below 0; try: [-1, 0] [E1439]",
        more=_PLACED + "poles = [[1, 0], [0, 0]]",
    ),
]
