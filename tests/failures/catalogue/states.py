"""Failure catalogue: internal states and controllers."""

from __future__ import annotations

from tests.failures.failure import Failure

#: A controller whose function is the caller's, or in a C file, and such a file.
_SERVO = '[controllers.servo]\ntype = "sampled"\nsample = "5 ms"\nsignals = { angle = "q.shoulder" }'
_C = """\
int servo(double t, const double *signals, double *values, double *memory)
{
    values[0] = signals[0];
    return 0;
}
"""

FAILURES = [
    Failure("A state without its rate", 3, more="[states]\nlag = { initial = 1.0 }"),
    Failure(
        "A state in a mass",
        3,
        "description error: scene.toml:12 (bodies.upper.mass): the state 'lag' cannot be used here (column 5); try: "
        "parameters only [E1556]",
        old='mass = "1 + load"',
        new='mass = "1 + lag"',
        more='[states]\nlag = { rate = "-lag" }',
    ),
    Failure(
        "A state called like a parameter",
        3,
        "description error: scene.toml:34 (states.load): the name load is both a parameter and a state; try: another "
        "name for one of them [E1461]",
        more='[states]\nload = { rate = "-load" }',
    ),
    Failure(
        "A rate with a name that there is not",
        3,
        "description error: scene.toml:34 (states.lag.rate): unknown name 'motr' (column 1); try: motor [E1553]",
        more='[states]\nlag = { rate = "motr - lag" }',
    ),
    Failure(
        "A controller of a kind that there is not",
        3,
        "description error: scene.toml:34 (controllers.servo.type): 'pdi' is not known here; try: one of pi, pid, "
        "low_pass, lead_lag, state_feedback, skyhook or sampled [E0263]",
        more='[controllers.servo]\ntype = "pdi"\nsignal = "q.shoulder"\nproportional = 2',
    ),
    Failure(
        "A controller without a signal",
        3,
        "description error: scene.toml:33 (controllers.servo): the type pi needs the key signal; try: signal ="
        ' "1-q.hinge" [E1418]',
        more='[controllers.servo]\ntype = "pi"\nproportional = 2',
    ),
    Failure(
        "A filter without its time",
        3,
        "description error: scene.toml:33 (controllers.servo): the type low_pass needs the key time_constant; try: "
        "time_constant = 0.01 [E1418]",
        more='[controllers.servo]\ntype = "low_pass"\nsignal = "q.shoulder"',
    ),
    Failure(
        "A limit below the other",
        3,
        more=(
            "[controllers.servo]\n"
            'type = "pi"\n'
            'signal = "q.shoulder"\n'
            "proportional = 2\n"
            "integral = 1\n"
            "minimum = 1\n"
            "maximum = -1"
        ),
    ),
    Failure(
        "A gain that another kind of controller has",
        3,
        more='[controllers.servo]\ntype = "pi"\nsignal = "q.shoulder"\ngain = 2',
    ),
    Failure(
        "Controllers that need each other at once",
        3,
        more=(
            "[controllers.first]\n"
            'type = "pi"\n'
            'signal = "second"\n'
            "proportional = 1\n"
            "\n"
            "[controllers.second]\n"
            'type = "pi"\n'
            'signal = "first"\n'
            "proportional = 1"
        ),
    ),
    Failure(
        "A controller of an acceleration",
        3,
        "description error: scene.toml:35 (controllers.servo.signal): a.shoulder cannot be used here (column 1); try: "
        "time, parameters, inputs, states, positions, velocities and tensions (not accelerations) only [E1556]",
        more='[controllers.servo]\ntype = "pi"\nsignal = "a.shoulder"\nproportional = 2',
    ),
    Failure(
        "A sampled controller without its function",
        2,
        command="simulate scene.toml --method rk4 --out run",
        more=f"{_SERVO}\n",
    ),
    Failure(
        "A sampled controller without its clock",
        3,
        "description error: scene.toml:33 (controllers.servo): the type sampled needs the key sample; try: sample ="
        " 0.01 [E1418]",
        more='[controllers.servo]\ntype = "sampled"\nsignals = { angle = "q.shoulder" }',
    ),
    Failure("A C file that is not there", 3, more=f'{_SERVO}\nsource = "servo.c"\nfunction = "servo"'),
    Failure(
        "A C file without the function",
        3,
        "description error: scene.toml:37 (controllers.servo.source): servo.c has no function servo; try: int"
        " servo(double t, const double *signals, double *values, double *memory) in it [E0904]",
        more=f'{_SERVO}\nsource = "servo.c"\nfunction = "servo"',
        files={"servo.c": "int law(double t, const double *signals, double *values, double *memory);\n"},
    ),
    Failure(
        "A C file with a header of its own",
        3,
        'description error: scene.toml:37 (controllers.servo.source): servo.c:2 includes "gains.h", a file of its own,'
        " which would not come along; try: its text in the C file; headers in angle brackets are there [E1426]",
        more=f'{_SERVO}\nsource = "servo.c"\nfunction = "servo"',
        files={"servo.c": f'#include <math.h>\n#include "gains.h"\n{_C}'},
    ),
    Failure(
        "A C file that does not compile",
        5,
        "note: the controller servo changes nothing: no formula mentions what it gives [W0103]\n"
        "toolchain error: servo.c:3: the C compiler finds 'error' undeclared (first use in this function){any}; try:"
        " C99, and int NAME(double t, const double *signals, double *values, double *memory) [E2108]",
        command="simulate scene.toml --method rk4 --out run",
        more=f'{_SERVO}\nsource = "servo.c"\nfunction = "servo"',
        files={"servo.c": _C.replace("signals[0]", "error")},
    ),
]
