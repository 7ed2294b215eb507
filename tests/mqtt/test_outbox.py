"""What waits for the broker: bounded, in order, and each event once."""

from onboard.daemon.mqtt.outbox import Outbox, newer


def drained(outbox):
    sent = []
    while (parcel := outbox.next()) is not None:
        outbox.confirm(parcel)
        sent.append((parcel.topic, parcel.payload))
    return sent


def test_of_too_many_events_the_oldest_are_lost_and_counted():
    outbox = Outbox(events_max=3)
    for number in range(5):
        outbox.event("event", bytes([number]))
    outbox.retain("state", b"now")
    assert outbox.dropped == 2
    assert drained(outbox) == [("state", b"now"), *(("event", bytes([n])) for n in (2, 3, 4))]


def test_a_late_confirmation_of_what_was_dropped_takes_nothing_else():
    outbox = Outbox(events_max=1)
    outbox.event("event", b"old")
    sent = outbox.next()
    outbox.event("event", b"new")
    outbox.confirm(sent)
    assert drained(outbox) == [("event", b"new")]


def test_what_is_newer_in_a_list_that_rolls():
    assert newer((), [1, 2]) == [1, 2]
    assert newer([1, 2], [1, 2, 3]) == [3]
    assert newer([1, 2], [2, 3, 4]) == [3, 4]
    assert newer([1, 2], [7, 8]) == [7, 8]
