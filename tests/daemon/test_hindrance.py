"""An autopilot is heard and nothing happens: the service says why."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.daemon.process import limits
from onboard.daemon.pushing.parameters import NEEDED, ParameterWatch
from onboard.errors import LinkError
from tests.daemon.daemons import SIX, until
from tests.daemon.standing_vehicle import Vehicle
from tests.daemon.test_parameter_watch import told

virtual_time = pytest.mark.virtual_time


class Sparing(Vehicle):
    """Sends RAW_IMU ``rate`` times a second, and of the rest not all."""

    lacks = ""

    def send(self, message):
        if message.get_type() != self.lacks:
            super().send(message)
        if message.get_type() == "RAW_IMU" and self.lacks != "GPS_RAW_INT":
            fix = (0, 3, 0, 0, 0, 100, 100, 0, 0, 12)
            super().send(mavlink.MAVLink_gps_raw_int_message(*fix))


class Deaf(Sparing):
    """The line to it is cut, or it drops what is not signed."""

    deaf = True

    def datagram_received(self, data, address):
        if not self.deaf:
            super().datagram_received(data, address)

    def sign(self):
        self._mav.signing.secret_key = bytes(range(32))
        self._mav.signing.link_id = 1
        self._mav.signing.sign_outgoing = True


@pytest.fixture(autouse=True)
def unhurried(monkeypatch, impatient):
    """Rates are measured over ticks; to wait for long is only costly here."""
    monkeypatch.setattr(limits, "TICK_S", 1.0)
    monkeypatch.setattr(limits, "SELDOM_S", 8.0)


def kinds(service):
    return [notice.kind for notice in service.snapshot().notices]


@virtual_time
@pytest.mark.parametrize("signs", [False, True])
async def test_an_autopilot_that_answers_nothing_is_told_of(document, daemon, port, signs):
    async with daemon(document) as service, Deaf(port) as vehicle:
        if signs:
            vehicle.sign()
        await until(lambda: "unanswered" in kinds(service))
        (warning,) = service.snapshot().link.warnings
        assert ("signing_key_file" in warning) is signs
        assert service.snapshot().next_step.text == warning
        vehicle.deaf = False
        await until(lambda: not service.snapshot().link.warnings)
        assert kinds(service).count("unanswered") == 1


class Full(Sparing):
    """A slow line: it obeys, but what it is asked for has no room beside its samples."""

    full = True
    untold = ()

    def _tell(self, name):
        if not self.full and name not in self.untold:
            super()._tell(name)


@virtual_time
async def test_a_line_that_has_no_room_for_parameters_is_not_called_cut(document, daemon, port):
    async with daemon(document) as service, Full(port, rate=8.0) as vehicle:
        await until(lambda: "unanswered" in kinds(service))
        (warning,) = service.snapshot().link.warnings
        assert "parameters are asked for in vain" in warning
        vehicle.full = False
        await until(lambda: not service.snapshot().link.warnings)


@virtual_time
async def test_what_it_does_not_tell_is_said_while_others_are_answered(document, daemon, port):
    async with daemon(document) as service, Full(port, rate=8.0) as vehicle:
        vehicle.full, vehicle.untold = False, SIX[:3]
        await until(lambda: "untold" in kinds(service))
        (warning,) = service.snapshot().link.warnings
        assert warning.startswith(f"the autopilot does not tell {SIX[0]} and 2 more")
        assert service.snapshot().next_step.text == warning
        vehicle.untold = ()
        await until(lambda: not service.snapshot().link.warnings)
        assert kinds(service).count("untold") == 1


@virtual_time
@pytest.mark.parametrize("signs", [False, True])
async def test_heartbeats_without_our_signature_are_told_of(
    document, daemon, port, tmp_path, signs
):
    key = tmp_path / "key"
    key.write_text("a passphrase")
    key.chmod(0o600)
    document["link"]["signing_key_file"] = str(key)
    async with daemon(document) as service, Deaf(port) as vehicle:
        if signs:
            vehicle.sign()  # with another key
        await until(lambda: "unsigned_vehicle" in kinds(service))
        assert service.link.autopilot is None
        assert service.snapshot().next_step.severity == "warning"
        with pytest.raises(LinkError, match="not signed with our key"):
            await service.link.wait_autopilot(1.0)


@virtual_time
@pytest.mark.parametrize(
    ("rate", "lacks"),
    [(4.0, "4 times"), (8.0, ""), (8.0, "RAW_IMU"), (8.0, "ATTITUDE"), (8.0, "GPS_RAW_INT")],
)
async def test_messages_too_seldom_to_learn_from_are_told_of(document, daemon, port, rate, lacks):
    async with daemon(document) as service, Sparing(port, rate=rate) as vehicle:
        vehicle.lacks = lacks
        await until(lambda: service.link.autopilot is not None)
        began = service.snapshot().uptime_s
        waited = lambda: service.snapshot().uptime_s - began  # noqa: E731
        await until(lambda: waited() > limits.SELDOM_S + 6.0 or "seldom" in kinds(service))
        assert ("seldom" in kinds(service)) is bool(lacks)
        warnings = service.snapshot().link.warnings
        assert len(warnings) == bool(lacks)
        assert all(lacks in text for text in warnings)


@pytest.mark.parametrize("seed", range(3))
def test_a_line_that_loses_a_third_both_ways_is_not_mute(seed):
    """An hour of it, with names that this firmware does not have."""
    chance, watch, there = random.Random(seed), ParameterWatch(), sorted(NEEDED)[::2]
    watch.start(1, 1, 0.0)
    worst = 0.0
    for step in range(18_000):
        now = 0.2 * step
        asked = [m.param_id for m in watch.poll(now) if m.get_type() == "PARAM_REQUEST_READ"]
        while asked:
            name = asked.pop()
            if name in there and chance.random() < 4 / 9:
                answers = watch.feed(told(name, 0.5), now)
                asked += [m.param_id for m in answers]
        worst = max(worst, watch.unanswered(now))
    assert worst <= limits.UNANSWERED_S
