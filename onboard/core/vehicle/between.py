"""By how much flights of one vehicle differ in a number of which each has its own."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array

SHARES = np.concatenate([[0.0], np.geomspace(0.02, 1.0, 40)])
"""Of the sigma of the prior, among which the likeliest is taken [cost]."""


def spread(estimate: Array, covariance: Array, prior: float) -> float:
    """The likeliest standard deviation of what the estimates are of; zero if they need none.

    Estimates differ by what is known of each badly, and by what they really differ by.  Without the
    prior each is normal about zero with both variances, and the second is the likeliest
    (restricted maximum likelihood; R. DerSimonian and N. Laird, 1986, have the same by moments).

    Args:
        estimate: (k,) of the flights, under a prior about zero.
        covariance: (k, k) of them, the prior in it.
        prior: its standard deviation, the largest that is looked for.
    """
    size, turned = np.linalg.eigh(np.linalg.inv(covariance) - np.eye(len(estimate)) / prior**2)
    known = size > 1e-3 / prior**2
    # What the flights say without the prior, in directions in which they say it independently.
    told = turned.T @ np.linalg.solve(covariance, estimate)
    z, variance = told[known] / size[known], 1.0 / size[known]
    total = variance + (prior * SHARES[:, None]) ** 2
    likelihood = -0.5 * np.sum(np.log(total) + z * z / total, axis=1)
    return float(prior * SHARES[int(np.argmax(likelihood))])
