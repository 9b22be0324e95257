"""Configurations of runs in words, and as keys of a scene."""

from __future__ import annotations

from dataclasses import replace

import pytest

from eomgen.products.studies.work_precision.axes import Configuration

PLAIN = Configuration("joint", "rk4")


@pytest.mark.parametrize(
    ("configuration", "keys", "label"),
    [
        (PLAIN, {}, "rk4, joint"),
        (replace(PLAIN, real="float"), {"real": "float"}, "rk4, joint, float"),
        (replace(PLAIN, settings={"iterations": 3}), {"settings": {"iterations": 3}}, "rk4, joint"),
        (replace(PLAIN, profile="another"), {}, "rk4, joint, another"),
        (replace(PLAIN, policy="frozen"), {}, "rk4, joint, frozen"),
        (Configuration("", "alpha", {"rho": 0.5}), {"rho": 0.5}, "alpha rho 0.5"),
    ],
)
def test_values_that_differ_from_the_defaults_are_named(
    configuration: Configuration, keys: dict[str, object], label: str
) -> None:
    assert (configuration.simulation_keys(), configuration.label) == (keys, label)
