"""Configurations of runs: all that decides speed and error, but the step or tolerance."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from eomgen.toolchain.profiles import STANDARD_PROFILE


@dataclass(frozen=True)
class Configuration:
    """All that decides a run's speed and error, but the step or tolerance.

    Attributes
    ----------
    formulation : name of a formulation of the study
    method : public name
    parameters : of the method, different from its defaults
    policy : name of the settings, empty for the defaults
    settings : of the stepper, different from its defaults
    real, profile : as of ``eomgen.build``
    """

    formulation: str
    method: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    policy: str = ""
    settings: Mapping[str, float] = field(default_factory=dict)
    real: str = "double"
    profile: str = STANDARD_PROFILE

    @property
    def label(self) -> str:
        """Words for pictures and tables: method, parameters, formulation, then unusual settings."""
        values = [f"{name} {value:g}" for name, value in self.parameters.items()]
        unusual = [
            self.policy,
            self.real if self.real != "double" else "",
            self.profile if self.profile != STANDARD_PROFILE else "",
        ]
        return ", ".join(filter(None, [" ".join((self.method, *values)), self.formulation, *unusual]))

    @property
    def key(self) -> str:
        """A text that no other configuration has."""
        return json.dumps(self.to_dict(), sort_keys=True)

    def varied(self, **changes: Any) -> Configuration:
        return replace(self, **changes)

    def of_scene(self) -> dict[str, Any]:
        """Return the keys of a scene's section ``simulation`` besides the method that are not their defaults."""
        settings = {"settings": dict(self.settings)} if self.settings else {}
        return {**self.parameters, **settings, **({"real": self.real} if self.real != "double" else {})}

    def to_dict(self) -> dict[str, Any]:
        return {
            "formulation": self.formulation,
            "method": self.method,
            "parameters": dict(self.parameters),
            "policy": self.policy,
            "settings": dict(self.settings),
            "real": self.real,
            "profile": self.profile,
        }
