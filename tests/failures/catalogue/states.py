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
        "A sampled controller without its function",
        2,
        command="simulate scene.toml --method rk4 --out run",
        more=f"{_SERVO}\n",
    ),
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
