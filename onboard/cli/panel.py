"""A snapshot as a few tables that fit 80 columns."""

from __future__ import annotations

import time
from collections.abc import Mapping

from rich import box
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from onboard.answers.words import DISTRUST
from onboard.cli.happened import Line, happened
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.view.snapshot import DATED_FROM, AccountView, ImuView, Snapshot, WrittenView

JOURNAL_LINES = 5
NOT_SEEN = {"no": "not seen yet", "together": "with its axis"}
STYLES = {"good": "bold green", "info": "bold", "warning": "bold yellow", "error": "bold red"}
"""By severity of a state."""


def panel(snapshot: Snapshot) -> RenderableType:
    """Everything at a glance: link, GPS, accelerometers, push."""
    parts: list[RenderableType] = [_head(snapshot)]
    parts += [_imu(snapshot, imu) for imu in snapshot.imus]
    parts.append(_push(snapshot))
    return Group(*parts)


def headline(imu: ImuView, more: str) -> Text:
    """Who, its state, and something more."""
    head = Text(f"IMU {imu.imu}: ", style="bold")
    head.append(imu.state.title, style=STYLES.get(imu.state.severity, "default"))
    return head.append(f"; {more}" if more else "", style="default")


def residual(imu: ImuView, written: WrittenView | None) -> str:
    """Velocity residual: what the last push has brought, else what a push would bring."""
    before, after = imu.velocity_rms_before_m_s, imu.velocity_rms_after_m_s
    what = "residual"
    if written is not None and written.velocity_rms_before_m_s is not None:
        before, what = written.velocity_rms_before_m_s, "residual through the last push"
        after = written.next_velocity_rms_m_s or written.velocity_rms_after_m_s
    if before is None or after is None:
        return ""
    return f"{what} {before:.2f} -> {after:.2f} m/s"


def last_push(snapshot: Snapshot, imu: int) -> WrittenView | None:
    """The push of an accelerometer that is in force."""
    return next((w for w in snapshot.push.written if w.imu == imu and w.in_force), None)


def who(snapshot: Snapshot) -> str:
    """The autopilot and its state."""
    link = snapshot.link
    flags = [
        {True: "armed", False: "disarmed", None: "arming unknown"}[link.armed],
        *({True: ["landed"], False: ["in the air"], None: []}[link.landed]),
    ]
    return f"{link.autopilot} {link.vehicle}, system {link.system_id}, {link.state}, " + (
        ", ".join(flags)
    )


def gps(snapshot: Snapshot) -> Text:
    """Whether GPS is trusted, and why not."""
    trust = snapshot.trust
    text = Text("GPS ", style="bold")
    if trust.open:
        text.append("trusted", style="green")
    elif not (reasons := trust.reasons or ((trust.reason,) if trust.reason else ())):
        text.append("not judged yet")
    else:
        why = ", ".join(DISTRUST.get(reason, reason) for reason in reasons)
        text.append(f"not trusted: {why}", style="yellow")
    return text.append(f"; {duration(trust.trusted_s)} used so far", style="default")


def _head(snapshot: Snapshot) -> Table:
    link = snapshot.link
    table = Table.grid(padding=(0, 1))
    table.add_column(style="bold", width=9)
    table.add_column(max_width=70, overflow="fold")
    table.add_row(
        "onboard", f"{snapshot.version}, {snapshot.phase}, up {duration(snapshot.uptime_s)}"
    )
    said = who(snapshot)
    if link.system_id is None:
        said = f"{link.state}: " + ", ".join(
            f"{e.endpoint} ({e.reason or e.state})" for e in link.endpoints
        )
    table.add_row("autopilot", escape(said))
    if snapshot.mode != "active":
        table.add_row("mode", Text(f"{snapshot.mode}: {snapshot.mode_reason}", style="yellow"))
    rates = [
        f"{name} {rate.rate_hz:.0f} Hz"
        for name, rate in sorted(link.messages.items())
        if name
        in {"RAW_IMU", "HIGHRES_IMU", "SCALED_IMU2", "SCALED_IMU3", "ATTITUDE", "GPS_RAW_INT"}
        and rate.count
    ]
    table.add_row("messages", ", ".join(rates) or "none yet")
    table.add_row("GPS", gps(snapshot)[4:])
    for sentence in link.warnings:
        table.add_row("warning", Text(sentence, style="yellow"))
    return table


def _imu(snapshot: Snapshot, imu: ImuView) -> RenderableType:
    table = Table(box=None, padding=(0, 1), title_justify="left", title_style="bold")
    for name, justify in (
        ("parameter", "left"),
        ("in force", "right"),
        ("estimate", "right"),
        ("sigma", "right"),
        ("coverage", "right"),
        ("", "left"),
    ):
        table.add_column(name, justify="right" if justify == "right" else "left", no_wrap=True)
    names = parameter_names(imu.imu).six
    c = imu.calibration
    in_force = imu.in_force_scale + imu.in_force_offset
    values = c.scale + c.offset
    sigmas = c.scale_sigma + c.offset_sigma
    for i, name in enumerate(names):
        table.add_row(
            name,
            decimal(in_force[i]) if imu.parameters_known else "?",
            decimal(values[i]),
            decimal(sigmas[i]),
            f"{imu.coverage.per_parameter.get(SIX_NAMES[i], 0.0):.0f} %",
            NOT_SEEN.get(c.known[i], ""),
        )
    share = f"coverage {imu.coverage.percent:.0f} %"
    parts: list[RenderableType] = [Text(), headline(imu, share), _below(imu.state.sentence)]
    if imu.state.next:
        parts.append(_below(f"next: {imu.state.next}"))
    reasons = _held_back(snapshot, imu.imu)
    if len(reasons) > 1:
        parts.append(_below(f"not written now: {'; '.join(reasons)}"))
    parts.append(table)
    if change := residual(imu, None):
        parts.append(_below(f"{change} (parameters in force -> estimate)"))
    written = last_push(snapshot, imu.imu)
    if written is not None:
        parts.append(_written(written))
    return Group(*parts)


def _below(sentence: str, style: str = "") -> RenderableType:
    """A sentence under a heading, with all of its lines indented."""
    return Padding(Text(sentence, style=style), (0, 0, 0, 1), expand=False)


def _held_back(snapshot: Snapshot, imu: int) -> list[str]:
    """Every reason why its values are not written now."""
    return [why for p in snapshot.push.proposals if p.imu == imu for why in p.held_back.values()]


def _written(written: WrittenView) -> RenderableType:
    """What the last push has changed, and what it has brought."""
    parts: list[RenderableType] = [_below(f"written {_moment(written.at)}:")]
    if written.account is not None:
        parts += _told(written.account)
    parts.append(changes(written))
    rows = (
        ("velocity residual", written.velocity_rms_before_m_s, written.velocity_rms_after_m_s),
        ("held-out residual", written.held_out_before, written.held_out_after),
    )
    for what, before, after in rows:
        if before is not None and after is not None:
            unit = " m/s" if what.startswith("velocity") else " (1 is noise)"
            parts.append(_below(f"{what} {before:.3g} before, {after:.3g} with these{unit}"))
    if written.verdict is None:
        parts.append(_below("the next flight has not judged it yet", style="dim"))
    else:
        seen = written.next_velocity_rms_m_s
        found = "" if seen is None else f"; velocity residual {seen:.3g} m/s"
        parts.append(_below(f"the flight after it: {written.verdict_sentence}{found}"))
    return Group(*parts)


def _told(account: AccountView) -> list[RenderableType]:
    """What was wrong, what was written, what it improved, what to do next."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for question, sentence in (
        (" was wrong", account.wrong),
        (" was written", account.written),
        (" improved", account.improved),
        (" to do next", account.next),
    ):
        table.add_row(question, Text(sentence))
    return [table]


def changes(written: WrittenView, now: Mapping[str, float] | None = None) -> Table:
    """Old and new values of a push; with what is in force ``now``, by name: of the way back."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    headings = ("before", "written") if now is None else ("in force", "to be written")
    for name in ("parameter", *headings):
        table.add_column(name, justify="left" if name == "parameter" else "right", no_wrap=True)
    for value in written.values:
        pair = (value.before, value.written)
        if now is not None:
            pair = (now.get(value.name, value.written), value.before)
        table.add_row(value.name, *(f"{v:.5f}" for v in pair))
    return table


def _push(snapshot: Snapshot) -> RenderableType:
    push = snapshot.push
    text = Text("\npush ", style="bold")
    text.append(f"policy {push.policy}, {push.state}", style="default")
    if push.approval_needed:
        text.append("; approve with `onboard approve`", style="bold yellow")
    lines: list[RenderableType] = [text]
    for one in push.unfinished:
        told = f"IMU {one.imu}: {one.sentence}" + (f"; {one.next}" if one.next else "")
        lines.append(_below(told, style="" if one.half is False else "bold red"))
    if push.last_outcome:
        lines.append(_below(f"last: {push.last_outcome}"))
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for line in happened(snapshot)[-JOURNAL_LINES:]:
        table.add_row(f" {clock(line.at)}", line.text, style=_style(line))
    return Group(*lines, table)


def when(line: Line) -> Text:
    """A line of what has happened."""
    return Text(f" {clock(line.at)}  {line.text}", style=_style(line))


def _style(line: Line) -> str:
    return "yellow" if line.warning else "dim"


def clock(at: float) -> str:
    """A moment of today; of a companion whose clock was not set nobody knows it."""
    return time.strftime("%H:%M:%S", time.localtime(at)) if at >= DATED_FROM else "--:--:--"


def _moment(at: float) -> str:
    if at < DATED_FROM:
        return "(date not known)"
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(at))


def decimal(value: float | None) -> str:
    """One of the six numbers."""
    return "?" if value is None else f"{value:.5f}"


def duration(seconds: float) -> str:
    """As people say it."""
    minutes, s = divmod(int(seconds), 60)
    hours, m = divmod(minutes, 60)
    if hours:
        return f"{hours} h {m} min"
    return f"{m} min {s} s" if m else f"{s} s"
