"""Two ways to say how well an estimate is known are one."""

import numpy as np

from onboard.core.filter.uncertainty import Covariance, Information


def test_information_says_what_its_inverse_does():
    rng = np.random.default_rng(4)
    root = rng.normal(size=(9, 9))
    C = root @ root.T + 0.1 * np.eye(9)
    D = rng.normal(size=(3, 9))
    np.testing.assert_allclose(Information(np.linalg.inv(C)).along(D), Covariance(C).along(D))


def test_it_is_what_such_errors_scatter_by():
    rng = np.random.default_rng(5)
    C = np.array([[0.4, 0.1], [0.1, 0.3]])
    D = np.array([[1.0, -2.0], [0.5, 1.0]])
    errors = rng.normal(size=(200_000, 2)) @ np.linalg.cholesky(C).T
    np.testing.assert_allclose(np.cov((errors @ D.T).T), Covariance(C).along(D), atol=0.02)
