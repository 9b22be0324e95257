"""Paragraphs of a function stand in an order in which few values wait."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from itertools import groupby

import pytest

from eomgen.codegen.scheduling.paragraphs import REGISTERS, reorder


def most_waiting(order: Sequence[int], labels: Mapping[int, str], reads: Mapping[int, set[int]]) -> int:
    """Return the largest number of values that are computed by the end of a paragraph and read by a later one."""
    ends = [k for k in range(1, len(order)) if labels[order[k]] != labels[order[k - 1]]]
    return max(sum(any(node in reads[later] for later in order[k:]) for node in order[:k]) for k in ends)


def paragraphs(order: Sequence[int], labels: Mapping[int, str]) -> list[list[int]]:
    return [list(nodes) for _, nodes in groupby(order, labels.__getitem__)]


def tree(branches: int, bodies: int, values: int) -> tuple[list[int], dict[int, str], dict[int, set[int]]]:
    """Return the operations of a recursion over chains from one root, as mechanics records the recursion: motions of
    all bodies outwards, then forces of all bodies inwards."""
    labels, reads = {}, {}
    motion: dict[tuple[int, int], list[int]] = {}
    for branch in range(branches):
        for body in range(bodies):
            made = motion[branch, body] = []
            for _ in range(values):
                node = len(labels) + 1
                labels[node] = f"motion {branch} {body}"
                reads[node] = set(motion[branch, body - 1]) if body else set()
                made.append(node)
    inwards = dict.fromkeys(range(branches), 0)
    for branch in reversed(range(branches)):
        for body in reversed(range(bodies)):
            node = len(labels) + 1
            labels[node] = f"force {branch} {body}"
            reads[node] = {*motion[branch, body], inwards[branch]} - {0}
            inwards[branch] = node
    return list(labels), labels, reads


def test_a_branch_is_carried_out_and_back_before_the_next_begins() -> None:
    order, labels, reads = tree(branches=6, bodies=4, values=3)
    found = reorder(paragraphs(order, labels), reads)
    names = [labels[nodes[0]].split() for nodes in paragraphs(found, labels)]
    assert [branch for branch, _ in groupby(branch for _, branch, _ in names)] == list("012345")
    assert [body for kind, branch, body in names if (kind, branch) == ("force", "2")] == list("3210")
    assert most_waiting(order, labels, reads) == 6 * 4 * 3
    assert most_waiting(found, labels, reads) == 4 * 3


def test_functions_whose_values_fit_into_registers_keep_their_order() -> None:
    order, labels, reads = tree(branches=2, bodies=4, values=REGISTERS // 8)
    assert most_waiting(order, labels, reads) == REGISTERS
    assert reorder(paragraphs(order, labels), reads) == order


@pytest.mark.slow_cases("0", "1", "4", "6", "7", "8", "9", "10", "11", "5", "3")
@pytest.mark.parametrize("seed", range(12))
def test_operations_follow_what_they_read_and_paragraphs_stay_whole(seed: int) -> None:
    source = random.Random(seed)
    order = list(range(1, 401))
    labels = {node: f"paragraph {node // source.choice((9, 10, 11))}" for node in order}
    reads = {node: {source.randrange(max(1, node - 150), node) for _ in range(2)} for node in order if node > 1}
    reads[1] = set()
    given = paragraphs(order, labels)
    found = reorder(given, {node: [*operands, *operands, -node] for node, operands in reads.items()})
    place = {node: k for k, node in enumerate(found)}
    assert sorted(found) == order
    assert all(place[operand] < place[node] for node in order for operand in reads[node])
    assert all([place[node] - place[nodes[0]] for node in nodes] == list(range(len(nodes))) for nodes in given)
    assert most_waiting(found, labels, reads) <= most_waiting(order, labels, reads)
