"""Executes the example notebook and stores what its cells show: ``python docs/notebook.py``.

Needs a checkout with the development extras.  Cells are run in order in one namespace, in a folder
of their own; what a cell's last expression gives is stored as a notebook would show it.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

COLOURS = 32
NOTEBOOK = Path(__file__).parent / "notebook.ipynb"
SHOWN = {"text/html": "_repr_html_", "image/png": "_repr_png_"}


def executed(notebook: dict[str, Any], names: dict[str, Any]) -> dict[str, Any]:
    """The notebook with new outputs.

    Args:
        notebook: as its file has it.
        names: the namespace of its cells; what they leave in it stays.
    """
    cells, count = [], 0
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            count += 1
            outputs = _outputs("".join(cell["source"]), names, count)
            cells.append({**cell, "execution_count": count, "outputs": outputs})
        else:
            cells.append(cell)
    return {**notebook, "cells": cells}


def _outputs(source: str, names: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Run one cell."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)  # noqa: S102 - cells of ours
        if isinstance(last, ast.Expr) and not source.rstrip().endswith(";"):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # noqa: S307
        elif last is not None:
            exec(compile(ast.Module([last], []), "cell", "exec"), names)  # noqa: S102
    out: list[dict[str, Any]] = []
    if printed.getvalue():
        out.append({"name": "stdout", "output_type": "stream", "text": _lines(printed.getvalue())})
    if value is not None:
        out.append(
            {
                "data": _shown(value),
                "execution_count": count,
                "metadata": {},
                "output_type": "execute_result",
            }
        )
    return out


def _shown(value: object) -> dict[str, Any]:
    """A value as a notebook shows it, by kind."""
    data: dict[str, Any] = {}
    for kind, method in SHOWN.items():
        made = getattr(value, method, str)()
        if made:  # some say that they have none
            data[kind] = _small(made) if isinstance(made, bytes) else _lines(made)
    return {**data, "text/plain": _lines(repr(value))}


def _small(picture: bytes) -> str:
    """A picture with few colours, as text."""
    file = io.BytesIO()
    few = Image.open(io.BytesIO(picture)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(file, format="png", optimize=True)
    return base64.b64encode(file.getvalue()).decode()


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def main() -> None:
    """Run it and write it."""
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        done = executed(notebook, {})
    NOTEBOOK.write_text(json.dumps(done, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
