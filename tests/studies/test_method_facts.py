"""Facts of studies about methods: every row names a method, its parameters and its settings."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.errors import UsageError
from eomgen.integrators.families.family import Sizes
from eomgen.integrators.families.register import method_compiled, method_names, row_of
from eomgen.products.studies.method_facts import FACTS, GROUP, MethodFacts, facts_of
from tests.models.distributions import distribution, register

__all__ = ["register"]

#: Facts of a distribution, by its entry point.
OF_ANOTHER = MethodFacts(compared={"order": (1.0, 2.0)}, studied=False)
FAMILY = "adams = tests.integrators.adams.family:AdamsBashforth"


@pytest.mark.parametrize("name", FACTS)
def test_a_row_is_of_a_method_and_of_its_parameters_and_settings(name: str) -> None:
    assert method_names()[name] == name
    facts = FACTS[name]
    assert set(facts.compared) <= set(row_of(name)[1].parameters)
    if name != "trapezoidal_index3":  # which no parameters bear
        settings = {setting.name for setting in method_compiled(name).settings(Sizes(7, 6, 2, 1, 3, 0, 0))}
        assert all(set(values) <= settings for values in facts.policies.values())
    assert facts.fine_by != "tolerance" or "tolerance" in row_of(name)[1].parameters


def test_facts_are_found_by_every_name_of_a_method() -> None:
    assert facts_of("RKMK4") is FACTS["rk4"]
    assert facts_of("chung-hulbert") is FACTS["generalized_alpha"]
    with pytest.raises(UsageError, match="there is no method 'magic'"):
        facts_of("magic")


@pytest.mark.usefixtures("register")
def test_another_distribution_gives_facts_about_its_method(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(distribution(tmp_path / "family", "eomgen-adams", FAMILY))
    assert facts_of("ab2") == MethodFacts()
    entry = f"{FAMILY}\n[{GROUP}]\nadams_bashforth = tests.studies.test_method_facts:OF_ANOTHER"
    monkeypatch.syspath_prepend(distribution(tmp_path / "both", "eomgen-adams-facts", entry.replace(FAMILY, "")))
    assert facts_of("ab2").compared == {"order": (1.0, 2.0)}
