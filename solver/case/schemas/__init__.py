"""The JSON Schemas of the project's files, and a refused value told in one line.

A schema's own `description` is what a message says is allowed, so that schema and messages agree.
"""

import json
from functools import cache
from pathlib import Path
from typing import Any

from solver.system.errors import InputError, hint, key_path

CASE_SCHEMA = Path(__file__).with_name("case.schema.json")


def validate(content: object, schema: Path, where: object) -> None:
    """Raise `InputError` for the first thing in `content` that the schema refuses."""
    from jsonschema.exceptions import relevance

    errors = list(_validator(schema).iter_errors(content))
    if errors:
        raise _refusal(max(errors, key=relevance), where)


@cache
def _validator(schema: Path) -> Any:
    from jsonschema.validators import Draft202012Validator

    return Draft202012Validator(json.loads(schema.read_text(encoding="utf-8")))


def _refusal(error: Any, where: object) -> InputError:
    keys, rule = list(error.absolute_path), error.validator
    if rule == "additionalProperties":
        known = error.schema.get("properties", {})
        unknown = next(key for key in error.instance if key not in known)
        path = key_path([*keys, unknown])
        return InputError(
            where, path, error.instance[unknown], f"unknown key; {hint(unknown, known)}"
        )
    if rule == "required":
        missing = next(key for key in error.validator_value if key not in error.instance)
        return InputError(where, key_path([*keys, missing]), None, "this key is needed")
    if rule == "enum" and "propertyNames" in error.absolute_schema_path:
        unknown = error.instance
        path = key_path([*keys, unknown])
        return InputError(where, path, None, f"unknown key; {hint(unknown, error.validator_value)}")
    allowed = f"must be {error.schema.get('description', error.message)}"
    if rule == "uniqueItems":
        allowed += ", each once"
    return InputError(where, key_path(keys) or "file", error.instance, allowed)
