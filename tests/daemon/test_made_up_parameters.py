"""Names without end take no memory without end, and what is needed is still taken."""

from __future__ import annotations

import tracemalloc

from onboard.daemon.learning.handover import Handover
from onboard.daemon.pushing.parameters import NEEDED
from onboard.daemon.view.notices import Notices
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.limits import PARAMETERS_MAX
from onboard.mavlink.parameter_messages import ValueReceived
from onboard.mavlink.parameters import ParameterClient, ValueRead

NAMES = 120_000


def test_the_client_keeps_as_many_as_a_firmware_has_and_what_was_asked_for():
    client = ParameterClient()
    client.feed(ValueReceived("INS_ACCSCAL_X", 1.0), 0.0)
    tracemalloc.start()
    for number in range(NAMES):
        client.feed(ValueReceived(f"P{number}", 1.0), 0.0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(client.cache) == PARAMETERS_MAX
    assert peak < 2_000_000
    client.feed(ValueReceived("INS_ACCSCAL_X", 1.01), 0.0)
    assert client.cache["INS_ACCSCAL_X"] == 1.01
    client.read(["INS_ACCOFFS_X"], 0.0)
    assert ValueRead("INS_ACCOFFS_X", 0.5) in client.feed(ValueReceived("INS_ACCOFFS_X", 0.5), 0.0)
    assert client.cache["INS_ACCOFFS_X"] == 0.5


def test_the_learner_is_not_handed_more_than_a_firmware_has():
    handover = Handover(
        learner=None,
        notices=Notices(lambda: 0.0),
        there=None,
        clock=lambda: 0.0,
        wall_clock=lambda: 0.0,
        save_every_s=60.0,
        needed=NEEDED,
    )

    handover.decoder = Decoder(1, 1)

    def told(name):
        message = mavlink.MAVLink_param_value_message(name.encode(), 1.5, 9, 1, 0)
        message._header = mavlink.MAVLink_header(22, srcSystem=1, srcComponent=1)
        message.param_id = name
        return [sample.name for sample in handover.take(message)]

    taken = sum(len(told(f"P{number}")) for number in range(2 * PARAMETERS_MAX))
    assert taken == PARAMETERS_MAX
    assert handover.counters["parameters_ignored"] == PARAMETERS_MAX
    assert told("P5") == ["P5"]
    assert all(told(name) == [name] for name in NEEDED)
