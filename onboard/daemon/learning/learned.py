"""Where the learner stands after a batch, as it is handed to the loop: frozen."""

from __future__ import annotations

from dataclasses import dataclass, field

from onboard.core.estimate.result import Calibration
from onboard.daemon.learning.flight import JudgedFlight
from onboard.daemon.view.snapshot import TrustView


@dataclass(frozen=True, slots=True)
class News:
    """Something that a person should hear of: kind, sentence, and whether it is a warning."""

    kind: str
    text: str
    warning: bool = False


@dataclass(frozen=True, slots=True)
class Learned:
    """Where the learner stands after a batch.

    ``calibrations`` are of the last flight as it was judged, or of what was flown since then;
    ``flown`` is the answer of the flight that has just ended, if a push waits for it; ``flight``
    the one that was judged, None if none was or a new one is not judged yet; ``diagnosing`` the
    accelerometers of one that is being judged; ``flying``: the end of one is not learned yet.
    """

    calibrations: dict[int, Calibration]
    trust: TrustView
    counters: dict[str, int]
    news: tuple[News, ...] = ()
    flown: dict[int, Calibration] = field(default_factory=dict)
    flight: JudgedFlight | None = None
    diagnosing: tuple[int, ...] = ()
    flying: bool = False
