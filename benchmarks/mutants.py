"""Do the tests notice?  Small changes, drawn by chance, of a package; each against its tests.

A copy of the project is changed, never the project.  A change that no test fails with is a
survivor: a test is missing, or the change makes no difference.  Every survivor is to be read.
``python -m benchmarks.mutants onboard/push --tests tests/push --count 80 --seed 3``.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

COPIED = ("onboard", "sitl", "tests", "benchmarks", "pyproject.toml")
AHEAD = (
    "pytest",
    "hypothesis",
    "numba",
    "msgspec",
    "asyncio",
    "pymavlink.dialects.v20.ardupilotmega",
    "onboard.core.filter.kernel",
    "onboard.core.estimate.result",
    "sitl.virtual_time",
)
"""Loaded once, for all; nothing of what is changed may be among them."""
LEFT_OUT = ("limits.py", "__init__.py")
"""Numbers chosen by reasons that no test knows."""
SWAPPED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
INVERSE: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """The ``index``-th place of a file at which something can be changed."""

    path: Path
    index: int

    def text(self) -> tuple[str, str]:
        """The changed file, and in words what was changed."""
        tree = ast.parse(self.path.read_text())
        node = list(places(tree))[self.index]
        before = ast.unparse(node).splitlines()[0][:90]
        what = change(node)
        where = f"{self.path}:{getattr(node, 'lineno', 0)}"
        return ast.unparse(ast.fix_missing_locations(tree)), f"{where} {what}: `{before}`"


def places(tree: ast.AST) -> Iterator[ast.AST]:
    """Where something can be changed: no docstrings, no decorators, no annotations."""
    skipped: set[int] = set()
    for node in ast.walk(tree):
        idle: list[ast.AST | None] = []
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            idle = [node]
        elif isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            idle = [*node.decorator_list, getattr(node, "returns", None)]
        elif isinstance(node, ast.arg | ast.AnnAssign):
            idle = [node.annotation]
        skipped.update(id(n) for one in idle if one is not None for n in ast.walk(one))
        if id(node) not in skipped and changeable(node):
            yield node


def changeable(node: ast.AST) -> bool:
    """Whether :func:`change` knows what to do."""
    match node:
        case ast.Compare():
            return type(node.ops[0]) in SWAPPED
        case ast.BinOp() | ast.AugAssign():
            return type(node.op) in INVERSE
        case ast.Constant():
            return isinstance(node.value, bool | int | float)
        case ast.Return():
            return node.value is not None and not isinstance(node.value, ast.Constant)
        case ast.Expr():
            return isinstance(node.value, ast.Call)
    return isinstance(node, ast.BoolOp | ast.If | ast.While | ast.IfExp)


def change(node: ast.AST) -> str:
    """Change it, and say how."""
    match node:
        case ast.Compare():
            node.ops[0] = SWAPPED[type(node.ops[0])]()
            return f"compared with {type(node.ops[0]).__name__}"
        case ast.BoolOp():
            node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            return f"joined with {type(node.op).__name__}"
        case ast.If() | ast.While() | ast.IfExp():
            node.test = ast.UnaryOp(ast.Not(), node.test)
            return "condition turned round"
        case ast.BinOp() | ast.AugAssign():
            node.op = INVERSE[type(node.op)]()
            return f"calculated with {type(node.op).__name__}"
        case ast.Constant(value=bool() as value):
            node.value = not value
            return f"{node.value}"
        case ast.Constant(value=int() | float() as value):
            node.value = value + 1 if isinstance(value, int) else 2.0 * value or 1.0
            return f"{node.value}"
        case ast.Return():
            node.value = ast.Constant(None)
            return "returns None"
        case ast.Expr():
            node.value = ast.Constant(None)
            return "call left out"
    raise TypeError(type(node).__name__)


def fate(tests: list[str], limit_s: float) -> str:
    """What the tests say in a process of its own: killed, killed by time, survived."""
    import pytest

    child = os.fork()
    if child == 0:
        os.setsid()
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        status = 1
        try:
            ignored = "ignore::pytest.PytestAssertRewriteWarning"
            options = ("-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-W", ignored)
            # One file after the other: whatever the first finds, the others need not be read.
            status = next((s for test in tests if (s := pytest.main([*options, test]))), 0)
        finally:
            os._exit(int(status))
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        gone, status = os.waitpid(child, os.WNOHANG)
        if gone:
            return "killed" if status else "survived"
        time.sleep(0.1)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "killed by time"


def play(chosen: argparse.Namespace) -> int:
    """In the copy: every mutant's fate, and how many of each."""
    sys.dont_write_bytecode = True
    for name in AHEAD:
        importlib.import_module(name)
    package = chosen.package.with_suffix("").as_posix().replace("/", ".")
    if early := [name for name in sys.modules if name.startswith(package)]:
        raise SystemExit(f"loaded before it is changed: {early}")
    if (found := fate(chosen.tests, chosen.limit)) != "survived":
        raise SystemExit(f"the tests do not pass without any change ({found})")
    there = chosen.package.rglob("*.py") if chosen.package.is_dir() else (chosen.package,)
    files = sorted(path for path in there if path.name not in LEFT_OUT)
    everywhere = [
        Mutant(path, index)
        for path in files
        for index in range(len(list(places(ast.parse(path.read_text())))))
    ]
    rng = random.Random(chosen.seed)  # noqa: S311 - chance, no secret
    fates: Counter[str] = Counter()
    for mutant in rng.sample(everywhere, min(chosen.count, len(everywhere))):
        original = mutant.path.read_text()
        text, words = mutant.text()
        mutant.path.write_text(text)
        try:
            # Those of its own first.
            own = sorted(chosen.tests, key=lambda test: mutant.path.stem not in test)
            found = fate(own, chosen.limit)
        finally:
            mutant.path.write_text(original)
        fates[found] += 1
        print(f"{found:14} {words}", flush=True)
    print(f"{len(everywhere)} places, {dict(fates)}")
    return 0


def main() -> int:
    """Make the copy, and play there."""
    parser = argparse.ArgumentParser(prog="benchmarks.mutants", description=__doc__)
    parser.add_argument("package", type=Path, help="or one file")
    parser.add_argument("--tests", nargs="+", required=True, help="quick ones first")
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="for one mutant, s")
    parser.add_argument("--in-this-copy", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.in_this_copy:
        return play(chosen)
    with tempfile.TemporaryDirectory() as folder:
        for name in COPIED:
            copy = shutil.copytree if Path(name).is_dir() else shutil.copy
            copy(name, Path(folder) / name)
        again = [sys.executable, "-m", "benchmarks.mutants", *sys.argv[1:], "--in-this-copy"]
        environment = os.environ | {"PYTHONPATH": folder, "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(again, cwd=folder, env=environment, check=False)  # noqa: S603 - ourselves
        return done.returncode


if __name__ == "__main__":
    sys.exit(main())
