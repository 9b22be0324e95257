"""Chains in absolute coordinates: what one function of them gives is what another one gives, and Newton's iteration
contracts."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from benchmarks import chains
from eomgen.integrators.families.register import terms_of


@pytest.fixture(scope="module")
def chain() -> eomgen.Model:
    """Return twenty hinges as users build them; gcc 12.2 made a wrong row of their ``equations`` while it put
    neighbouring sums into 512 bits."""
    scene = chains.scene("absolute", "hinge", 20)
    return eomgen.build(scene, terms=terms_of("generalized_alpha", constrained=True), profile="fast")


@pytest.mark.long
def test_equations_and_residual_agree(chain: eomgen.Model) -> None:
    random = np.random.default_rng(20)
    blocks = {"q": chain.initial_q, **{name: random.normal(size=chain.nv) for name in "va"}}
    blocks["lam"] = random.normal(size=len(chain.multipliers))
    together, alone = (chain.functions(name, blocks)[0] for name in ("equations", "residual"))
    assert together == pytest.approx(alone, abs=1e-10)


@pytest.mark.long
def test_iterations_of_a_long_chain(chain: eomgen.Model) -> None:
    run = chain.simulate(0.2, 1e-3, rho_inf=0.8)
    assert run.stats["newton_iterations"] <= 4.0 * run.stats["steps"]
    assert run.stats["factorizations"] <= 0.3 * run.stats["steps"]
    assert run.stats["max_constraint"] <= 1e-12
