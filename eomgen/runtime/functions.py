"""The compiled functions on NumPy arrays: leading axes of all inputs broadcast, and one C call evaluates the whole batch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import Problem, UsageError

Array = NDArray[np.float64]

#: The entry of the layout's sizes that says how many components an input block has.
_SIZE_OF = {"p": "p", "t": "", "q": "q", "v": "v", "a": "v", "z": "z", "lam": "lam", "u": "u", "base": "base"}


class LibraryLike(Protocol):
    """A compiled model behind the generic interface (``build.library.Library`` is one)."""

    ffi: Any
    lib: Any
    layout: Mapping[str, Any]
    index: Mapping[str, int]

    def call(self, function: int | str, inputs: Any, outputs: Any) -> None: ...


class Functions:
    """The functions of a library by name.

    Parameters
    ----------
    library : LibraryLike
    """

    def __init__(self, library: LibraryLike) -> None:
        self.library = library
        self.sizes: dict[str, int] = dict(library.layout["sizes"])
        self._layouts = {function["name"]: function for function in library.layout["functions"]}

    def __contains__(self, name: str) -> bool:
        return name in self._layouts

    @property
    def names(self) -> list[str]:
        return list(self._layouts)

    def inputs(self, name: str) -> list[str]:
        """Return the input blocks of a function. Raises UsageError when the model was built without it."""
        if name not in self._layouts:
            there = ", ".join(name for name in self._layouts if name not in ("base", "inputs"))
            raise UsageError(
                Problem("", f"the term {name} is not in this model, which was built with {there}", f'terms=[..., "{name}"] in eomgen.build')
            )
        return list(self._layouts[name]["inputs"])

    def outputs(self, name: str) -> list[Mapping[str, Any]]:
        """Return name, shape, size and description of every output of a function."""
        return list(self._layouts[name]["outputs"])

    def size(self, block: str) -> int:
        """Return the number of components of an input block."""
        return self.sizes[_SIZE_OF[block]] if _SIZE_OF[block] else 1

    def __call__(self, name: str, blocks: Mapping[str, Array]) -> tuple[Array, ...]:
        """Evaluate a function.

        Parameters
        ----------
        blocks : mapping
            At least the function's inputs; each (..., size), and t (...).

        Returns
        -------
        tuple of arrays
            Leading axes are those of the inputs, broadcast; the rest is each output's shape.

        Raises
        ------
        UsageError
            Leading axes that do not broadcast.
        """
        arrays = [blocks[block][..., np.newaxis] if block == "t" else blocks[block] for block in self.inputs(name)]
        try:
            shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            shapes = ", ".join(f"{block} {blocks[block].shape}" for block in self.inputs(name))
            raise UsageError(Problem(name, f"the leading axes do not broadcast: {shapes}", "batches of equal shape")) from None
        count = int(np.prod(shape))
        flat = [_samples(array, shape, count) for array in arrays]
        described = self.outputs(name)
        results = [np.empty((count, output["size"])) for output in described]
        if count:
            self.library.call(name, flat, results)
        return tuple(
            result.reshape((*shape, *output["shape"])) for result, output in zip(results, described, strict=True)
        )


def _samples(array: Array, shape: tuple[int, ...], count: int) -> Array:
    """Return (size,) for one value in all samples, else (count, size)."""
    size = array.shape[-1]
    if array.size == size and count != 0:
        return np.ascontiguousarray(array.reshape(size))
    return np.ascontiguousarray(np.broadcast_to(array, (*shape, size)).reshape(count, size))
