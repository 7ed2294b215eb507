"""The manual of the diagnosis against the code: verdicts, effects, every field of the JSON."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest

from onboard.answers import explain_document
from onboard.answers.explain_document import EXPLAIN_SCHEMA
from onboard.core.diagnosis.records import Verdict
from onboard.core.physics.catalogue import kinds

MANUAL = (Path(__file__).resolve().parents[2] / "docs" / "explaining.md").read_text("utf-8")
DOCUMENTS = [
    d
    for d in vars(explain_document).values()
    if isinstance(d, type)
    and issubclass(d, msgspec.Struct)
    and d.__module__ == explain_document.__name__
]


def table(title: str) -> list[list[str]]:
    """Cells of the rows of the table under a heading."""
    found = re.search(rf"^##+ {title}\n(.*?)(?=^##|\Z)", MANUAL, re.MULTILINE | re.DOTALL)
    assert found is not None, title
    rows = re.findall(r"^\| (`.*)\|$", found.group(1), re.MULTILINE)
    return [[cell.strip() for cell in row.split("|")] for row in rows]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.__name__)
def test_it_has_every_field(document):
    told = [row[0].strip("`") for row in table(document.__name__)]
    assert sorted(told) == sorted(f.name for f in msgspec.structs.fields(document))


def test_it_has_every_verdict_and_the_schema():
    assert [row[0].strip("`") for row in table("Verdicts")] == [v.value for v in Verdict]
    assert f'"{EXPLAIN_SCHEMA}"' in MANUAL


def test_it_names_every_effect_as_the_program_does():
    assert [row[:3] for row in table("Effects")] == [
        [f"`{kind.effect}`", kind.title, kind.meaning] for kind in kinds()
    ]
