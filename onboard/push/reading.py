"""All six and the accelerometer's id as just read: what they mean to a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from onboard.push import limits
from onboard.push.plan import PushPlan, offset_is_zero


@dataclass(frozen=True, slots=True)
class Reading:
    """``values`` holds the plan's six names and its ``device_id_name``."""

    plan: PushPlan
    values: Mapping[str, float]

    @property
    def right_device(self) -> bool:
        """Whether this is the accelerometer that the plan is for."""
        return self.values[self.plan.device_id_name] == self.plan.vehicle.device_id

    def unlike(self, target: Mapping[str, float]) -> str:
        """What differs from ``target``, in words; empty if nothing does."""
        return ", ".join(
            f"{n} is {self.values[n]:.7g}, not {target[n]:.7g}"
            for n in self.plan.names
            if self.values[n] != target[n]
        )

    @property
    def foreign(self) -> frozenset[str]:
        """Names whose value is neither old nor new: somebody else's, not ours to touch.

        What an autopilot has rounded when it took it from us is ours.
        """
        return frozenset(
            c.name
            for c in self.plan.changes
            if self.values[c.name] != c.before
            and abs(self.values[c.name] - c.wanted) > limits.ROUNDED
        )

    @property
    def left(self) -> frozenset[str]:
        """Names that a roll-back leaves as they are.

        Somebody else's; and, where those together with our old offsets would make all three
        zero (which ArduPilot takes for "never calibrated"), our offsets too.
        """
        foreign = self.foreign
        offsets = self.plan.names[3:]
        before = self.plan.before
        after = tuple(self.values[n] if n in foreign else before[n] for n in offsets)
        if foreign & set(offsets) and offset_is_zero(after):
            ours = {n for n in offsets if self.values[n] != before[n]}
            return foreign | ours
        return foreign

    @property
    def undo_order(self) -> tuple[str, ...]:
        """Names to write back, in a safe order."""
        left = self.left
        order = self.plan.write_order(self.values, undo=True)
        return tuple(n for n in order if n not in left)
