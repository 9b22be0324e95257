"""The cheapest configuration of a scene that meets a demand: racing, verification, the scene's file."""

__all__: list[str] = ["result", "tune"]
