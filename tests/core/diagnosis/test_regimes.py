"""What a batch of flight mostly was does not depend on how the board is mounted."""

import numpy as np
import pytest

from onboard.core.diagnosis.regimes import regime_of
from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.maths.board_orientation import board_rotation


def flown(orientation, load):
    """Ten seconds at ``load`` g, as a board of that orientation reads them."""
    t, n = np.arange(0.0, 10.0, 0.02), 500
    R_bs = board_rotation(orientation)
    f_b = np.tile([0.0, 0.0, -9.80665 * load], (n, 1))
    segment = Segment(t, np.zeros((n, 3)), f_b @ R_bs, t, np.tile(np.eye(3), (n, 1, 1)), R_bs)
    at = np.arange(1.0, 9.0, 0.2)
    fixes = Fixes(at, np.tile([15.0, 0.0, 0.0], (len(at), 1)), np.zeros(len(at)), np.zeros(len(at)))
    return Batch(segment, fixes, np.ones(len(at), dtype=bool), fresh=True)


@pytest.mark.parametrize("orientation", [0, 4, 8, 12, 16, 24])
def test_load_is_that_of_the_body(orientation):
    assert regime_of(flown(orientation, 1.6)) == "high load factor"
    assert regime_of(flown(orientation, 1.0)) == "steady"
