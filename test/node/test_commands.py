"""Topics and services that command a cloth; time passes tick by tick."""

import math

import numpy as np
from node.conftest import at_rest
from ros import diagnosis, numbers, pose, stamp, wind
from visualization_msgs.msg import Marker, MarkerArray

INVALID = (math.nan, math.inf, 1e308)
FAR = -9e5  # m/s, too fast; m, too far from the sheet


def test_wind_acts_within_two_ticks(cloth):
    assert at_rest(cloth.tick()[0])
    cloth.send_and_wait('/wind', wind(z=5.0, frame='world'))
    assert cloth.tick(2)[-1][1:-1, 1:-1, 5].min() > 0


def test_the_sphere_acts_within_two_ticks(cloth):
    assert cloth.tick()[0][4, 4, 2] == 1.0
    cloth.send_and_wait('/sphere_pose', pose(z=0.7))
    assert min(state[4, 4, 2] for state in cloth.tick(2)) < 0.601


def test_the_sphere_passes_the_points_commanded_within_one_tick_in_order(cloth):
    """Around the sheet it does not touch it; through it, to the same point, it does."""
    assert cloth.set(wind__air_density=0.0) == ['']
    cloth.send('/sphere_pose', *(pose(x=x, z=z) for x, z in ((2.0, 2.0), (2.0, 0.0), (0.0, 0.0))))
    assert all(map(at_rest, cloth.tick(2)))
    cloth.send('/sphere_pose', pose(z=2.0))
    cloth.tick_until(lambda state: state[..., 5].max() > 0.1)


def test_a_sphere_of_any_speed_leaves_the_cloth_finite(cloth):
    cloth.send('/sphere_pose', pose(y=-5.0, z=0.95), pose(y=900.0, z=1.05))
    cloth.tick_until(lambda state: not at_rest(state))
    assert np.isfinite(cloth.tick(5)).all()


def test_a_pause_holds_state_and_stamp_and_a_reset_restores_both(cloth):
    cloth.send('/wind', wind(z=5.0))
    moving = cloth.tick_until(lambda state: state[..., 5].max() > 0.1)
    cloth.pause(True)
    cloth.tick(5)
    assert len({stamp(message) for message in cloth.states[-4:]}) == 1
    assert len({bytes(message.data) for message in cloth.states[-4:]}) == 1
    assert numbers(cloth.states[-1])[..., 2].max() >= moving[..., 2].max()
    assert diagnosis(cloth.probe)['message'] == 'paused'
    cloth.reset()
    initial = cloth.tick(2)[-1]
    assert np.array_equal(np.unique(initial[..., 2]), [1.0])
    assert at_rest(initial)
    cloth.pause(False)
    assert at_rest(cloth.tick(3)[-1])  # the wind was reset as well
    cloth.send('/wind', wind(z=5.0))
    cloth.tick_until(lambda state: state[..., 5].max() > 0.1)


def test_commands_without_effect_say_what_to_set(cloth):
    assert cloth.set(wind__air_density=0.0, sphere__radius=0.0) == ['', '']
    cloth.tick()
    texts = (
        'set wind.air_density above 0',
        'sphere.radius is 0.0, but must be more than 0 to move a sphere',
    )

    def reported() -> bool:
        cloth.send('/wind', wind(z=5.0))  # again and again: warnings are throttled
        cloth.send('/sphere_pose', pose(z=1.0))
        return all(text in cloth.process.output for text in texts)

    cloth.probe.spin_until(reported)


def test_invalid_commands_are_rejected_counted_and_reported_once(cloth):
    texts = [f'rejected a message on {topic}:' for topic in ('wind', 'sphere_pose')]
    lines = {text: cloth.process.output.count(text) for text in texts}
    topics = ('rejected messages on wind', 'rejected messages on sphere_pose')
    names = ('rejected inputs', *topics)
    before = {name: int(value) for name, value in diagnosis(cloth.probe).items() if name in names}
    cloth.send('/wind', *(wind(x=x) for x in (*INVALID, FAR)), wind(x=1.0, frame='moon'))
    cloth.send('/sphere_pose', *(pose(y=y) for y in (*INVALID, FAR)), pose(z=1.0, frame='moon'))
    added = dict(zip(names, (10, 5, 5), strict=True))

    def counted() -> bool:
        found = diagnosis(cloth.probe)
        return all(int(found[name]) == before[name] + added[name] for name in names)

    cloth.probe.spin_until(counted)
    assert at_rest(cloth.tick(3)[-1])
    for line, number in lines.items():  # throttled: one line in 5 s
        assert 0 < cloth.process.output.count(line) <= number + 2


def test_markers_that_the_scene_has_no_longer_are_deleted(cloth):
    markers: list[MarkerArray] = cloth.probe.collect(MarkerArray, '/cloth/markers')

    def ticked_until(condition) -> None:
        cloth.tick_until(lambda _: condition())

    def shown(action: int) -> set[str]:
        return {each.ns for array in markers for each in array.markers if each.action == action}

    ticked_until(lambda: markers)
    assert {each.ns for each in markers[-1].markers} == {'sheet', 'pins', 'wind', 'sphere'}
    assert shown(Marker.DELETE) == {'wind'}  # the air is still
    markers.clear()
    assert cloth.set(sphere__radius=0.0, wind__air_density=0.0, pins=['']) == ['', '', '']
    ticked_until(lambda: shown(Marker.DELETE) == {'sphere', 'wind', 'pins'})
    markers.clear()
    ticked_until(lambda: len(markers) > 1)
    assert {each.ns for each in markers[-1].markers} == {'sheet'}
