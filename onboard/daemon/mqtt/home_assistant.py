"""Home Assistant's discovery: one retained document that names the device and what it shows.

Everything it shows is read from topic ``summary``; nothing can be changed from there.  The form is
Home Assistant's *device discovery* (2024.11 and later).
"""

from __future__ import annotations

import re
from typing import Any

import msgspec

from onboard.daemon.view.snapshot import Snapshot

LONGEST = 255
"""Characters of a state; Home Assistant refuses longer ones."""


def discovery_topic(discovery: str, prefix: str) -> str:
    """Where Home Assistant looks for it, e.g. ``homeassistant/device/onboard-1/config``."""
    return f"{discovery.rstrip('/')}/device/{_identifier(prefix)}/config"


def discovery_message(prefix: str, snapshot: Snapshot) -> bytes:
    """The document: a device with its sensors.

    Args:
        prefix: of the service's own topics.
        snapshot: which accelerometers there are, and whose.
    """
    identifier = _identifier(prefix)
    link = snapshot.link
    kind = " ".join(word for word in (link.autopilot, link.vehicle) if word)
    components = {
        name: {
            "unique_id": f"{identifier}_{name}",
            "state_topic": f"{prefix}/summary",
            "availability_topic": f"{prefix}/availability",
            **shown,
        }
        for name, shown in _components(snapshot).items()
    }
    return msgspec.json.encode(
        {
            "device": {
                "identifiers": [identifier],
                "name": prefix.replace("/", " "),
                "model": kind or "vehicle",
                "sw_version": snapshot.version,
            },
            "origin": {"name": "onboard", "sw_version": snapshot.version},
            "components": components,
        }
    )


def _components(snapshot: Snapshot) -> dict[str, dict[str, Any]]:
    sensors = {
        "state": {
            "platform": "sensor",
            "name": "Calibration",
            "value_template": "{{ value_json.title }}",
        },
        "next": {
            "platform": "sensor",
            "name": "What to do next",
            "value_template": f"{{{{ value_json.next[:{LONGEST}] }}}}",
        },
        "trusted": {
            "platform": "sensor",
            "name": "Flight with trusted GPS",
            "device_class": "duration",
            "unit_of_measurement": "s",
            "value_template": "{{ value_json.trusted_s }}",
        },
        "gps": _yes_or_no("GPS trusted", "value_json.gps_trusted"),
        "approval": _yes_or_no("Waits for approval", "value_json.approval_needed"),
        "problem": {
            **_yes_or_no("Needs attention", "value_json.severity in ('warning', 'error')"),
            "device_class": "problem",
        },
    }
    for index, view in enumerate(snapshot.imus):
        sensors[f"imu_{view.imu}"] = {
            "platform": "sensor",
            "name": f"Accelerometer {view.imu} covered",
            "unit_of_measurement": "%",
            "state_class": "measurement",
            "value_template": f"{{{{ value_json.imus[{index}].percent }}}}",
        }
    return sensors


def _yes_or_no(name: str, condition: str) -> dict[str, Any]:
    template = f"{{{{ 'ON' if {condition} else 'OFF' }}}}"
    return {"platform": "binary_sensor", "name": name, "value_template": template}


def _identifier(prefix: str) -> str:
    """With the characters that Home Assistant allows."""
    return re.sub(r"[^A-Za-z0-9_-]", "-", prefix)
