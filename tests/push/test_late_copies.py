"""On the way back: a late copy of a new value, and late answers that were given before it came."""

import pytest

from onboard.mavlink.parameter_messages import SendParamSet, ValueReceived
from onboard.push import limits
from onboard.push.entries import Result
from onboard.push.signals import Cancelled
from onboard.push.states import State
from tests.push.pushing import when_written

DELAY_S = 0.95 * limits.SETTLE_S
"""Of the slowest packets that are reckoned with."""


@pytest.mark.parametrize("number", [0, 2])
def test_answers_of_before_a_late_copy_came_are_not_believed(world, number):
    when_written(world, 3, lambda: world.feed(Cancelled("a person rejected it")))
    world.push()
    world.run(stop=lambda: world.client.state is State.UNDO_SETTLING)
    undone, plan = world.now, world.plan
    name = plan.write_order(plan.before)[number]

    def late_copy():
        answers = [ValueReceived(n, world.autopilot.ram[n]) for n in plan.names]
        world.autopilot.receive(SendParamSet(name, plan.wanted[name]), world.now)
        world.at(world.now + DELAY_S, lambda: [world.feed(answer) for answer in answers])

    world.at(undone + limits.SETTLE_S + 0.001 - DELAY_S, late_copy)
    world.run(stop=lambda: world.client is None)
    (outcome,) = world.outcomes
    assert outcome.result is Result.ROLLED_BACK
    assert world.holds() == world.journal_says() == "old"
