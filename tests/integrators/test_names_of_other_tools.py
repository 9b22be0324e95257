"""Methods of other tools are answered with eomgen's, by any spelling."""

from __future__ import annotations

import pytest

from eomgen.errors import UsageError
from eomgen.integrators.families.register import method_named

SUBSTITUTES = {
    "generalized_alpha, for stiff motions": "BDF LSODA Radau ode15s ode23t ida cvode implicit-euler backward_euler",
    "rk45, or taylor for small errors": "ode45 RK23 DOP853 rkf45 ode113 dp45",
    "rk4": "euler forward_euler semi-implicit-euler rk2 rk",
    "leapfrog": "verlet velocity_verlet stoermer_verlet",
    "yoshida4": "forest_ruth forest-ruth ruth4",
}
CASES = [(name, method) for method, names in SUBSTITUTES.items() for name in names.split()]


@pytest.mark.parametrize(("name", "method"), CASES)
def test_methods_of_other_tools_are_answered_with_a_method(name: str, method: str) -> None:
    with pytest.raises(UsageError) as raised:
        method_named(name)
    assert str(raised.value) == f"usage error: method: there is no method '{name}'; try: {method}"
