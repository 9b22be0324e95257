"""One signature for all functions of a folder: names for its templates, and its description in the manifest."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

from eomgen.codegen.program import OutputArray, Program, ProgramFunction
from eomgen.system.system import INPUT_BLOCKS

#: Meanings of the arrays of arguments.
MEANINGS: Mapping[str, str] = {
    "p": "tunable parameters",
    "t": "time, s",
    "q": "configuration",
    "v": "velocity",
    "a": "acceleration",
    "j": "first time derivative of a",
    "s": "second time derivative of a",
    "a_higher": "time derivatives of a from the third on, row by row",
    "z": "internal states",
    "lam": "multipliers",
    "u": "inputs",
    "u_dot": "first time derivative of u",
    "u_ddot": "second time derivative of u",
    "u_higher": "time derivatives of u from the third on, row by row",
    "base": "state of the base: quaternion, position, omega, velocity, omega_dot, velocity_dot",
    "base_rates": "time derivatives of the twist of the base from the second on, row by row",
    "weights": "weights of the equations, then of the outputs",
    "direction": "a change of q, v, a, z, lam and p",
}
#: Functions of a model that fill arrays of arguments.
_DRIVERS = {"inputs": ("u",), "input_rates": ("u_dot", "u_ddot", "u_higher"), "base": ("base",)}
_DRIVERS |= {"base_rates": ("base_rates",)}
_ALWAYS = ("p", "t", "q", "v", "a", "z", "lam", "u")


class Uniform:
    """Texts for the templates of functions with one signature: arrays of arguments (input blocks), sizes and calls."""

    def __init__(self, program: Program) -> None:
        self.program = program

    @cached_property
    def _read(self) -> list[str]:
        """Arrays that functions read."""
        read = {block for function in self.program.functions for block in function.inputs}
        return [block for block in INPUT_BLOCKS if block in read]

    @cached_property
    def sizes(self) -> list[int]:
        """Lengths of all arrays, 0 of arrays that are not in the model."""
        known = {*self._read, *_ALWAYS}
        return [self.program.input_size(block) if block in known else 0 for block in INPUT_BLOCKS]

    @cached_property
    def rates(self) -> list[str]:
        """Time derivatives of inputs that functions read or the scene gives."""
        names = self.program.function_names
        driven = {o.name for o in self.program.function("input_rates").outputs} if "input_rates" in names else set()
        return [block for block in _DRIVERS["input_rates"] if block in driven or block in self._read]

    @cached_property
    def scene_arrays(self) -> list[str]:
        """Arrays that the scene may fill; the base is a struct."""
        names = self.program.function_names
        drivers = [block for block in ("u", "base_rates") if {"u": "inputs"}.get(block, block) in names]
        return [*drivers, *self.rates]

    @cached_property
    def drivers(self) -> dict[str, str]:
        """C masks of the arrays that a scene's function reads to fill an array, by this array, the last filled
        first."""
        order = [(block, name) for name in reversed(_DRIVERS) for block in _DRIVERS[name]]
        known = [(block, name) for block, name in order if name in self.program.function_names]
        return {block: self.bits(self.program.function(name).inputs) for block, name in known if block in self._read}

    @cached_property
    def from_caller(self) -> list[str]:
        """Arrays that only the caller can give."""
        filled = {"p", "t", *self.scene_arrays, *(["base"] if "base" in self.program.function_names else [])}
        return [block for block in self._read if block not in filled and self.sizes[INPUT_BLOCKS.index(block)]]

    @staticmethod
    def bit(block: str) -> str:
        """Return the bit of an array."""
        return f"1ul << EOMGEN_BLOCK_{block.upper()}"

    def bits(self, blocks: Iterable[str]) -> str:
        """Return the bits of several arrays."""
        return " | ".join(self.bit(block) for block in blocks) or "0ul"

    @staticmethod
    def arguments(function: ProgramFunction, *outputs: str) -> str:
        """Return the arguments of a call of a function of the model."""
        structs = {"p": "&own->p", "base": "&own->base"}
        return ", ".join([*(structs.get(block, f"own->in.{block}") for block in function.inputs), *outputs])

    @staticmethod
    def places(function: ProgramFunction) -> list[tuple[OutputArray, int]]:
        """Return the outputs of a function, each with the place of its first number in ``out``."""
        firsts = itertools.accumulate((output.size for output in function.outputs), initial=0)
        return list(zip(function.outputs, firsts, strict=False))

    def targets(self, function: ProgramFunction) -> list[str]:
        """Return the addresses of the outputs of a function."""
        return [f"out + {first}" if first else "out" for _, first in self.places(function)]

    @staticmethod
    def driver_arrays(driver: ProgramFunction) -> list[str]:
        """Return the arrays that a function of the scene fills."""
        return [f"own->{output.name}" for output in driver.outputs]

    def size(self, function: ProgramFunction) -> int:
        """Return the number of numbers in ``out``."""
        return sum(output.size for output in function.outputs)

    def manifest(self) -> dict[str, Any]:
        """Return the entry ``uniform`` of the manifest: header, sizes of arguments, inputs and outputs of functions."""
        prefix = self.program.prefix
        return {
            "header": f"{prefix}_uniform.h",
            "model": f"{prefix}_uniform",
            "arguments": [
                {"name": block, "size": size, "description": MEANINGS[block]}
                for block, size in zip(INPUT_BLOCKS, self.sizes, strict=True)
                if size
            ],
            "functions": {
                function.name: {
                    "reads": list(function.inputs),
                    "size": self.size(function),
                    "outputs": [
                        {"name": output.name, "first": first, "size": output.size, "shape": list(output.shape)}
                        for output, first in self.places(function)
                    ],
                }
                for function in self.program.functions
            },
        }
