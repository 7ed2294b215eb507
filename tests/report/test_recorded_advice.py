"""What the files and words of recordings set: nothing that the policy would not write."""

from __future__ import annotations

import re

import pytest

from onboard.answers.explain import Explanation
from onboard.answers.verdict import about_six
from onboard.report.parameters import parameter_text
from tests.explained import explained
from tests.report.test_advice import comment
from tests.report.test_report_parameters import loaded

pytestmark = pytest.mark.recordings


def file_of(result: Explanation) -> str:
    return parameter_text(result.diagnosis, result.advice, result.files)


@pytest.mark.slow
def test_a_jump_gives_both_offsets_and_when(recordings):
    """i03: 0.05 before the jump at 188 s, 0.40 after it."""
    text = file_of(explained(recordings / "sitl" / "i03.tlog"))
    assert loaded(text) == {}
    said = comment(text, "INS_ACCOFFS_X")
    before, t, after = map(
        float, re.search(r"([\d.]+) until (\d+) s, ([\d.]+) from", said).groups()
    )
    assert (before, after) == (pytest.approx(0.049, abs=0.01), pytest.approx(0.40, abs=0.02))
    assert abs(t - 188.0) < 2.0


@pytest.mark.slow
def test_a_drift_gives_its_temperature_and_what_was_flown(recordings):
    text = file_of(explained(recordings / "sitl" / "b04.tlog"))
    assert loaded(text) == {}
    assert re.search(
        r"at 35 degC, [+-][\d.]+ per degree, flown from \d+ to \d+ degC",
        comment(text, "INS_ACCOFFS_X"),
    )


@pytest.mark.slow
def test_a_flight_that_is_not_calibrated_sets_nothing_and_says_why(recordings):
    """A hover of a bit more than a minute."""
    text = file_of(explained(recordings / "real" / "real-quad-10-hover.BIN"))
    assert loaded(text) == {}
    assert "the calibration is 'insufficient'" in re.findall("not to be set: (.+)", text)


@pytest.mark.slow
def test_what_improves_nothing_is_not_recommended(recordings):
    """real-fixedwing-02: held-out residual 0.90 -> 0.89, and no parameters in the log."""
    result = explained(recordings / "real" / "real-fixedwing-02.BIN")
    assert loaded(file_of(result)) == {}
    assert about_six(result.advice).startswith("Leave the calibration parameters as they are")
    assert "in force" in about_six(result.advice)
    assert "scale 1 and offset 0 are assumed" in file_of(result)
