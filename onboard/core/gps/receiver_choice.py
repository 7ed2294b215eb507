"""Which of several receivers is watched."""

from __future__ import annotations

from onboard.core.gps.limits import GIVEN_UP_S
from onboard.core.inputs.samples import GpsFix


class ReceiverChoice:
    """The receiver named, or the first that is heard from.

    One that has never had a trusted fix is given up for another that has had fixes for
    :data:`~onboard.core.gps.limits.GIVEN_UP_S`; one that has, is not, for sums hold the latency of
    one receiver.
    """

    def __init__(self, receiver: int | None, fix_type: int) -> None:
        """Take the receiver to watch (None: the first) and the least fix type of another one."""
        self.receiver = receiver
        self._fix_type = fix_type
        self._named = self._final = receiver is not None
        self._other: tuple[int, float] | None = None  # another with a fix, and since when

    def settle(self) -> None:
        """The receiver had a trusted fix: it is watched for good."""
        self._final = True

    def begin_anew(self) -> None:
        """Nothing holds the latency of one any more: it may be given up, unless it was named."""
        self._final, self._other = self._named, None

    def has_fix(self) -> None:
        """The receiver has a fix: others count from anew."""
        self._other = None

    def changes_for(self, fix: GpsFix) -> bool:
        """Whether this fix of another receiver makes it the one that is watched."""
        if self._final or fix.fix_type < self._fix_type:
            return False
        if self._other is None or self._other[0] != fix.receiver:
            self._other = (fix.receiver, fix.t)
        if not fix.t - self._other[1] >= GIVEN_UP_S:
            return False
        self.receiver, self._other = fix.receiver, None
        return True
