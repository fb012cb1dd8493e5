"""The published schemas against the files in models/ and the documents of the verbs; broken ones are refused by schema and reader alike."""

from __future__ import annotations

import copy
import json
import sys
from collections.abc import Iterator
from typing import Any

import pytest

import mechlab as ml
from mechlab.cli import main
from tests.docs.pages import DOCS

jsonschema = pytest.importorskip("jsonschema")
pytest.importorskip("sphinx")
MODELS = sorted((DOCS.parent / "models").glob("*/*.json"))


@pytest.fixture(scope="module")
def schemas() -> Iterator[Any]:
    """The module that writes them."""
    sys.path.insert(0, str(DOCS / "_ext"))
    try:
        import schemas

        yield schemas
    finally:
        sys.path.remove(str(DOCS / "_ext"))


def test_every_written_model_fits_the_schema(schemas: Any) -> None:
    found = jsonschema.Draft202012Validator(schemas.mechanism_schema())
    assert len(MODELS) > 80
    for path in MODELS:
        errors = [e.message for e in found.iter_errors(json.loads(path.read_text(encoding="utf-8")))]
        assert not errors, f"{path.name}: {errors[:2]}"


def test_what_the_reader_refuses_the_schema_refuses(schemas: Any) -> None:
    found = jsonschema.Draft202012Validator(schemas.mechanism_schema())
    good = json.loads(ml.to_json(ml.load("planetary_stage").mechanism("full")))
    assert found.is_valid(good)

    def broken(*path: Any, value: Any = None, drop: bool = False) -> dict[str, Any]:
        made = copy.deepcopy(good)
        at = made
        for key in path[:-1]:
            at = at[key]
        if drop:
            del at[path[-1]]
        else:
            at[path[-1]] = value
        return made

    wrong = [
        broken("format", value="other"), broken("schema", value=2), broken("bodies", drop=True), broken("bodies", 0, "name", value=3),
        broken("bodies", 0, "joints", 0, "axis", value=[0.0, 0.0]), broken("bodies", 0, "joints", 0, "damping", value="1"),
        broken("relations", 0, "coefficients", "sun", value=1.5), broken("gravity", value=[0.0, 0.0, 1e400]), broken("extra", value=1),
    ]  # fmt: skip
    for document in wrong:
        assert not found.is_valid(document)
        with pytest.raises(ml.MechlabError):
            ml.from_json(json.dumps(document))


@pytest.mark.parametrize(
    "command",
    ["list", "show fourbar", "solve fourbar crank_angle=1", "simulate fourbar --duration 0.01", "solve fourbr", "solve", "nothing",
     "solve fourbar crank=0.3 crank_angle=180deg", "simulate n_fourbar --timestep 20ms --duration 1.5"],
)  # fmt: skip
def test_the_document_of_a_verb_fits_the_schema(command: str, schemas: Any, capsys: pytest.CaptureFixture[str]) -> None:
    code = main([*command.split(), "--json"])
    document = json.loads(capsys.readouterr().out)
    jsonschema.validate(document, schemas.document_schema())
    assert document["exit_code"] == code
