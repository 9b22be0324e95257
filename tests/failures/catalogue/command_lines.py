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
    Failure(
        "A step of 0",
        2,
        "usage error: step: the step must be positive, not 0; try: 1e-3 [E2072]",
        command="simulate scene.toml --out out --step 0",
    ),
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
    Failure(
        "A parameter that there is not",
        2,
        "usage error: there is no parameter 'laod'; try: load [E0100]",
        command="simulate scene.toml --out out --set laod=2",
    ),
    Failure(
        "A parameter that is fixed",
        2,
        "usage error: the parameter length exists, but its value is fixed in the code; try: length = { value = ..., "
        "tunable = true } in the scene's [parameters] [E0239]",
        command="simulate scene.toml --out out --set length=2",
    ),
    Failure(
        "A value that the scene would refuse as its own",
        2,
        "usage error: scene.toml:12 (bodies.upper.mass): the mass -0.5 is negative at load = -1.5; try: a positive"
        " number of kg [E1709]",
        command="simulate scene.toml --out out --set load=-1.5",
    ),
    Failure("A parameter without a value", 2, command="simulate scene.toml --out out --set load"),
    Failure("A parameter that is not a number", 2, command="simulate scene.toml --out out --set load=heavy"),
    Failure("A parameter that is not finite", 2, command="simulate scene.toml --out out --set load=nan"),
    Failure(
        "An input that there is not",
        2,
        "usage error: there is no input 'moter'; try: motor [E0100]",
        command="simulate scene.toml --out out --input moter=1",
    ),
    Failure("A term that there is not", 2, command="info scene.toml --terms mass,forces"),
    Failure(
        "A method that cannot bear constraints",
        4,
        command="simulate scene.toml --out out --method rk4 --coordinates absolute",
    ),
    Failure(
        "A Taylor series of constrained motion",
        4,
        "model error: taylor cannot run on this scene: it needs a system without constraints: it expands ordinary "
        "differential equations and would ignore the constraint equations; try: generalized_alpha, which keeps "
        "constraints, rk4_partitioned, which eliminates them, or a tree of joints [E0860]",
        command="simulate scene.toml --out out --method taylor --coordinates absolute",
    ),
    Failure(
        "A Taylor series of a force with corners",
        4,
        "model error: taylor cannot run on this scene: a Taylor series needs smooth equations, or discontinuities at"
        " known times; here are abs(), decided by the motion; try: generalized_alpha [E0860]",
        command="simulate scene.toml --out out --method taylor",
        old='effort = "motor"',
        new='effort = "motor - abs(v.shoulder) * v.shoulder"',
    ),
    Failure("A tolerance that is none", 2, command="simulate scene.toml --out out --method taylor --tolerance -1e-6"),
    Failure(
        "A tolerance that no number can show",
        2,
        command="simulate scene.toml --out out --method taylor --tolerance 1e-30",
    ),
    Failure(
        "Taylor steps too short to reach the next row",
        6,
        "stopped at t = 0 s, after 0 of 10 steps: 100000 series were not enough for one row: the motion is stiff, or"
        " the tolerance cannot be met at this order; try: generalized_alpha, a larger tolerance, or shorter"
        " rows\nwritten to out: solution.npz, solution.csv, summary.json",
        command=(
            "simulate scene.toml --out out --method taylor --tolerance 1e-16 --order 2 --step 0.1 --t-end 1 --no-plots"
        ),
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
    Failure(
        "A check with a negative seed",
        2,
        "usage error: seed: a whole number from 0 on is needed, not -1; try: 0 [E0246]",
        command="check scene.toml --seed -1",
    ),
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
    Failure(
        "A check whose folder is a file",
        7,
        "input/output error: scene.toml: this is a file, and a folder is needed; try: another folder [E0130]",
        command="check scene.toml --only partials.K --states 1 --out scene.toml",
    ),
    Failure("An animation of a kind that there is not", 2, command="animate scene.toml --out arm.gif"),
    Failure(
        "A solution that is not there",
        7,
        "input/output error: solution.npz: cannot be read: No such file or directory; try: another path [E0115]",
        command="animate solution.npz --out arm.html",
    ),
    Failure(
        "A solution that is none", 7, command="animate solution.npz --out arm.html", files={"solution.npz": "PK no zip"}
    ),
    Failure(
        "Options of a run for a stored one",
        2,
        command="animate solution.npz --out arm.html --t-end 2",
        files={"solution.npz": "PK no zip"},
    ),
    Failure(
        "A checkpoint that is none",
        7,
        "input/output error: run.ckpt: this is not a checkpoint written by eomgen: it is not an .npz archive, or not"
        " all of one; try: a file that simulate(checkpoint=...) wrote [E0134]",
        command="simulate scene.toml --out out --resume run.ckpt",
        files={"run.ckpt": "no checkpoint"},
    ),
]
