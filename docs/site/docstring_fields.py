"""The fields of a dataclass as its docstring describes them."""

import inspect
import re
from typing import Any

#: The heading of a list of fields; headings of other lists, after which no field is described.
_ATTRIBUTES, _OTHERS = "Attributes:", ("Raises:", "Examples:", "Args:", "Returns:")


def described_fields(record: type[Any]) -> tuple[list[str], dict[str, str]]:
    """Return the paragraphs of a docstring, and apart from them the meanings of fields by name.

    Fields are described as `name: meaning. other: meaning.` in a paragraph, or below the heading
    `Attributes:`.
    """
    names = "|".join(getattr(record, "__dataclass_fields__", {}))
    some = rf"((?:{names})(?:, (?:{names}))*): "
    inline, listed = re.compile(rf"(?:^|(?<=[.;] )){some}"), re.compile(rf"^ {{4}}{some}", re.M)
    text: list[str] = []
    meanings: dict[str, str] = {}
    for paragraph in (inspect.getdoc(record) or "").split("\n\n"):
        if paragraph.startswith(_OTHERS):
            break
        is_list = paragraph.startswith(_ATTRIBUTES)
        source = paragraph.partition("\n")[2] if is_list else " ".join(paragraph.split())
        pattern = listed if is_list else inline
        before, *found = pattern.split(source) if names else [source]
        text += [before.strip()] if before.strip() else []
        for some_names, meaning in zip(found[::2], found[1::2], strict=True):
            meanings |= dict.fromkeys(some_names.split(", "), " ".join(meaning.split()))
    return text, meanings
