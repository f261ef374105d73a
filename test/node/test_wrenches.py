"""Topics with the force and torque of the cloth on each collider."""

import pytest
from geometry_msgs.msg import WrenchStamped
from node.conftest import SteppedCloth
from ros import stamp

WEIGHT = 0.2 * 9.81  # N, of the sheet


def has_topic(cloth: SteppedCloth) -> bool:
    return cloth.probe.count_publishers('/sphere/wrench') == 1


def test_a_wrench_has_the_stamp_and_frame_of_each_state(cloth):
    wrenches = cloth.probe.collect(WrenchStamped, '/sphere/wrench', 1000)
    cloth.tick_until(lambda _: wrenches)
    cloth.tick(5)
    states = [stamp(each) for each in cloth.states[-5:]]
    cloth.probe.spin_until(lambda: stamp(wrenches[-1]) == states[-1])
    assert [stamp(each) for each in wrenches[-5:]] == states
    assert {each.header.frame_id for each in wrenches} == {'world'}
    for each in wrenches:  # the sphere is out of reach
        force, torque = each.wrench.force, each.wrench.torque
        assert (force.x, force.y, force.z, torque.x, torque.y, torque.z) == (0.0,) * 6


def test_the_topic_of_a_collider_comes_and_goes_with_it(cloth):
    cloth.probe.spin_until(lambda: has_topic(cloth))
    assert cloth.set(sphere__radius=0.0) == ['']
    cloth.tick_until(lambda _: not has_topic(cloth))
    assert cloth.set(sphere__radius=0.1) == ['']
    cloth.tick_until(lambda _: has_topic(cloth))
    wrenches = cloth.probe.collect(WrenchStamped, '/sphere/wrench', 1000)
    cloth.tick_until(lambda _: wrenches)


def test_a_sheet_that_lies_on_the_sphere_weighs_on_it(cloth):
    """Its weight, once it is at rest: held by friction and by air that damps its motion."""
    parameters = {
        'gravity': [0.0, 0.0, -9.81],
        'pins': [''],
        'drag': 5.0,
        'sphere.radius': 1.0,
        'sphere.position': [0.0, 0.0, -0.001],
        'sphere.friction': 2.0,
    }
    # Removed and added again, it is placed below the sheet; moved, it would pass through it.
    assert cloth.set(sphere__radius=0.0) == ['']
    cloth.tick()
    assert cloth.set_together(parameters) == ''
    cloth.tick_until(lambda _: has_topic(cloth))
    wrenches = cloth.probe.collect(WrenchStamped, '/sphere/wrench', 1000)

    def weighs() -> bool:
        forces = [each.wrench.force for each in wrenches[-50:]]
        if len(forces) < 50:
            return False
        mean = [sum(getattr(each, axis) for each in forces) / 50 for axis in 'xyz']
        return mean == pytest.approx([0.0, 0.0, -WEIGHT], abs=0.05 * WEIGHT)

    cloth.tick_until(lambda _: weighs())
