"""
Stages of an impulse of the dashpots: a Chebyshev method, stable for strong dashpots.

With the positions fixed, dashpots change velocities by dv/dt = −C v, where C is symmetric with
respect to the masses and has no negative eigenvalue.  During t s, s stages of one evaluation each
change them to P(t C) v with

    P(z) = 1 − b T(w₀) + b T(w₀ − w₁ z),   T: Chebyshev polynomial of degree s.

w₁ and b are such that P(z) = 1 − z + z²/2 + O(z³), of second order; w₀ is a little above 1, so
that P is below 1 for every z > 0.  Up to z = (w₀ + 1)/w₁, about 0.6 (s² − 1), P stays between 0.31
and 1.  For s = 2 and w₀ = 1, P is the midpoint rule; so many evaluations as steps of that rule
reach 0.6 s − 0.6/s times as far in one step of s stages.

With v₀ = v, the recurrence of the polynomials is one of velocities,

    vⱼ = v + aⱼ (vⱼ₋₁ − v) + bⱼ (vⱼ₋₂ − v) − cⱼ t C vⱼ₋₁,

and the result is v + b T(w₀) (vₛ − v).  In this form a sheet that moves as a whole keeps its
velocity to the bit.

B. P. Sommeijer, L. F. Shampine, J. G. Verwer, "RKC: an explicit solver for parabolic PDEs",
J. Comput. Appl. Math. 88, 1998, section 2.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

from numpy.polynomial import Chebyshev

# Stages at most: rounding grows with the square of their number.
MOST = 32
# s² (w₀ − 1).  At w₀ = 1, P would be 1 at its inner maxima too; here it is at most 0.82 there, and
# the reach 0.9 times as large.
_DAMPING = 1.0


class Stage(NamedTuple):
    """
    Factors of one stage.

    Attributes
    ----------
    before, two_before
        Of the change after the stage before, and after the one before that.
    rate
        Of t times the acceleration by the dashpots.

    """

    before: float
    two_before: float
    rate: float


class Stages(NamedTuple):
    """
    Stages of an impulse.

    Attributes
    ----------
    stages
        At least two.
    share
        Factor of the change after the last stage: that is the result.
    reach
        Largest product of t and an eigenvalue of C for which they are stable.

    """

    stages: tuple[Stage, ...]
    share: float
    reach: float

    def change(self, start: Any, accelerated: Callable[[Any], Any]) -> Any:
        """Return the change of velocities `start`; `accelerated` is −t C v for velocities v."""
        former = change = 0.0 * start
        for before, two_before, rate in self.stages:
            damped = before * change + two_before * former + rate * accelerated(start + change)
            former, change = change, damped
        return self.share * change

    def factor(self, z: float) -> float:
        """Return P(z)."""
        return 1.0 + float(self.change(1.0, lambda velocity: -z * velocity))


@functools.cache
def stages(count: int) -> Stages:
    """Return a number of stages, at least 2."""
    polynomial = Chebyshev.basis(count)
    start = 1 + _DAMPING / count**2
    first, second = (float(polynomial.deriv(n)(start)) for n in (1, 2))
    slope = first / second
    values = [float(Chebyshev.basis(n)(start)) for n in range(count + 1)]
    result = [Stage(0.0, 0.0, slope / start)]
    for two_before, before, now in zip(values, values[1:], values[2:], strict=False):
        factor = 2 * before / now
        result.append(Stage(start * factor, -two_before / now, slope * factor))
    # Before the first stage nothing has changed.
    result[1] = result[1]._replace(two_before=0.0)
    share = second / first**2 * values[-1]
    return Stages(tuple(result), share, (start + 1) / slope)


# Largest product of t and an eigenvalue of C in one impulse.
REACH = stages(MOST).reach


def stages_for(product: float) -> Stages:
    """Return the fewest stages for products of t and eigenvalues of C up to `product`."""
    count = max(math.isqrt(math.floor(1.6 * min(product, REACH) + 1)), 2)
    while stages(count).reach < product and count < MOST:
        count += 1
    return stages(count)
