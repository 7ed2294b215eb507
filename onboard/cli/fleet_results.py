"""Results of a fleet as files: one that cannot be written does not cost the others.

They are the work of hours, so what cannot be written is found before it where that is possible.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ParamSpec

from onboard.answers.fleet.document import fleet_document
from onboard.answers.fleet.history import History
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.shared_numbers import Comparison
from onboard.cli.replay import write_json, write_text
from onboard.errors import UsageError

P = ParamSpec("P")

INDEX = "index.html"
LONGEST_NAME = 200
"""Bytes of a page's name before ``.html``: file systems take 255."""
MOST_SAID = 3
"""Results that are named where they could not be written: a reason of thousands of pages is one."""


class UnreadError(UsageError):
    """Some recordings could not be read; the others are done."""


@dataclass(frozen=True, slots=True)
class Results:
    """Where results are to be.

    Attributes:
        folder: of the pages; None: none are wanted.
        parquet: the table.
        json: the document, ``-`` for standard output.
        places: the page of each recording, by its name.
        pages: those that were written.
        lost: why those that were not were not.
    """

    folder: Path | None
    parquet: Path | None
    json: str | None
    places: dict[str, str]
    pages: dict[str, str] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)

    def page(self, name: str, packed: bytes) -> None:
        """Write the report of a recording, packed by gzip."""
        if self.folder is None:
            return
        text, place = gzip.decompress(packed).decode(), self.places[name]
        if self._written(write_text, text, str(self.folder / place)):
            self.pages[name] = place

    def write(
        self, done: Sequence[Flown], histories: Sequence[History], compared: Comparison
    ) -> None:
        """Write the index of the pages, the table and the document, those that are asked for.

        Raises:
            UsageError: a result could not be written, or a recording not be read; names them.
        """
        if self.folder is not None:
            from onboard.report.fleet import fleet_html

            index = fleet_html(done, histories, compared, self.pages)
            self._written(write_text, index, str(self.folder / INDEX))
        if self.parquet is not None:
            from onboard.batches.table import write_parquet

            self._written(write_parquet, done, histories, self.parquet)
        if self.json is not None:
            self._written(
                write_json, fleet_document(done, histories, compared).to_json(), self.json
            )
        self._complete(sum(bool(one.error) for one in done), len(done))

    def _written(self, write: Callable[P, object], *args: P.args, **more: P.kwargs) -> bool:
        try:
            write(*args, **more)
        except UsageError as error:
            self.lost.append(str(error))
            return False
        return True

    def _complete(self, failed: int, recordings: int) -> None:
        more = ["..."] if len(self.lost) > MOST_SAID else []
        said = "; ".join([*self.lost[:MOST_SAID], *more])
        if failed and said:
            raise UnreadError(f"{said}; {failed} of {recordings} recordings could not be read")
        if failed:
            raise UnreadError(f"{failed} of {recordings} recordings could not be read")
        if said:
            raise UsageError(said)


def pages_of(names: Sequence[str]) -> dict[str, str]:
    """The file of each recording's report, beside the index, by the name of the recording."""
    out: dict[str, str] = {}
    taken = {INDEX}
    for name in names:
        plain = "-".join(part for part in Path(name).parts if part != Path(name).anchor)
        plain = plain.encode("utf-8", "replace")[-LONGEST_NAME:].decode("utf-8", "ignore")
        page, n = f"{plain}.html", 2
        while page in taken:
            page, n = f"{plain}-{n}.html", n + 1
        taken.add(page)
        out[name] = page
    return out
