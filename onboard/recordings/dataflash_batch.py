"""Some DataFlash records of one format, and what becomes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from onboard.core.inputs.samples import Sample
from onboard.recordings.dataflash_context import Context, Floats
from onboard.recordings.dataflash_formats import Format, Records


@dataclass(frozen=True, slots=True)
class Batch:
    """Some records of one format and their times (n,), s, NaN where not known."""

    form: Format
    records: Records
    t: Floats

    def floats(self, *columns: str) -> list[list[float]]:
        """Columns as lists of Python floats."""
        return [self.form.numbers(self.records, column).tolist() for column in columns]

    def integers(self, column: str, default: int = 0) -> list[int]:
        """An integer column, or a default where the layout has none."""
        if not self.form.has(column):
            return [default] * len(self.records)
        return self.form.integers(self.records, column, default)


Converted = Iterable[Sample | None]
Converter = Callable[[Batch, Context], Converted]


def record_times(form: Format, records: Records) -> Floats | None:
    """(n,) boot time of records, s; None where the layout has no time of its own."""
    if form.has("TimeUS"):
        return form.numbers(records, "TimeUS") / 1e6
    if form.name.startswith("GPS"):
        return form.numbers(records, "T") / 1e3 if form.has("T") else None
    return form.numbers(records, "TimeMS") / 1e3 if form.has("TimeMS") else None
