"""Sine and cosine against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.fields.kernel.angles import MANY, padded, sines_and_cosines


@pytest.mark.parametrize("reach", [1e-9, 1.0, 4.0, 100.0, 0.99 * MANY, 1e6, 1e300])
@pytest.mark.parametrize("n", [1, 7, 8, 3000])
def test_agrees_to_the_last_digits(n: int, reach: float) -> None:
    random = np.random.default_rng(n)
    q = random.uniform(-reach, reach, n)
    q[: n // 3] = np.round(q[: n // 3] * 4.0 / np.pi) * np.pi / 4.0  # where one polynomial gives way to the other
    angle, sine, cosine = (np.full(padded(n), np.nan) for _ in range(3))
    sines_and_cosines(q, angle, sine, cosine)
    np.testing.assert_allclose(sine[:n], np.sin(q), rtol=0.0, atol=3e-16)
    np.testing.assert_allclose(cosine[:n], np.cos(q), rtol=0.0, atol=3e-16)


def test_what_is_no_angle_gives_none() -> None:
    angle, sine, cosine = np.zeros(8), np.zeros(8), np.zeros(8)
    sines_and_cosines(np.array([0.5, np.nan, np.inf]), angle, sine, cosine)
    assert sine[0] == np.sin(0.5)
    assert np.isnan([sine[1:3], cosine[1:3]]).all()
