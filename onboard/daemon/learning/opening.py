"""When an open trust window is told: after the autopilot's filter has had its say.

Fixes and reports of the filter (EKF_STATUS_REPORT) come by themselves.  Where the first fix comes
before the first report, the window opens, and half a second later the report may close it again:
GPS would be called trusted for that moment.  Nothing is learned from it on the ground.  So a window
is told when a report has come since the autopilot's start, or when none is to be expected any more.
"""

from __future__ import annotations

import math

from onboard.core.inputs.samples import EkfHealth, ImuSample, Sample
from onboard.daemon.learning import limits


class Opening:
    """What is known of the filter since the autopilot's start, and whether the window was told."""

    def __init__(self) -> None:
        self.told = False
        """Whether it has been said that GPS is trusted; false again once it is not."""
        self._reported = False
        self._opened = math.inf

    def feed(self, sample: Sample) -> bool:
        """Take what has come, after the window has; whether it is to be told as open now."""
        match sample:
            case EkfHealth():
                self._reported = True
            case ImuSample(t=t):
                self._reported |= t - self._opened > limits.FILTER_SILENT_S
        if self.told or not self._reported or not math.isfinite(self._opened):
            return False
        self.told = True
        return True

    def opened(self, t: float) -> None:
        """The window has opened, s of the autopilot's clock."""
        self._opened = t

    def closed(self) -> bool:
        """The window has closed; whether it had been told as open."""
        told, self.told = self.told, False
        self._opened = math.inf
        return told

    def restarted(self) -> None:
        """Another boot, or another calibrator: its filter has said nothing yet."""
        self.told = self._reported = False
        self._opened = math.inf
