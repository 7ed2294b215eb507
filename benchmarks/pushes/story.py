"""What happened in one history, line by line."""

from __future__ import annotations

from typing import NoReturn

from benchmarks.pushes.faults import Script
from benchmarks.pushes.vehicle import Agenda


class BrokenRuleError(AssertionError):
    """A rule did not hold; the text says which, and when."""


class Story:
    """The lines of a script, each with its time."""

    def __init__(self, script: Script, agenda: Agenda) -> None:
        self._script, self._agenda = script, agenda

    def say(self, text: str) -> None:
        """Add a line."""
        self._script.lines.append(self._at(text))

    def broken(self, what: str) -> NoReturn:
        """End it, for a rule does not hold.

        Raises:
            BrokenRuleError: always.
        """
        told = "\n".join(self._script.lines)
        raise BrokenRuleError(f"{self._script}\n\n{told}\n{self._at(f'RULE: {what}')}")

    def _at(self, text: str) -> str:
        return f"{self._agenda.now:8.3f} s  {text}"
