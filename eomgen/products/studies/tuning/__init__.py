"""The cheapest configuration of a scene that meets a demand: racing, verification, the scene's file."""

__all__: list[str] = []
#: Open to the other parts of ``studies``.
WITHIN = ["real_time", "result", "tune"]
