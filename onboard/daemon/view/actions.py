"""What a person may ask of the service, by whatever way."""

from __future__ import annotations

from typing import Protocol

from onboard.daemon.view.snapshot import Snapshot


class Actions(Protocol):
    """What the service offers to people; each returns one line that says what happened."""

    def snapshot(self) -> Snapshot:
        """Everything, now."""

    async def approve(self, imus: tuple[int, ...], *, despite_diagnosis: bool = False) -> str:
        """Allow the proposed push of these accelerometers (none named: all that wait)."""

    async def reject(self, imus: tuple[int, ...]) -> str:
        """Refuse the proposed push."""

    async def rollback(self, imus: tuple[int, ...]) -> str:
        """Write the values back that were in force before the last push."""

    async def reset(self, imus: tuple[int, ...]) -> str:
        """Forget what was learned."""
