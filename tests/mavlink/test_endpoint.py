from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.errors import ConfigurationError, UsageError
from onboard.mavlink.endpoint import Endpoint, EndpointError, EndpointKind
from onboard.mavlink.limits import DEFAULT_BAUD


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("udp:127.0.0.1:14550", Endpoint(EndpointKind.UDP_IN, "127.0.0.1", 14550)),
        ("udpin::14550", Endpoint(EndpointKind.UDP_IN, "", 14550)),
        ("udpout:10.0.0.2:14555", Endpoint(EndpointKind.UDP_OUT, "10.0.0.2", 14555)),
        ("tcp:localhost:5760", Endpoint(EndpointKind.TCP, "localhost", 5760)),
        ("tcp:[::1]:5760", Endpoint(EndpointKind.TCP, "::1", 5760)),
        (
            "serial:/dev/ttyAMA0:921600",
            Endpoint(EndpointKind.SERIAL, device="/dev/ttyAMA0", baud=921600),
        ),
        (
            "serial:/dev/ttyACM0",
            Endpoint(EndpointKind.SERIAL, device="/dev/ttyACM0", baud=DEFAULT_BAUD),
        ),
    ],
)
def test_endpoints_are_read_and_written_back(text, endpoint):
    assert Endpoint.parse(text) == endpoint
    assert Endpoint.parse(str(endpoint)) == endpoint


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "must start with"),
        ("14550", "must start with"),
        ("http:localhost:80", "must start with"),
        ("udpin", "must start with"),
        ("udp:14550", "expected udpin:HOST:PORT"),
        ("tcp::5760", "host is missing"),
        ("tcp:localhost:", "port '' is not a number"),
        ("tcp:localhost:57x0", "port '57x0' is not a number"),
        ("tcp:localhost:0", "not within 1 to 65535"),
        ("udp:localhost:65536", "not within 1 to 65535"),
        ("tcp:::1:5760", "brackets"),
        ("serial:", "expected serial:DEVICE:BAUD"),
        ("serial:/dev/ttyS0:12345", "baud rate 12345 is not one of"),
        ("serial:/dev/ttyS0:fast", "baud rate 'fast' is not a number"),
    ],
)
def test_errors_quote_the_endpoint_and_say_what_is_wrong(text, says):
    with pytest.raises(ConfigurationError) as caught:
        Endpoint.parse(text)
    assert repr(text) in str(caught.value)
    assert says in str(caught.value)


@given(st.text(max_size=30))
def test_any_text_is_an_endpoint_or_one_clear_error(text):
    try:
        endpoint = Endpoint.parse(text)
    except ConfigurationError:
        return
    assert Endpoint.parse(str(endpoint)) == endpoint


def test_an_endpoint_that_cannot_be_opened_is_the_users_to_mend():
    assert issubclass(EndpointError, UsageError)
    assert EndpointError.exit_status == 2
