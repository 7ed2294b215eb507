"""``onboard fleet`` in the terminal: a line for each accelerometer, then the vehicles."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence

from rich.text import Text

from onboard.answers.fleet.history import History
from onboard.answers.fleet.record import Flown, ImuRecord
from onboard.answers.fleet.severity import (
    SAID,
    Severity,
    sentences,
    severity_of,
    shared_sentence,
    state_in_words,
)
from onboard.answers.fleet.shared_numbers import Comparison
from onboard.answers.knowledge import determined
from onboard.core.estimate.result import Calibration, Status

WIDTH = 80
"""Columns of the terminal that the table fits [use: what a terminal has when nobody widens it]."""
NAME = 23
"""Characters of a recording's name; with the other columns, the terminal's width."""
STATE = 15
"""Of the longest state, "missing physics"."""
UNKNOWN = "-"
STATES = {
    Status.CALIBRATED: "green",
    Status.COLLECTING: "yellow",
    Status.INSUFFICIENT: "yellow",
    Status.INVALID: "red",
}
COLOURS = {
    Severity.CONTRADICTED: "red",
    Severity.CHANGED: "yellow",
    Severity.TO_SET: "yellow",
    Severity.UNKNOWN: "",
    Severity.WELL: "green",
}
ROW = f"{{:<{NAME}}} {{:>3}} {{:<{STATE}}} {{:>5}} {{:>6}} {{:>7}} {{:>14}}"
HEAD = ROW.format("recording", "imu", "state", "cover", "scale", "offset", "residual")


def lines(one: Flown) -> Iterator[Text]:
    """One recording."""
    name = _short(one.name)
    if one.record is None:
        yield from _wrapped(f"{name:<{NAME}} {one.error.removeprefix(f'{one.path}: ')}", "red")
    else:
        for imu in one.record.imus:
            yield _line(name, imu)
            name = ""
        for damage in one.record.document.recording.damage:
            yield from _wrapped(f"{'':<{NAME}} damage: {damage}", "yellow")
    for note in one.notes:
        yield from _wrapped(f"{'':<{NAME}} {note}", "yellow")


def vehicle_lines(histories: Sequence[History], compared: Comparison) -> Iterator[Text]:
    """Vehicles with several recordings, the most urgent first, and what types share."""
    order = list(Severity)
    several = [h for h in histories if len(h.vehicle.flights) > 1]
    for h in sorted(several, key=lambda h: (order.index(severity_of(h)), h.vehicle.name)):
        severity = severity_of(h)
        said = f"{h.vehicle.name}, {len(h.vehicle.flights)} recordings: {SAID[severity]}"
        yield from _wrapped(said, COLOURS[severity], 2)
        for sentence in sentences(h):
            yield from _wrapped(f"  {sentence}", "", 4)
    for common in compared.common:
        yield from _wrapped(shared_sentence(common), "", 2)


def _line(name: str, one: ImuRecord) -> Text:
    c = one.calibration
    scale = _largest(c, (0, 1, 2), c.scale, c.in_force_scale)
    offset = _largest(c, (3, 4, 5), c.offset, c.in_force_offset)
    residual = f"{_fixed(c.velocity_rms_before, 2)} -> {_fixed(c.velocity_rms_after, 2)}"
    row = ROW.format(
        name,
        c.imu,
        state_in_words(one),
        f"{c.coverage.percent:.0f} %",
        f"{100.0 * scale:+.2f}" if math.isfinite(scale) else UNKNOWN,
        f"{offset:+.3f}" if math.isfinite(offset) else UNKNOWN,
        residual,
    )
    line = Text(row)
    line.stylize(STATES[c.status], NAME + 5, NAME + 5 + STATE)
    return line


def _largest(
    c: Calibration, which: tuple[int, ...], values: tuple[float, ...], held: tuple[float, ...]
) -> float:
    """The largest change of a known number, with its sign; NaN if none is known."""
    found = determined(c)
    flags = found.known if found is not None else (False,) * 6
    changes = [values[i % 3] - held[i % 3] for i in which if flags[i]]
    return max(changes, key=abs, default=math.nan)


def _short(name: str) -> str:
    return name if len(name) <= NAME else "..." + name[-NAME + 3 :]


def _wrapped(text: str, style: str, indent: int = NAME + 1) -> Iterator[Text]:
    for line in textwrap.wrap(text, WIDTH, subsequent_indent=" " * indent):
        yield Text(line, style=style)


def _fixed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else UNKNOWN
