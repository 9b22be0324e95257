"""Which tests can notice a change of a block of statements: measured for files that ran under probes, else by nearness.

A measurement is one run of a tier under probes. It is kept in the user's cache folder and names blocks by their
functions, so it holds for a test file as long as the file stays as it is, whatever moves in the package.
"""

from __future__ import annotations

import ast
import base64
import hashlib
import json
import mmap
import re
import shutil
import zlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import platformdirs

from tests.mutants.operators import Mutant, line_starts
from tests.mutants.probe.sitecustomize import blocks, install

ROOT = Path(__file__).parents[2]
TIERS = {"first": "not slow", "second": "slow and not long"}
MEASURED = Path(platformdirs.user_cache_dir("eomgen-mutants"))
#: What each test costs beside its own time, in s: so the quickest of many do not hide the nearest.
OVERHEAD = 0.05


class Candidate(NamedTuple):
    """A test that can notice a mutant; ``seconds`` is its processor time."""

    test: str
    seconds: float


@dataclass
class Run:
    """One measurement: blocks by number, and for each test a row of bits with the blocks that it ran.

    A row with the name ``file::`` has the blocks of fixtures that tests of the file share.
    """

    folder: Path
    columns: dict[str, int]
    tests: list[str] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    rows: list[np.ndarray] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    read_to: int = 0

    @classmethod
    def of(cls, folder: Path) -> Run:
        """Return the measurement in a folder."""
        names = json.loads((folder / "names.json").read_text(encoding="utf-8"))
        run = cls(folder, {name: number for number, name in enumerate(names)})
        run.go_on()
        return run

    def go_on(self) -> None:
        """Read the lines that were added since."""
        with (self.folder / "tests.jsonl").open(encoding="utf-8") as file:
            file.seek(self.read_to)
            while line := file.readline():
                entry = json.loads(line)
                if "digest" in entry:
                    self.digests[entry["test"]] = entry["digest"]
                    continue
                marks = zlib.decompress(base64.b64decode(entry["blocks"]))
                self.tests.append(entry["test"])
                self.seconds.append(entry["seconds"])
                self.rows.append(np.packbits(np.frombuffer(marks, dtype=np.uint8)))
            self.read_to = file.tell()

    def has_one_of(self, wanted: Sequence[str]) -> bool:
        """Tell whether the package had one of some blocks when the measurement was made; True for no block."""
        return not wanted or any(name in self.columns for name in wanted)

    def running(self, wanted: Iterable[str]) -> list[int]:
        """Return the rows of tests that ran one of some blocks."""
        columns = [self.columns[name] for name in wanted if name in self.columns]
        return [number for number, row in enumerate(self.rows) if np.unpackbits(row)[columns].any()]


class Recording:
    """The measurements of a tier, of which the last counts for a test file, and the one that is being made."""

    marks: mmap.mmap

    def __init__(self, tier: str) -> None:
        runs = MEASURED / tier
        self.runs = [Run.of(one.parent) for one in sorted(runs.glob("*/tests.jsonl"))]
        self.folder = runs / f"{len(self.runs):04d}"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        plan: dict[str, int] = {}
        names: list[str] = []
        for path in sorted((ROOT / "eomgen").rglob("*.py")):
            file = path.relative_to(ROOT).as_posix()
            plan[file] = len(names)
            names += [name for name, _ in block_names(path.read_bytes(), file)]
        for name, content in (("plan.json", plan), ("names.json", names)):
            (self.folder / name).write_text(json.dumps(content), encoding="utf-8")
        (self.folder / "marks").write_bytes(bytes(len(names)))
        (self.folder / "tests.jsonl").touch()
        self.runs.append(Run.of(self.folder))
        self.mutant = self.folder / "mutant.json"

    def start(self) -> None:
        """Mark the blocks that this process and its children run from now on."""
        self.marks = install(str(self.folder), str(ROOT / "eomgen"))

    def take(self) -> bytes:
        """Return the marks since the last call, and remove them."""
        ran = self.marks[:]
        self.marks[:] = bytes(len(ran))
        return ran

    def write(self, test: str, seconds: float) -> None:
        """Write the marks since the last call under the name of a test."""
        blocks = base64.b64encode(zlib.compress(self.take(), 1)).decode()
        with (self.folder / "tests.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({"test": test, "seconds": round(seconds, 4), "blocks": blocks}) + "\n")

    def close(self, file: str) -> None:
        """Say that a test file is measured."""
        with (self.folder / "tests.jsonl").open("a", encoding="utf-8") as opened:
            opened.write(json.dumps({"test": file, "digest": _digest(ROOT / file)}) + "\n")
        self.runs[-1].go_on()

    def put_mutant(self, mutant: Mutant) -> None:
        """Write the mutated file for child processes."""
        source = mutant.applied((ROOT / mutant.file).read_bytes()).decode()
        self.mutant.write_text(json.dumps({"file": mutant.file, "source": source}), encoding="utf-8")

    def is_marked(self, marks: bytes, mutant: Mutant) -> bool:
        """Tell whether the block of a mutant is among some marks."""
        columns = self.runs[-1].columns
        return any(marks[columns[name]] for name in blocks_of(mutant))

    def run_of(self, test: str) -> Run | None:
        """Return the measurement of a test file, None if it was not measured as it is now."""
        digest = _digest(ROOT / test)
        return next((run for run in reversed(self.runs) if run.digests.get(test) == digest), None)

    def tests_of(self, wanted: Sequence[str]) -> tuple[dict[str, float], dict[str, float]]:
        """Return the seconds of tests that ran one of some blocks, and of other tests in the same files.

        A test of the second group may use a value that a test of the first left in a cache.
        """
        direct: dict[str, float] = {}
        beside: dict[str, float] = {}
        for run in self.runs:
            near = {row for row in run.running(wanted) if self.run_of(file_of(run.tests[row])) is run}
            shared = {file_of(run.tests[row]) for row in near if run.tests[row].endswith("::")}
            touched = {file_of(run.tests[row]) for row in near}
            for row, test in enumerate(run.tests):
                if not test.endswith("::") and file_of(test) in touched:
                    group = direct if row in near or file_of(test) in shared else beside
                    group[test] = run.seconds[row]
        return direct, {test: time for test, time in beside.items() if test not in direct}


def test_files() -> list[str]:
    """Return all test files, relative to the top folder."""
    return sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py"))


def chosen(mutant: Mutant, recording: Recording) -> list[Candidate]:
    """Return the tests of measured files that can notice a mutant, the most promising first.

    They are the tests that run the mutant's block, then the others of the same files; of a mutant outside all
    functions, tests that run a block with its name.
    """
    direct, beside = recording.tests_of(blocks_of(mutant))
    ranks = {file: nearness(mutant, file, _text(file)) for file in {file_of(test) for test in direct}}

    def cost(one: Candidate) -> float:
        return (one.seconds + OVERHEAD) / (1.0 + ranks[file_of(one.test)])

    groups = ([Candidate(test, seconds) for test, seconds in tests.items()] for tests in (direct, beside))
    return [one for group in groups for one in sorted(group, key=cost)]


def unmeasured(mutant: Mutant, recording: Recording) -> list[str]:
    """Return the test files that are not measured, the nearest to a mutant first.

    A measurement made before a function was moved or named tells nothing of the mutants in this function.
    """
    wanted = blocks_of(mutant)
    runs = {file: recording.run_of(file) for file in test_files()}
    missing = [file for file, run in runs.items() if run is None or not run.has_one_of(wanted)]
    ranks = {file: nearness(mutant, file, _text(file)) for file in missing}
    return sorted(missing, key=lambda file: -ranks[file])


def block_names(source: bytes, file: str) -> list[tuple[str, int]]:
    """Return the name and the place in bytes of each block of a file; names have the function and a number."""
    text = ast.parse(source)
    starts = line_starts(source)
    counts: Counter[str] = Counter()
    result = []
    for function, statements, place in blocks(text):
        first = statements[place]
        counts[function] += 1
        result.append((f"{file}::{function}#{counts[function]}", starts[first.lineno - 1] + first.col_offset))
    return result


def blocks_of(mutant: Mutant) -> list[str]:
    """Return the block of a mutant; of one outside all functions, the blocks that use the name which it changes."""
    source = (ROOT / mutant.file).read_bytes()
    if mutant.function:
        prefix = f"{mutant.file}::{mutant.function}#"
        own = [(name, start) for name, start in block_names(source, mutant.file) if name.startswith(prefix)]
        before = [name for name, start in own if start <= mutant.start]
        return [before[-1] if before else own[0][0]] if own else []
    names = _defined_at(ast.parse(source), source[: mutant.start].count(b"\n") + 1)
    return [block for name in names for block in _blocks_using(name)]


def _defined_at(tree: ast.Module, line: int) -> list[str]:
    """Return the names that a statement outside functions defines: variables, else fields of a class and the class."""
    names: list[str] = []
    body: list[ast.stmt] = tree.body
    while statement := next((one for one in body if one.lineno <= line <= (one.end_lineno or 0)), None):
        body = []
        if isinstance(statement, ast.ClassDef):
            names, body = [statement.name], statement.body
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            own = [one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
            names = own + names
    return names


@cache
def _blocks_using(name: str) -> list[str]:
    """Return the blocks of the package that use a name, as a variable, an attribute or a keyword argument."""
    result = []
    for path in sorted((ROOT / "eomgen").rglob("*.py")):
        source = path.read_bytes()
        if not re.search(rf"\b{name}\b".encode(), source):
            continue
        places = block_names(source, path.relative_to(ROOT).as_posix())
        for number, (block, start) in enumerate(places):
            end = places[number + 1][1] if number + 1 < len(places) else len(source)
            if re.search(rf"\b{name}\b".encode(), source[start:end]):
                result.append(block)
    return result


def nearness(mutant: Mutant, test: str, text: str) -> int:
    """Return a rank from names alone: how likely a test file is about the place of a mutant."""
    module = mutant.file.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package, _, last = module.rpartition(".")
    rooms = module.split(".")[1:-1]
    room = rooms[rooms[:1] == ["products"]] if len(rooms) > (rooms[:1] == ["products"]) else ""
    rank = 0
    if module in text and module in imported(text):
        rank += 8
    words = {word for word in re.split(r"[/_.]", last) if len(word) > 3}
    rank += 2 * len(words & set(re.split(r"[/_.]", test)))
    function = mutant.function.rpartition(".")[2]
    if len(function) > 4 and re.search(rf"\b{function}\b", text):
        rank += 3
    if room and f"/{room}/" in test:
        rank += 1 + 2 * (package in text)
    return rank + (bool(room) and re.search(rf"\beomgen\.(products\.)?{room}\b", text) is not None)


@cache
def imported(text: str) -> set[str]:
    """Return the modules that a file imports by name."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
    return found


def file_of(test: str) -> str:
    """Return the file of a test."""
    return test.partition("::")[0]


@cache
def _text(test: str) -> str:
    return (ROOT / test).read_text(encoding="utf-8")


@cache
def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
