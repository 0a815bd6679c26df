"""Options that are declared by the fields of records, added to parsers."""

import argparse
from collections.abc import Callable
from typing import Any

from lightpaint.cli.options import arguments
from lightpaint.field_options import FieldOption, Option, options_of
from lightpaint.validation import SWITCH, Check


def add_fields(
    parser: "argparse._ActionsContainer", record: type, *names: str, default: str = ""
) -> None:
    """Add the options of fields of `record`; their values go by the names of the fields.

    default: the default in words, if this command has another.
    """
    for name in names:
        declared = options_of(record)[name]
        option, words = declared.option, default or declared.option.default
        parser.add_argument(
            option.name,
            dest=name,
            default=declared.default,
            help=option.help + (f" (default: {words})" if words else ""),
            **_value(declared),
        )


def _value(declared: FieldOption) -> dict[str, Any]:
    """Return the arguments of argparse for the value of an option."""
    option, check = declared.option, declared.check
    if check is SWITCH:
        if declared.default is None:
            return {"action": argparse.BooleanOptionalAction}
        return {"action": "store_false" if declared.default else "store_true"}
    if "enum" in check.schema:
        return {"choices": check.schema["enum"]}
    value = {"type": _parser_of(option, check), "metavar": option.metavar}
    return value if option.bare is None else {**value, "nargs": "?", "const": option.bare}


def _parser_of(option: Option, check: Check) -> Callable[[str], Any]:
    """Return the function that makes a value of a text, as the check of its field says."""
    if option.parse is not None:
        return arguments.parsed_by(option.parse)
    schema = check.schema
    if schema.get("type") == "integer":
        least = schema["minimum"] if option.least is None else option.least
        return arguments.at_least(least, maximum=schema.get("maximum"))
    if schema.get("type") == "number":
        quantity = f" of {check.unit}" if check.unit else ""
        return arguments.number(quantity, may_be_zero="minimum" in schema)
    return str
