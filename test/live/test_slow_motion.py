"""Why time was lost, by injected times."""

import pytest
from builders import scene_of

from cloth_ros.live.pacing import PacingReport
from cloth_ros.live.slow_motion import SlowMotion
from cloth_ros.model.time_step import usual_substep

SCENE = scene_of(sheet__rows=16, sheet__columns=16)
COARSE = scene_of(sheet__rows=8, sheet__columns=8, solver__tolerance=1.0)
SUBSTEP = usual_substep(SCENE)
COUNT = round(1 / SUBSTEP)  # a second of simulated time


def explain(*, wall, cpu, usual=0.3, division=1.0, requested=SCENE, simulated=SCENE) -> str:
    """Explain a second in which half of the time was lost; costs as shares of real time."""
    count = COUNT // 2
    report = PacingReport(0.5, 0.5, wall, cpu, count)
    usual_cost = usual * usual_substep(simulated)
    return SlowMotion().explain(requested, simulated, usual_cost, report, division)


@pytest.mark.parametrize(
    ('values', 'parts'),
    [
        # Half of the time without a processor; it takes 0.2 s for half a second.
        (
            {'wall': 0.4, 'cpu': 0.2},
            ['did not get the processor for 0.2 s of the 0.4 s', 'takes 40 % of real time'],
        ),
        ({'wall': 0.8, 'cpu': 0.4, 'usual': 0.6}, ['for 0.4 s of the 0.8 s', 'itself takes 80 %']),
        (
            {'wall': 0.4, 'cpu': 0.4, 'usual': 0.6},
            ['a substep is more expensive', 'instead of 60 %'],
        ),
        ({'wall': 0.2, 'cpu': 0.19}, ['ticks came late', 'takes 38 % of real time']),
        ({'wall': 0.0, 'cpu': 0.0}, ['ticks came late']),
        # Too stiff, whether others run or not.
        (
            {'wall': 1.0, 'cpu': 1.0, 'usual': 2.0},
            ['200 % of real time', 'because springs.structural is', 'sheet.mass: '],
        ),
        (
            {'wall': 2.0, 'cpu': 1.0, 'usual': 2.0},
            ['did not get the processor for 1 s of the 2 s', '; 67 substeps a tick, each '],
        ),
        (
            {'wall': 1.0, 'cpu': 1.0},
            [
                'contact makes a substep 6.7 times as expensive',
                '200 % of real time, instead of 30 %',
            ],
        ),
        (
            {'wall': 1.0, 'cpu': 1.0, 'division': 6.5},
            ['fast motion divides substeps by 6.5: ', 'solver.overload: "coarsen"'],
        ),
        (
            {'wall': 1.0, 'cpu': 1.0, 'division': 2.0},
            ['substeps by 2 and contact makes a substep 3.3 times', 'sheet.rows: '],
        ),
    ],
)
def test_the_cause_of_lost_time_is_told_by_processor_time_and_usual_cost(values, parts):
    text = explain(**values)
    for part in parts:
        assert part in text, text
    assert ('did not get' in text) == (values['wall'] > 1.5 * values['cpu'])


def test_advice_is_for_the_requested_scene_where_a_coarser_one_is_simulated():
    text = explain(wall=1.0, cpu=1.0, usual=2.0, simulated=COARSE)
    assert '16 × 16 particles' in text
    assert f'{1 / (60 * SUBSTEP):.0f} substeps a tick' in text


def test_advice_is_kept_until_scene_or_cost_change():
    slow = SlowMotion()
    texts = [slow.advice(SCENE, share * SUBSTEP) for share in (2.0, 2.5, 4.0)]
    assert texts[0] is texts[1] != texts[2]
    stiff = SCENE.with_parameters({'springs.structural': 1e5})
    assert 'structural is 100000' in slow.advice(stiff, 3.0 * SUBSTEP)
