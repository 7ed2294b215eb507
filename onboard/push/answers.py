"""What the autopilot's answers amount to: which step of the course they lead to.

An answer is what :class:`onboard.mavlink.parameters.ParameterClient` made of the autopilot's words:
a value read, a value set, or a failure of either.
"""

from __future__ import annotations

from onboard.mavlink.parameters import (
    Failure,
    ReadFailed,
    SetDone,
    SetFailed,
    ValueChanged,
    ValueRead,
)
from onboard.push.course import Course, Heard
from onboard.push.entries import ReadBack, Recovery, Result
from onboard.push.reading import Reading
from onboard.push.signals import Reason
from onboard.push.states import State, Trigger

WHY_NOT_SET = {
    Failure.SILENT: Reason.SILENT,
    Failure.CHANGED_BY_OTHER: Reason.CHANGED_BY_OTHER,
}
"""Reasons of a write that failed; any other failure is a denial."""
IN_WORDS = {
    Failure.SILENT: "the autopilot does not answer",
    Failure.DOES_NOT_EXIST: "the autopilot has no such parameter",
    Failure.DENIED: "the autopilot refuses it",
    Failure.NOT_TAKEN: "the autopilot keeps its old value",
    Failure.CHANGED_BY_OTHER: "somebody else set it meanwhile",
}
"""The end of a sentence on each, for people."""


class Answers:
    """Listens to the parameter client and moves the course.

    Args:
        course: what is moved.
        recovery: what an interrupted transaction had come to, if it is resumed.
    """

    def __init__(self, course: Course, recovery: Recovery | None) -> None:
        self._course = course
        self._recovery = recovery

    def hear(self, outputs: Heard, now: float) -> None:
        """Take what the client says, and what it says to the steps that follow from it."""
        course, state = self._course, self._course.state
        for output in outputs:
            if course.state is not state:
                return  # the rest answers questions of a state that is left
            match output:
                case ValueRead(name, value):
                    self._value_read(name, value, now)
                case ReadFailed(name, failure):
                    self._read_failed(name, failure, now)
                case SetDone():
                    self._set_done(output, now)
                case SetFailed(name, failure, value):
                    self._set_failed(name, failure, value, now)
                case ValueChanged(name, _, value):
                    # May be a late duplicate: only a read of our own convicts.
                    if course.forward and value != self._expected(name, value):
                        self.hear(course.client.read((name,), now), now)
                case _:
                    course.send(output, now)

    def _expected(self, name: str, otherwise: float) -> float:
        plan = self._course.plan
        if name == plan.device_id_name:
            return plan.vehicle.device_id
        if name not in plan.names:
            return otherwise
        return self._course.progress.expected(name, plan.before[name], plan.wanted[name])

    def _value_read(self, name: str, value: float, now: float) -> None:
        course, progress = self._course, self._course.progress
        if name in progress.awaiting:
            progress.awaiting.discard(name)
            progress.values[name] = value
            if not progress.awaiting:
                self._all_read(now)
        elif course.forward and value != self._expected(name, value):
            sentence = f"{name} became {value:.7g} meanwhile"
            self.hear(course.trouble(Reason.CHANGED_BY_OTHER, sentence, now), now)

    def _read_failed(self, name: str, failure: Failure, now: float) -> None:
        course, sentence = self._course, f"{name} cannot be read: {IN_WORDS[failure]}"
        turn = course.trouble if course.forward else course.stuck
        self.hear(turn(Reason.SILENT, sentence, now), now)

    def _set_done(self, done: SetDone, now: float) -> None:
        course, progress = self._course, self._course.progress
        progress.values[done.name] = done.value
        course.answered(done.name)
        course.record(ReadBack(course.identifier, done.name, done.value, done.saved))
        if not done.saved:
            progress.undo_unsaved |= course.state is State.UNDOING
            sentence = f"{done.name} is in force, but the autopilot does not say that it is stored"
            self.hear(course.trouble(Reason.NOT_SAVED, sentence, now), now)
        if course.state in {State.WRITING, State.UNDOING}:
            self.hear(course.write_next(now), now)

    def _set_failed(self, name: str, failure: Failure, value: float | None, now: float) -> None:
        course, progress = self._course, self._course.progress
        reason = WHY_NOT_SET.get(failure, Reason.DENIED)
        sentence = f"{name} was not written: {IN_WORDS[failure]}"
        if reason is Reason.CHANGED_BY_OTHER:
            sentence = f"somebody else set {name} in the middle"
        if course.state is State.WRITING:
            self.hear(course.trouble(reason, sentence, now), now)
        elif course.state is State.UNDOING:
            if reason is Reason.CHANGED_BY_OTHER and value is not None:
                progress.left |= {name}
                progress.values[name] = value
                if name in course.plan.names[3:]:
                    # The order of the rest counted on this offset.  All are read again, for one
                    # answer may be wrong, before anything could make all three zero.
                    progress.queue.clear()
                self.hear(course.write_next(now), now)
            else:
                self.hear(course.stuck(reason, sentence, now), now)

    def _all_read(self, now: float) -> None:
        """The six and the accelerometer's id were read: what do they say?"""
        course = self._course
        reading = Reading(course.plan, course.progress.values)
        if not reading.right_device:
            heard = self._another_device(now)
        elif course.forward:
            heard = self._read_on_the_way_to_new(reading, now)
        else:
            heard = self._read_on_the_way_back(reading, now)
        self.hear(heard, now)

    def _another_device(self, now: float) -> Heard:
        course = self._course
        sentence = f"{course.plan.device_id_name} is another accelerometer's"
        if course.forward:
            return course.trouble(Reason.OTHER_VEHICLE, sentence, now)
        course.result = Result.OTHER_VEHICLE
        return course.stuck(Reason.OTHER_VEHICLE, sentence, now)

    def _read_on_the_way_to_new(self, reading: Reading, now: float) -> Heard:
        course, plan = self._course, self._course.plan
        comparing = course.state is State.COMPARING
        wrong = reading.unlike(plan.before if comparing else plan.wanted)
        if not wrong:
            return course.go(Trigger.AGREES, now)
        changed = comparing or reading.foreign
        return course.trouble(Reason.CHANGED_BY_OTHER if changed else Reason.REVERTED, wrong, now)

    def _read_on_the_way_back(self, reading: Reading, now: float) -> Heard:
        course, progress = self._course, self._course.progress
        foreign = {name: reading.values[name] for name in reading.foreign}
        if foreign and foreign != progress.foreign:
            # One answer may be wrong: what is left to somebody else was read alike twice.
            progress.foreign = foreign
            return course.read_six(now)
        progress.left = reading.left
        if self._can_finish(reading):
            return course.go(Trigger.ALL_NEW, now)
        if reading.undo_order:
            progress.queue = list(reading.undo_order)
            return course.go(Trigger.DIFFERS, now)
        if progress.undo_unsaved and course.state is State.UNDO_VERIFYING:
            sentence = "the old values are in force, but not known to be stored"
            return course.stuck(Reason.NOT_SAVED, sentence, now)
        return course.go(Trigger.AGREES, now)

    def _can_finish(self, reading: Reading) -> bool:
        """Whether a resumed transaction needs nothing but its verification."""
        course = self._course
        if course.progress.turned or self._recovery is None or course.state is not State.INSPECTING:
            return False
        return self._recovery.all_confirmed and not reading.unlike(course.plan.wanted)
