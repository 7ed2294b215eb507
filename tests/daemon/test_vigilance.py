"""What on the wire is not as it should be: told once, and shown while it lasts."""

import asyncio
import json
import stat

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.daemon.process.condition import Flips
from onboard.daemon.process.signing_file import SigningFile
from onboard.daemon.setup.configuration import from_mapping
from onboard.errors import ConfigurationError
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.signing import SigningRecord
from tests.daemon.daemons import until
from tests.daemon.standing_vehicle import Vehicle
from tests.daemon.strangers import Stranger

virtual_time = pytest.mark.virtual_time


@pytest.mark.parametrize(
    ("endpoint", "is_open"),
    [
        ("udpin:127.0.0.1:14550", False),
        ("udpin:[::1]:14550", False),
        ("udpin:localhost:14550", False),
        ("udpin::14550", True),
        ("udpin:0.0.0.0:14550", True),
        ("udpout:192.168.1.2:14550", True),
        ("tcp:192.168.1.2:5760", False),
        ("serial:/dev/ttyAMA0:57600", False),
    ],
)
def test_udp_that_a_network_reaches_is_open_to_it(endpoint, is_open):
    assert Endpoint.parse(endpoint).is_open_to_a_network is is_open


@virtual_time
@pytest.mark.parametrize("signed", [True, False])
async def test_unsigned_udp_that_is_not_loopback_is_warned_of_at_the_start_and_shown(
    document, daemon, port, tmp_path, signed
):
    document["link"]["endpoints"] = [f"udpin:0.0.0.0:{port}"]
    if signed:
        key = tmp_path / "key"
        key.write_text("a passphrase")
        key.chmod(0o600)
        document["link"]["signing_key_file"] = str(key)
    async with daemon(document) as service:
        snapshot = service.snapshot()
        told = [n for n in snapshot.notices if n.kind == "unsigned_network"]
        assert len(told) == (0 if signed else 1)
        assert any("0.0.0.0" in text for text in snapshot.link.warnings) is not signed


@virtual_time
@pytest.mark.parametrize("allowed", [True, False])
async def test_a_ground_station_loosens_the_policy_only_where_it_may(
    document, daemon, port, allowed
):
    document["push"]["allow_loosening"] = allowed
    with Stranger(port) as station:
        async with daemon(document) as service, Vehicle(port) as vehicle:
            vehicle.armed = True
            await until(lambda: service.link.autopilot is not None)
            policy = lambda: service.snapshot().push.policy  # noqa: E731
            station.beat(system=255, component=190, kind=6, firmware=8)
            station.set("OBC_PUSH", 0.0)
            await until(lambda: policy() == "never")
            station.heard()
            station.set("OBC_PUSH", 1.0)
            answer = None

            def answered():
                nonlocal answer
                values = [m for m in station.heard() if m.get_type() == "PARAM_VALUE"]
                answer = next((m.param_value for m in values if m.param_id == "OBC_PUSH"), answer)
                return answer is not None

            await until(answered)
            assert answer == (1.0 if allowed else 0.0)
            assert policy() == ("landed" if allowed else "never")
            denied = [n for n in service.snapshot().notices if n.kind == "parameter_denied"]
            assert bool(denied) is not allowed


@virtual_time
@pytest.mark.parametrize("chosen", [False, True])
async def test_of_two_vehicles_on_one_link_it_is_said_whose_it_is(document, daemon, port, chosen):
    if chosen:
        document["link"]["system_id"] = 2
    with Stranger(port) as other:
        async with daemon(document) as service, Vehicle(port, system=2):
            await until(lambda: service.link.presence.proven)
            for _ in range(20):
                other.beat(system=1)
                await asyncio.sleep(0.1)
            texts = [n.text for n in service.snapshot().notices if n.kind == "another_vehicle"]
            assert service.link.autopilot.system == 2
            assert len(texts) == (0 if chosen else 1)
            assert all("system 1 is" in text and "for system 2" in text for text in texts)


@virtual_time
async def test_ground_stations_of_one_id_are_no_lost_frames(document, daemon, port):
    """Each counts its own packets; of both together every second one seems to have jumped."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.link.presence.proven)
        first, second = (mavlink.MAVLink(None, srcSystem=255, srcComponent=190) for _ in range(2))
        for number in range(20):
            for station, ahead in ((first, 0), (second, 100)):
                station.seq = number + ahead
                beat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(station)
                vehicle._transport.sendto(beat, vehicle._address)
            await asyncio.sleep(0.1)
        assert service.snapshot().link.counters["lost"] == 0
        vehicle._mav.seq += 4  # it does not count by itself
        await asyncio.sleep(1.0)
        counters = service.snapshot().link.counters
        assert counters["lost"] == 3
        assert counters["heard"] + 40 <= counters["frames"]


@virtual_time
async def test_a_silence_is_as_long_as_it_was(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.link.presence.proven)
        vehicle.stop_talking()
        await asyncio.sleep(21.0)
        vehicle.talk_again()
        texts = lambda: [n.text for n in service.snapshot().notices if "are back" in n.text]  # noqa: E731
        await until(texts)
        seconds = float(texts()[0].split("after ")[1].split(" s")[0])
        assert 20.0 <= seconds <= 23.0


@pytest.mark.parametrize("seconds", [0.0, 0.5, 1.99])
def test_disarmed_covers_two_heartbeats(seconds):
    with pytest.raises(ConfigurationError, match=r"\[push\] disarmed_s"):
        from_mapping({"push": {"disarmed_s": seconds}}, source="test")
    assert from_mapping({"push": {"disarmed_s": 2.0}}, source="test").push.disarmed_s == 2.0


def heard(*beats):
    """Whether these contradict each other: seconds, negative where it says disarmed."""
    flips = Flips()
    for beat in beats:
        flips.take(abs(beat), armed=beat > 0)
    return flips.contradict(abs(beats[-1]))


def test_a_vehicle_that_arms_and_disarms_does_not_contradict_itself():
    assert not heard(-1, -2, 3, 4, 5, -6, -7)
    assert not heard(-1, -2.9, 3.0, 4.0, 5.0)  # it says so at once
    assert not heard(-1, 2, 3.5, -4.5)


@pytest.mark.parametrize("period", [0.02, 0.11, 0.5, 1.0, 2.3])
def test_whoever_speaks_between_two_heartbeats_contradicts_them(period):
    real = [n + 0.5 for n in range(1, 12)]
    false = [-(1.0 + n * period) for n in range(round(10 / period))]
    assert heard(*sorted((*real, *false), key=abs))


def test_the_record_of_signing_outlives_the_service_and_whatever_else_is_there(tmp_path, caplog):
    path = tmp_path / "signing.json"
    file = SigningFile(path)
    assert file.load() == SigningRecord()
    record = SigningRecord(7_000_000, {"000101": 6_999_999})
    file.save(record)
    assert SigningFile(path).load() == record
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    for hostile in (
        b"",
        b"\xff\xfe",
        b"[" * 100_000,
        b"null",
        json.dumps({"timestamp": -1, "streams": {}}).encode(),
        json.dumps({"timestamp": 1 << 60, "streams": {}}).encode(),
        json.dumps({"timestamp": 1, "streams": {"xyz": 1}}).encode(),
        json.dumps({"timestamp": 1, "streams": {"00": 1}}).encode(),
    ):
        path.write_bytes(hostile)
        assert file.load() == SigningRecord()
    path.unlink()
    path.mkdir()
    assert file.load() == SigningRecord()
    file.save(record)
    file.save(record)
    assert len([r for r in caplog.records if r.levelname == "ERROR"]) == 1
