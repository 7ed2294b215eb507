"""The axes of the charts: what runs along them, and in which unit."""

from __future__ import annotations

import re

import numpy as np
import pytest

from onboard.report.chart import Line, line_chart, time_ticks


@pytest.mark.parametrize(
    ("span", "marks", "unit"),
    [
        ((0.0, 25.0), [0, 5, 10, 15, 20, 25], "s"),
        ((0.0, 259.0), [0, 60, 120, 180, 240], "min"),
        ((40.0, 82.0), [40, 50, 60, 70, 80], "s"),
        ((0.0, 9000.0), [0, 1800, 3600, 5400, 7200, 9000], "s"),
        ((0.0, 18000.0), [0, 3600, 7200, 10800, 14400, 18000], "h"),
    ],
)
def test_a_time_axis_is_marked_as_people_count(span, marks, unit):
    found, seconds, name = time_ticks(*span)
    if marks[1] == 1800:  # half hours are whole minutes
        unit = "min"
    assert (found, name) == (marks, unit)
    assert all((mark / seconds).is_integer() for mark in found)


def test_no_time_has_no_marks():
    assert time_ticks(3.0, 3.0)[0] == []
    assert time_ticks(0.0, float("nan"))[0] == []
    assert len(time_ticks(0.0, 1e6)[0]) >= 2


def chart(x, **options):
    return line_chart("A title", "m/s", [Line(x, np.sin(x), "one", "one")], **options)


def test_under_the_axis_stands_what_it_is():
    html = chart(np.linspace(0.0, 250.0, 99))
    assert '<span class="along">time, min</span>' in html
    assert re.findall(r'class="tick x"[^>]*>([^<]*)<', html) == ["0", "1", "2", "3", "4"]


def test_what_is_no_time_keeps_its_own_unit():
    html = chart(np.linspace(0.0, 250.0, 99), x_label="temperature", x_unit="K")
    assert '<span class="along">temperature, K</span>' in html
    assert "100" in re.findall(r'class="tick x"[^>]*>([^<]*)<', html)
    bare = chart(np.linspace(0.0, 1.0, 99), x_label="throttle", x_unit="")
    assert '<span class="along">throttle</span>' in bare
