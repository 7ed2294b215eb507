"""The vehicle's condition as the push policy gets it: what is stale is unknown."""

from hypothesis import given
from hypothesis import strategies as st

from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.samples import EkfHealth, VehicleState
from onboard.daemon.process.condition import Observed
from onboard.daemon.process.limits import STALE_S


def armed(observed, value, now):
    observed.feed(VehicleState(now, armed=value), now)


def test_nothing_is_known_at_first():
    condition = Observed().condition(10.0)
    assert condition.armed is None
    assert condition.landed is None
    assert condition.ekf_flags is None
    assert condition.disarmed_for == 0.0


def test_disarmed_time_counts_from_the_first_word_of_it_without_break():
    observed = Observed()
    for now in range(8):
        armed(observed, value=now < 3, now=float(now))
    assert observed.condition(7.5).disarmed_for == 4.5
    armed(observed, value=True, now=8.0)
    assert observed.condition(8.0).disarmed_for == 0.0
    armed(observed, value=False, now=9.0)
    assert observed.condition(9.5).disarmed_for == 0.5


def test_a_silence_makes_it_unknown_and_the_time_begins_anew():
    observed = Observed()
    armed(observed, value=False, now=0.0)
    assert observed.condition(STALE_S + 1).armed is None
    assert observed.condition(STALE_S + 1).disarmed_for == 0.0
    armed(observed, value=False, now=STALE_S + 2)
    assert observed.condition(STALE_S + 3).disarmed_for == 1.0


def test_flags_that_a_message_does_not_carry_stay():
    observed = Observed()
    observed.feed(VehicleState(0.0, landed=True), 0.0)
    armed(observed, value=True, now=0.5)
    observed.feed(EkfHealth(0.6, 0x3F), 0.6)
    condition = observed.condition(1.0)
    assert (condition.armed, condition.landed, condition.ekf_flags) == (True, True, 0x3F)
    observed.forget()
    assert observed.condition(1.0) == Observed().condition(1.0)


WORD = st.sampled_from([None, False, True])


@given(st.lists(st.tuples(WORD, WORD), max_size=12))
def test_service_and_estimator_have_one_idea_of_where_the_vehicle_is(words):
    """While nothing is stale: armed, landed and in the air are the estimator's own."""
    observed, ground = Observed(), Ground()
    for k, (is_armed, landed) in enumerate(words):
        state = VehicleState(0.1 * k, armed=is_armed, landed=landed)
        observed.feed(state, 0.1 * k)
        ground.feed(state)
        condition = observed.condition(0.1 * k)
        assert (condition.armed, condition.landed) == (ground.armed, ground.landed)
        assert condition.may_fly == (ground.grounded is not True)
