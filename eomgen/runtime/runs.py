"""The part of a compiled model that is about runs: from a start, from a checkpoint, and to where it comes to rest."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from eomgen.runtime.terms import Inputs, Parameters

if TYPE_CHECKING:
    from eomgen.runtime.equilibrium import Equilibrium
    from eomgen.runtime.model import Model
    from eomgen.runtime.solution import Solution


class Runs:
    """Each run is a module of its own, imported when it is first asked for."""

    def simulate(self, t_end: float | None = None, step: float | None = None, **options: Any) -> Solution:
        """Integrate from the initial state; see ``runtime.simulate.simulate`` for all options."""
        from eomgen.runtime.simulate import simulate  # noqa: PLC0415  # the model is used without it too

        return simulate(cast("Model", self), t_end, step, **options)

    def equilibrium(
        self, initial: Mapping[str, Any] | None = None, parameters: Parameters = None, t: float = 0.0, u: Inputs = None, *,
        any_kind: bool = False,
    ) -> Equilibrium:  # fmt: skip
        """Return a state of rest near the initial one; see ``runtime.equilibrium.equilibrium``."""
        from eomgen.runtime.equilibrium import equilibrium  # noqa: PLC0415

        return equilibrium(cast("Model", self), initial, parameters, t, u, any_kind=any_kind)

    def resume(self, path: str | os.PathLike[str], t_end: float | None = None, **options: Any) -> Solution:
        """Go on with a run from its checkpoint, to the same bits; see ``runtime.resume.resume`` for all options."""
        from eomgen.runtime.resume import resume  # noqa: PLC0415

        return resume(cast("Model", self), path, t_end, **options)
