"""The link's state and counters as the snapshot shows them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from onboard.daemon.view.snapshot import (
    EndpointView,
    LinkView,
    MessageRate,
)
from onboard.mavlink.link import Link
from onboard.push.policy import VehicleCondition

SEQUENCE: Final[Mapping[str, str]] = MappingProxyType(
    {"heard": "received", "lost": "lost", "late": "late", "duplicated": "duplicated"}
)
"""Counters that the sequence numbers tell, and what each is for one source."""


def link_view(
    link: Link,
    *,
    condition: VehicleCondition,
    messages: dict[str, MessageRate],
    signed: bool,
    warnings: tuple[str, ...] = (),
) -> LinkView:
    """Health of the link, and who is behind it."""
    autopilot = link.autopilot
    counters: dict[str, int] = {
        "standby": link.presence.standby,
        "foreign": link.presence.foreign,
        "echoed": link.echoed,
        "reboots": link.boot_clock.reboots,
    }
    for connection in link.connections:
        for statistics in connection.statistics():
            for name in ("frames", "bad_bytes", "bad_frames", "bad_signatures", "unknown", "sent"):
                counters[name] = counters.get(name, 0) + getattr(statistics, name)
            for source, numbered in statistics.sources.items():
                # Of the vehicle alone: two ground stations often have one id, whose numbers then
                # go to and fro as if all between them were lost.
                counts = link.presence.source in (None, source)
                for name, field in SEQUENCE.items():
                    told = getattr(numbered, field) if counts else 0
                    counters[name] = counters.get(name, 0) + told
        counters["rationed"] = counters.get("rationed", 0) + connection.refused
        for name in ("dropped", "connects", "failures"):
            counters[name] = counters.get(name, 0) + getattr(connection, name)
    return LinkView(
        state=link.state.value,
        endpoints=tuple(
            EndpointView(
                endpoint=str(connection.endpoint),
                state=connection.state.value,
                reason=connection.last_error,
                tries=connection.outage.tries,
            )
            for connection in link.connections
        ),
        signed=signed,
        warnings=warnings,
        system_id=autopilot.system if autopilot else None,
        component_id=autopilot.component if autopilot else None,
        autopilot=autopilot.firmware_name if autopilot else None,
        vehicle=autopilot.vehicle if autopilot else None,
        armed=condition.armed,
        landed=condition.landed,
        messages=messages,
        counters=counters,
    )
