"""Failure catalogue: state feedback, calibrations and skyhook."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "State feedback without gains",
        3,
        more='[controllers.hold]\ntype = "state_feedback"\ncoordinates = ["shoulder"]',
    ),
    Failure(
        "State feedback of nothing",
        3,
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "State feedback of a joint that there is not",
        3,
        more='[controllers.hold]\ntype = "state_feedback"\ncoordinates = ["sholder"]\nposition_gains = { sholder = 1 }',
    ),
    Failure(
        "State feedback of a beam as if it were a joint",
        3,
        "description error: scene.toml:43 (controllers.hold.coordinates[0]): 'mast' is a beam: signals name its"
        ' elastic coordinates; try: signals = { mast_0 = "q.mast[0]", mast_0_rate = "v.mast[0]", ... } [E1432]',
        more=(
            "[beams.mast]\n"
            "length = 2.0\n"
            "mass_per_length = 1.5\n"
            "bending_y = { modes = 2, stiffness = 100.0 }\n"
            "[joints.foot]\n"
            'type = "fixed"\n'
            'parent = "base"\n'
            'child = "mast"\n'
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["mast"]\n'
            "position_gains = { mast = 1 }"
        ),
    ),
    Failure(
        "A weight on a beam as if it were a joint",
        3,
        "description error: scene.toml:45 (controllers.hold.calibration.position_weights.mast): 'mast' is a beam, not"
        ' a joint; try: a signal "q.mast[0]", or "v.mast[0]", and its weight in signal_weights [E1449]',
        more=(
            "[beams.mast]\n"
            "length = 2.0\n"
            "mass_per_length = 1.5\n"
            "bending_y = { modes = 2, stiffness = 100.0 }\n"
            "[joints.foot]\n"
            'type = "fixed"\n'
            'parent = "base"\n'
            'child = "mast"\n'
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "[controllers.hold.calibration]\n"
            "position_weights = { mast = 10 }\n"
            'method = "lqr"\n'
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "Gains that are no numbers",
        3,
        "description error: scene.toml:36 (controllers.hold.position_gains.shoulder[0]): a finite number is needed "
        "here, not nan [E1475]",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "position_gains = { shoulder = nan }"
        ),
    ),
    Failure(
        "Gains of another number than outputs",
        3,
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            'outputs = ["up", "down"]\n'
            "position_gains = { shoulder = 1 }"
        ),
    ),
    Failure(
        "Gains, and a calibration that would find them",
        3,
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "position_gains = { shoulder = 1 }\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "A negative weight",
        3,
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = -10 }\n"
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "A weight on a joint that there is not",
        3,
        "description error: scene.toml:39 (controllers.hold.calibration.position_weights.elbow): there is no joint "
        "'elbow'; try: one of shoulder [E0100]",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { elbow = 10 }\n"
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "A list of weights of the wrong length",
        3,
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = [0.1, 0.2]"
        ),
    ),
    Failure(
        "A weight that the method does not know",
        3,
        "description error: scene.toml:39 (controllers.hold.calibration.effort_weights): effort_weights has no "
        "meaning for pole_placement; try: method = lqr or imsc [E1417]",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "pole_placement"\n'
            "effort_weights = 1\n"
            "damping_ratios = 0.5"
        ),
    ),
    Failure(
        "Modal control without the weight of its forces",
        3,
        "description error: scene.toml:37 (controllers.hold.calibration): the method imsc needs the key "
        "effort_weights; try: effort_weights = 1e-3 [E1418]",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "imsc"'
        ),
    ),
    Failure(
        "A mode that nothing stabilises",
        4,
        "note: the controller hold changes nothing: no formula mentions what it gives [W0103]\n"
        "model error: scene.toml:38 (controllers.hold.calibration): the mode of shoulder that grows at 5.625 1/s "
        "without oscillating cannot be stabilised: no actuator moves it; try: an actuator that works on it, or a "
        "spring and a damper that hold it [E0378]",
        command="generate scene.toml --out c",
        old="axis = [0, 1, 0]",
        new="axis = [0, 1, 0]\ninitial = { position = 3.1416 }",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0.1"
        ),
    ),
    Failure(
        "Efforts that cost nothing",
        3,
        "description error: scene.toml:37 (controllers.hold.calibration): some effort has zero weight, so the optimal "
        "gain is unbounded; try: a positive weight for every effort, or for accelerations that they give [E0409]",
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0\n"
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"'
        ),
    ),
    Failure(
        "Poles without their conjugates",
        3,
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "pole_placement"\n'
            "poles = [[-1, 2], [-1, 2]]\n"
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"'
        ),
    ),
    Failure(
        "More poles than the model has",
        3,
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "pole_placement"\n'
            "poles = [[-1, 2], [-1, -2], [-5, 0]]\n"
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"'
        ),
    ),
    Failure(
        "More modes to place than actuators",
        4,
        "model error: scene.toml:44 (controllers.hold.calibration): the modes 2, 3 cannot be placed each by itself:"
        " hold acts on them in 1 independent way only; try: 1 of the modes, an output more, all poles in place of"
        " modes, or lqr [E0517]",
        command="generate scene.toml --out c",
        more=(
            "[beams.mast]\n"
            "length = 2.0\n"
            "mass_per_length = 1.5\n"
            "bending_y = { modes = 2, stiffness = 100.0 }\n"
            "[joints.foot]\n"
            'type = "fixed"\n'
            'parent = "base"\n'
            'child = "mast"\n'
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'signals = { b0 = "q.mast[0]", b1 = "q.mast[1]", b0_rate = "v.mast[0]", b1_rate = "v.mast[1]" }\n'
            "[controllers.hold.calibration]\n"
            'method = "pole_placement"\n'
            "modes = [2, 3]\n"
            "damping_ratios = 0.3\n"
            "[forces.push]\n"
            'body = "mast"\n'
            "point = [1.5, 0, 0]\n"
            'force = [0, "hold", 0]'
        ),
    ),
    Failure(
        "A mode beyond the model",
        3,
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "imsc"\n'
            "modes = [2]\n"
            "effort_weights = 0.1\n"
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"'
        ),
    ),
    Failure(
        "Signals that do not determine the state",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): the feedback needs v.shoulder, which the "
        "coordinates and signals of hold do not determine; try: v.shoulder among its signals, or its joint among its "
        "coordinates [E0521]",
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'signals = { angle = "q.shoulder" }\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0.1\n"
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"'
        ),
    ),
    Failure(
        "A calibration at a state that is not in balance",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): the initial state is not in balance: it "
        'accelerates with 9.68 m/s^2 or rad/s^2; try: at = "equilibrium", or an initial state of rest or of steady '
        "motion [E0518]",
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "lqr"\n'
            "position_weights = { shoulder = 10 }\n"
            "effort_weights = 0.1\n"
            'at = "initial"\n'
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "hold"\n'
            "\n"
            "[forces.push]\n"
            'body = "upper"\n'
            'point = [0, 0, "-length"]\n'
            "force = [3, 0, 0]"
        ),
    ),
    Failure(
        "Modal control of forces that lag",
        4,
        "model error: scene.toml:37 (controllers.hold.calibration): forces depend on the internal states lag, and "
        "modes belong to models of second order; try: lqr, or all poles; a controller without memory between, or "
        "gains of your own [E0519]",
        command="generate scene.toml --out c",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "imsc"\n'
            "effort_weights = 0.1\n"
            "\n"
            "[states.lag]\n"
            'rate = "10 * (hold - lag)"\n'
            "\n"
            "[efforts.hold]\n"
            'joint = "shoulder"\n'
            'effort = "lag"'
        ),
    ),
    Failure(
        "A skyhook on no spring",
        3,
        "description error: scene.toml:33 (controllers.sky): the type skyhook needs the key spring; try: spring = "
        '"suspension" [E1418]',
        more='[controllers.sky]\ntype = "skyhook"\ndamping = 100',
    ),
    Failure(
        "A clipped skyhook without its hardest damper",
        3,
        more=(
            "[points.mount]\n"
            'body = "base"\n'
            "position = [0.3, 0, 0]\n"
            "\n"
            "[springs.strut]\n"
            'first = "mount"\n'
            'second = "tip"\n'
            "\n"
            "[controllers.sky]\n"
            'type = "skyhook"\n'
            'spring = "strut"\n'
            "damping = 100\n"
            "clipped = true"
        ),
    ),
    Failure(
        "A clipped skyhook whose limits cross",
        3,
        "description error: scene.toml:46 (controllers.sky.minimum_damping): the range is empty: "
        "minimum_damping 300 is not below maximum_damping 200; try: a smaller minimum_damping [E1790]",
        more=(
            "[points.mount]\n"
            'body = "base"\n'
            "position = [0.3, 0, 0]\n"
            "\n"
            "[springs.strut]\n"
            'first = "mount"\n'
            'second = "tip"\n'
            "\n"
            "[controllers.sky]\n"
            'type = "skyhook"\n'
            'spring = "strut"\n'
            "damping = 100\n"
            "clipped = true\n"
            "minimum_damping = 300\n"
            "maximum_damping = 200"
        ),
    ),
    Failure(
        "Poles that do not decay",
        3,
        "description error: 2 problems\n"
        "  1. scene.toml:39 (controllers.hold.calibration.poles[0]): the pole [1, 0] does not decay: its real part is "
        "not below 0; try: [-1, 0] [E1439]\n"
        "  2. scene.toml:39 (controllers.hold.calibration.poles[1]): the pole [0, 0] does not decay: its real part is "
        "not below 0; try: [-1, 0] [E1439]",
        more=(
            "[controllers.hold]\n"
            'type = "state_feedback"\n'
            'coordinates = ["shoulder"]\n'
            "\n"
            "[controllers.hold.calibration]\n"
            'method = "pole_placement"\n'
            "poles = [[1, 0], [0, 0]]"
        ),
    ),
]
