"""What the program can say to a person, read from its own source.

A message is the fixed parts of a string in order; what is filled in between is left out.
"""

from __future__ import annotations

import ast
import functools
import re
from pathlib import Path

import onboard
from onboard import errors

ROOT = Path(onboard.__file__).parent
Message = tuple[str, ...]
FEWEST_LETTERS = 4
OWN = {"EndpointError", "UnreadError", "DemoError"}
"""Errors outside the tree's file; each is a subclass of one in it."""


@functools.cache
def nodes() -> tuple[tuple[Path, tuple[ast.Raise | ast.Call, ...]], ...]:
    """What may say something, by file; read once."""
    return tuple(
        (path, tuple(n for n in ast.walk(tree) if isinstance(n, ast.Raise | ast.Call)))
        for path in sorted(ROOT.rglob("*.py"))
        for tree in [ast.parse(path.read_text(encoding="utf-8"))]
    )


def fixed(node: ast.expr) -> Message:
    """The constant parts of a string or f-string, without those that say nothing."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        parts = [node.value]
    elif isinstance(node, ast.JoinedStr):
        parts = [str(p.value) for p in node.values if isinstance(p, ast.Constant)]
    else:
        return ()
    told = (" ".join(part.replace("`", "").split()).strip(" :;,()'[]") for part in parts)
    return tuple(t for t in told if len(re.findall("[A-Za-z]", t)) >= FEWEST_LETTERS)


def raised() -> dict[Message, str]:
    """One-line errors: first argument of whatever is raised from the tree of errors."""
    names = {n for n, v in vars(errors).items() if isinstance(v, type)} | OWN
    found: dict[Message, str] = {}
    for path, sayings in nodes():
        for node in sayings:
            if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)):
                continue
            function = node.exc.func
            configured = path.name == "configuration.py"  # there, what is ValueError is explained
            name = getattr(function, "id", "")
            if (name in names or (configured and name == "ValueError")) and node.exc.args:
                message = fixed(node.exc.args[0])
                if message:
                    found[message] = f"{path.relative_to(ROOT)}:{node.lineno}"
    return found


def posted() -> dict[str, set[Message]]:
    """Notices by kind, where kind and text are written in one place."""
    found: dict[str, set[Message]] = {}
    for _, sayings in nodes():
        for node in sayings:
            if not (isinstance(node, ast.Call) and len(node.args) >= 2):
                continue
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            kind = node.args[0]
            if name in {"post", "_tell"} and isinstance(kind, ast.Constant):
                message = fixed(node.args[1])
                if message:
                    found.setdefault(str(kind.value), set()).add(message)
    return found


def objections() -> dict[str, Message]:
    """Reasons why nothing is written now."""
    path = ROOT / "push" / "policy.py"
    found: dict[str, Message] = {}
    tree = ast.parse(path.read_text(encoding="utf-8"))
    sentences: dict[str, ast.expr] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "sentence":
            sentences[str(node.lineno)] = node.value
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "_no":
            which, said = node.args
            name = which.attr if isinstance(which, ast.Attribute) else ""
            found[name] = fixed(said)
    return found


def told(message: Message, entry: str) -> bool:
    """Whether an entry of a manual has all fixed parts, in order."""
    at = 0
    for part in message:
        at = entry.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True
