"""What every result can do: tables, the command's document, the report, its head in a notebook."""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from onboard.api.accelerometer import Row
from onboard.report.files import save
from onboard.report.page import HEAD, PAGE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Document(Protocol):
    """What other programs read."""

    def to_json(self) -> bytes:
        """Indented JSON."""


class Result(ABC):
    """One answer about one or several recordings."""

    __slots__ = ()

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the whole report, one HTML file without script or network; returns its path.

        Raises:
            UsageError: the file cannot be written.
        """
        return save(self._html(PAGE), os.fspath(path))

    def param(self, path: str | os.PathLike[str]) -> Path:
        """Write the parameter file of the command's ``--param``; returns its path.

        Raises:
            UsageError: another autopilot than ArduPilot, or the file cannot be written.
        """
        return save(self._settings(os.fspath(path)), os.fspath(path))

    def to_json(self) -> str:
        """The document that the command writes with ``--json``."""
        return self._document().to_json().decode("utf-8")

    def to_dict(self) -> dict[str, Any]:
        """The same document as plain Python: what is not known is None."""
        found: dict[str, Any] = json.loads(self.to_json())
        return found

    @abstractmethod
    def rows(self) -> list[Row]:
        """A table as plain records, as ``pandas.DataFrame`` takes them; NaN is not known."""

    @abstractmethod
    def plot(self, figure: Figure | None = None) -> Figure:
        """Draw the result with matplotlib (the extra ``plot``)."""

    @abstractmethod
    def _html(self, base: str) -> str:
        """The report, or its head."""

    @abstractmethod
    def _settings(self, file: str) -> str:
        """The text of the parameter file."""

    @abstractmethod
    def _document(self) -> Document:
        """The command's document."""

    def _repr_html_(self) -> str:
        """The head of the report, for a notebook."""
        return self._html(HEAD)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {str(self).partition(chr(10))[0]}>"
