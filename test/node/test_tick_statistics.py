from cloth_ros.node.tick_clock import Tick
from cloth_ros.node.tick_statistics import TickStatistics


def test_times_of_ticks_that_are_never_reported_do_not_accumulate():
    statistics = TickStatistics()
    for _ in range(100_000):
        statistics.end(Tick(0.0, 1e-3, 1e-3, None), 1e-4)
    assert len(statistics) <= 10_000
    assert statistics.take_report(1e-3)['tick jitter, 99th percentile [s]'] == 0
    assert len(statistics) == 0
