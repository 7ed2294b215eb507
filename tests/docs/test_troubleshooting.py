"""Whatever the program can say is in the manual, and the manual has nothing that it cannot say."""

from __future__ import annotations

import functools
import re
from pathlib import Path

from onboard.core.gps.distrust import Distrust
from onboard.daemon.outlets.announcer import LINES
from onboard.daemon.outlets.parameter_view import REASONS
from onboard.daemon.view.trust import FILTER_UNKNOWN
from onboard.push.policy import Objection
from onboard.push.signals import Reason
from tests.docs.messages_in_code import Message, objections, posted, raised, told

ROOT = Path(__file__).resolve().parents[2]
MANUAL = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
SECTIONS = dict(
    zip(*[iter(re.split(r"^## (.+)$", MANUAL, flags=re.MULTILINE)[1:])] * 2, strict=True)
)
INTERNAL = ("core/", "push/plan.py", "push/course.py", "push/transaction.py")
"""Never shown by themselves: behind *starting from nothing*, or a fault of ours."""


def entries(section: str) -> list[str]:
    """The code spans of the tables' first columns."""
    return re.findall(r"^\| `([^`]+)` \|", SECTIONS[section], flags=re.MULTILINE)


@functools.cache
def errors() -> dict[Message, str]:
    """What a person may read as one line, and where it is raised."""
    return {m: where for m, where in raised().items() if not where.startswith(INTERNAL)}


def test_the_code_was_read():
    assert len(errors()) > 50
    assert ("no such file",) in errors()
    assert "window_opened" in posted()
    assert objections().keys() <= set(Objection.__members__)


def test_every_one_line_error_has_an_entry():
    manual = entries("One line and an exit status")
    for message, where in errors().items():
        assert any(told(message, entry) for entry in manual), f"{where}: {message}"


def test_no_entry_is_of_an_error_that_does_not_exist():
    # Those come from the operating system's own words.
    foreign = {"ENDPOINT: port in use"}
    for entry in entries("One line and an exit status"):
        assert entry in foreign or any(told(m, entry) for m in errors()), entry


def test_every_reason_to_hold_back_has_an_entry_and_no_other():
    source = (ROOT / "onboard" / "daemon" / "pushing" / "proposals.py").read_text(encoding="utf-8")
    beyond = set(re.findall(r'(?:found\[|return \{)"(\w+)"', source))
    assert {"approval", "refused"} <= beyond
    assert set(entries("Nothing is written")) == {o.value for o in Objection} | beyond


def test_every_reason_of_distrust_has_its_number():
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \|", SECTIONS["GPS is not trusted"], re.MULTILINE)
    assert {name: int(number) for number, name in rows} == dict(REASONS)
    assert set(REASONS) == {reason.value for reason in Distrust} | {FILTER_UNKNOWN}


def test_every_end_of_a_transaction_has_an_entry():
    assert set(entries("A write went wrong")) == {reason.value for reason in Reason}


def test_every_message_to_the_pilot_has_an_entry_and_no_other():
    manual = entries("In the ground station")
    notices = posted()
    lines: set[tuple[str, ...]] = {("is read-only",), ("allowed are",), ("allowed are whole",)}
    lines.add(("stays (allow_loosening",))
    for kind, line in LINES.items():
        if line.text:
            lines.add(("OBC: " + line.text.replace("{imu}", "IMU N"),))
        else:
            lines |= notices.get(kind, set())
    for message in lines:
        assert any(told(message, entry) for entry in manual), message
    lines.add(("OBC: IMU N: NOTE",))
    for entry in manual:
        assert entry.startswith("OBC: ")
        assert any(told(message, entry) for message in lines), entry


def test_every_notice_in_the_log_has_an_entry():
    manual = entries("In the log")
    for kind, messages in posted().items():
        for message in messages:
            assert any(told(message, entry) for entry in manual), (kind, message)
