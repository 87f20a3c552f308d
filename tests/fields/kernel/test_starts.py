"""Where the contact search starts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from cdfctl.fields.kernel.starts import halton


@pytest.mark.parametrize("n", [1, 2, 7, 14])
def test_the_halton_sequence_is_scipys(n: int) -> None:
    np.testing.assert_allclose(halton(500, n), qmc.Halton(n, scramble=False).random(500), atol=1e-15)
