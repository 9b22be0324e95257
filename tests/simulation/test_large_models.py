"""Large models: what is recorded and written for them, and that they run. How long that takes is measured in
``benchmarks``."""

from __future__ import annotations

import pytest

import eomgen
from benchmarks import chains
from eomgen.codegen.convert import to_program

pytestmark = pytest.mark.slow

#: Statements of all functions, loops counted once.
CHAIN_OF_200 = 2_300
TREE_OF_100 = 147_000


def statements(system: eomgen.System) -> int:
    return sum(function.operations for function in to_program(system).functions)


def test_a_chain_of_200_links_is_a_few_thousand_statements() -> None:
    assert statements(eomgen.derive(chains.scene("joint", "hinge", 200))) <= CHAIN_OF_200


def test_a_tree_of_100_degrees_of_freedom_is_stepped_sparsely() -> None:
    system = eomgen.derive(chains.scene("joint", "tree", 100))
    assert system.nv == 100
    assert not {"mass", "partials"} & set(system.functions)
    assert statements(system) <= TREE_OF_100
