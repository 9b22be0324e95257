"""JAX on cards, by the stand-in: the handler that launches kernels, as the handler of JAX on the processor."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from tests.gpu.test_functions import PENDULUM, model_of, states

jax = pytest.importorskip("jax")


@pytest.fixture
def on_card(stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Let JAX on the processor call the handler of cards, by another name, and return the stand-in."""
    from eomgen.products.gpu.jax_kernels import JaxCards
    from eomgen.products.optimisers import jax_functions

    jax.config.update("jax_enable_x64", True)
    cards = JaxCards()
    jax_functions._package()
    monkeypatch.setattr(jax_functions, "_TARGET", "eomgen_card")
    address = ctypes.c_void_p(jax_functions._handler(cards.launch)[1])
    jax.ffi.register_ffi_target("eomgen_card", jax.ffi.pycapsule(address), platform="cpu")
    monkeypatch.setattr(jax_functions, "_cards", lambda: (cards,))
    monkeypatch.setattr(jax_functions, "_package", lambda: jax)
    jax_functions._primitive.cache_clear()
    yield stand_in
    jax_functions._primitive.cache_clear()


def test_values_and_derivatives_are_kernels(on_card: ctypes.CDLL) -> None:
    model = model_of(PENDULUM)
    q, v, _ = states(model)
    functions = eomgen.jax(model)
    before = on_card.stand_in_calls(b"cuLaunchKernel")
    found = jax.jit(jax.vmap(functions.forward_dynamics))(q, v)
    assert np.array_equal(found, model.forward_dynamics(q, v))
    assert on_card.stand_in_calls(b"cuLaunchKernel") == before + 2  # the law of the base, and the accelerations
    found = jax.vmap(jax.jacfwd(functions.forward_dynamics), (0, None))(q, v[0])
    steps = 1e-6 * np.eye(2)
    slopes = [(model.forward_dynamics(q + d, v[0]) - model.forward_dynamics(q - d, v[0])) / 2e-6 for d in steps]
    assert np.allclose(found, np.stack(slopes, -1), rtol=1e-6, atol=1e-6)
    assert on_card.stand_in_calls(b"cuLaunchKernel") > before + 3


@pytest.mark.usefixtures("stand_in")
def test_other_functions_take_arrays_of_jax() -> None:
    functions, q = eomgen.gpu(model_of(PENDULUM)), jax.numpy.zeros(2)
    with pytest.raises(UsageError, match=r"jax: JAX fills its arrays itself, .*; try: eomgen.jax\(model\)"):
        functions.mass(q)
    with pytest.raises(UsageError, match="jax: JAX fills its arrays itself"):
        jax.jit(functions.mass)(q)
