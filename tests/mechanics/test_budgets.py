"""Exact numbers of operations, committed as budgets, and published numbers of the same robots.

A count that rises is a regression; one that falls is written here with its new value. Counts are additions and
multiplications; sines, cosines and divisions come on top.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import pytest

from benchmarks import chains
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.symbolic.latency import critical_path
from eomgen.system.system import System
from tests.anchors import anchor
from tests.oracles import robots
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.pinocchio_oracle import robot_file

TERMS = ["mass", "coupling", "force", "inverse_dynamics", "forward_dynamics", "partials"]


def panda_of_file() -> Scene:
    fingers = ("panda_finger_joint1", "panda_finger_joint2")
    return load(robot_file("panda_description/urdf/panda.urdf"), lock=fingers)


SCENES: dict[str, Callable[[], Scene]] = {
    "panda": robots.panda,
    "panda.urdf": panda_of_file,
    "puma": robots.puma,
    "rx90": robots.rx90,
    "general 6R": partial(robots.general_arm, 6),
    "general 7R": partial(robots.general_arm, 7),
}
#: robot, term, exact count, the published or demanded count that it must not exceed
COUNTS = [
    ("panda", "inverse_dynamics", 602, 610),
    ("panda", "mass", 351, 415),
    ("panda", "coupling", 567, 583),
    ("panda", "force", 82, 82),
    ("panda", "forward_dynamics", 1145, 1229),
    ("panda", "partials", 3067, 7450),  # 7450: forward differentiation of the same operations
    ("panda.urdf", "inverse_dynamics", 616, 1093),  # joint damping of the file included
    ("panda.urdf", "mass", 351, 813),
    ("panda.urdf", "forward_dynamics", 1159, 2082),
    ("puma", "inverse_dynamics", 347, 347),
    ("puma", "mass", 190, 227),
    ("rx90", "inverse_dynamics", 473, 476),
    ("rx90", "mass", 222, 258),
    ("rx90", "coupling", 437, 448),
    ("rx90", "forward_dynamics", 813, 863),
    ("general 6R", "inverse_dynamics", 764, 794),  # 92 n - 127 and 81 n - 117, Khalil and Kleinfinger 1987
    ("general 7R", "inverse_dynamics", 924, 967),
    ("panda", "rates_1", 1321, 1500),
    # 2872 by repeated differentiation, 2779 by Taylor coefficients of the operations of tau
    ("panda", "rates", 2284, 2779),
    ("panda", "rates_3", 3671, 4304),  # 4304: Taylor coefficients of the operations of tau
    ("panda", "forward_rates", 3838, 5856),  # 5856: Taylor coefficients of the operations of vdot along its flow
    ("panda", "mass_rates", 1815, 2276),
    ("panda", "coriolis", 3834, 3834),
    ("panda", "coriolis_rates", 14764, 14764),
    ("puma", "rates", 1403, 1712),
    ("rx90", "rates", 1815, 2189),
    # 18109: instructions of CasADi's Hessian of its own recursion (benchmarks/optimisers.py); 8328 and 13827 by
    # differentiation of each operation
    ("panda", "inverse_dynamics_hessian", 5060, 18109 // 2),
    ("panda", "forward_dynamics_hessian", 8066, 13827),
]


@cache
def system_of(name: str) -> System:
    return derive(SCENES[name](), TERMS)


@pytest.mark.parametrize(("name", "term", "count", "limit"), COUNTS)
def test_number_of_operations(name: str, term: str, count: int, limit: int) -> None:
    assert count <= limit
    system = system_of(name) if term in TERMS else derive(SCENES[name](), [term])
    assert system.counts[term].flops == count


def test_mass_and_coupling_share_what_they_have_in_common() -> None:
    for name, count, limit in (("panda", 918, 998), ("rx90", 659, 706)):
        system = system_of(name)
        together = system.tape.counts(system.functions["mass"].refs + system.functions["coupling"].refs).flops
        assert together == count <= limit, name


def test_published_trajectory_of_the_panda() -> None:
    """Thirteen printed digits, computed before this project by three other routes; more times in ``test_rates.py``."""
    evaluate = tape_evaluator(system_of("panda"))
    state = robots.panda_state(1.0)
    anchor("panda_inverse_dynamics").check(evaluate("inverse_dynamics", state)["tau"])
    anchor("panda_mass").check(np.diag(evaluate("mass", state)["M"]))


def test_published_state_of_the_puma() -> None:
    state = {
        "q": np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]),
        "v": np.array([1.0, -1.0, 0.5, 0.3, -0.2, 0.1]),
        "a": np.array([0.5, 0.4, 0.3, 0.2, 0.1, 0.0]),
    }
    anchor("puma_inverse_dynamics").check(tape_evaluator(system_of("puma"))("inverse_dynamics", state)["tau"])


CHAINS = {"planar": robots.planar_chain, "spatial": robots.spatial_chain}
#: statements of a chain of n >= 3 equal links: constant, linear and quadratic part
GROWTH = {
    ("planar", "coupling"): (-40, 24, 0.0),
    ("planar", "force"): (-20, 18, 0.0),
    ("planar", "inverse_dynamics"): (-31, 31, 0.0),
    ("planar", "mass"): (-25, 9, 4.0),
    ("spatial", "coupling"): (-179, 121, 0.0),
    ("spatial", "force"): (-20, 19, 0.0),
    ("spatial", "inverse_dynamics"): (-145, 122, 0.0),
    ("spatial", "mass"): (-24, 3.5, 9.5),
}


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 12, 16, 17, 32, 64])
def test_code_grows_with_the_tree_and_no_faster(chain: str, count: int) -> None:
    """Vectors are linear and M is quadratic in the number of links, exactly, statement by statement."""
    system = derive(CHAINS[chain](count), TERMS[:4])
    for term in TERMS[:4]:
        constant, linear, quadratic = GROWTH[chain, term]
        assert system.counts[term].statements == constant + linear * count + quadratic * count**2, term


@pytest.mark.parametrize(("chain", "constant", "per_link"), [("planar", -114, 119), ("spatial", -499, 444)])
def test_time_derivatives_of_chains_are_linear(chain: str, constant: int, per_link: int) -> None:
    for count in (5, 6, 12, 31, 32, 64):
        assert derive(CHAINS[chain](count), ["rates"]).counts["rates"].statements == constant + per_link * count, count


@pytest.mark.parametrize(("chain", "per_link"), [("planar", 71), ("spatial", 330)])
def test_forward_dynamics_of_long_chains_is_linear(chain: str, per_link: int) -> None:
    term = "forward_dynamics"
    statements = [derive(CHAINS[chain](count), [term]).counts[term].statements for count in (16, 17, 40)]
    assert statements[1] - statements[0] == per_link, statements
    assert statements[2] - statements[1] == 23 * per_link, statements


@pytest.mark.parametrize(("links", "cycles", "operations"), [(2, 98, 34), (4, 154, 169), (6, 206, 416), (10, 634, 580)])
def test_forward_dynamics_of_short_planar_chains_have_short_critical_paths(
    links: int, cycles: int, operations: int
) -> None:
    """Chains of 4 to 7 rods factor M, whose path is shorter; longer ones pass on articulated bodies, in fewer
    operations. Late terms of sums are added last.
    """
    system = derive(CHAINS["planar"](links), ["forward_dynamics"])
    outputs = system.functions["forward_dynamics"].refs
    assert critical_path(system.tape, outputs) == cycles
    assert system.counts["forward_dynamics"].flops == operations


def test_a_joint_without_rotor_transmits_no_inertia_about_its_own_axis() -> None:
    """Three freed axes of a ball leave nothing of the articulated inertia but its mass at the joint's point."""
    counts = derive(chains.scene("joint", "ball", 10), ["forward_dynamics"]).counts["forward_dynamics"]
    assert (counts.flops, counts.divisions) == (2902, 18)
