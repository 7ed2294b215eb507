"""The recordings of a merged replay one by one, in 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from onboard.answers.answer import FlightAnswer

NAME: Final = 18
"""Letters of a file's name: what six numbers and a chi-square leave of 80 columns [bound]."""
HEADS = ("scale x", "y", "z", "offset x", "y", "z")
UNKNOWN = "-"


def flights(every: Sequence[FlightAnswer]) -> Iterator[RenderableType]:
    """Each recording's own six, sigmas below, and its difference from the others."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("flight", no_wrap=True)
    for head in HEADS:
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("chi2", justify="right", no_wrap=True)
    for f in every:
        c = None if f.given is None else f.given.calibration
        values = (math.nan,) * 6 if c is None else c.scale + c.offset
        sigmas = (math.nan,) * 6 if c is None else c.scale_sigma + c.offset_sigma
        chi_square = f"{f.apart.chi_square:.0f} of {f.apart.dof}" if f.apart.dof else UNKNOWN
        table.add_row(_short(f.name), *_fixed(values), chi_square)
        said = ("counts", "green") if f.counted else ("left out", "yellow")
        said = ("contradicts", "bold red") if f.contradicted else said
        table.add_row(
            Text(f"  {said[0]}", said[1]),
            *(Text(x, "dim") for x in _fixed(sigmas)),
            "",
            end_section=False,
        )
    yield table


def _short(name: str) -> str:
    return name if len(name) <= NAME else "..." + name[-NAME + 3 :]


def _fixed(six: Sequence[float]) -> list[str]:
    return [
        f"{x:.{4 if i < 3 else 3}f}" if math.isfinite(x) else UNKNOWN for i, x in enumerate(six)
    ]
