"""The same with numpy's arithmetic and with compiled loops."""

import numpy as np

from onboard.core.maths.compiling import compiled_loops, prefer_compiled


def both_ways(what):
    """Something with numpy, then with compiled loops; those are preferred afterwards."""
    prefer_compiled(yes=False)
    one = what()
    prefer_compiled()
    assert compiled_loops() is not None
    return one, what()


def assert_close(a, b, tolerance=1e-11):
    """Equal to a share of the largest."""
    np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * np.abs(b).max(initial=1.0))
