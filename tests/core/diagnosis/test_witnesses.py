"""What other accelerometers have seen, as an argument for what one of them did."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.candidates import accepted
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.score import least
from onboard.core.physics.effects.bias_step import Witness
from tests.core.diagnosis.problems import candidates, made


@pytest.mark.parametrize("seed", range(4))
def test_a_jump_of_the_scale_that_is_none_is_not_what_others_have_seen(seed):
    """They have seen a jump of the offset: at the force that is felt it is as large, or another."""
    felt = np.array([0.1, -0.2, -9.8])
    jumped, quiet = (made(np.random.default_rng(seed), *names) for names in (("b",), ()))
    free = [*range(6), *jumped.columns("b")]
    size = jumped.fitter().fit(free).theta[list(jumped.columns("b"))]
    seen = Witness(1000.0, 200, 0.0, size * felt, np.full(3, 0.01))
    for problem, said in ((jumped, True), (quiet, False)):
        fitter = problem.fitter()
        before, after = fitter.fit(range(6)), fitter.fit(free)
        (scale,) = candidates(problem, "b")
        scale = replace(scale, jump=True, witness=seen, felt=felt)
        assert accepted(fitter, before, after, scale) is said
        assert (scale.score(fitter, before, after) > least()) is said
        assert (scale.margin(fitter, before, after) > CLEARLY) is said
