"""Parameters, held and spoken as ArduPilot does: float32, silent about the unknown, saved late.

The quirks that a client has to live with, all of them here:

- values pass through float32, integers are truncated to their type; the type field of
  PARAM_SET is ignored;
- an unknown name, a NaN or an infinity gets no answer at all;
- a read-only parameter gets a STATUSTEXT and PARAM_VALUE with the *old* value;
- an accepted value takes effect at once, is saved by a background thread, and only then
  broadcast to every link, with ``param_index`` 65535;
- reads by index answer with the index, reads by name with 65535; lists come a few at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

SAVE_DELAY = 0.03
"""Typical time until the background thread has saved a value, s."""
READ_DELAY = 0.002
NO_INDEX = 65535


class Kind(IntEnum):
    """MAV_PARAM_TYPE of what ArduPilot stores."""

    INT8 = 2
    INT16 = 4
    INT32 = 6
    FLOAT = 9


_INTEGER_RANGE = {Kind.INT8: 2**7, Kind.INT16: 2**15, Kind.INT32: 2**31}


@dataclass(slots=True)
class Parameter:
    """One stored value."""

    name: str
    value: float
    kind: Kind = Kind.FLOAT
    read_only: bool = False


@dataclass(frozen=True, slots=True)
class Value:
    """A PARAM_VALUE to be sent; ``broadcast`` goes to every link."""

    name: str
    value: float
    kind: Kind
    count: int
    index: int
    broadcast: bool = False


@dataclass(frozen=True, slots=True)
class Notice:
    """A STATUSTEXT to every link."""

    text: str
    severity: int = 4


def as_float32(value: float) -> float:
    """The nearest float32, as a Python float."""
    return float(np.float32(value))


class ParameterStore:
    """All parameters of one autopilot.

    ``on_change(name)`` is called when a value that is in force changes.
    """

    def __init__(self, parameters: list[Parameter], on_change: Callable[[str], None]) -> None:
        self._table = {p.name: p for p in parameters}
        self._order = [p.name for p in parameters]
        self._on_change = on_change
        self._saving: list[tuple[float, str]] = []
        for parameter in parameters:
            parameter.value = _cast(parameter.value, parameter.kind)

    def __len__(self) -> int:
        return len(self._order)

    def __contains__(self, name: str) -> bool:
        return name in self._table

    def __getitem__(self, name: str) -> float:
        return self._table[name].value

    @property
    def saving(self) -> bool:
        """Whether something waits to be saved."""
        return bool(self._saving)

    def names(self) -> Iterator[str]:
        """All names in the order of their index."""
        return iter(self._order)

    def vector(self, stem: str) -> tuple[float, float, float]:
        """``stem`` + X, Y, Z."""
        return self[stem + "X"], self[stem + "Y"], self[stem + "Z"]

    def load(self, values: Mapping[str, float]) -> None:
        """Sets values as a defaults file does: no broadcast.

        Raises:
            KeyError: a name that does not exist.
        """
        for name, value in values.items():
            self._table[name].value = _cast(value, self._table[name].kind)
            self._on_change(name)

    def count_boot(self) -> None:
        """One more start; what was not yet saved is saved now, unannounced."""
        self._table["STAT_BOOTCNT"].value += 1.0
        self._saving.clear()

    def set(self, now: float, name: str, value: float) -> tuple[Value | Notice, ...]:
        """PARAM_SET; what has to be sent at once (a saved value follows from :meth:`poll`)."""
        parameter = self._table.get(name)
        if parameter is None or not math.isfinite(value):
            return ()
        if parameter.read_only:
            return (Notice(f"Param write denied ({name})"), self._value(name, NO_INDEX))
        before = parameter.value
        parameter.value = _cast(value, parameter.kind)
        self._saving.append((now + SAVE_DELAY, name))
        if parameter.value != before:
            self._on_change(name)
        return ()

    def poll(self, now: float) -> tuple[Value, ...]:
        """Broadcasts of what has been saved by now."""
        done = [name for due, name in self._saving if due <= now]
        if done:
            self._saving = [(due, name) for due, name in self._saving if due > now]
        return tuple(self._value(name, NO_INDEX, broadcast=True) for name in done)

    def read(self, name: str, index: int) -> Value | None:
        """PARAM_REQUEST_READ; None where ArduPilot stays silent."""
        if index != -1:
            if not 0 <= index < len(self._order):
                return None
            return self._value(self._order[index], index)
        if name not in self._table:
            return None
        return self._value(name, NO_INDEX)

    def by_index(self, index: int) -> Value:
        """One line of a list."""
        return self._value(self._order[index], index)

    def _value(self, name: str, index: int, *, broadcast: bool = False) -> Value:
        p = self._table[name]
        return Value(p.name, p.value, p.kind, len(self._order), index, broadcast)


def _cast(value: float, kind: Kind) -> float:
    """To float32, then to the type stored."""
    value = as_float32(value)
    if kind is Kind.FLOAT:
        return value
    limit = _INTEGER_RANGE[kind]
    return float(min(max(math.trunc(value), -limit), limit - 1))
