"""Occurrences of shared stretches that are computed together: every order of any graph, the bits of calls one by one,
and the calls of the cars of the examples."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.codegen import convert
from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling.joining import LANES, join
from eomgen.codegen.scheduling.sharing import Occurrence, SharedBody
from eomgen.codegen.targets.c.target import generate_files
from eomgen.symbolic.tape import Tape
from tests.codegen.hand_made import call, compile_files

EXAMPLES = Path(__file__).parents[2] / "examples"


def occurrence(body: SharedBody, operations: int = 100, reads: int = 3) -> Occurrence:
    return Occurrence(body, tuple(range(operations)), tuple(range(reads)), (1,), (), (), ())


def body() -> SharedBody:
    return SharedBody(Tape(), (), ())


@pytest.mark.parametrize("seed", range(40))
def test_joined_graphs_keep_an_order(seed: int) -> None:
    """In random graphs every entry comes once, after all that it reads, and no joined entry needs another one."""
    source = random.Random(seed)
    size, bodies = source.randint(20, 150), [body() for _ in range(source.randint(1, 4))]
    width = source.choice((3, 20, size))
    reads = {
        k: [source.randrange(max(0, k - width), k) for _ in range(source.randint(0, 2))] if k else []
        for k in range(size)
    }
    chosen = sorted(source.sample(range(size), size // 2))
    stretches = {k: occurrence(source.choice(bodies)) for k in chosen}
    order, groups = join(range(size), reads, stretches)
    by_occurrence = {id(stretch): k for k, stretch in stretches.items()}
    members = {first: [by_occurrence[id(stretch)] for stretch in group] for first, group in groups.items()}
    assert sorted(k for first in order for k in members.get(first, [first])) == list(range(size))
    done: set[int] = set()
    for first in order:
        together = members.get(first, [first])
        assert len(together) in (1, LANES)
        assert together[0] == first
        assert all(done.issuperset(reads[k]) for k in together)
        assert len({id(stretches[k].body) for k in together if k in stretches}) <= 1
        done |= set(together)
    if not any(len(group) > 1 for group in groups.values()):
        assert order == list(range(size))


def test_independent_occurrences_are_joined() -> None:
    """Nine independent occurrences are two groups and one alone; in a chain all are alone."""
    alike = body()
    stretches = {k: occurrence(alike) for k in range(9)}
    apart = {k: list[int]() for k in range(9)}
    assert [len(group) for group in join(range(9), apart, stretches)[1].values()] == [4, 4, 1]
    chain = {k: [k - 1] if k else [] for k in range(9)}
    assert [len(group) for group in join(range(9), chain, stretches)[1].values()] == [1] * 9


def test_groups_do_not_need_one_another() -> None:
    """Two kinds that need each other across corners: both cannot be joined."""
    one, other = body(), body()
    stretches = {k: occurrence(one if k % 2 == 0 else other) for k in range(8)}
    reads: dict[int, list[int]] = {k: [] for k in range(8)}
    reads[1], reads[6] = [0], [3]  # the other kind needs the first kind, and the last one of it needs the other kind
    order, groups = join(range(8), reads, stretches)
    assert sorted(len(group) for group in groups.values()) == [1, 1, 1, 1, 4]
    assert order.index(0) < order.index(1)


def test_occurrences_with_little_to_compute_stay_alone() -> None:
    alike = body()
    for reads, wanted in ((100, 1), (10, 4)):  # 50 operations, and 10 for the call, against operands of four lanes
        stretches = {k: occurrence(alike, 50, reads) for k in range(4)}
        groups = join(range(4), {k: [] for k in range(4)}, stretches)[1]
        assert {len(group) for group in groups.values()} == {wanted}


@pytest.mark.slow
@pytest.mark.long_cases("full_car")
@pytest.mark.parametrize(("car", "wanted"), [("car", (2, 6, 12)), ("full_car", (3, 47, 20))], ids=["car", "full_car"])
def test_cars_have_the_bits_of_calls_one_by_one(
    car: str, wanted: tuple[int, int, int], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tyres of a car are computed together, with the bits of the same text without vectors. Exact numbers of calls for
    four in the equations, of all calls there, and of calls for four in the partial derivatives."""
    monkeypatch.setattr(convert, "LONG", 10_000)  # models of cars have more functions
    program = to_program(eomgen.derive(EXAMPLES / f"driving_car/system/{car}.toml", ["equations", "iteration"]))
    calls = {
        function.name: [
            len(item.data[1]) // program.shared[item.data[0]].places
            for part in function.parts
            for item in part.statements
            if item.kind == "share"
        ]
        for function in program.functions
    }
    found = calls["equations"].count(LANES), len(calls["equations"]), calls["iteration"].count(LANES)
    assert found == wanted
    files = generate_files(program)
    alone = {name: text.replace("#if defined(__GNUC__) && (", "#if 0 && (") for name, text in files.items()}
    assert alone != files
    source = np.random.default_rng(1)
    libraries = [compile_files(program, made, cache) for made in (files, alone)]
    for name in calls:
        blocks = program.function(name).inputs
        inputs = {block: source.uniform(0.5, 1.0, program.input_size(block)) for block in blocks}
        pairs = zip(*(call(library, name, inputs) for library in libraries), strict=True)
        assert all(np.array_equal(own, other) and np.isfinite(own).all() for own, other in pairs)
