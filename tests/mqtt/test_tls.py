"""Encrypted: the broker's certificate is checked, and ours shown where there is one."""

import asyncio
import gc
import ssl

import pytest

from onboard.daemon.mqtt.publisher import Publisher
from onboard.errors import ConfigurationError
from tests.mqtt.authority import Authority
from tests.mqtt.broker import Broker, Subscriber
from tests.mqtt.published import noticeboard, settings, snapshot


async def connected(publisher):
    async with asyncio.timeout(60.0):
        while not any(n.kind == "mqtt_connected" for n in publisher.kept):
            await asyncio.sleep(0.01)


async def lost(publisher):
    async with asyncio.timeout(60.0):
        while not (found := [n for n in publisher.kept if n.kind == "mqtt_lost"]):
            await asyncio.sleep(0.01)
    return found[0].text


@pytest.fixture
def authority(tmp_path):
    return Authority(tmp_path / "authority")


def encrypted(tmp_path, authority, *lines):
    certificate, key = authority.issue("broker")
    return Broker(
        tmp_path,
        f"certfile {certificate}",
        f"keyfile {key}",
        *(lines or ("allow_anonymous true",)),
        credentials={"tls_context": ssl.create_default_context(cafile=authority.certificate)},
    )


async def test_a_broker_of_ones_own_authority(tmp_path, authority, publishing):
    async with encrypted(tmp_path, authority) as broker:
        ca = str(authority.certificate)
        async with publishing(broker.port, tls=True, ca_file=ca) as publisher:
            publisher.publish(snapshot())
            await connected(publisher)
            async with Subscriber(broker.client()) as station:
                assert await station.payload("onboard/1/availability") == b"online"


# The MQTT library leaves a socket whose handshake failed to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
async def test_a_broker_that_nobody_vouches_for_gets_nothing(tmp_path, authority, publishing):
    foreign = Authority(tmp_path / "foreign")
    async with encrypted(tmp_path, authority) as broker:
        ca = str(foreign.certificate)
        async with publishing(broker.port, tls=True, ca_file=ca) as publisher:
            publisher.publish(snapshot())
            assert "certificate" in await lost(publisher)
            assert publisher.counters["mqtt_published"] == 0
    gc.collect()


@pytest.fixture
def unanswered(monkeypatch):
    """For who waits in vain for a broker's answer; a late one would be no other outcome."""
    monkeypatch.setattr("onboard.daemon.mqtt.limits.ANSWER_S", 0.5)


async def test_plain_text_to_an_encrypted_port_is_refused_in_words(
    tmp_path, authority, publishing, unanswered
):
    async with encrypted(tmp_path, authority) as broker, publishing(broker.port) as publisher:
        publisher.publish(snapshot())
        assert await lost(publisher)
        assert publisher.counters["mqtt_published"] == 0


@pytest.mark.parametrize("shown", [True, False])
async def test_client_certificates(tmp_path, authority, publishing, shown, request):
    if not shown:
        request.getfixturevalue("unanswered")
    lines = (
        f"cafile {authority.certificate}",
        "require_certificate true",
        "use_identity_as_username true",
    )
    certificate, key = authority.issue("kite")
    ours = {"certificate_file": str(certificate), "key_file": str(key)} if shown else {}
    async with (
        encrypted(tmp_path, authority, *lines) as broker,
        publishing(broker.port, tls=True, ca_file=str(authority.certificate), **ours) as publisher,
    ):
        publisher.publish(snapshot())
        if shown:
            await connected(publisher)
            assert "u'kite'" in broker.log
        else:
            await lost(publisher)
            assert publisher.counters["mqtt_published"] == 0


@pytest.mark.parametrize(
    ("key", "files"),
    [
        ("password_file", {"username": "x", "password_file": "none"}),
        ("ca_file", {"tls": True, "ca_file": "none"}),
        ("ca_file", {"tls": True, "ca_file": "rubbish"}),
        (
            "certificate_file",
            {"tls": True, "certificate_file": "rubbish", "key_file": "rubbish"},
        ),
    ],
)
async def test_a_file_that_cannot_be_used_is_named(tmp_path, key, files):
    (tmp_path / "rubbish").write_text("no certificate\n")
    located = {
        name: str(tmp_path / value) if name.endswith("_file") else value
        for name, value in files.items()
    }
    notices, _ = noticeboard()
    with pytest.raises(ConfigurationError) as caught:
        Publisher(settings(**located), None, notices, clock=lambda: 0.0)
    assert key in str(caught.value)
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)
