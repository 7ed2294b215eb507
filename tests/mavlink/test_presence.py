"""Who the vehicle is: pinned by proof, moved only where nothing can be lost by it."""

import pytest

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.mavlink.autopilot import (
    AutopilotFound,
    AutopilotReturned,
    AutopilotState,
    RivalHeard,
)
from onboard.mavlink.claims import Claims
from onboard.mavlink.limits import (
    CLAIMS_KNOWN,
    FAILOVER_S,
    GIVEN_UP_S,
    HEARTBEAT_TIMEOUT_S,
    PEER_SILENCE_S,
    PROOF_S,
)
from onboard.mavlink.presence import Presence, Whose
from tests.mavlink.mavlink_peer import heartbeat, received

VEHICLE = (1, 1)
HERE, THERE, OTHER_ENDPOINT = (0, ("a", 1)), (0, ("b", 2)), (1, None)
BEAT, ARMED = received(heartbeat()), received(heartbeat(base_mode=128))


class Wire:
    """A presence, and a clock that goes on."""

    def __init__(self, *, committed=False, held=False, **kwargs):
        self.presence = Presence(kwargs.get("system"), kwargs.get("component"))
        self.presence.committed = lambda: self.committed
        self.presence.held = lambda: self.held
        self.committed, self.held = committed, held
        self.now = 0.0
        self.events = []

    def hear(self, way, source=VEHICLE, message=None, boot=None):
        heard = self.presence.hear(source, way, message, boot, self.now)
        self.events += heard.events
        return heard.whose

    def second(self, *ways, source=VEHICLE, offset=100.0, beats=True):
        """What a vehicle says in a second, by each of these ways."""
        for tenth in range(10):
            for way in ways:
                if beats and tenth == 0:
                    self.hear(way, source, BEAT)
                self.hear(way, source, boot=self.now + offset)
            self.now += 0.1
            self.presence.check(self.now)

    def silence(self, seconds):
        for _ in range(round(seconds / 0.1)):
            self.now += 0.1
            self.presence.check(self.now)


def test_what_speaks_in_its_name_elsewhere_is_counted_and_not_heard():
    wire = Wire()
    wire.second(HERE)
    assert wire.presence.proven
    assert wire.hear(THERE, message=BEAT) is Whose.FOREIGN
    assert wire.hear(THERE, boot=3.0) is Whose.FOREIGN
    assert wire.hear(OTHER_ENDPOINT, message=ARMED) is Whose.STANDBY
    assert (wire.presence.foreign, wire.presence.standby) == (2, 1)
    assert wire.presence.way == HERE
    assert [e for e in wire.events if isinstance(e, RivalHeard)] == [
        RivalHeard(armed=False, same_clock=False),
        RivalHeard(armed=True, same_clock=False),
    ]
    assert wire.presence.rivals(wire.now) == 1  # on the other endpoint nobody has asked


def test_two_ways_with_one_clock_are_no_rivals():
    wire = Wire()
    for _ in range(3):
        wire.second(HERE, OTHER_ENDPOINT)
    assert wire.presence.rivals(wire.now) == 0
    assert wire.presence.standby > 0


@pytest.mark.parametrize(("offset", "taken"), [(100.0, True), (60.0, False)])
def test_a_silent_way_is_followed_by_another_with_the_same_clock_only(offset, taken):
    wire = Wire(committed=True)
    wire.second(HERE)
    wire.silence(FAILOVER_S + 0.1)
    wire.second(THERE, offset=offset)
    assert (wire.presence.way == THERE) is taken
    assert AutopilotReturned() not in wire.events


def test_in_a_push_it_stays_where_it_is():
    wire = Wire(held=True)
    wire.second(HERE)
    wire.silence(FAILOVER_S + 0.1)
    wire.second(THERE, OTHER_ENDPOINT)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    wire.second(THERE, OTHER_ENDPOINT)
    assert wire.presence.way == HERE
    wire.held = False
    wire.second(THERE)
    assert wire.presence.way == THERE


def test_an_endpoint_that_only_hears_heartbeats_takes_over_from_one_that_is_lost():
    wire = Wire(committed=True)
    wire.second(HERE)
    wire.hear(OTHER_ENDPOINT, message=BEAT)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    wire.hear(OTHER_ENDPOINT, message=BEAT)
    assert wire.presence.way == OTHER_ENDPOINT
    assert wire.events[-1] == AutopilotReturned()


def test_one_that_is_lost_is_back_by_another_way_and_that_is_told():
    wire = Wire(committed=True)
    wire.second(HERE)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    assert wire.presence.state is AutopilotState.SILENT
    wire.second(THERE, offset=1.0)  # it has rebooted
    wire.second(THERE, offset=1.0)
    assert wire.presence.way == THERE
    assert wire.events[-1] == AutopilotReturned()


def test_who_only_beats_gives_way_to_who_has_a_stream_unless_something_was_learned():
    for committed, system in ((False, 1), (True, 77)):
        wire = Wire(committed=committed)
        wire.hear(HERE, (77, 1), BEAT)
        assert isinstance(wire.events[-1], AutopilotFound)
        wire.second(THERE)
        assert wire.presence.source == (system, 1)


@pytest.mark.parametrize(("committed", "system"), [(False, 2), (True, 1)])
def test_another_vehicle_takes_the_place_of_a_lost_one_of_which_nothing_was_learned(
    committed, system
):
    wire = Wire(committed=committed)
    wire.second(HERE)
    wire.hear(THERE, (2, 1), BEAT)
    assert wire.presence.source == VEHICLE
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    wire.hear(THERE, (2, 1), BEAT)
    assert wire.presence.source == (system, 1)


def test_among_those_that_only_beat_each_has_its_turn():
    wire = Wire()
    tried = set()
    for _ in range(int(4 * PROOF_S)):
        for number, way in enumerate((HERE, THERE, OTHER_ENDPOINT), start=10):
            wire.hear(way, (number, 1), BEAT)
        tried.add(wire.presence.source)
        wire.now += 1.0
    assert tried == {(10, 1), (11, 1), (12, 1)}


def test_the_autopilots_own_component_is_preferred_where_both_have_streams():
    wire = Wire()
    wire.second(HERE, source=(1, 50))
    assert wire.presence.source == (1, 50)
    wire.second(THERE, source=(1, 1))
    assert wire.presence.source == (1, 1)


@pytest.mark.parametrize(("system", "component"), [(1, 50), (1, None), (None, 50)])
def test_what_is_configured_decides(system, component):
    wire = Wire(system=system, component=component)
    wire.second(HERE, source=(7, 1))
    wire.second(THERE, source=(1, 50))
    assert wire.presence.source == (1, 50)


def test_a_lost_name_that_somebody_took_is_given_back_to_who_has_a_stream():
    wire = Wire(committed=True)
    wire.second(HERE)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    wire.hear(THERE, message=BEAT)
    assert wire.presence.way == HERE  # it has shown no stream
    wire.silence(GIVEN_UP_S)
    wire.hear(THERE, message=BEAT)
    assert wire.presence.way == THERE
    wire.second(HERE, offset=1.0)
    assert wire.presence.way == HERE


def test_any_number_of_claims_takes_a_bounded_place_and_never_the_vehicles():
    wire = Wire()
    wire.second(HERE)
    for number in range(500):
        wire.hear((0, ("x", number)), (number % 250 + 2, 1), BEAT)
    assert len(list(wire.presence._claims)) <= CLAIMS_KNOWN + 1
    assert wire.hear(HERE, message=BEAT) is Whose.VEHICLE
    assert wire.presence.way == HERE


def test_of_the_claims_those_that_are_silent_give_way_first_whatever_they_proved():
    claims = Claims()
    proven = claims.make(VEHICLE, HERE, BEAT, 0.0)
    for stamp in range(5):
        proven.note_stamp(float(stamp), float(stamp))
    now = 5.0 + PEER_SILENCE_S + 1.0
    for number in range(CLAIMS_KNOWN - 1):
        claims.make((2, 1), (0, ("x", number)), BEAT, now)
    assert proven.proven
    claims.make((3, 1), THERE, BEAT, now)
    assert claims.get(VEHICLE, HERE) is None
    assert len(list(claims)) == CLAIMS_KNOWN
    assert claims.get((2, 1), (0, ("x", 0))) is not None


def many_names(wire, way):
    """One address speaks as 40 autopilots, all with streams, for a second."""
    for component in range(2, 2 + CLAIMS_KNOWN + 8):
        wire.hear(way, (1, component), BEAT)
        for tenth in range(3):
            wire.hear(way, (1, component), boot=wire.now + 0.1 * tenth + 500.0)


@pytest.mark.parametrize("committed", [False, True])
def test_many_names_from_one_address_do_not_take_the_places_of_others(committed):
    """The vehicle's router is restarted meanwhile, and sends from another port."""
    wire = Wire(committed=committed)
    wire.second(HERE)
    for _ in range(5):
        many_names(wire, THERE)
        wire.second(HERE)
    wire.silence(1.0)
    many_names(wire, THERE)
    moved = (0, ("c", 3))
    for _ in range(3):
        wire.second(moved)
        many_names(wire, THERE)
    assert wire.presence.way == moved
    assert wire.presence.source == VEHICLE


def test_the_vehicles_own_claim_is_kept_however_long_it_is_silent():
    wire = Wire(committed=True)
    wire.second(HERE)
    wire.silence(2.0 * PEER_SILENCE_S)
    for port in range(2 * CLAIMS_KNOWN):
        wire.second((0, ("d", port)), source=(77, 1))
    wire.second(HERE)
    assert wire.presence.way == HERE
    assert wire.hear(HERE, message=BEAT) is Whose.VEHICLE


RENAMED = (7, 1)


def test_a_vehicle_with_another_system_id_is_known_by_its_clock_and_back_again():
    wire = Wire(committed=True)
    for _ in range(5):
        wire.second(HERE)
    for source in (RENAMED, VEHICLE, RENAMED):
        for _ in range(4):
            wire.second(HERE, source=source)
        assert wire.presence.source == source
        assert wire.events[-1] == AutopilotFound(wire.presence.autopilot)
        assert wire.presence.state is AutopilotState.PRESENT
        assert wire.presence.others(wire.now) == ()
    assert len(wire.events) == 4


@pytest.mark.parametrize(
    ("offset", "way"),
    [(130.0, HERE), (70.0, HERE), (100.0, THERE), (100.0, OTHER_ENDPOINT)],
    ids=["later clock", "earlier clock", "another address", "another endpoint"],
)
def test_another_vehicle_that_begins_when_it_falls_silent_is_not_taken_for_it(offset, way):
    wire = Wire(committed=True)
    wire.second(HERE)
    for _ in range(20):
        wire.second(way, source=RENAMED, offset=offset)
    assert wire.presence.source == VEHICLE
    assert wire.presence.state is AutopilotState.SILENT


def test_a_vehicle_beside_it_with_the_same_clock_does_not_take_its_place():
    """Two of them, powered together: both have spoken."""
    wire = Wire(committed=True)
    for _ in range(5):
        wire.second(HERE)
        wire.second(HERE, source=RENAMED)
    for _ in range(20):
        wire.second(HERE, source=RENAMED)
    assert wire.presence.source == VEHICLE


def test_in_a_push_and_where_an_id_is_configured_nothing_is_followed():
    for wire in (Wire(committed=True, held=True), Wire(system=1)):
        wire.second(HERE)
        for _ in range(20):
            wire.second(HERE, source=RENAMED)
        assert wire.presence.source == VEHICLE


@pytest.mark.parametrize("apart", [1.2 * LONGEST_DELAY_S, -1.2 * LONGEST_DELAY_S, 300.0])
@pytest.mark.parametrize(("committed", "way"), [(True, HERE), (False, THERE)])
def test_another_vehicle_under_its_name_does_not_take_the_place_of_one_that_was_learned(
    committed, way, apart
):
    """Both were heard, with clocks of their own: what is silent is not what still speaks."""
    wire = Wire(committed=committed)
    for _ in range(30):
        wire.second(HERE)
        wire.now -= 1.0
        wire.second(THERE, offset=100.0 + apart)
    for _ in range(30):
        wire.second(THERE, offset=100.0 + apart)
    assert wire.presence.way == way
    assert wire.presence.namesake(wire.now) is committed
    for _ in range(3):
        wire.second(HERE)
    assert wire.presence.way == way
    assert (AutopilotReturned() in wire.events) is True


def test_a_vehicle_that_was_heard_by_two_ways_and_reboots_is_no_other_one():
    """What stood beside it was itself, and after the reboot it is only heard by the second."""
    wire = Wire(committed=True)
    for _ in range(30):
        wire.second(HERE, OTHER_ENDPOINT)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    for _ in range(3):
        wire.second(OTHER_ENDPOINT, offset=-wire.now)
    assert wire.presence.way == OTHER_ENDPOINT


def test_a_way_that_is_late_is_no_other_vehicle():
    """By a radio that holds everything back for as long as any does, the clock is behind."""
    wire = Wire(committed=True)
    for _ in range(30):
        wire.second(HERE)
        wire.now -= 1.0
        wire.second(OTHER_ENDPOINT, offset=100.0 - 0.9 * LONGEST_DELAY_S)
    assert not wire.presence.namesake(wire.now)
    wire.silence(HEARTBEAT_TIMEOUT_S + 1.0)
    for _ in range(3):
        wire.second(OTHER_ENDPOINT, offset=100.0 - 0.9 * LONGEST_DELAY_S)
    assert wire.presence.way == OTHER_ENDPOINT
