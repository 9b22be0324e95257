"""Code generation: System -> Program (statements, layout) -> text of a target language."""

__all__ = ["convert", "folder", "lanes", "metadata", "program", "scheduling", "targets"]
