"""Code generation: System -> Program (statements, layout) -> text of a target language."""

__all__ = ["continuation", "convert", "folder", "metadata", "program", "scheduling", "targets"]
