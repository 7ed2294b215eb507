"""The recordings of a merged replay one by one, as rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from onboard.answers import words
from onboard.answers.answer import FlightAnswer


def flight_rows(flights: Sequence[FlightAnswer]) -> list[dict[str, Any]]:
    """Each recording's own six, with sigmas, and how far it is from the others."""
    return [_row(f) for f in flights]


def _row(f: FlightAnswer) -> dict[str, Any]:
    c = None if f.given is None else f.given.calibration
    delay = None if c is None else c.timing.get("gps_delay_s")
    cells = [("", "")] * 6
    if c is not None:
        six = zip(
            c.scale + c.offset, c.scale_sigma + c.offset_sigma, (4,) * 3 + (3,) * 3, strict=True
        )
        cells = [(words.fixed(x, digits), words.fixed(s, digits)) for x, s, digits in six]
    return {
        "name": f.name,
        "cells": cells,
        "delay": "" if delay is None else words.seconds(delay.value, delay.sigma),
        "chi_square": f"{f.apart.chi_square:.1f} of {f.apart.dof}" if f.apart.dof else "",
        "state": "counts" if f.counted else "contradicts" if f.contradicted else "left out",
        "kind": "good" if f.counted else "warn",
        "why": "" if f.contradicted or f.counted else f.why,
    }
