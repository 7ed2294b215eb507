"""What one has to see while flying: a snapshot that fits a terminal of 80x24."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from onboard.cli.happened import happened
from onboard.cli.panel import decimal, duration, gps, headline, last_push, residual, when, who
from onboard.core.estimate.result import SIX_NAMES
from onboard.daemon.view.snapshot import ImuView, Snapshot

JOURNAL_LINES = 2
ROOMY = 2
"""Of more accelerometers the numbers come before the journal."""
ROWS = 4
WARNINGS = 2
"""What is wrong on the wire takes no more lines than that: the page has all of it."""
LEAST = 3
"""Lines above all accelerometers, however many there are."""
IMU_LINES = 4
"""Of an accelerometer, besides the rows of its table."""


def compact(snapshot: Snapshot, height: int) -> RenderableType:
    """As much as fits into ``height`` lines: 24 hold all of two accelerometers."""
    top = [_vehicle(snapshot), gps(snapshot)]
    if snapshot.mode != "active":
        top.append(Text(f"{snapshot.mode}: {snapshot.mode_reason}", style="yellow"))
    top += [Text(f"warning: {said}", style="yellow") for said in snapshot.link.warnings[:WARNINGS]]
    bottom = [_push(snapshot)]
    if len(snapshot.imus) <= ROOMY:
        bottom += [when(line) for line in happened(snapshot)[-JOURNAL_LINES:]]
    bottom.append(Text("Ctrl-C ends it; --full shows everything", style="dim"))
    spare = height - len(bottom) - len(snapshot.imus) * (IMU_LINES + 2)
    top = top[: max(spare, LEAST)]
    each = (height - len(top) - len(bottom)) // max(len(snapshot.imus), 1)
    rows = min(max(each - IMU_LINES, 1), ROWS)
    imus = [_imu(snapshot, imu, rows) for imu in snapshot.imus]
    return Group(*map(_line, top), *imus, *map(_line, bottom))


def _imu(snapshot: Snapshot, imu: ImuView, rows: int) -> RenderableType:
    """One accelerometer: its state, what to do, and the six numbers side by side."""
    c = imu.calibration
    table = Table(box=None, padding=(0, 1), show_edge=False, pad_edge=False)
    table.add_column("", width=9, no_wrap=True)
    for name in SIX_NAMES:
        table.add_column(name, justify="right", width=9, no_wrap=True)
    in_force = imu.in_force_scale + imu.in_force_offset
    covered = [imu.coverage.per_parameter.get(name, 0.0) for name in SIX_NAMES]
    lines = (
        ("in force", [decimal(v if imu.parameters_known else None) for v in in_force]),
        ("estimate", [decimal(v) for v in c.scale + c.offset]),
        ("coverage", [f"{v:.0f} %" for v in covered]),
        ("sigma", [decimal(v) for v in c.scale_sigma + c.offset_sigma]),
    )
    for name, values in lines[:rows]:
        table.add_row(name, *values)
    head = headline(imu, residual(imu, last_push(snapshot, imu.imu)))
    then = f"next: {imu.state.next}" if imu.state.next else imu.state.sentence
    return Group(Text(), _line(head), _line(Text(then, style="dim")), table)


def _vehicle(snapshot: Snapshot) -> Text:
    text = Text("onboard ", style="bold")
    text.append(f"{snapshot.version}, up {duration(snapshot.uptime_s)}; ", style="default")
    if snapshot.link.system_id is None:
        return text.append("no autopilot heard yet", style="yellow")
    return text.append(who(snapshot), style="default")


def _push(snapshot: Snapshot) -> Text:
    text = Text("push ", style="bold")
    return text.append(f"policy {snapshot.push.policy}, {snapshot.push.state}", style="default")


def _line(text: Text) -> Text:
    """Cut where the terminal ends: a second line would push the last one out."""
    text.no_wrap, text.overflow = True, "ellipsis"
    return text
