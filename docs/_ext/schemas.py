"""JSON Schemas (draft 2020-12): of the JSON of a mechanism, read off the dataclasses; of the document that every verb prints."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from reference import write_if_new
from sphinx.application import Sphinx

from mechlab.formats.mechanism_json import _PAIRS, EXTRA_KEYS, FORMAT, SCHEMA
from mechlab.mechanism.model import Mechanism
from mechlab.values import LARGEST_NUMBER

DRAFT = "https://json-schema.org/draft/2020-12/schema"
EXIT_CODES = (0, 1, 2, 3, 4, 130, 143)


def mechanism_schema() -> dict[str, Any]:
    """The schema of NAME.json: one object for each dataclass, exact ratios as texts."""
    parts: dict[str, Any] = {}
    root = _object(Mechanism, parts)
    root["properties"] |= {"format": {"const": FORMAT}, "schema": {"const": SCHEMA}, **{k: {"type": "object"} for k in EXTRA_KEYS}}
    root["required"] = ["format", "schema", *root["required"]]
    return {"$schema": DRAFT, "title": "A mechanism of mechlab", "$defs": parts, **root}


def document_schema() -> dict[str, Any]:
    """The schema of the one document that a verb prints with --json, also on failure."""
    text, number = {"type": "string"}, {"type": "integer"}
    error = {"type": "object", "required": ["kind", "message"], "properties": {"kind": text, "message": text}}
    return {
        "$schema": DRAFT,
        "title": "The document of a verb of mechlab (--json)",
        "type": "object",
        "required": ["schema", "command", "names", "status", "exit_code", "units", "versions", "parameters"],
        "properties": {
            "schema": number, "command": text, "names": {"type": "array", "items": text}, "status": text,
            "exit_code": {"enum": list(EXIT_CODES)}, "units": {"type": "object", "additionalProperties": text},
            "versions": {"type": "object", "additionalProperties": text}, "parameters": {"type": "object"}, "error": error,
        },
        # a document without an answer says why
        "if": {"properties": {"exit_code": {"enum": [1, 2, 130, 143]}}},
        "then": {"required": ["error"]},
    }  # fmt: skip


def _object(cls: type, parts: dict[str, Any]) -> dict[str, Any]:
    hints = get_type_hints(cls)
    needed = [f.name for f in fields(cls) if f.default is MISSING and f.default_factory is MISSING]
    properties = {f.name: _of(hints[f.name], parts, f.name in _PAIRS) for f in fields(cls)}
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def _of(hint: Any, parts: dict[str, Any], pairs: bool = False) -> dict[str, Any]:
    if get_origin(hint) in (types.UnionType, Union):
        return {"anyOf": [{"type": "null"} if h is type(None) else _of(h, parts) for h in get_args(hint)]}
    if is_dataclass(hint):
        assert isinstance(hint, type)
        if hint.__name__ not in parts:
            parts[hint.__name__] = {}
            parts[hint.__name__] = _object(hint, parts)
        return {"$ref": f"#/$defs/{hint.__name__}"}
    if hint is str:
        return {"type": "string"}
    if hint is Fraction:
        return {"type": "string", "pattern": r"^[+-]?\d{1,400}([/.]\d{1,400})?$"}
    if get_origin(hint) is tuple:
        items = get_args(hint)
        if pairs:
            return {"type": "object", "additionalProperties": _of(get_args(items[0])[1], parts)}
        if len(items) == 2 and items[1] is Ellipsis:
            return {"type": "array", "items": _of(items[0], parts)}
        return {"type": "array", "prefixItems": [_of(h, parts) for h in items], "minItems": len(items), "maxItems": len(items)}
    return {"type": "number", "minimum": -LARGEST_NUMBER, "maximum": LARGEST_NUMBER}


def _write(schemas: Mapping[str, dict[str, Any]], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, schema in schemas.items():
        write_if_new(folder / f"{name}.schema.json", json.dumps(schema, indent=1) + "\n")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write both schemas beside the other generated pages."""
    schemas = {"mechanism": mechanism_schema(), "document": document_schema()}
    app.connect("config-inited", lambda app, config: _write(schemas, Path(app.srcdir) / "reference" / "generated"))
    return {"parallel_read_safe": True}
