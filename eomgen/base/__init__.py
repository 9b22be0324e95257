"""Modules without knowledge of mechanics, open to every room: arrays, text, files, calls, registers of extensions."""

__all__ = [
    "arrays",
    "calls",
    "concurrency",
    "data",
    "display",
    "extensions",
    "files",
    "products",
    "progress",
    "public_modules",
    "random_inputs",
    "random_roads",
    "road_classes",
    "standard_normals",
    "text",
    "verbs",
    "version",
]
