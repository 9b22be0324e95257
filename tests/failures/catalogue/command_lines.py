"""Failure catalogue: command lines."""

from __future__ import annotations

from pathlib import Path

from tests.failures.failure import Failure


def thesis(folder: Path) -> None:
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.txt").write_text("mine", encoding="utf-8")


FAILURES = [
    Failure("A verb that there is not", 2, command="simulat scene.toml"),
    Failure("A missing option", 2, command="simulate scene.toml"),
    Failure("An option that there is not", 2, command="info scene.toml --fast"),
    Failure("A word for a number", 2, command="simulate scene.toml --out out --step fast"),
    Failure("A negative step", 2, command="simulate scene.toml --out out --step -1"),
    Failure("An end before the start", 2, command="simulate scene.toml --out out --t-end -1"),
    Failure("A run of too many steps", 2, command="simulate scene.toml --out out --t-end 1e300 --step 1e-9"),
    Failure(
        "A run that fills the memory",
        2,
        "usage error: record_every: 1000000000002 rows of 4 numbers would take about 9.6e+04 GB, this machine has"
        " {any}; try: record_every = {any} or more [E2076]",
        command="simulate scene.toml --out out --t-end 1e9 --step 1e-3",
    ),
    Failure("A damping out of its range", 2, command="simulate scene.toml --out out --rho-inf 1.5"),
    Failure("A parameter without a value", 2, command="simulate scene.toml --out out --set load"),
    Failure("A parameter that is not a number", 2, command="simulate scene.toml --out out --set load=heavy"),
    Failure("A parameter that is not finite", 2, command="simulate scene.toml --out out --set load=nan"),
    Failure("A term that there is not", 2, command="info scene.toml --terms mass,forces"),
    Failure(
        "A method that cannot bear constraints",
        4,
        command="simulate scene.toml --out out --method rk4 --coordinates absolute",
    ),
    Failure("A tolerance that is none", 2, command="simulate scene.toml --out out --method taylor --tolerance -1e-6"),
    Failure(
        "A tolerance that no number can show",
        2,
        command="simulate scene.toml --out out --method taylor --tolerance 1e-30",
    ),
    Failure(
        "Fixed Taylor steps without an order", 2, command="simulate scene.toml --out out --method taylor --tolerance 0"
    ),
    Failure("An order that is too high", 2, command="simulate scene.toml --out out --method taylor --order 50"),
    Failure("A folder without a name", 2, command="generate scene.toml --out ''"),
    Failure(
        "A folder that holds other things",
        7,
        command="generate scene.toml --out mine",
        prepare=thesis,
        preparation="mine/ holds thesis.txt",
    ),
    Failure("A file in the place of the folder", 7, command="simulate scene.toml --out scene.toml"),
    Failure("A check at no state", 2, command="check scene.toml --states 0"),
    Failure("A closed form that there is not", 2, command="check scene.toml --only partial.K"),
    Failure(
        "A check where no formula has a value",
        6,
        "left out: initial state, where the equations of motion are not finite\n"
        "around the motion 1 of 1 states were not found: no finite or consistent ones\n"
        "1 of 1 closed form not shown to agree\n"
        "partials.K was not checked: no state where it is finite",
        old='effort = "motor"',
        new='effort = "log(q.shoulder - 100)"',
        command="check scene.toml --only partials.K --states 2",
    ),
    Failure("An animation of a kind that there is not", 2, command="animate scene.toml --out arm.gif"),
    Failure(
        "A solution that is none", 7, command="animate solution.npz --out arm.html", files={"solution.npz": "PK no zip"}
    ),
    Failure(
        "Options of a run for a stored one",
        2,
        command="animate solution.npz --out arm.html --t-end 2",
        files={"solution.npz": "PK no zip"},
    ),
]
