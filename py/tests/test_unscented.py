"""The extended Kalman filter against an unscented one that shares nothing with it but the plant: docs/estimators.md
says that they err alike."""

import furuta
import numpy as np
import pytest
from unscented import H, Model, Unscented, errors, record, watch


@pytest.mark.parametrize("known", [True, False])
def test_an_unscented_filter_errs_as_the_extended_one(known):
    rig = furuta.Rig.load("shahzad2022-srv02")
    real = rig.with_effect("arm.coulomb", torque=0.0642269)
    xs, ys, us = record(rig, real, 0.8, lambda t: 0.0, 0.0)
    by = real if known else rig
    extended = furuta.Estimator("ekf", by, H).filter(ys[:, 0], ys[:, 1], us)
    unscented = watch(Unscented(Model(by)), ys, us)
    np.testing.assert_allclose(errors(unscented, xs), errors(extended, xs), rtol=0.06)
    # They see the same speeds, to a part of what either is off.
    apart = np.sqrt(np.mean((unscented - extended)[125:, 2:] ** 2, axis=0))
    assert (apart < 0.3 * errors(extended, xs)).all(), apart
