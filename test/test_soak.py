"""Two minutes of what `make soak` does for an hour."""

from reliability import soak

SECONDS = 100.0
# MB, over 75 s: 0.6 kB a tick.  Allocators settle within less; one message of particles that is
# never freed is 98 kB.
GROWTH = 3.0


def test_two_minutes_pass_without_growth_drift_or_warning():
    # A machine that is busy elsewhere for a second does not make it warn.
    found = soak.run(SECONDS, '-p', 'solver.max_tick:=2.0')
    growth, _ = found.growth(SECONDS / 4)
    assert growth < GROWTH
    assert abs(found.rate / 60 - 1) < 0.03
    assert abs(found.real_time - 1) < 0.03
    assert found.warnings == []
    assert found.not_finite == 0
