"""Failure catalogue: environments."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A compiler that is not there",
        5,
        command="simulate scene.toml --out out --t-end 0.01 --no-plots",
        environment={"CC": "no-such-cc"},
    ),
    Failure(
        "A compiler's command that cannot be read",
        5,
        command="simulate scene.toml --out out --t-end 0.01 --no-plots",
        environment={"CC": "gcc 'x"},
    ),
    Failure(
        "No compiler at all",
        5,
        "toolchain error: no C compiler found: looked for cc, gcc, clang on the path, in CC, and for the package"
        " ziglang, and the cache {folder} has no library of this model with these terms, this method and profile fast"
        ' for this machine; try: pip install "eomgen[compiler]" [E2101]',
        command="simulate scene.toml --out out --t-end 0.01 --no-plots --profile fast",
        environment={"CC": None, "PATH": "{folder}", "EOMGEN_CACHE": "{folder}"},
    ),
    Failure(
        "A cache of a user that there is not",
        7,
        command="simulate scene.toml --out out --t-end 0.01 --no-plots",
        environment={"EOMGEN_CACHE": "~no_such_user/cache"},
    ),
    Failure(
        "A force that breaks at once",
        6,
        "note: the input motor changes nothing: no formula mentions it [W0101]\n"
        "note: efforts.motor.effort: the formula subtracts t in s from load - 1 in kg; try: a factor that turns one"
        " unit into the other [W0137]\n"
        "stopped at t = 0 s, after 0 of 1000 steps: a value became infinite or not a number; the first block that is"
        " not finite is Q (the generalized force), component v.shoulder at t = 0 s, where in a formula log(0) has"
        " no value at load = 1, t = 0; try: another start, or a formula that has a value there, such as max(x, 1e-3) in"
        " place of x\nwritten to out: solution.npz, solution.csv, summary.json",
        command="simulate scene.toml --out out --t-end 1 --no-plots",
        old='effort = "motor"',
        new='effort = "log(load - 1 - t)"',
    ),
    Failure("A folder that cannot be made", 7, command="simulate scene.toml --out /proc/nowhere/out"),
    Failure(
        "A cache that cannot be written",
        0,
        "warning: the cache /proc/nowhere cannot be written (No such file or directory); building in {any} instead. Set"
        " EOMGEN_CACHE to a folder that can be written to keep compiled models [W0208]\nreached t = 0 s in 0"
        " steps\nwritten to"
        " out: solution.npz, solution.csv, summary.json",
        command="simulate scene.toml --out out --t-end 0 --no-plots --method rk4",
        environment={"EOMGEN_CACHE": "/proc/nowhere"},
    ),
]
