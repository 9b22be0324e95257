"""Work-precision studies: time and error of all configurations of a scene."""

__all__: list[str] = ["result", "study"]
#: Open to the other parts of ``studies``.
WITHIN = ["axes", "formulations", "observation", "reference", "result", "running"]
