"""JSON Schema of everything that goes over the broker.

``python -m onboard.daemon.mqtt.schema`` writes it.

The file ``schema.json`` is what other programs read; it is made from the records themselves.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec

from onboard.daemon.mqtt.payloads import (
    CALIBRATION_SCHEMA,
    EVENT_SCHEMA,
    REPLY_SCHEMA,
    CalibrationMessage,
    CommandMessage,
    EventMessage,
    ReplyMessage,
)
from onboard.daemon.mqtt.summary import SUMMARY_SCHEMA, SummaryMessage
from onboard.daemon.view.snapshot import SCHEMA, Snapshot

FILE = Path(__file__).with_name("schema.json")
DIALECT = "https://json-schema.org/draft/2020-12/schema"
DOCUMENTS: dict[str, tuple[type[msgspec.Struct], str | None]] = {
    "state": (Snapshot, SCHEMA),
    "summary": (SummaryMessage, SUMMARY_SCHEMA),
    "calibration": (CalibrationMessage, CALIBRATION_SCHEMA),
    "event": (EventMessage, EVENT_SCHEMA),
    "command": (CommandMessage, None),
    "command/reply": (ReplyMessage, REPLY_SCHEMA),
}
DIAGNOSIS: dict[str, Any] = {
    "type": "object",
    "title": "Diagnosis",
    "description": "What `onboard explain --json` writes.",
    "properties": {
        "schema": {"const": "onboard.explain/1"},
        "verdict": {
            "enum": ["clean", "explained", "partly_explained", "unexplained", "insufficient"]
        },
        "effects": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {"name": {"type": "string"}},
                "required": ["name"],
            },
        },
    },
    "required": ["schema", "verdict", "effects"],
}
AVAILABILITY: dict[str, Any] = {
    "title": "Availability",
    "description": "Plain text, not JSON; the broker says offline where the service cannot.",
    "enum": ["online", "offline"],
}


def schema() -> dict[str, Any]:
    """One JSON Schema document; ``properties`` has one entry per topic below the prefix."""
    types = [record for record, _ in DOCUMENTS.values()]
    references, components = msgspec.json.schema_components(types, ref_template="#/$defs/{name}")
    topics: dict[str, Any] = dict(zip(DOCUMENTS, references, strict=True))
    for topic, (record, name) in DOCUMENTS.items():
        fields = components[record.__name__]
        if name is not None:
            # Always there, and always this: what a reader tells the version by.
            fields["properties"]["schema"] = {"const": name}
            fields["required"] = [*fields["required"], "schema"]
        del topic
    return {
        "$schema": DIALECT,
        "title": "onboard over MQTT: the document of each topic below the prefix",
        "type": "object",
        "properties": topics | {"diagnosis": DIAGNOSIS, "availability": AVAILABILITY},
        "$defs": components,
    }


def text() -> str:
    """The file's contents."""
    return json.dumps(schema(), indent=1, sort_keys=True) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
