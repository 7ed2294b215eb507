"""Who is believed: others on the wire, who speak first, louder, or as the vehicle itself."""

import asyncio
import contextlib

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.mavlink.limits import ASKED_HZ, BYTES_PER_TURN, LIST_HZ, SENDERS_WAITING
from tests.daemon.daemons import SIX, WANTED, convinced, in_force, until
from tests.daemon.standing_vehicle import Vehicle
from tests.daemon.strangers import Stranger

pytestmark = pytest.mark.virtual_time
NEW = WANTED.scale + WANTED.offset


@pytest.fixture
def stranger(port):
    with Stranger(port) as stranger:
        yield stranger


@contextlib.asynccontextmanager
async def repeated(what, period):
    """Have it done again and again."""

    async def forever():
        while True:
            what()
            await asyncio.sleep(period)

    task = asyncio.create_task(forever(), name="stranger")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def as_disarmed_vehicle(stranger, vehicle):
    old = dict(zip(SIX, in_force(vehicle), strict=True))

    def speak():
        stranger.beat(armed=False)
        for name, value in old.items():
            stranger.value(name, value)

    return speak


@pytest.mark.parametrize("a_second", [9, 50])
async def test_an_armed_vehicle_is_not_written_because_somebody_calls_it_disarmed(
    a_second, document, daemon, port, stranger
):
    document["push"]["disarmed_s"] = 2.0
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed, vehicle.landed = True, False
        convinced(service, WANTED)
        await until(lambda: service.parts.parameters.complete)
        async with repeated(as_disarmed_vehicle(stranger, vehicle), 1.0 / a_second):
            await asyncio.sleep(30.0)
        assert vehicle.sets == []
        assert service.parts.observed.condition(service._clock()).armed is True


async def test_one_who_was_there_first_and_is_silent_about_flight_gives_way(
    document, daemon, port, stranger
):
    document["push"]["disarmed_s"] = 2.0
    async with daemon(document) as service, repeated(lambda: stranger.beat(system=77), 1.0):
        await until(lambda: service.link.autopilot is not None)
        async with Vehicle(port) as vehicle:
            convinced(service, WANTED)
            await until(lambda: service.link.autopilot.system == 1)
            await until(lambda: in_force(vehicle) == pytest.approx(NEW, rel=1e-6))


async def test_another_component_of_the_system_does_not_lock_the_autopilot_out(
    document, daemon, port, stranger
):
    document["link"]["system_id"] = 1
    async with daemon(document) as service, repeated(lambda: stranger.beat(component=50), 1.0):
        await until(lambda: service.link.autopilot is not None)
        async with Vehicle(port):
            await until(lambda: service.link.autopilot.component == 1)


async def test_eight_who_say_nothing_do_not_keep_the_vehicle_out(document, daemon, port):
    with contextlib.ExitStack() as stack:
        crowd = [stack.enter_context(Stranger(port)) for _ in range(8)]

        def murmur():
            for one in crowd:
                one.raw(b"x")

        async with daemon(document) as service, repeated(murmur, 1.0):
            await asyncio.sleep(3.0)
            async with Vehicle(port) as vehicle:
                convinced(service, WANTED)
                await until(lambda: in_force(vehicle) == pytest.approx(NEW, rel=1e-6))


async def test_forty_who_speak_mavlink_do_not_keep_the_vehicle_out(document, daemon, port):
    """They are ground stations, for all that they say, and were there before the vehicle."""
    with contextlib.ExitStack() as stack:
        crowd = [stack.enter_context(Stranger(port)) for _ in range(40)]

        def greet():
            for one in crowd:
                one.beat(system=255, component=190, kind=6, firmware=8)

        async with daemon(document) as service, repeated(greet, 1.0):
            await asyncio.sleep(3.0)
            async with Vehicle(port) as vehicle:
                convinced(service, WANTED)
                await until(lambda: in_force(vehicle) == pytest.approx(NEW, rel=1e-6))


@pytest.mark.parametrize("source", [(42, 7), (1, 1), (255, 190)])
async def test_nobody_on_the_wire_loosens_the_policy(source, document, daemon, port, stranger):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed, vehicle.landed = True, False
        convinced(service, WANTED)
        await until(lambda: service.parts.parameters.complete)
        stranger.set("OBC_PUSH", 2.0, system=source[0], component=source[1])
        await asyncio.sleep(1.0)
        assert service.snapshot().push.policy == "landed"
        flags = 0x33F
        async with repeated(
            lambda: stranger.say(mavlink.MAVLink_ekf_status_report_message(flags, 0, 0, 0, 0, 0)),
            0.2,
        ):
            await asyncio.sleep(10.0)
        assert vehicle.sets == []


async def armed_in_the_middle(document, daemon, port, after_sets, *, says_so_at_once):
    """What was set after the vehicle armed: (s after arming, whether it is a new value)."""
    loop = asyncio.get_running_loop()
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = dict(zip(SIX, in_force(vehicle), strict=True))
        armed_at, sets = None, []
        taken = vehicle._set

        def set_and_note(message):
            nonlocal armed_at
            taken(message)
            new = message.param_value != pytest.approx(before[message.param_id], abs=1e-9)
            sets.append((loop.time(), new))
            if len(sets) == after_sets:
                vehicle.armed, armed_at = True, loop.time()
                if says_so_at_once:
                    vehicle.send(mavlink.MAVLink_heartbeat_message(2, 3, 128, 0, 4, 3))

        vehicle._set = set_and_note
        convinced(service, WANTED)
        await until(lambda: armed_at is not None)
        await asyncio.sleep(20.0)
        late = [(t - armed_at, new) for t, new in sets if t > armed_at]
        return late, in_force(vehicle), tuple(before.values()), service.snapshot()


@pytest.mark.parametrize("after_sets", [1, 3, 5, 6])
async def test_who_says_at_once_that_it_armed_gets_its_old_values_back_at_once(
    after_sets, document, daemon, port
):
    late, now, old, snapshot = await armed_in_the_middle(
        document, daemon, port, after_sets, says_so_at_once=True
    )
    assert [new for _, new in late] == [False] * after_sets
    assert late[-1][0] < 0.5
    assert now == pytest.approx(old, rel=1e-6)
    assert snapshot.push.state == "idle"


@pytest.mark.parametrize("after_sets", [1, 3, 5])
async def test_who_says_so_with_the_next_heartbeat_gets_no_new_value_after_it(
    after_sets, document, daemon, port
):
    late, now, old, snapshot = await armed_in_the_middle(
        document, daemon, port, after_sets, says_so_at_once=False
    )
    assert all(t <= 1.1 for t, new in late if new)  # its HEARTBEAT comes within a second
    assert all(t <= 1.1 + 2.0 for t, _ in late)
    assert now == pytest.approx(old, rel=1e-6) or now == pytest.approx(NEW, rel=1e-6)
    assert snapshot.push.state == "idle"


async def test_heartbeats_that_contradict_each_other_stop_a_push_and_are_shown(
    document, daemon, port
):
    """Somebody forges the vehicle's own address, so that only what he says gives him away."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        old = in_force(vehicle)
        taken = vehicle._set

        def set_and_contradict(message):
            taken(message)
            if len(vehicle.sets) == 2:
                for mode in (128, 0):
                    vehicle.send(mavlink.MAVLink_heartbeat_message(2, 3, mode, 0, 4, 3))

        vehicle._set = set_and_contradict
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert in_force(vehicle) == pytest.approx(old, rel=1e-6)
        sets = len(vehicle.sets)
        await asyncio.sleep(10.0)
        snapshot = service.snapshot()
        assert len(vehicle.sets) == sets
        assert any("armed and disarmed" in warning for warning in snapshot.link.warnings)
        assert "heartbeats_contradict" in snapshot.push.proposals[0].held_back


async def test_a_rival_that_says_armed_is_believed_as_far_as_that(document, daemon, port, stranger):
    """Whichever of the two is the vehicle: one of them is armed."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        async with repeated(lambda: stranger.beat(armed=True), 1.0):
            await asyncio.sleep(2.0)
            convinced(service, WANTED)
            await asyncio.sleep(20.0)
            snapshot = service.snapshot()
        assert vehicle.sets == []
        assert snapshot.link.counters["foreign"] > 10
        assert any("speak as the vehicle" in warning for warning in snapshot.link.warnings)


async def test_what_is_for_the_vehicle_goes_to_the_vehicle_alone(document, daemon, port, stranger):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        async with repeated(stranger.beat, 1.0):
            await asyncio.sleep(3.0)
            convinced(service, WANTED)
            await until(lambda: in_force(vehicle) == pytest.approx(NEW, rel=1e-6))
        kinds = {message.get_type() for message in stranger.heard()}
        assert "HEARTBEAT" in kinds
        assert not kinds & {"PARAM_SET", "PARAM_REQUEST_READ", "COMMAND_LONG"}


async def test_what_a_crowd_sends_beyond_its_queues_is_counted_and_shown(document, daemon, port):
    async with daemon(document) as service, Vehicle(port):
        await until(lambda: service.parts.parameters.complete)
        transport = service.link.connections[0]._transport
        with contextlib.ExitStack() as stack:
            crowd = [stack.enter_context(Stranger(port)) for _ in range(SENDERS_WAITING + 8)]
            for one in crowd:
                one.raw(b"x" * BYTES_PER_TURN)
            await until(lambda: transport.refused >= 8)
            await asyncio.sleep(1.0)
        assert service.snapshot().link.counters["rationed"] >= 8
        assert service.snapshot().link.state == "present"


async def test_requests_of_a_stranger_take_little_of_the_vehicles_line(
    document, daemon, port, stranger
):
    """Values are for everybody, and so go to the vehicle too: over a radio, it may be."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        vehicle.heard.clear()

        def ask():
            for _ in range(100):
                stranger.read("OBC_STATE")
                stranger.set("OBC_APPROVE", 1.0)

        async with repeated(ask, 0.1):
            await asyncio.sleep(10.0)
        values = vehicle.heard.count("PARAM_VALUE")
        assert 0 < values <= (ASKED_HZ + LIST_HZ) * 11.0
        assert service.snapshot().counters["parameter_requests_left"] > 100


async def test_samples_of_a_stranger_are_not_the_vehicles(document, daemon, port, stranger):
    """With the vehicle's own time stamps, and sent first."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        heard = []
        taken = service.handover.take
        service.handover.take = lambda message: heard.append(message) or taken(message)

        def forge():
            ms = int(vehicle.boot_ms + 1e3 * vehicle._period)
            false = mavlink.MAVLink_raw_imu_message(ms * 1000, 500, 0, -1000, 0, 0, 0, 0, 0, 0)
            stranger.say(false)

        async with repeated(forge, vehicle._period):
            await asyncio.sleep(10.0)
        assert {m.xacc for m in heard if m.get_type() == "RAW_IMU"} == {0}


async def test_two_samples_of_one_stamp_are_both_dropped_and_shown(document, daemon, port):
    """From the vehicle's own address: nobody can tell which is true."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.handover.identified)
        convinced(service, WANTED)
        ms = int(vehicle.boot_ms) + 1
        kept = service.handover._samples
        for xacc in (500, 0, 500):
            vehicle.send(
                mavlink.MAVLink_raw_imu_message(ms * 1000, xacc, 0, -1000, 0, 0, 0, 0, 0, 0)
            )
        vehicle.armed = True
        await until(lambda: service.snapshot().counters.get("samples_contradict"))
        kept = [s for s in service.handover._samples if getattr(s, "t", None) == ms * 1e-3]
        assert not [s for s in kept if type(s).__name__ == "ImuSample"]
        await asyncio.sleep(2.0)
        snapshot = service.snapshot()
        assert any("one time stamp" in warning for warning in snapshot.link.warnings)
        assert "doubtful" in snapshot.push.proposals[0].held_back


class Routed(Vehicle):
    """Serves two ports, and hands on what is for everybody, as ArduPilot does."""

    def __init__(self, port, other):
        super().__init__(port)
        self._ports = [("127.0.0.1", port), ("127.0.0.1", other)]

    def send(self, message):
        packet = message.pack(self._mav)
        for address in self._ports:
            self._transport.sendto(packet, address)

    def datagram_received(self, data, address):
        for other in self._ports:
            if other != address and mavlink.MAVLink(None).decode(bytearray(data)).get_msgId() == 0:
                self._transport.sendto(data, other)
        super().datagram_received(data, address)


async def test_of_two_services_the_later_one_writes_nothing(document, daemon, port, tmp_path):
    with Stranger(0) as probe:
        other = probe._socket.getsockname()[1]
    second = document | {
        "link": {"endpoints": [f"udpin:127.0.0.1:{other}"]},
        "state": {"directory": str(tmp_path / "second")},
    }
    async with daemon(document) as first, Routed(port, other) as vehicle:
        vehicle.armed = True
        await until(lambda: first.parts.parameters.complete)
        await asyncio.sleep(6.0)
        async with daemon(second) as later:
            await until(lambda: later.parts.parameters.complete)
            await asyncio.sleep(3.0)
            convinced(first, WANTED)
            convinced(later, WANTED)
            vehicle.armed = False
            await until(lambda: first.snapshot().push.can_roll_back == (1,))
            await asyncio.sleep(10.0)
            assert len(vehicle.sets) == 6
            assert later.snapshot().push.can_roll_back == ()
            assert "was there first" in later.snapshot().mode_reason
        await asyncio.sleep(15.0)
        assert first.snapshot().mode == "active"
