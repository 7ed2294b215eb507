"""Turns of the loop that take too long are counted, all of them, where the loop waits."""

from __future__ import annotations

import asyncio

from onboard.daemon.process import limits
from onboard.daemon.process.turns import MeteredLoop, MeteredSelector, Turns, turns_here


def test_only_what_is_too_long_is_counted():
    turns = Turns()
    for seconds in (0.0, limits.STALL_S, 0.2, 0.1):
        turns.note(seconds)
    assert (turns.stalls, turns.worst_s) == (2, 0.2)


def test_time_between_waits_is_measured_and_waiting_is_not():
    now = 0.0
    turns = Turns()
    with MeteredSelector(turns, lambda: now) as selector:
        selector.select(0.0)
        now += 0.3  # a handler
        selector.select(0.0)
        now += 0.01
        selector.select(0.0)
    assert (turns.stalls, turns.worst_s) == (1, 0.3)


def test_a_loop_measures_its_own():
    async def busy():
        asyncio.get_running_loop().turns.note(0.5)
        return turns_here()

    with asyncio.Runner(loop_factory=MeteredLoop) as runner:
        assert runner.run(busy()).worst_s == 0.5
    with asyncio.Runner() as runner:
        assert runner.run(_nothing()).stalls == 0


async def _nothing():
    return turns_here()
