"""A broker that hangs up again and again says nothing of why: what can be told of it is."""

import asyncio

from onboard.daemon.mqtt import limits
from onboard.daemon.mqtt.hang_ups import HangUps
from onboard.daemon.mqtt.outbox import Outbox, Parcel
from tests.mqtt.broker import Broker, Subscriber
from tests.mqtt.published import journal_line, kinds, snapshot

SMALL = Parcel("summary", b"x" * 100, retain=True)
LARGE = Parcel("state", b"x" * 5000, retain=True)


async def test_a_broker_that_takes_no_large_packet_gets_the_small_ones(tmp_path, publishing):
    lines = ("allow_anonymous true", "max_packet_size 1400")
    async with (
        Broker(tmp_path, *lines) as broker,
        publishing(broker.port) as publisher,
        Subscriber(broker.client()) as station,
    ):
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_too_large")
        assert b"onboard.summary/1" in await station.payload("onboard/1/summary")
        publisher.publish(snapshot(journal=[journal_line(1)]))
        await station.payload("onboard/1/event")
        assert "onboard/1/state" not in station.latest
        (notice,) = [n for n in publisher.kept if n.kind == "mqtt_too_large"]
        assert "state" in notice.text


async def test_two_clients_of_one_id_are_told_so_once_and_fill_no_log(tmp_path, publishing):
    async with (
        Broker(tmp_path) as broker,
        publishing(broker.port) as one,
        publishing(broker.port) as other,
    ):
        one.publish(snapshot())
        other.publish(snapshot())

        def asked(publisher):
            return [n.text for n in publisher.kept if "have the id onboard-1" in n.text]

        async with asyncio.timeout(60.0):
            while not (asked(one) and asked(other)):
                await asyncio.sleep(0.02)
        lost = one.counters["mqtt_failures"]
        async with asyncio.timeout(60.0):
            while one.counters["mqtt_failures"] < lost + 5:
                await asyncio.sleep(0.02)
        assert len(asked(one)) == len(asked(other)) == 1
        texts = [n.text for n in one.kept if n.kind == "mqtt_lost"]
        assert len(texts) == len(set(texts))


def test_what_went_through_before_was_not_too_large():
    hang_ups = HangUps()
    hang_ups.confirmed(LARGE)
    assert not any(hang_ups.take(LARGE, 1000.0) for _ in range(2 * limits.HANG_UPS))


def test_it_takes_one_document_in_connections_one_after_the_other():
    hang_ups = HangUps()
    for parcel in (LARGE, SMALL, None) * 2:
        assert not hang_ups.take(parcel, 1000.0)
    told = [hang_ups.take(LARGE, 1000.0) for _ in range(limits.HANG_UPS)]
    assert told == [False] * (limits.HANG_UPS - 1) + [True]
    assert not hang_ups.again_and_again


def test_a_broker_that_was_away_has_not_hung_up():
    hang_ups = HangUps()
    for _ in range(2 * limits.HANG_UPS):
        assert not hang_ups.take(LARGE, 1.0)
        hang_ups.absent()
        assert not hang_ups.again_and_again
    hang_ups.take(None, limits.LASTING_S)
    for _ in range(limits.HANG_UPS):
        hang_ups.take(None, 1.0)
    assert hang_ups.again_and_again


def test_what_is_too_large_keeps_nothing_else_waiting():
    outbox = Outbox()
    outbox.too_large = 1000
    outbox.retain("state", b"x" * 1000)
    outbox.retain("summary", b"x" * 10)
    outbox.event("event", b"x" * 2000)
    outbox.event("event", b"after it")
    assert outbox.next() == Parcel("summary", b"x" * 10, retain=True)
    outbox.confirm(outbox.next())
    assert outbox.next().payload == b"after it"
    assert outbox.dropped == 1
    outbox.retain("state", b"smaller")
    assert outbox.next().payload == b"smaller"
