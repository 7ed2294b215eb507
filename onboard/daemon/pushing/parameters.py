"""The autopilot's parameters that the service lives by: read at the start, then watched.

Sans-IO participant of the link.  The values themselves reach the estimator as samples, like
any PARAM_VALUE; this only causes them, and knows what is still missing.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Mapping, Sequence

from onboard.core.inputs import views
from onboard.core.inputs.parameters import receiver_names
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.pushing import limits
from onboard.mavlink.dialect import COMPONENT, Message, mavlink
from onboard.mavlink.parameter_messages import (
    SendAction,
    ValueReceived,
    parameter_event,
    parameter_message,
)
from onboard.mavlink.parameters import (
    Failure,
    ParameterClient,
    ReadFailed,
    ValueChanged,
    ValueRead,
)
from onboard.mavlink.twofold import TELLING, Twofold
from onboard.push.policy import context_names

logger = logging.getLogger(__name__)

IMUS = (1, 2, 3)
"""MAVLink has messages for three accelerometers."""
REQUIRED = tuple(
    name for imu in IMUS for name in (*parameter_names(imu).six, parameter_names(imu).device_id)
)
FIRST = REQUIRED[:7]
MEANING = (
    "AHRS_ORIENTATION",
    "AHRS_EKF_TYPE",
    "AHRS_EKF_USE",
    "AHRS_RP_P",
    "AHRS_TRIM_X",
    "AHRS_TRIM_Y",
    "AHRS_TRIM_Z",
    "INS_ACCEL_FILTER",
    "INS_GYRO_FILTER",
    *dict.fromkeys(name for imu in IMUS for name in context_names(imu)),
)
"""Change what the messages mean or what may be written; not every firmware has all."""
KNOWLEDGE = (
    *(name for receiver in (1, 2) for names in receiver_names(receiver).values() for name in names),
    *(f"INS_POS{imu}_{axis}" for imu in IMUS for axis in "XYZ"),
    *(parameter_names(imu).gyro_id for imu in IMUS),
    "EK3_IMU_MASK",
    "EK3_PRIMARY",
    *sorted(views.ASKED),
    *TELLING,
)
"""Good to have, in a recording too; under one of two names, by version; the last ones of planes."""
NEEDED = frozenset((*REQUIRED, *MEANING, *KNOWLEDGE))


class ParameterWatch:
    """Reads what is needed, again after every reboot or silence, now and then, and what changes."""

    names = ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")

    def __init__(self) -> None:
        self.counters: Counter[str] = Counter()
        self.enabled = True
        self.twofold = Twofold()
        self.heard: dict[str, float] = {}
        """When each that is needed was told last, by our own clock, s."""
        self._asked_again: dict[str, float] = {}
        self._to_ask: dict[str, float] = {}
        self._client = ParameterClient()
        self._codec = mavlink.MAVLink(None)
        self._target: tuple[int, int] | None = None
        self._next_read = 0.0
        self._absent: dict[str, float] = {}
        self._answered: set[str] = set()
        self._asking_since = 0.0
        self._in_vain = 0

    @property
    def values(self) -> Mapping[str, float]:
        """Every value that the autopilot has reported, by name."""
        return self._client.cache

    @property
    def complete(self) -> bool:
        """Whether everything that decides what may be written was read or is not there."""
        return self._answered.issuperset((*REQUIRED, *MEANING))

    @property
    def confirmed(self) -> set[str]:
        """Names whose values were read since the autopilot was (again) there."""
        return (self._answered & self.values.keys()) - self._absent.keys()

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the first accelerometer that are needed and not known."""
        return tuple(name for name in FIRST if name not in self.values)

    @property
    def untold(self) -> tuple[str, ...]:
        """Those of them that were asked for in vain, while others are answered."""
        return tuple(name for name in self.missing if name in self._answered)

    def unanswered(self, now: float) -> float:
        """For how long, s, it has been asked in vain: a word that nobody asked for is no answer."""
        if self._in_vain < limits.IN_VAIN or not self.enabled:
            return 0.0
        return now - self._asking_since

    def start(self, system: int, component: int, now: float) -> None:
        """Read everything (anew): the autopilot may have rebooted, or be another."""
        if self._target != (system, component):
            self._client = ParameterClient()
            self.twofold.forget()
        self._target = (system, component)
        self._asked_again.clear()
        self._to_ask.clear()
        self._client.cancel()
        self._absent.clear()
        self._answered.clear()
        self._in_vain = 0
        self._next_read = now

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take an answer, or a change by somebody else."""
        if self._target is None:
            return ()
        system, component = self._target
        event = parameter_event(
            message,
            system=system,
            component=component,
            own_system=system,
            own_component=COMPONENT,
        )
        if isinstance(event, ValueReceived):
            self.twofold.take(event.name, event.value, now)
            if event.name in NEEDED:
                self.heard[event.name] = now
        return () if event is None else self._act(self._client.feed(event, now), now)

    def poll(self, now: float) -> Sequence[Message]:
        """Requests that are due."""
        if self._target is None or not self.enabled:
            return ()
        messages = self._act(self._client.tick(now), now)
        late = [name for name, due in self._to_ask.items() if due <= now]
        messages += self._ask_again(late, now) if late else []
        if now >= self._next_read:
            self._next_read = now + limits.REREAD_S
            for names, attempts in (
                (REQUIRED, None),
                (MEANING + KNOWLEDGE, limits.OPTIONAL_ATTEMPTS),
            ):
                due = [name for name in names if self._absent.get(name, now) <= now]
                messages += self._act(self._client.read(due, now, attempts), now)
        return messages

    def _act(self, outputs: Sequence[object], now: float) -> list[Message]:
        messages = []
        for output in outputs:
            match output:
                case ValueRead(name):
                    self._answered.add(name)
                    self._in_vain = 0
                case ReadFailed(name, failure):
                    self._answered.add(name)
                    if failure is not Failure.SILENT:
                        self._in_vain = 0
                    self.counters["parameters_not_read"] += 1
                    self._absent[name] = now + limits.ABSENT_S
                    if name in FIRST:  # every autopilot that we write to has these: ask again soon
                        self._absent[name] = now
                        self._next_read = min(self._next_read, now + limits.RETRY_S)
                case ValueChanged(name, previous, value) if previous is not None:
                    # An autopilot tells its statistics, too, every half minute for ever.
                    if name not in NEEDED:
                        continue
                    self.counters["parameters_changed"] += 1
                    logger.info("%s changed from %.7g to %.7g", name, previous, value)
                    # ArduPilot answers reads from a queue, with the values of when they were asked:
                    # an answer can be older than the announcement before it.  What nobody asked for
                    # is taken, and asked for.
                    # Of two autopilots each contradicts the other for ever: not more than so often.
                    due = self._asked_again.get(name, -math.inf) + limits.RETRY_S
                    if now >= due:
                        messages += self._ask_again((name,), now)
                    else:
                        self._to_ask[name] = due
                case _ if isinstance(output, SendAction):
                    messages.append(self._encode(output))
                    # Silence is the usual answer to a name that not every firmware has.
                    if output.name in FIRST or output.name in self.values:
                        self._asking_since = self._asking_since if self._in_vain else now
                        self._in_vain += 1
                case _:
                    pass
        return messages

    def _ask_again(self, names: Sequence[str], now: float) -> list[Message]:
        for name in names:
            self._asked_again[name] = now
            self._to_ask.pop(name, None)
        return self._act(self._client.read(names, now), now)

    def _encode(self, action: SendAction) -> Message:
        system, component = self._target or (0, 0)
        return parameter_message(action, self._codec, system=system, component=component)
