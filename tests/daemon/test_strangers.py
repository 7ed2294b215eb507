"""Who is believed: others on the wire, who speak first, louder, or as the vehicle itself."""

import asyncio
import contextlib

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.maths.accelerometer import parameter_names
from tests.daemon.daemons import calibration, convinced, until
from tests.daemon.standing_vehicle import Vehicle
from tests.daemon.strangers import Stranger

pytestmark = pytest.mark.virtual_time
SIX = parameter_names(1).six
WANTED = calibration()
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


def in_force(vehicle):
    return tuple(vehicle.parameters[name] for name in SIX)


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
    async with daemon(document) as service:
        async with repeated(lambda: stranger.beat(system=77), 1.0):
            await until(lambda: service.link.autopilot is not None)
            async with Vehicle(port) as vehicle:
                convinced(service, WANTED)
                await until(lambda: service.link.autopilot.system == 1)
                await until(lambda: in_force(vehicle) == pytest.approx(NEW, rel=1e-6))


async def test_another_component_of_the_system_does_not_lock_the_autopilot_out(
    document, daemon, port, stranger
):
    document["link"]["system_id"] = 1
    async with daemon(document) as service:
        async with repeated(lambda: stranger.beat(component=50), 1.0):
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


async def armed_in_the_middle(document, daemon, port, after_sets):
    """(new values, all values) set after the vehicle armed, and how long after, s."""
    loop = asyncio.get_running_loop()
    document["push"]["disarmed_s"] = 2.0
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

        vehicle._set = set_and_note
        convinced(service, WANTED)
        await until(lambda: armed_at is not None)
        await asyncio.sleep(20.0)
        late = [(t - armed_at, new) for t, new in sets if t > armed_at]
        return late, in_force(vehicle), tuple(before.values()), service.snapshot()


@pytest.mark.parametrize("after_sets", [1, 3, 5])
async def test_a_vehicle_that_arms_gets_no_new_value_and_its_old_ones_at_once(
    after_sets, document, daemon, port
):
    late, now, old, snapshot = await armed_in_the_middle(document, daemon, port, after_sets)
    print("after arming:", [(round(t, 2), "new" if new else "old") for t, new in late])
    assert now == pytest.approx(old, rel=1e-6)
    assert max((t for t, new in late if new), default=0.0) <= 1.1  # until its next HEARTBEAT
    assert max((t for t, _ in late), default=0.0) <= 3.0
    assert snapshot.push.state == "idle"


async def test_of_two_services_the_later_one_writes_nothing(
    document, daemon, port, tmp_path, unused_port
):
    second = document | {
        "link": {"endpoints": [f"udpin:127.0.0.1:{unused_port}"]},
        "state": {"directory": str(tmp_path / "second")},
    }
    async with daemon(document) as first, Vehicle(port) as vehicle:
        vehicle.armed = True
        await until(lambda: first.parts.parameters.complete)
        await asyncio.sleep(5.0)
        async with daemon(second) as later, Vehicle.again(vehicle, unused_port):
            await until(lambda: later.parts.parameters.complete)
            await asyncio.sleep(3.0)
            convinced(first, WANTED)
            convinced(later, WANTED)
            vehicle.armed = False
            await until(lambda: first.snapshot().push.can_roll_back == (1,))
            await asyncio.sleep(10.0)
            assert len(vehicle.sets) == 6
            assert later.snapshot().push.can_roll_back == ()
            assert "other service" in later.snapshot().mode_reason
