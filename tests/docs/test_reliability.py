"""Every test that the manual names to hold an attack is there."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"`(tests/[a-z_/]+\.py)(?:::(\w+))?`")


def defined(file):
    tree = ast.parse(file.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return {node.name for node in ast.walk(tree) if isinstance(node, kinds)}


def test_the_tests_that_are_named_exist():
    found = 0
    for manual in ("reliability.md", "threat-model.md"):
        for path, name in NAMED.findall((ROOT / "docs" / manual).read_text(encoding="utf-8")):
            file = ROOT / path
            assert file.is_file(), path
            assert not name or name in defined(file), f"{path}::{name}"
            found += 1
    assert found > 40
