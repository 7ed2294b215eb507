"""Hang-ups: a broker that ends connections has no words for why (MQTT 3.1.1), but ways of doing it.

At a packet that is too large for it; and at every connection as soon as another client comes that
has the same id, which is then hung up on as soon as this one is back.
"""

from __future__ import annotations

from onboard.daemon.mqtt import limits
from onboard.daemon.mqtt.outbox import Parcel


class HangUps:
    """What the last connections that the broker has ended have in common."""

    def __init__(self) -> None:
        self._largest = 0
        self._topic = ""
        self._times = 0
        self._short = 0

    def confirmed(self, parcel: Parcel) -> None:
        """The broker has taken this one."""
        self._largest = max(self._largest, len(parcel.payload))

    def absent(self) -> None:
        """A connection could not be made at all: whatever ended those before may be over."""
        self._topic, self._times, self._short = "", 0, 0

    def take(self, under_way: Parcel | None, lasted_s: float) -> bool:
        """One more; whether it is at this parcel, time and again, and at none as large before.

        Args:
            under_way: what was sent and not confirmed.
            lasted_s: how long the connection was good, s.
        """
        self._short = self._short + 1 if lasted_s < limits.LASTING_S else 0
        larger = under_way is not None and len(under_way.payload) > self._largest
        topic = under_way.topic if under_way is not None and larger else ""
        self._times = self._times + 1 if topic == self._topic else 1
        self._topic = topic
        return bool(topic) and self._times >= limits.HANG_UPS

    @property
    def again_and_again(self) -> bool:
        """Whether no connection lasts."""
        return self._short >= limits.HANG_UPS
