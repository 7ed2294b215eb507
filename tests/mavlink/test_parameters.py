import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    ParameterErrorCode,
    SendParamRead,
    SendParamSet,
    TextReceived,
    ValueReceived,
    to_float32,
)
from onboard.mavlink.parameters import (
    ClientSettings,
    Failure,
    ParameterClient,
    ReadFailed,
    SetDone,
    SetFailed,
    ValueChanged,
    ValueRead,
)
from tests.autopilot_parameters import Autopilot, Weather, World, accelerometer_parameters, float32

SIX = [n for n in accelerometer_parameters() if not n.endswith("ID")]
NAME = "INS_ACCSCAL_Y"


def world(weather=None, seed=0, **autopilot):
    w = World(Autopilot(accelerometer_parameters(), **autopilot), weather, seed)
    w.plug(ParameterClient())
    return w


def results(w, kind):
    return [o for o in w.outputs if isinstance(o, kind)]


class TestRead:
    def test_named_set_arrives_and_fills_the_cache(self):
        w = world()
        w.handle(w.client.read(SIX, w.now))
        w.run()
        assert {r.name: r.value for r in results(w, ValueRead)} == {
            n: w.autopilot.ram[n] for n in SIX
        }
        assert dict(w.client.cache) == {n: w.autopilot.ram[n] for n in SIX}
        assert not w.client.busy
        assert w.client.next_deadline() is None

    def test_unknown_name_ends_in_silence_after_bounded_attempts(self):
        w = world()
        w.handle(w.client.read(["NO_SUCH"], w.now))
        w.run()
        assert results(w, ReadFailed) == [ReadFailed("NO_SUCH", Failure.SILENT)]
        assert len(w.sent) == ClientSettings().attempts

    def test_newer_autopilot_says_that_a_name_does_not_exist(self):
        w = world()
        w.autopilot.speaks_errors = True
        w.handle(w.client.read(["NO_SUCH"], w.now))
        w.run()
        assert results(w, ReadFailed) == [ReadFailed("NO_SUCH", Failure.DOES_NOT_EXIST)]
        assert len(w.sent) == 1

    def test_never_more_in_flight_than_allowed(self):
        client = ParameterClient(ClientSettings(in_flight=3))
        names = [f"P{i}" for i in range(10)]
        waiting = {o.name for o in client.read(names, 0.0)}
        assert len(waiting) == 3
        answered = 0
        while waiting:
            name = waiting.pop()
            answered += 1
            outputs = client.feed(ValueReceived(name, 1.0), 0.1)
            waiting |= {o.name for o in outputs if isinstance(o, SendParamRead)}
            assert len(waiting) <= 3
        assert answered == 10

    def test_asking_twice_sends_once(self):
        client = ParameterClient()
        assert client.read([NAME], 0.0) == (SendParamRead(NAME),)
        assert client.read([NAME], 0.1) == ()

    def test_duplicates_and_late_replies_change_nothing(self):
        client = ParameterClient()
        client.read([NAME], 0.0)
        assert client.feed(ValueReceived(NAME, 1.5), 0.1) == (ValueRead(NAME, 1.5),)
        assert client.feed(ValueReceived(NAME, 1.5), 0.2) == ()
        assert client.tick(100.0) == ()

    def test_write_of_another_station_is_reported(self):
        w = world()
        w.handle(w.client.read([NAME], w.now))
        w.run()
        w.autopilot.set_by_other(NAME, 1.01, w.now)
        w.run()
        assert results(w, ValueChanged) == [ValueChanged(NAME, 1.0, float32(1.01))]
        assert w.client.cache[NAME] == float32(1.01)

    def test_not_a_number_from_the_autopilot_is_a_value_like_any_other(self):
        client = ParameterClient()
        client.read([NAME], 0.0)
        (result,) = client.feed(ValueReceived(NAME, math.nan), 0.1)
        assert math.isnan(result.value)


class TestSet:
    @pytest.mark.parametrize("name", SIX)
    def test_takes_effect_is_stored_and_read_back(self, name):
        w = world()
        w.handle(w.client.read(SIX, w.now))
        w.run()
        w.handle(w.client.set(name, 0.8765432101, w.now))
        w.run()
        assert results(w, SetDone) == [SetDone(name, float32(0.8765432101), True)]
        assert w.autopilot.stored[name] == float32(0.8765432101)
        assert (
            SendParamRead(name) in w.sent[w.sent.index(SendParamSet(name, float32(0.8765432101))) :]
        )

    def test_cache_does_not_believe_what_was_only_sent(self):
        client = ParameterClient()
        client.read([NAME], 0.0)
        client.feed(ValueReceived(NAME, 1.0), 0.0)
        client.set(NAME, 1.1, 0.1)
        assert client.cache[NAME] == 1.0

    def test_acknowledgement_alone_is_not_enough(self):
        client = ParameterClient()
        client.set(NAME, 1.1, 0.0)
        out = client.feed(ValueReceived(NAME, to_float32(1.1)), 0.1)
        assert out == (SendParamRead(NAME),)
        out = client.feed(ValueReceived(NAME, to_float32(1.1)), 0.2)
        assert out == (SetDone(NAME, to_float32(1.1), saved=True),)

    def test_denied_with_a_text_fails_and_tells_the_old_value(self):
        w = world()
        w.autopilot.denied.add(NAME)
        w.handle(w.client.set(NAME, 1.1, w.now))
        w.run()
        assert results(w, SetFailed) == [SetFailed(NAME, Failure.DENIED, 1.0)]
        assert w.autopilot.history == []

    def test_a_denial_of_another_parameter_is_none_of_this_one(self):
        client = ParameterClient()
        out = list(client.set(NAME, 1.1, 0.0))
        for tenth in range(50):
            if any(isinstance(o, SetFailed) for o in out):
                break
            out += client.feed(TextReceived("Param write denied (INS_ACCSCAL_Z)"), 0.1 * tenth)
            out += client.feed(ValueReceived(NAME, 1.0), 0.1 * tenth)
            out += client.tick(0.1 * tenth)
        assert out[-1] == SetFailed(NAME, Failure.NOT_TAKEN, 1.0)

    def test_denied_whose_text_was_lost_still_fails(self):
        client = ParameterClient()
        out = list(client.set(NAME, 1.1, 0.0))
        for tenth in range(50):
            if any(isinstance(o, SetFailed) for o in out):
                break
            out += client.feed(ValueReceived(NAME, 1.0), 0.1 * tenth)
            out += client.tick(0.1 * tenth)
        assert out[-1] == SetFailed(NAME, Failure.NOT_TAKEN, 1.0)
        sets = [o for o in out if isinstance(o, SendParamSet)]
        assert len(sets) == ClientSettings().attempts

    def test_values_that_come_faster_than_it_asks_do_not_make_it_write_again(self):
        """A flood of the old value, from whoever can forge the vehicle's address."""
        client = ParameterClient()
        out = list(client.set(NAME, 1.1, 0.0, before=1.0))
        for hundredth in range(20):
            for _ in range(100):
                out += client.feed(ValueReceived(NAME, 1.0), 0.01 * hundredth)
        assert len([o for o in out if isinstance(o, SendParamSet)]) == 1

    def test_parameter_error_ends_it(self):
        client = ParameterClient()
        client.set(NAME, 1.1, 0.0)
        out = client.feed(ErrorReceived(NAME, ParameterErrorCode.READ_ONLY), 0.1)
        assert out == (SetFailed(NAME, Failure.DENIED, None),)

    def test_unknown_name_fails_in_silence(self):
        w = world()
        w.handle(w.client.set("NO_SUCH", 1.0, w.now))
        w.run()
        assert results(w, SetFailed) == [SetFailed("NO_SUCH", Failure.SILENT, None)]

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e39])
    def test_what_gets_no_reply_is_not_sent(self, value):
        with pytest.raises(ValueError):
            ParameterClient().set(NAME, value, 0.0)

    def test_somebody_elses_value_is_not_written_over(self):
        client = ParameterClient()
        assert client.set(NAME, 1.1, 0.0, before=1.0) == (SendParamRead(NAME),)
        out = client.feed(ValueReceived(NAME, 1.05), 0.1)
        assert out == (SetFailed(NAME, Failure.CHANGED_BY_OTHER, 1.05),)

    def test_somebody_elses_value_that_comes_after_ours_is_not_fought(self):
        client = ParameterClient()
        client.set(NAME, 1.1, 0.0, before=1.0)
        out = client.feed(ValueReceived(NAME, 1.0), 0.1)
        assert out == (SendParamSet(NAME, to_float32(1.1)),)
        assert client.feed(ValueReceived(NAME, 1.05), 0.2) == (SendParamRead(NAME),)
        out = client.feed(ValueReceived(NAME, 1.05), 0.3)
        assert out == (SetFailed(NAME, Failure.CHANGED_BY_OTHER, 1.05),)

    def test_somebody_elses_value_that_ours_has_overwritten_is_no_success(self):
        """They set it between our look and our write, and hear that theirs is in force."""
        value, client = to_float32(1.1), ParameterClient()
        client.set(NAME, value, 0.0, before=1.0)
        client.feed(ValueReceived(NAME, 1.0), 0.1)
        assert client.feed(ValueReceived(NAME, 1.05), 0.2) == (SendParamRead(NAME),)
        out = client.feed(ValueReceived(NAME, value), 0.3)
        assert out == (SetFailed(NAME, Failure.CHANGED_BY_OTHER, value),)

    def test_lost_set_is_checked_again_before_it_is_repeated(self):
        client = ParameterClient()
        client.set(NAME, 1.1, 0.0, before=1.0)
        client.feed(ValueReceived(NAME, 1.0), 0.1)
        assert client.tick(10.0) == (SendParamRead(NAME),)

    def test_full_storage_is_told_from_success(self):
        w = world()
        w.autopilot.full = True
        w.handle(w.client.set(NAME, 1.1, w.now, before=1.0))
        w.run()
        assert results(w, SetDone) == [SetDone(NAME, float32(1.1), False)]

    def test_announcement_of_the_whole_vector_is_no_refusal(self):
        """Storing x announces x, y and z: y's old value comes while y is being set."""
        w = world(store_delay=0.5)
        w.handle(w.client.read(SIX, w.now))
        w.run()
        w.autopilot.set_by_other("INS_ACCSCAL_X", 1.02, w.now)
        before = w.autopilot.ram["INS_ACCSCAL_Y"]
        w.run(until=w.now + 0.495)
        w.handle(w.client.set("INS_ACCSCAL_Y", 1.03, w.now, before=before))
        w.run()
        assert results(w, SetDone) == [SetDone("INS_ACCSCAL_Y", float32(1.03), True)]

    def test_in_force_without_an_announcement_is_announced_again_before_it_counts(self):
        """A stale value hides the announcement: the set is repeated, not believed stored."""
        value = to_float32(1.1)
        client = ParameterClient()
        client.set(NAME, 1.1, 0.0)
        assert client.feed(ValueReceived(NAME, 1.0), 0.1) == (SendParamRead(NAME),)
        assert client.feed(ValueReceived(NAME, value), 0.2) == (SendParamSet(NAME, value),)
        assert client.feed(ValueReceived(NAME, value), 0.3) == (SendParamRead(NAME),)
        assert client.feed(ValueReceived(NAME, value), 0.4) == (SetDone(NAME, value, saved=True),)

    def test_autopilot_that_reboots_meanwhile_gets_it_afterwards(self):
        w = world(store_delay=0.5)
        w.handle(w.client.set(NAME, 1.1, w.now))
        w.at(0.1, lambda: w.autopilot.reboot(w.now))
        w.run()
        assert results(w, SetDone) == [SetDone(NAME, float32(1.1), True)]
        assert w.autopilot.stored[NAME] == float32(1.1)


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    loss=st.floats(0.0, 0.6),
    duplication=st.floats(0.0, 0.5),
    late=st.floats(0.0, 0.3),
    denied=st.sets(st.sampled_from(SIX)),
)
def test_whatever_the_link_does_a_result_is_true_and_there_is_exactly_one(
    seed, loss, duplication, late, denied
):
    weather = Weather(loss=loss, duplication=duplication, late=late, latest=0.6)
    w = world(weather, seed)
    w.autopilot.denied = denied
    values = {n: float32(random.Random(seed).uniform(0.5, 1.5)) for n in SIX}
    for name, value in values.items():
        w.handle(w.client.set(name, value, w.now))
    w.run()
    ended = results(w, SetDone) + results(w, SetFailed)
    assert sorted(r.name for r in ended) == sorted(SIX)
    for result in results(w, SetDone):
        assert result.name not in denied
        assert w.autopilot.ram[result.name] == values[result.name] == result.value
        assert not result.saved or w.autopilot.stored[result.name] == values[result.name]
    for name, value in w.client.cache.items():
        assert value in {values[name], float32(accelerometer_parameters()[name])}
