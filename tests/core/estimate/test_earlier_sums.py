"""Sums that wait for a flight: no flight is counted twice, whichever way its sums come back."""

import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.earlier import EarlierSums
from onboard.core.estimate.limits import MOST_WAITING
from onboard.core.estimate.saving import SavedEngine, dump, load
from onboard.core.filter.noise import NoiseLevels
from onboard.core.maths.blocks import Block, Seconds
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import Linearisation


def saved(*flights, trusted=100.0):
    block = Block(0.0, 1.0, NormalSums.zeros(3))
    return SavedEngine(
        1,
        7.0,
        (0.0,) * 6,
        Linearisation(),
        (0.0, 0.0, 0.0),
        NoiseLevels(),
        Seconds(trusted, trusted),
        (block,),
        flights,
    )


def waiting(*sums, begun=""):
    made = EarlierSums()
    if begun:
        made.begins(1, begun)
    for its in sums:
        made.wait_with(its)
    return [its.flights for its in made.with_these({}, Calibrator().parameters)]


@pytest.mark.parametrize("order", [1, -1])
def test_of_sums_that_share_a_flight_those_with_more_of_it_stay(order):
    both, first = saved("a", "b", trusted=200.0), saved("a")
    assert waiting(*[both, first][::order]) == [("a", "b")]
    assert waiting(first, first, first) == [("a",)]
    assert waiting(first, saved("b")) == [("a",), ("b",)]


def test_what_is_learned_already_is_not_waited_with():
    assert waiting(saved("a"), saved("a", "b"), saved("c"), begun="a") == [("c",)]


def test_sums_without_a_name_are_nobodys_copy():
    assert waiting(saved(), saved()) == [(), ()]


def test_no_more_wait_than_a_flight_can_decide_on():
    assert len(waiting(*(saved(str(k)) for k in range(3 * MOST_WAITING)))) == MOST_WAITING


def test_names_survive_the_disk():
    (back,) = load(dump([saved("a", "b")]))
    assert back.flights == ("a", "b")
