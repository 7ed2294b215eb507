"""Between the loop and the learner's thread: batches go over, what was learned comes back.

**A learner that fails** (a mistake of ours: it never raises on data that is merely bad) takes
nobody along.  Link, parameters, page and a push under way go on; another learner takes its place
and begins as after a restart of the service, from what is on the disk.  Where several fail before
one flight was judged, the last one *rests* until the next flight: it is told who is there and which
parameters are in force, so that everything written can still be audited, approved and rolled back.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import Counter
from collections.abc import Callable, Mapping
from typing import ParamSpec, Protocol, TypeVar

from onboard.core.inputs.samples import (
    AttitudeSample,
    ImuSample,
    ParameterValue,
    Sample,
    Vibration,
)
from onboard.daemon.learning import limits
from onboard.daemon.learning.failures import Failures, LearnerError
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learned import Learned
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.worker import Worker
from onboard.daemon.view.notices import Notices
from onboard.errors import OnboardError, StateError
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import Message
from onboard.mavlink.limits import PARAMETERS_MAX
from onboard.mavlink.repetitions import Repetitions
from onboard.outage import Outage

STAMPED = (ImuSample, AttitudeSample, Vibration)
"""Samples of messages that tell the boot time, and move the clock if it is believed."""

P = ParamSpec("P")
T = TypeVar("T")
logger = logging.getLogger(__name__)


class There(Protocol):
    """Who is there, and what is to be done with what it teaches."""

    @property
    def identity(self) -> Identity | None:
        """As far as it is known; None while nobody is heard."""

    @property
    def introduced(self) -> bool:
        """Whether it has said who it is, and the parameters that say what its messages mean."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """All that it has told of them, by name."""

    @property
    def judging(self) -> frozenset[str]:
        """Pushes that wait for the flight that judges them, by transaction."""

    @property
    def in_flight(self) -> bool:
        """Whether values may be written in flight."""


class Handover:
    """Decodes, batches, saves.

    Args:
        learner: whom to hand the batches.
        successor: makes another one when it has failed; None: its failure ends :meth:`run`.
        notices: where its news go.
        there: who is there, and what is to be done with what it teaches.
        clock: monotonic time, s.
        wall_clock: Unix time, s.
        save_every_s: how often sums go to disk.
        needed: parameters that are taken however many others were told.
    """

    def __init__(
        self,
        learner: Learner,
        notices: Notices,
        *,
        there: There,
        clock: Callable[[], float],
        wall_clock: Callable[[], float],
        save_every_s: float,
        needed: frozenset[str] = frozenset(),
        successor: Callable[[], Learner] | None = None,
    ) -> None:
        self.decoder = Decoder()
        self.repetitions = Repetitions()
        self.learned: Learned | None = None
        self.counters: Counter[str] = Counter()
        self.failures = Failures()
        self.unsaved = ""
        """Why what is learned is not kept over a restart, in a sentence; empty: it is."""
        self._learner = learner
        self._successor = successor
        self._notices = notices
        self._there = there
        self._begun = self._taught = self._succeeded = False
        self._clock = clock
        self._wall_clock = wall_clock
        self._save_every_s = save_every_s
        self._needed = needed
        self._told: set[str] = set()
        self._next_save = 0.0
        self._samples: list[Sample] = []
        self._before_gap: list[Sample] | None = None
        self._rebooted = False
        self._arrived: float | None = None
        self._taken: float | None = None
        self._behind = False
        self._disk = Outage(settle_s=0.0)
        self._worker: Worker | None = None
        self._busy_since: float | None = None
        self._examined = -math.inf
        self._closing = False
        self._listeners: list[Callable[[Learned], None]] = []

    def listen(self, listener: Callable[[Learned], None]) -> None:
        """Have ``listener(learned)`` called on the loop after every batch."""
        self._listeners.append(listener)

    def take(self, message: Message) -> tuple[Sample, ...]:
        """Decode a message of the autopilot and put its samples into the next batch."""
        samples = self._consistent(self._plausible(self.decoder.decode(message)))
        if not samples:
            return samples
        if self._arrived is None:
            self._arrived = self._clock()
        self._samples += samples
        if len(self._samples) > limits.WAITING_LIMIT:
            half = limits.WAITING_LIMIT // 2
            self.counters["samples_dropped"] += half
            del self._samples[:half]
        return samples

    def _consistent(self, samples: tuple[Sample, ...]) -> tuple[Sample, ...]:
        """Without those that contradict one of the same stamp, which is taken back, too."""
        contradicts, now = self.repetitions.contradicts, self._clock()
        for sample in samples:
            before = contradicts(sample, now)
            if before is not None:
                self.counters["samples_contradict"] += 1
                self._samples = [s for s in self._samples if s is not before]
                samples = tuple(s for s in samples if s is not sample)
        return samples

    @property
    def has_learned(self) -> bool:
        """Whether a flight of this run has taught anything."""
        learned = self.learned
        if learned is None:
            return False
        return learned.trust.trusted_s > 0.0 or (
            learned.flight is not None and learned.flight.current
        )

    def _plausible(self, samples: tuple[Sample, ...]) -> tuple[Sample, ...]:
        """Without parameters beyond what any firmware has: everything that is told is kept.

        And without what is stamped by no boot that the link has told.
        """
        for sample in samples:
            if isinstance(sample, STAMPED) and self.decoder.clock.doubts(sample.t):
                self.counters["samples_of_no_boot"] += 1
                return ()
            if type(sample) is ParameterValue and sample.name not in self._told:
                if len(self._told) >= PARAMETERS_MAX and sample.name not in self._needed:
                    self.counters["parameters_ignored"] += 1
                    return ()
                self._told.add(sample.name)
        return samples

    @property
    def identified(self) -> bool:
        """Whether what was learned is of the autopilot that is there now."""
        return self._begun and self._taught

    def gap(self, *, rebooted: bool = False) -> None:
        """The autopilot rebooted or is silent: another may answer next, so it is asked who it is.

        What comes from here on waits for that; what came before is learned at once.

        Args:
            rebooted: its clock has begun anew, and the stamps of its samples do not say so.
        """
        self._rebooted |= rebooted
        self.counters["gaps"] += 1
        self._before_gap = [*(self._before_gap or ()), *(self._samples if self._begun else ())]
        if self._begun:
            self._samples = []
        self._begun, self._taught, self._arrived = False, False, None

    async def run(self) -> None:
        """Learn until cancelled."""
        self._worker = Worker("learner")
        while True:
            try:
                await self.step()
            except LearnerError as failure:
                self._replace(failure)
            await asyncio.sleep(limits.BATCH_S)

    def _replace(self, failure: LearnerError) -> None:
        """Another learner takes the place of one that has failed, or there is none left.

        Raises:
            LearnerError: one has failed that rests.
        """
        if self._successor is None or self.failures.stopped:
            raise failure
        self.counters["learner_failed"] += 1
        logger.error("the estimator has failed", exc_info=failure.__cause__)
        self._notices.post(*self.failures.take(failure), warning=True)
        self._learner, self._succeeded = self._successor(), True
        self._begun = self._taught = self._rebooted = False
        self._arrived = self._taken = self._busy_since = self._before_gap = None

    async def step(self) -> None:
        """One batch, one diagnosis if one is due, and the sums to disk when that is due."""
        now = self._busy_since = self._clock()
        if self._before_gap is not None:
            await self._close_gap()
        if self._begun or await self._begin(now):
            await self._learn(self._next_batch())
            self._taken = None
        # Also of a board that has gone: often the power goes right after the landing.
        if self.learned is not None and self.learned.diagnosing and not self._closing:
            self._busy_since = self._clock()
            self._accept(await self._call(self._learner.examine))
            self._examined = self._clock()
            self._next_save = now  # the flight cannot be diagnosed again after a power cut
        if now >= self._next_save:
            self._next_save = now + self._save_every_s
            await self.save()
        self._busy_since = None

    async def _close_gap(self) -> None:
        """Learn what came before the gap, and note what was in force then."""
        before, self._before_gap = self._before_gap, None
        if before:
            await self._learn(before)
        rebooted, self._rebooted = self._rebooted, False
        await self._call(self._learner.gap, rebooted=rebooted)

    async def _begin(self, now: float) -> bool:
        """Whether it is known who is there and what the messages mean, or is waited for in vain."""
        waited = 0.0 if self._arrived is None else now - self._arrived
        identity = self._there.identity
        ready = self._there.introduced or waited > limits.PARAMETERS_S or self._closing
        if identity is None or not ready:
            return False
        # The parameters before all else; a stable order: the latest report still comes last.
        self._samples.sort(key=lambda sample: type(sample) is not ParameterValue)
        told = [s for s in self._samples if type(s) is ParameterValue]
        if self._succeeded:  # it has missed what was told to the one before
            known = self._there.parameters
            told = [*(ParameterValue(name, value) for name, value in known.items()), *told]
        gaps = self.counters["gaps"]
        await self._call(self._learner.identify, identity, told)
        self._begun = gaps == self.counters["gaps"]  # no other one while that was done
        self._succeeded &= not self._begun
        return self._begun

    async def _learn(self, samples: list[Sample]) -> None:
        self._accept(
            await self._call(
                self._learner.learn,
                samples,
                judging=self._there.judging,
                in_flight=self._there.in_flight,
            )
        )

    def _next_batch(self) -> list[Sample]:
        samples, self._samples = self._samples, []
        samples = self.failures.left_over(samples)
        self._taken, self._arrived = self._arrived, None
        return samples

    async def reset(self) -> None:
        """Forget what was learned."""
        self._accept(await self._call(self._learner.reset))

    async def save(self) -> None:
        """Put the sums on disk; a disk that does not take them is told and tried again."""
        now = self._clock()
        try:
            await self._call(self._learner.save, self._wall_clock())
        except StateError as error:
            self.counters["save_failed"] += 1
            self.unsaved = f"what is learned is not kept over a restart: {error}"
            if self._disk.failed(str(error), now):
                self._notices.post("not_saved", self.unsaved, warning=True)
            return
        self.unsaved = ""
        self._disk.works(now)
        over = self._disk.over(now)
        if over is not None:
            self._notices.post(
                "saved_again", f"what was learned is on the disk again, after {over}"
            )

    def keeps_up(self, now: float) -> bool:
        """Whether the learner is not stuck in a batch."""
        return self._busy_since is None or now - self._busy_since < limits.STEP_LIMIT_S

    def behind(self, now: float) -> float:
        """How long ago the oldest sample came that is not learned yet, s."""
        oldest = self._arrived if self._taken is None else self._taken
        return 0.0 if oldest is None else max(0.0, now - oldest)

    def tell_of_lag(self, now: float) -> None:
        """Say when the learner falls behind what comes in, and when it has caught up.

        While a flight is judged, all else waits: that is told by itself.
        """
        lag = self.behind(now)
        if not self._begun:
            return
        judging = self.learned is not None and bool(self.learned.diagnosing)
        by_itself = 0.0 if judging else min(lag, now - self._examined)
        if not self._behind and by_itself > limits.BEHIND_S:
            self._behind = True
            self.counters["fell_behind"] += 1
            text = f"the learner is {lag:.0f} s behind what comes in: answers come late"
            self._notices.post("learner_behind", text, warning=True)
        elif self._behind and lag < limits.CAUGHT_UP_S:
            self._behind = False
            self._notices.post("learner_caught_up", "the learner has caught up")

    async def close(self, limit_s: float) -> None:
        """Learn what has come, save, and let the thread go; if it is busy, the last save counts."""
        self._closing = True
        try:
            async with asyncio.timeout(limit_s):
                await self.step()
                await self.save()
                if self._worker is not None:
                    await self._worker.close()
        except TimeoutError:
            logger.warning("the learner is busy: the next start goes on from the last save")
        except LearnerError:
            logger.exception("the estimator has failed: the next start goes on from the last save")

    def let_go(self) -> None:
        """Stop at once; the thread ends when it can, or with the process."""
        if self._worker is not None:
            self._worker.dismiss()

    def _accept(self, learned: Learned) -> None:
        self.learned = learned
        self.failures.judged(learned)
        # Until it has learned a batch of who is there, what is known is of who was there before.
        self._taught = self._begun
        for news in learned.news:
            self._notices.post(news.kind, news.text, warning=news.warning)
        for listener in self._listeners:
            listener(learned)

    async def _call(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """On the learner's thread, or here while there is none.

        Raises:
            OnboardError: an answer that is none that was hoped for.
            LearnerError: a mistake of ours.
        """
        try:
            if self._worker is None:
                return function(*args, **kwargs)
            return await self._worker.call(function, *args, **kwargs)
        except (OnboardError, MemoryError):  # memory comes back with another process
            raise
        except Exception as error:
            raise LearnerError("the estimator has failed") from error
