"""Announcer: what a pilot should hear, as STATUSTEXT in the ground station's message window.

A pilot reads at most one line every few seconds, and a telemetry line carries other things: so
events are chosen, worded in at most 50 characters, and paced.  What waits and has been
overtaken (a window that closed again) is never said.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

from onboard.daemon.outlets import limits
from onboard.daemon.view.snapshot import Notice
from onboard.mavlink.dialect import Message, mavlink

TEXT_LENGTH = 50
PREFIX = "OBC: "

ERROR = int(mavlink.MAV_SEVERITY_ERROR)
WARNING = int(mavlink.MAV_SEVERITY_WARNING)
NOTICE = int(mavlink.MAV_SEVERITY_NOTICE)
INFO = int(mavlink.MAV_SEVERITY_INFO)


@dataclass(frozen=True, slots=True)
class Line:
    """How one kind of notice is said.

    ``text`` stands for the notice's own, ``{imu}`` for the accelerometer that it names.  Of
    those that wait, a later line of the same ``topic`` replaces an earlier one; ``pause`` is the
    time (s) between two lines of the topic.
    """

    severity: int
    text: str = ""
    topic: str = ""
    pause: float = 0.0


LINES: Final[Mapping[str, Line]] = MappingProxyType(
    {
        "window_opened": Line(INFO, "GPS trusted, learns in flight", "window", limits.FLAPPING_S),
        "window_closed": Line(NOTICE, "", "window", limits.FLAPPING_S),
        "calibrated": Line(NOTICE),
        "invalid": Line(WARNING),
        "imu_state": Line(NOTICE),
        "imu_stuck": Line(ERROR, "", "stuck {imu}", limits.FLAPPING_S),
        "learner_failed": Line(WARNING, "estimator failed, learns anew"),
        "learner_stopped": Line(ERROR, "estimator failed, this flight is lost"),
        "advise_only": Line(WARNING, "writes nothing, see the status page"),
        "state_refused": Line(WARNING, "saved calibration unusable, starts anew"),
        "push_begins": Line(INFO, "{imu} writing calibration", "push {imu}"),
        "push_completed": Line(NOTICE, "{imu} calibration written", "push {imu}"),
        "push_rolled_back": Line(WARNING, "{imu} write failed, rolled back", "push {imu}"),
        "push_aborted": Line(WARNING, "{imu} not written", "push {imu}"),
        "push_interrupted": Line(ERROR, "{imu} write interrupted", "push {imu}"),
        "push_other_vehicle": Line(ERROR, "open write is of another vehicle", "push {imu}"),
        "push_not_stored": Line(WARNING, "{imu} written values are gone, undoing", "push {imu}"),
        "push_gone": Line(WARNING, "{imu} old values are there again", "push {imu}"),
        "push_mixed": Line(WARNING, "{imu} old and new values mixed", "push {imu}"),
        "half_written": Line(ERROR, "{imu} half a set in force: land, disarm", "half {imu}"),
        "half_written_standing": Line(ERROR, "{imu} half a set in force: do not arm", "half {imu}"),
        "push_resumed": Line(WARNING, "{imu} interrupted write taken up", "push {imu}"),
        "push_kept": Line(INFO, "new calibration flew well"),
        "push_doubted": Line(WARNING, "calibration does not fit this flight"),
        "push_worse": Line(WARNING, "new calibration flew worse, going back"),
        "roll_back_begins": Line(NOTICE, "{imu} rolling back", "push {imu}"),
        "roll_back_completed": Line(NOTICE, "{imu} rolled back", "push {imu}"),
        "roll_back_rolled_back": Line(ERROR, "{imu} roll-back failed", "push {imu}"),
        "roll_back_aborted": Line(WARNING, "{imu} not rolled back", "push {imu}"),
        "roll_back_interrupted": Line(ERROR, "{imu} roll-back interrupted", "push {imu}"),
        "roll_back_not_stored": Line(WARNING, "{imu} values rolled back are back", "push {imu}"),
        "physics_missing": Line(WARNING, "", "physics"),
        "worth_knowing": Line(INFO, "", "physics"),
        "seldom": Line(
            WARNING, "link brings too little to learn from", "seldom", limits.FLAPPING_S
        ),
        "heartbeats_contradict": Line(WARNING, "two speak as the vehicle, not writing"),
        "two_vehicles": Line(WARNING, "two vehicles have one system id, not writing"),
        "flight_lost": Line(WARNING, "last flight was not diagnosed, it is lost"),
        "another_board": Line(WARNING, "another board answers, it starts anew"),
        "rivals": Line(WARNING, "somebody else speaks as the vehicle"),
        "twin": Line(WARNING, "another onboard service is there"),
        "samples_contradict": Line(WARNING, "samples contradict, not writing"),
        "approval_needed": Line(NOTICE, "calibration waits for OBC_APPROVE 1"),
        "approved": Line(NOTICE, "push approved"),
        "parameter_denied": Line(WARNING),
        "parameter_done": Line(INFO),
    }
)
"""By the notice's kind; other kinds are for logs and screens."""

_IMU = re.compile(r"IMU \d")


class _Text(NamedTuple):
    """One line that waits."""

    severity: int
    text: str
    not_before: float


class Announcer:
    """Participant of the link: notices in, STATUSTEXT out.

    Args:
        clock: monotonic time, s, the link's.
    """

    names: tuple[str, ...] = ()

    def __init__(self, clock: Callable[[], float]) -> None:
        self.counters: Counter[str] = Counter()
        self._clock = clock
        self._waiting: dict[str, _Text] = {}
        self._said: dict[str, tuple[str, float]] = {}
        self._not_before = 0.0

    def hear(self, notice: Notice) -> None:
        """Take a notice; whether and when it is said is decided here."""
        line = LINES.get(notice.kind)
        if line is None:
            return
        found = _IMU.search(notice.text)
        imu = found.group() if found else ""
        text = statustext((line.text or notice.text).replace("{imu}", imu).strip())
        topic = line.topic.replace("{imu}", imu) or text
        now = self._clock()
        self._said = {t: said for t, said in self._said.items() if now - said[1] < limits.SILENCE_S}
        if self._waiting.pop(topic, None) is not None:
            self.counters["texts_overtaken"] += 1
        last, at = self._said.get(topic, ("", -math.inf))
        if text == last:
            self.counters["texts_repeated"] += 1
            return
        self._waiting[topic] = _Text(line.severity, text, at + line.pause)
        if len(self._waiting) > limits.WAITING_MAX:
            # The least severe goes, of those the oldest.
            del self._waiting[max(self._waiting, key=self._severity)]
            self.counters["texts_dropped"] += 1

    # What the link calls

    def start(self, system: int, component: int, now: float) -> None:
        """Nothing to do: STATUSTEXT has no target."""

    def feed(self, message: Message, now: float) -> Sequence[Message]:  # noqa: ARG002 - the participants' signature
        """Nothing is asked of an announcer."""
        return ()

    def poll(self, now: float) -> Sequence[Message]:
        """The next line, the most severe first, when it is time for one."""
        if now < self._not_before:
            return ()
        due = [topic for topic, text in self._waiting.items() if text.not_before <= now]
        if not due:
            return ()
        topic = min(due, key=self._severity)
        said = self._waiting.pop(topic)
        self._not_before = now + limits.INTERVAL_S
        self._said[topic] = (said.text, now)
        self.counters["texts"] += 1
        return (mavlink.MAVLink_statustext_message(said.severity, said.text.encode("ascii")),)

    def _severity(self, topic: str) -> int:
        return self._waiting[topic].severity


def statustext(sentence: str) -> str:
    """A sentence as it fits into STATUSTEXT: ASCII, with our prefix, 50 characters at most."""
    text = PREFIX + sentence.encode("ascii", "replace").decode()
    if len(text) <= TEXT_LENGTH:
        return text
    return text[: TEXT_LENGTH - 2].rstrip(" ,;:") + ".."
