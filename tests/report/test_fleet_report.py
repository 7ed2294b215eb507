"""The index of a fleet: the most urgent vehicle first, links that lead somewhere, no network."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.shared_numbers import common_of
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.report.fleet import fleet_html
from onboard.report.sparkline import MOST_POINTS, sparkline
from tests.fleet.records_by_hand import TRUE, flown
from tests.report.html_page import Page

STEP = np.array([0.0, 0.0, 0.0, 0.5, 0.0, 0.0])


@pytest.fixture(scope="module")
def fleet():
    """Three vehicles: one is well, one has stepped, one contradicts itself; and a bad log."""
    changes = {
        "well": lambda _: 0.0 * STEP,
        "step": lambda k: STEP * (k >= 5),
        "odd": lambda k: 2.0 * STEP * (k == 4),
    }
    logs = [
        flown(f"{name}/{k}.BIN", TRUE + change(k), day=5.0 * k, board=f"{v:024x}", seed=10 * v + k)
        for v, (name, change) in enumerate(changes.items(), start=1)
        for k in range(9)
    ]
    bad = Flown(Path("/logs/<b>.BIN"), "<b>.BIN", None, "/logs/<b>.BIN: was killed & lost")
    return [*logs, bad]


@pytest.fixture(scope="module")
def html(fleet):
    histories = [history_of(v) for v in vehicles_of(fleet)]
    pages = {o.name: o.name.replace("/", "-") + ".html" for o in fleet if o.record}
    return fleet_html(fleet, histories, common_of([h.vehicle for h in histories]), pages)


def test_the_most_urgent_is_first(html):
    assert re.findall(r'class="(\w+) vehicle"', html) == ["error", "warn", "good"]


def test_every_recording_is_there_with_its_page_and_the_bad_one_with_its_reason(fleet, html):
    page = Page.of(html)
    links = [a["href"] for tag, a in page.tags if tag == "a"]
    assert sorted(links) == sorted(
        "./" + o.name.replace("/", "-") + ".html" for o in fleet if o.record
    )
    assert "<b>.BIN was killed & lost" in page.words


def test_nothing_comes_from_elsewhere(html):
    assert not re.search(r"https?:|//|url\(|@import|<img", html)
    assert html.count("<script") == 1  # ours


def test_what_happened_is_said_in_words_and_drawn(html):
    words = Page.of(html).words
    assert re.search(r"x offset stepped by \+0\.[45]\d+ ± 0\.0", words)
    assert re.search(r"contradicts the others by \+(0\.9|1\.0)", words)
    assert html.count('class="spark-step"') == 1
    assert html.count('class="spark-odd"') == 1


def test_a_picture_has_the_latest_flights_and_breaks_its_line_at_a_step():
    n = MOST_POINTS + 30
    value = np.where(np.arange(n) < n - 10, 0.0, 5.0)
    drawn = sparkline(value, np.full(n, 0.1), [int(k >= n - 10) for k in range(n)], [0], 'a "b"')
    assert drawn.count("h0") == MOST_POINTS
    assert drawn.count("spark-line") == 1
    lines = re.search(r'class="spark-line" d="([^"]+)"', drawn)[1]
    assert lines.count("M") == 2
    assert "spark-odd" not in drawn  # it is no longer in the picture
    assert "&#34;b&#34;" in drawn


def test_a_single_flight_is_a_dot():
    drawn = sparkline(np.array([1.0]), np.array([0.1]), [0], [], "one")
    assert "spark-line" not in drawn
    assert "nan" not in drawn
