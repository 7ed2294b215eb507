"""A snapshot as a few tables that fit 80 columns."""

from __future__ import annotations

import time

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from onboard.core.accelerometer import parameter_names
from onboard.core.result import SIX_NAMES
from onboard.daemon.snapshot import ImuView, ProposalView, Snapshot

JOURNAL_LINES = 5
STATUS_STYLE = {"calibrated": "bold green", "collecting": "yellow", "invalid": "bold red"}


def panel(snapshot: Snapshot) -> RenderableType:
    """Everything at a glance: link, GPS, accelerometers, push."""
    parts: list[RenderableType] = [_head(snapshot)]
    parts += [_imu(snapshot, imu) for imu in snapshot.imus]
    parts.append(_push(snapshot))
    return Group(*parts)


def _head(snapshot: Snapshot) -> Table:
    link, trust = snapshot.link, snapshot.trust
    table = Table.grid(padding=(0, 1))
    table.add_column(style="bold", width=9)
    table.add_column(max_width=70)
    table.add_row(
        "onboard", f"{snapshot.version}, {snapshot.phase}, up {_duration(snapshot.uptime_s)}"
    )
    if link.system_id is None:
        who = f"{link.state}: " + ", ".join(
            f"{e.endpoint} ({e.reason or e.state})" for e in link.endpoints
        )
    else:
        flags = [
            {True: "armed", False: "disarmed", None: "arming unknown"}[link.armed],
            *({True: ["landed"], False: ["in the air"], None: []}[link.landed]),
        ]
        who = f"{link.autopilot} {link.vehicle}, system {link.system_id}, {link.state}, " + (
            ", ".join(flags)
        )
    table.add_row("autopilot", escape(who))
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
    gps = Text("trusted", style="green")
    if not trust.open:
        why = ", ".join(trust.reasons) or trust.reason or "nothing heard yet"
        gps = Text(f"not trusted: {why}", style="yellow")
    gps.append(f"; {_duration(trust.trusted_s)} used so far", style="default")
    table.add_row("GPS", gps)
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
            _decimal(in_force[i]) if imu.parameters_known else "?",
            _decimal(values[i]),
            _decimal(sigmas[i]),
            f"{imu.coverage.per_parameter.get(SIX_NAMES[i], 0.0):.0f} %",
            "" if c.observable[i] else "not seen yet",
        )
    head = Text(f"\nIMU {imu.imu}: ", style="bold")
    head.append(imu.status, style=STATUS_STYLE.get(imu.status, "default"))
    head.append(f", coverage {imu.coverage.percent:.0f} %", style="default")
    residual = (imu.velocity_rms_before_m_s, imu.velocity_rms_after_m_s)
    if residual[0] is not None and residual[1] is not None:
        head.append(f", residual {residual[0]:.2f} -> {residual[1]:.2f} m/s", style="default")
    parts: list[RenderableType] = [head, table]
    if imu.coverage.advice and imu.status != "calibrated":
        parts.append(Text(f" next: {imu.coverage.advice}"))
    if c.note:
        parts.append(Text(f" {c.note}", style="dim"))
    proposal = next((p for p in snapshot.push.proposals if p.imu == imu.imu), None)
    if proposal is not None and "not_calibrated" not in proposal.held_back:
        parts.append(_proposal(proposal))
    return Group(*parts)


def _proposal(proposal: ProposalView) -> Text:
    if "nothing_to_change" in proposal.held_back:
        return Text(" the autopilot has these values: nothing to write", style="green")
    changed = sum(change.before != change.after for change in proposal.changes)
    text = Text(f" push of {changed} values ", style="bold")
    if not proposal.held_back:
        return text.append("is about to be made", style="green")
    text.append("waits: ", style="yellow")
    return text.append("; ".join(proposal.held_back.values()), style="default")


def _push(snapshot: Snapshot) -> RenderableType:
    push = snapshot.push
    text = Text("\npush ", style="bold")
    text.append(f"policy {push.policy}, {push.state}", style="default")
    if push.approval_needed:
        text.append("; approve with `onboard approve`", style="bold yellow")
    if push.last_outcome:
        text.append(f"\n last: {push.last_outcome}", style="default")
    lines: list[RenderableType] = [text]
    lines += [
        Text(f" {time.strftime('%H:%M:%S', time.localtime(line.at))}  {line.text}", style="dim")
        for line in snapshot.journal[-JOURNAL_LINES:]
    ]
    return Group(*lines)


def _decimal(value: float | None) -> str:
    return "?" if value is None else f"{value:.5f}"


def _duration(seconds: float) -> str:
    minutes, s = divmod(int(seconds), 60)
    hours, m = divmod(minutes, 60)
    if hours:
        return f"{hours} h {m} min"
    return f"{m} min {s} s" if m else f"{s} s"
