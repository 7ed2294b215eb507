"""The snapshot in a few lines, for a wall display or an automation: topic ``summary``."""

from __future__ import annotations

import msgspec

from onboard.daemon.view.snapshot import Record, Snapshot

SUMMARY_SCHEMA = "onboard.summary/1"
GRAVITY = ("good", "info", "warning", "error")


class SummaryImu(Record, frozen=True, kw_only=True):
    """One accelerometer: its state by name and in words, how much of the six is covered, %."""

    imu: int
    state: str
    title: str
    severity: str
    percent: int


class SummaryMessage(Record, frozen=True, kw_only=True):
    """What a person wants to know at a glance.

    ``state`` and ``title`` are of the accelerometer whose state is gravest, or of the link where
    there is no accelerometer yet; ``next`` is what to do, empty where there is nothing.
    """

    system_id: int | None
    link: str
    armed: bool | None
    gps_trusted: bool
    trusted_s: int
    state: str
    title: str
    severity: str
    next: str
    approval_needed: bool
    imus: tuple[SummaryImu, ...]
    schema: str = SUMMARY_SCHEMA


def summary(snapshot: Snapshot) -> SummaryMessage:
    """The document of topic ``summary``."""
    imus = tuple(
        SummaryImu(
            imu=view.imu,
            state=view.state.name,
            title=view.state.title,
            severity=view.state.severity,
            percent=round(view.coverage.percent),
        )
        for view in snapshot.imus
    )
    gravest = max(imus, key=lambda imu: GRAVITY.index(imu.severity), default=None)
    link, step = snapshot.link, snapshot.next_step
    half = any(one.half for one in snapshot.push.unfinished)
    alone = "half_written" if half else link.state
    return SummaryMessage(
        system_id=link.system_id,
        link=link.state,
        armed=link.armed,
        gps_trusted=snapshot.trust.open,
        trusted_s=round(snapshot.trust.trusted_s),
        state=alone if gravest is None else gravest.state,
        title=alone.replace("_", " ") if gravest is None else gravest.title,
        severity=("error" if half else "info") if gravest is None else gravest.severity,
        next="" if step is None else step.text,
        approval_needed=snapshot.push.approval_needed,
        imus=imus,
    )


def summary_message(snapshot: Snapshot) -> bytes:
    """The same as UTF-8 JSON."""
    return msgspec.json.encode(summary(snapshot))
