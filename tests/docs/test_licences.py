"""The list of licences is of what is really needed, and says what the packages themselves say."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KNOWN = {"MIT", "BSD-2-Clause", "BSD-3-Clause", "0BSD", "Apache-2.0", "PSF-2.0", "Zlib", "CC0-1.0",
         "LGPL-3.0", "EPL-2.0", "LLVM-exception"}  # fmt: skip


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", ROOT / "docs" / "licences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_is_what_is_installed(licences):
    manual = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    assert licences.table() in manual


def test_no_licence_is_of_a_kind_that_nobody_has_looked_at(licences):
    for name, distribution in licences.needed().items():
        words = licences.licence(distribution).replace("(", " ").replace(")", " ").split()
        assert words, name
        assert set(words) - {"AND", "OR", "WITH"} <= KNOWN, name
