"""schema.json describes what is really sent."""

import json

import jsonschema
import pytest

from onboard.daemon.mqtt import schema
from onboard.daemon.mqtt.payloads import (
    CommandMessage,
    ReplyMessage,
    calibration_message,
    document,
    event_message,
    read_command,
)
from onboard.daemon.mqtt.summary import summary_message
from tests.mqtt.published import imu_view, journal_line, snapshot

PUBLISHED = json.loads(schema.FILE.read_text(encoding="utf-8"))


def validate(topic, payload):
    validator = jsonschema.Draft202012Validator(
        {**PUBLISHED, "required": [topic]}, format_checker=None
    )
    validator.validate({topic: json.loads(payload)})


def test_the_file_is_what_the_records_are_now():
    assert schema.FILE.read_text(encoding="utf-8") == schema.text(), (
        "python -m onboard.daemon.mqtt.schema writes it anew"
    )
    jsonschema.Draft202012Validator.check_schema(PUBLISHED)


def test_every_document_fits():
    diagnosis = {"schema": "onboard.explain/1", "verdict": "clean", "effects": []}
    full = snapshot(imus=[imu_view(1), imu_view(2)], journal=[journal_line(1)], diagnosis=diagnosis)
    validate("state", full.to_json())
    validate("state", snapshot(imus=[], system_id=None).to_json())
    validate("summary", summary_message(full))
    validate("calibration", calibration_message(full))
    validate("diagnosis", document(diagnosis))
    validate("event", event_message(journal_line(1)))
    validate("command/reply", document(ReplyMessage(command="approve", done="done")))
    validate("command", b'{"command": "approve", "imus": [1, 2], "id": "x"}')
    validate("availability", b'"online"')


@pytest.mark.parametrize(
    ("topic", "payload"),
    [
        ("state", b"{}"),
        ("calibration", b'{"schema": "onboard.calibration/2", "imus": [], "system_id": 1}'),
        ("event", b'{"at": 1}'),
        ("diagnosis", b'{"verdict": "perhaps"}'),
        ("availability", b'"perhaps"'),
        ("command", b'{"command": "format"}'),
        ("command", b'{"command": "approve", "imus": [6]}'),
        ("command", b'{"command": "approve", "imu": 1}'),
    ],
)
def test_what_does_not_fit_is_told(topic, payload):
    with pytest.raises(jsonschema.ValidationError):
        validate(topic, payload)


@pytest.mark.parametrize("command", ["approve", "reject", "rollback", "reset"])
def test_a_bare_word_is_a_command(command):
    assert read_command(f" {command}\n".encode()) == CommandMessage(command=command)
