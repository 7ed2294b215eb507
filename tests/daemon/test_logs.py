"""A log that cannot be flooded."""

import logging

import pytest

from onboard.cli.main import run as onboard
from onboard.daemon.setup.logs import KINDS_MAX, Restrained


class Kept(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


def logger_and_lines(name, now):
    handler = Kept()
    handler.addFilter(Restrained(lines=3, period_s=60.0, clock=lambda: now[0]))
    logger = logging.getLogger(name)
    logger.propagate = False
    logger.addHandler(handler)
    return logger, handler


def test_one_line_again_and_again_is_written_a_few_times_and_then_counted():
    now = [0.0]
    logger, handler = logger_and_lines("flooded", now)
    for at in [0.0] * 100_000 + [61.0]:
        now[0] = at
        logger.warning("again: %d", 1)
    assert handler.lines[:3] == ["again: 1"] * 3
    assert handler.lines[3:] == ["again: 1 (99997 more were not written)"]


def test_other_lines_are_written_meanwhile():
    logger, handler = logger_and_lines("mixed", [0.0])
    for _ in range(100):
        logger.warning("flood")
    logger.warning("something else")
    assert handler.lines == ["flood"] * 3 + ["something else"]


def test_what_is_remembered_is_bounded():
    restrained = Restrained()
    for number in range(3 * KINDS_MAX):
        restrained.filter(logging.LogRecord("x", 30, "file.py", number, "text", (), None))
    assert len(restrained._kinds) == KINDS_MAX


@pytest.mark.parametrize("there", [[], [Kept()]], ids=["nobody else", "somebody else"])
def test_the_services_own_lines_are_restrained_and_nobody_elses(tmp_path, monkeypatch, there):
    """What another program in this process hears would be missing for as long as it runs."""
    monkeypatch.setattr(logging.getLogger(), "handlers", list(there))
    file = tmp_path / "vehicle.toml"
    file.write_text('[http]\ntoken_file = "/nonexistent/token"\n')
    assert onboard(["run", "--config", str(file), "--state", str(tmp_path / "state")]) == 2
    handlers = logging.getLogger().handlers
    assert [h for h in handlers if not h.filters] == there
    restrained = [h for h in handlers if h not in there]
    assert [[type(f) for f in h.filters] for h in restrained] == [[Restrained]] * (not there)
