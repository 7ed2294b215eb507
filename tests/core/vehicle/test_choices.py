"""What parts of a flight, and other effects, say against one that all of it shows."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from onboard.core.vehicle.block_sums import BlockSums
from onboard.core.vehicle.choices import Choices
from onboard.core.vehicle.chosen import _rivals
from onboard.core.vehicle.effects.effect import Unknown

BLOCKS, DRAWS = 10, 300
FLOOR = 2.0
"""Of what matters, in sigmas of the whole flight."""


def lasts(means):
    """Whether an unknown lasts that each block (k,) alone would find there, as well known in all.

    In units of the sigma of the whole flight, in which a block's is the root of their number.
    """
    information = np.full(len(means), 1.0 / len(means))
    theta = float(np.sum(information * means))
    blocks = tuple(
        BlockSums(np.array([[n]]), np.array([n * (x - theta)]), 0.0, 24, np.arange(1))
        for n, x in zip(information, means, strict=True)
    )
    unknown = Unknown("x", 0.0, 100.0, FLOOR, "1")
    model = SimpleNamespace(
        unknowns=(unknown,),
        effects=(SimpleNamespace(name="effect"),),
        least=np.array([-np.inf]),
        indices=lambda name: [0] if name == "effect" else [],
        nominal_near=lambda theta: 0.0 * theta,
    )
    fit = SimpleNamespace(
        model=model,
        theta=np.array([theta]),
        prior=np.array([1e-4]),
        blocks=blocks,
        inflation=np.ones(1),
        untold=lambda information, free: np.zeros((1, 1)),
        scale=1.0,
    )
    choices = Choices(fit)
    return choices.lasting(["effect"], [0], choices.solved(["effect"]))


def test_what_is_there_all_the_time_lasts_whatever_its_blocks_scatter_by():
    rng = np.random.default_rng(1)
    # Just past what is named, two sigmas beyond what matters: where a test loses most.
    drawn = FLOOR + 2.5 + np.sqrt(BLOCKS) * rng.normal(size=(DRAWS, BLOCKS))
    assert np.mean([lasts(means) for means in drawn]) > 0.97


def test_what_two_blocks_alone_show_does_not_last():
    rng = np.random.default_rng(2)
    drawn = np.sqrt(BLOCKS) * rng.normal(size=(DRAWS, BLOCKS))
    drawn[:, 4:6] += (FLOOR + 4.0) * BLOCKS / 2.0
    assert np.mean([lasts(means) for means in drawn]) < 0.01


def rivals(without, wind, curve, both):
    """Rivals of a wind, by chi-square with neither, one or both of two effects."""
    chi2 = {(): without, ("wind",): wind, ("curve",): curve, ("curve", "wind"): both}
    choices = SimpleNamespace(
        names=("wind", "curve"), solved=lambda of: SimpleNamespace(chi2=chi2[tuple(sorted(of))])
    )
    return _rivals(choices, ["wind"], "wind")


def test_what_would_do_as_well_in_its_place_is_a_rival():
    assert rivals(200.0, 100.0, 103.0, 99.0) == ("curve",)
    assert rivals(200.0, 100.0, 150.0, 99.0) == ()


def test_what_explains_something_else_is_none():
    # It explains more than the wind, and leaves all that the wind explains.
    assert rivals(300.0, 200.0, 100.0, 0.0) == ()
