"""A sampled LQI against SciPy: the integral is sampled with the rig."""

import furuta
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

C, Q, R = np.array([[1.0, 0, 0, 0]]), np.diag([5.0, 1, 0.1, 0.1, 20]), np.array([[0.1]])


@pytest.mark.parametrize("rate", [500.0, 50.0])
@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_the_gain_is_that_of_the_sampled_extended_system(name, rate):
    a, b = furuta.linearize(furuta.Rig.load(name))
    extended = np.block([[a, np.zeros((4, 1))], [C, np.zeros((1, 1))]])
    ad, bd, *_ = cont2discrete((extended, np.vstack([b, [[0.0]]]), np.eye(5), np.zeros((5, 1))), 1 / rate)
    s = solve_discrete_are(ad, bd, Q, R)
    expected = np.linalg.solve(R + bd.T @ s @ bd, bd.T @ s @ ad)
    k, _, poles = furuta.lqi(a, b, C, Q, R, hold=1 / rate)
    np.testing.assert_allclose(k, expected, rtol=1e-8)
    np.testing.assert_allclose(np.sort(np.abs(poles)), np.sort(np.abs(np.linalg.eigvals(ad - bd @ expected))), rtol=1e-7)
    # Euler's rule is another gain.
    sampled = furuta.zero_order_hold(a, b, 1 / rate)
    assert not np.allclose(k, furuta.lqi(*sampled, C, Q, R, dt=1 / rate)[0], rtol=1e-4)


def test_what_is_refused():
    a, b = furuta.linearize(furuta.Rig.load("qube-servo-2"))
    with pytest.raises(furuta.DesignError, match="hold = -1 s"):
        furuta.lqi(a, b, C, Q, R, hold=-1.0)
    with pytest.raises(furuta.DesignError, match="both given"):
        furuta.lqi(a, b, C, Q, R, dt=0.002, hold=0.002)
