"""Tables of Chebyshev polynomials against those of numpy."""

import numpy as np
import pytest

from mechlab.integrate.path_time import chebyshev_derivative, chebyshev_integral


@pytest.mark.parametrize("n", [1, 2, 3, 6, 7, 48, 192])
def test_derivative_and_integral_are_those_of_numpy(n: int) -> None:
    """Coefficient by coefficient; sums of n numbers of size n leave some roundings."""
    for k, unit in enumerate(np.eye(n + 1)):
        integral = np.pad(np.polynomial.chebyshev.chebint(unit, lbnd=-1.0), (0, n))[: n + 2]
        assert chebyshev_integral(n)[:, k] == pytest.approx(integral, abs=1e-15)
        derivative = np.pad(np.polynomial.chebyshev.chebder(unit), (0, n + 1))[: n + 1]
        assert chebyshev_derivative(n)[:, k] == pytest.approx(derivative, rel=1e-14)
