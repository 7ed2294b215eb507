"""The push transaction's state machine, as data.

The upper half leads to "all six new", the lower half to "all six old".  Any ``TROUBLE`` on
the way to new turns to old; there is no way back.  ``STUCK`` leaves the journal open.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class State(Enum):
    """Where a transaction is."""

    NEW = "new"
    COMPARING = "comparing"
    RECORDING = "recording"
    WRITING = "writing"
    SETTLING = "settling"
    VERIFYING = "verifying"
    INSPECTING = "inspecting"
    UNDOING = "undoing"
    UNDO_SETTLING = "undo_settling"
    UNDO_VERIFYING = "undo_verifying"
    CLOSING = "closing"
    FINISHED = "finished"


class Trigger(Enum):
    """What moves it.  ``STUCK``: nothing more can be done now."""

    PUSH = "push"
    RESUME = "resume"
    AGREES = "agrees"
    DIFFERS = "differs"
    ALL_NEW = "all_new"
    DURABLE = "durable"
    DONE = "done"
    WAITED = "waited"
    TROUBLE = "trouble"
    STUCK = "stuck"


TRANSITIONS: Mapping[State, Mapping[Trigger, State]] = {
    State.NEW: {
        Trigger.PUSH: State.COMPARING,
        Trigger.RESUME: State.INSPECTING,
        Trigger.STUCK: State.FINISHED,
    },
    # The way to "new"
    State.COMPARING: {
        Trigger.AGREES: State.RECORDING,
        Trigger.TROUBLE: State.FINISHED,
        Trigger.STUCK: State.FINISHED,
    },
    State.RECORDING: {
        Trigger.DURABLE: State.WRITING,
        Trigger.TROUBLE: State.CLOSING,
        Trigger.STUCK: State.CLOSING,
    },
    State.WRITING: {
        Trigger.DONE: State.SETTLING,
        Trigger.TROUBLE: State.INSPECTING,
        Trigger.STUCK: State.FINISHED,
    },
    State.SETTLING: {
        Trigger.WAITED: State.VERIFYING,
        Trigger.TROUBLE: State.INSPECTING,
        Trigger.STUCK: State.FINISHED,
    },
    State.VERIFYING: {
        Trigger.AGREES: State.CLOSING,
        Trigger.TROUBLE: State.INSPECTING,
        Trigger.STUCK: State.FINISHED,
    },
    # The way to "old"; trouble is no news here
    State.INSPECTING: {
        Trigger.ALL_NEW: State.SETTLING,
        Trigger.DIFFERS: State.UNDOING,
        Trigger.AGREES: State.UNDO_SETTLING,
        Trigger.STUCK: State.FINISHED,
    },
    State.UNDOING: {
        Trigger.DONE: State.UNDO_SETTLING,
        Trigger.STUCK: State.FINISHED,
    },
    State.UNDO_SETTLING: {
        Trigger.WAITED: State.UNDO_VERIFYING,
        Trigger.STUCK: State.FINISHED,
    },
    State.UNDO_VERIFYING: {
        Trigger.AGREES: State.CLOSING,
        Trigger.DIFFERS: State.UNDOING,
        Trigger.STUCK: State.FINISHED,
    },
    State.CLOSING: {Trigger.DURABLE: State.FINISHED, Trigger.STUCK: State.FINISHED},
    State.FINISHED: {},
}

FORWARD = frozenset(
    {State.COMPARING, State.RECORDING, State.WRITING, State.SETTLING, State.VERIFYING}
)
"""States on the way to "new"."""
