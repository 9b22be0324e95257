"""``eomgen linearize --ride``: root mean squares and spectra of outputs on random roads."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.linear.linearization import Linearization
    from eomgen.linear.spectra import PowerSpectrum, RideTable, RoadExcitation


@dataclass(frozen=True)
class RideRequest:
    """Request of ``--ride``, ``--classes``, ``--speeds`` and ``--band``."""

    outputs: dict[str, str | None]
    classes: tuple[str, ...]
    speeds: tuple[float, ...]
    band: tuple[float, float] | None

    @classmethod
    def read(
        cls, rides: tuple[str, ...], classes: str | None, speeds: str | None, band: tuple[float, float] | None
    ) -> RideRequest | None:
        """Return the request; None if there is none. Raises UsageError for words that cannot be read."""
        if not rides:
            for option, given in (("--classes", classes), ("--speeds", speeds)):
                if given is not None:
                    raise UsageError(Problem(option, "it belongs to a ride", "--ride body_acceleration"))
            return None
        from eomgen.base.random_inputs import ROUGHNESS  # noqa: PLC0415
        from eomgen.linear.spectra import WEIGHTINGS  # noqa: PLC0415

        outputs: dict[str, str | None] = {}
        for text in rides:
            name, colon, weighting = text.rpartition(":")
            if colon and weighting not in WEIGHTINGS:
                fault = f"there is no weighting {ascii(weighting)[:32]}"
                raise UsageError(Problem(f"--ride {text}", fault, " or ".join(f"{name}:{key}" for key in WEIGHTINGS)))
            outputs[(name if colon else text).strip()] = weighting or None if colon else None
        chosen = tuple(part.strip() for part in classes.split(",")) if classes is not None else ()
        unknown = [name for name in chosen if name not in ROUGHNESS]
        if unknown:
            fault = f"there is no road class {ascii(unknown[0])[:32]}"
            raise UsageError(Problem(f"--classes {classes}", fault, f"some of {','.join(ROUGHNESS)}"))
        return cls(outputs, chosen, _speeds(speeds), band)

    def table(self, lin: Linearization, excitation: RoadExcitation) -> RideTable:
        """Return the root mean squares; by default on the road of the scene and at its speed."""
        classes = self.classes or ((excitation.road.road_class,) if excitation.road.road_class else ())
        return lin.ride_table(excitation, self.outputs, classes, self.speeds, self.band)

    def spectra(self, lin: Linearization, excitation: RoadExcitation) -> list[PowerSpectrum]:
        """Return the spectra of the outputs, without their weightings."""
        return [lin.psd(name, excitation) for name in self.outputs]


def _speeds(text: str | None) -> tuple[float, ...]:
    if text is None:
        return ()
    try:
        speeds = tuple(float(part) for part in text.split(","))
    except ValueError:
        speeds = (math.nan,)
    if not all(0.0 < speed < math.inf for speed in speeds):
        raise UsageError(Problem(f"--speeds {text}", "positive speeds in m/s are needed", "--speeds 10,20,30"))
    return speeds
