"""Modules without knowledge of mechanics, open to every room: arrays, text, files, calls, registers of extensions."""

__all__ = [
    "arrays",
    "calls",
    "data",
    "extensions",
    "figures",
    "files",
    "html",
    "locks",
    "products",
    "progress",
    "public_modules",
    "random_inputs",
    "random_roads",
    "resources",
    "road_classes",
    "standard_normals",
    "text",
    "threads",
    "verbs",
    "version",
]
