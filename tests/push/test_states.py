"""The transaction's machine as data."""

from onboard.push.states import FORWARD, TRANSITIONS, State, Trigger


def test_every_state_leads_to_the_end():
    reach = {State.FINISHED}
    while True:
        more = {s for s, t in TRANSITIONS.items() if set(t.values()) & reach} | reach
        if more == reach:
            break
        reach = more
    assert reach == set(State)


def test_trouble_after_the_first_write_turns_back_and_nothing_turns_forward():
    for state in (State.WRITING, State.SETTLING, State.VERIFYING):
        assert TRANSITIONS[state][Trigger.TROUBLE] is State.INSPECTING
    for state in (State.UNDOING, State.UNDO_SETTLING, State.UNDO_VERIFYING):
        assert not set(TRANSITIONS[state].values()) & FORWARD
    assert TRANSITIONS[State.INSPECTING][Trigger.ALL_NEW] is State.SETTLING
    assert State.WRITING not in TRANSITIONS[State.INSPECTING].values()


def test_writing_is_entered_only_from_a_durable_plan():
    into = [
        (s, t) for s, row in TRANSITIONS.items() for t, to in row.items() if to is State.WRITING
    ]
    assert into == [(State.RECORDING, Trigger.DURABLE)]
