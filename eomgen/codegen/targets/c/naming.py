"""Names that come from outside become legal, distinct C identifiers and harmless comments."""

from __future__ import annotations

import re

from eomgen.errors import ModelError

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_COMMENT_UNSAFE = re.compile(r"[^A-Za-z0-9 _.,:;=()\[\]{}<>+^|/-]")
_C_WORDS = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|restrict|return|short|signed|sizeof|static|struct|switch|"
    r"typedef|union|unsigned|void|volatile|while|_Bool|_Complex|_Imaginary|asm|bool|catch|class|delete|explicit|export|false|friend|mutable|namespace|new|operator|private|protected|public|template|this|throw|"
    r"true|try|typename|using|virtual|real|complex|main|count|inputs|outputs|strides"
)


_STANDARD_HEADERS = re.compile(
    r"alloca|assert|complex|ctype|errno|features|fenv|float|inttypes|iso646|limits|locale|math|memory|setjmp|signal|stdarg|stdbool|"
    r"stddef|stdint|stdio|stdlib|string|strings|tgmath|threads|time|uchar|unistd|wchar|wctype"
)


def mangle(name: str, prefix: str = "p_") -> str:
    """Return a C identifier for a name, different for different names.

    Letters, digits and underscores stay; everything else, and an underscore in front of a ``Z``, becomes ``_Z<hex>_``.
    """
    text: list[str] = []
    for position, character in enumerate(name):
        if character == "_" and name[position + 1 : position + 2] == "Z":
            text.append("_Z5f_")
        elif character == "_" or (character.isascii() and character.isalnum()):
            text.append(character)
        else:
            text.append(f"_Z{ord(character):x}_")
    return prefix + "".join(text)


def comment(text: str, limit: int = 200) -> str:
    """Return text that cannot end a comment, continue a line, form a trigraph or leave ASCII."""
    clean = _COMMENT_UNSAFE.sub("_", " ".join(text.split())).replace("//", "/_")
    return clean if len(clean) <= limit else clean[: limit - 3] + "..."


def c_string(text: str) -> str:
    """Return a string literal of C: letters, digits and underscores as they are; any other text in octal escapes throughout."""
    plain = re.fullmatch(r"[A-Za-z0-9_]*", text) is not None
    return f'"{text}"' if plain else '"' + "".join(f"\\{byte:03o}" for byte in text.encode()) + '"'


def check_prefix(prefix: str) -> str:
    """Return the prefix of a model's symbols. Raises ModelError unless it is a free C identifier."""
    if not _IDENTIFIER.fullmatch(prefix):
        raise ModelError(f"the model's name {prefix!r} is not a C identifier", "letters, digits and underscores, a letter first")
    if _STANDARD_HEADERS.fullmatch(prefix.lower()):
        raise ModelError(f"the model's name {prefix!r} would let {prefix}.h hide a header of C itself", f"{prefix}_model")
    if prefix.lower() in ("main", "interface", "eg", "eomgen", "eomgen_real"):
        raise ModelError(f"the model's name {prefix!r} is taken by the generated code", f"{prefix}_model")
    return prefix


def check_identifier(name: str, what: str) -> str:
    """Return a name that mechanics gave to a function. Raises ModelError unless it is an identifier."""
    if not _IDENTIFIER.fullmatch(name):
        raise ModelError(f"{what} {name!r} is not an identifier")
    return name


def output_name(name: str, inputs: tuple[str, ...]) -> str:
    """Return the name of an output argument, out of the way of inputs, locals and words of C."""
    check_identifier(name, "the output")
    clash = name in inputs or _C_WORDS.fullmatch(name) or re.fullmatch(r"x\d+|[wij]|eg_.*|EG_.*", name)
    return f"{name}_out" if clash else name
