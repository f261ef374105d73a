"""The browser view of real nodes in a real browser, with the mouse."""

import signal

import numpy as np
import pytest
from chromium import DESKTOP
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.msg import ParameterEvent
from ros import pose, set_parameters, stamp
from sensor_msgs.msg import PointCloud2

UPPER = '/cloths/cloth/sheet/upper'
SPHERE = '/cloths/cloth/colliders/sphere'
LAMP = '/light/lamp'
GRIPPER = '/cloths/cloth/colliders/left'
# A curtain at rest, seen from the side of a sphere.
CURTAIN = {
    'sheet__rows': 16,
    'sheet__columns': 16,
    'sheet__position': '[0.0, 0.0, 1.5]',
    'sheet__orientation': '[-0.70710678, 0.0, 0.0, 0.70710678]',
    'pins': '["0,:"]',
    'sphere__radius': 0.15,
    'sphere__position': '[0.0, -0.6, 1.4]',
}


def test_the_mouse_turns_the_wind_and_drags_the_sphere(start_cloth, view, probe, tmp_path):
    """Commands arrive on the topics, and what they do is seen on the page."""
    start_cloth(**CURTAIN)
    winds = probe.collect(Vector3Stamped, '/wind')
    view.wait_for_node(SPHERE)
    view.wait_for_node(UPPER)
    view.wait_for_text('sphere')
    poses = probe.collect(PoseStamped, '/sphere_pose')
    still = view.corners(UPPER)
    assert still.shape == (256, 3)
    assert not [each for each in view.nodes() if each.endswith('part_1')]

    view.drag_collider(SPHERE, [0.0, 0.13, 0.0], [0.0, 0.75, 0.0])
    probe.spin_until(lambda: len(poses) > 1)
    assert poses[-1].pose.position.y > -0.5
    assert abs(poses[-1].pose.position.x) < 0.01
    pushed = lambda: view.corners(UPPER)[:, 1].max() > still[:, 1].max() + 0.02  # noqa: E731
    view.wait_for(pushed)
    view.keep_screenshot(tmp_path, 'sphere_in_the_cloth_laptop')

    assert view.casts_shadow(LAMP)
    view.page.get_by_label('shadows').uncheck()
    view.wait_for(lambda: not view.casts_shadow(LAMP))

    view.slide('speed, m/s', 0.5)
    probe.spin_until(lambda: winds and abs(winds[-1].vector.y - 7.5) < 1.0)
    assert abs(winds[-1].vector.x) < 1e-6
    view.wait_for(lambda: view.corners(UPPER)[:, 1].max() > 0.5)


def test_a_button_grasps_and_a_handle_moves_what_is_held(start_cloth, view, probe, tmp_path):
    """One refusal is shown: the gripper was moved away from the sheet."""
    start_cloth(
        **{**CURTAIN, 'sphere__radius': 0.0}, gripper__names='["left"]', gripper__left__radius=0.1,
        gripper__left__position='[-0.5, 0.0, 1.0]',
    )  # fmt: skip
    view.wait_for_node(GRIPPER)
    view.wait_for_node(UPPER)
    still = view.corners(UPPER)
    button = lambda text: view.page.get_by_role('button', name=text)  # noqa: E731
    view.wait_for(button('left: grasp').count)
    button('left: grasp').click()
    view.wait_for(button('left: release').count)
    poses = probe.collect(PoseStamped, '/left/pose')
    view.drag_collider(GRIPPER, [0.0, 0.0, 0.14], [0.0, 0.0, 0.45])
    probe.spin_until(lambda: poses and poses[-1].pose.position.z > 1.1)
    view.keep_screenshot(tmp_path, 'gripper_laptop')
    view.wait_for(lambda: np.abs(view.corners(UPPER) - still).max() > 0.1)
    button('left: release').click()
    view.wait_for(button('left: grasp').count)
    away = probe.publisher(PoseStamped, '/left/pose')
    away.publish(pose(3.0, 3.0, 3.0))
    probe.spin_for(0.2)
    button('left: grasp').click()
    view.wait_for_text('the distance of')


@pytest.mark.slow
def test_parameters_are_set_and_refusals_shown(start_cloth, view, probe, tmp_path):
    """With so few substeps that only little more stiffness is stable."""
    start_cloth(**CURTAIN, solver__substeps=24)
    events = probe.collect(ParameterEvent, '/parameter_events')
    view.wait_for_text('structural')
    view.slide('bending', 0.6)
    changed = lambda: {each.name for event in events for each in event.changed_parameters}  # noqa: E731
    probe.spin_until(lambda: 'springs.bending' in changed())
    view.slide('structural', 1.0)
    view.wait_for_text('The node has refused this')
    view.wait_for_text('solver.substeps')
    assert 'refused: ' in view.viewer.output
    # The slider returns from the value that was refused.
    view.wait_for(lambda: not view.page.locator('input[value="1000"]').count())
    view.keep_screenshot(tmp_path, 'refusal_desktop', DESKTOP)


@pytest.mark.slow
def test_the_page_names_what_is_missing_and_recovers(start_cloth, view, tmp_path):
    view.wait_for_text('No cloth is heard')
    view.keep_screenshot(tmp_path, 'no_cloth_laptop')
    node = start_cloth(**CURTAIN)
    view.wait_for_node(UPPER)
    assert node.stop(signal.SIGINT) == 0
    view.wait_for_text('has ended')
    assert view.corners(UPPER).shape == (256, 3)
    view.keep_screenshot(tmp_path, 'ended_laptop')
    start_cloth(**{**CURTAIN, 'sheet__rows': 20, 'sphere__radius': 0.0})
    view.wait_for(lambda: UPPER in view.nodes() and view.corners(UPPER).shape == (320, 3))
    view.wait_for(lambda: SPHERE not in view.nodes())
    view.wait_for_text('real-time factor 1.')


@pytest.mark.slow
def test_several_cloths_and_their_colours(start_cloth, view, probe, tmp_path):
    start_cloth('-r', '__ns:=/left', **CURTAIN)
    moved = {**CURTAIN, 'sheet__position': '[1.5, 0.0, 1.5]', 'sphere__radius': 0.0}
    start_cloth('-r', '__ns:=/right', **moved)
    for name in ('left', 'right'):
        view.wait_for_node(f'/cloths/{name}/cloth/sheet/upper')
    apart = np.subtract(
        *(view.corners(f'/cloths/{name}/cloth/sheet/upper').mean(0) for name in ('right', 'left'))
    )
    np.testing.assert_allclose(apart, (1.5, 0.0, 0.0), atol=0.01)
    winds = {name: probe.collect(Vector3Stamped, f'/{name}/wind') for name in ('left', 'right')}
    view.open_tab('left/cloth')
    view.slide('speed, m/s', 0.4)
    probe.spin_until(lambda: winds['left'])
    assert not winds['right']
    view.page.locator('input[value="two sides"]').locator('visible=true').first.click()
    view.page.get_by_role('option', name='speed').click()
    view.wait_for_node('/cloths/left/cloth/sheet/level_0')
    view.wait_for(lambda: len(view.corners('/cloths/left/cloth/sheet/level_0')) > 3)
    view.keep_screenshot(tmp_path, 'two_cloths_desktop', DESKTOP)


@pytest.mark.slow
def test_a_recording_without_services_is_shown(start_cloth, view, probe, tmp_path):
    """Only particles are published, as while a bag is played."""
    node = start_cloth(**CURTAIN)
    states = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(states) > 5)
    assert node.stop(signal.SIGINT) == 0
    player = probe.create_publisher(PointCloud2, '/cloth/particles', 5)

    def play() -> bool:
        player.publish(states[-1])
        probe.spin_for(0.02)
        return UPPER in view.nodes()

    view.wait_for(play)
    view.wait_for(lambda: play() and view.page.get_by_text('nothing to command').count())
    assert not view.page.get_by_text('Pause').is_visible()
    view.keep_screenshot(tmp_path, 'recording_laptop')


def test_a_signal_ends_the_viewer(start_viewer):
    viewer = start_viewer()
    assert viewer.stop(signal.SIGINT) == 0
    assert 'Traceback' not in viewer.output
    assert len(viewer.output.splitlines()) == 1


@pytest.mark.slow
def test_what_the_scene_and_others_set_is_shown(start_cloth, view, probe):
    start_cloth(**CURTAIN, wind__velocity='[0.0, 3.5, 0.0]')
    view.wait_for_text('structural')
    view.wait_for(view.page.locator('input[value="3.5"]').count)
    assert '/cloths/cloth/wind' in view.nodes()
    assert set_parameters(probe, springs__structural=777.0)[0].successful
    shown = view.page.locator('input[value="777"]')
    view.wait_for(shown.count)


@pytest.mark.slow
def test_a_paused_cloth_is_stepped(start_cloth, view, probe):
    start_cloth(**CURTAIN)
    states = probe.collect(PointCloud2, '/cloth/particles')
    view.wait_for_node(UPPER)
    button = lambda name: view.page.get_by_role('button', name=name, exact=True)  # noqa: E731
    view.wait_for(button('Pause').count)
    button('Pause').click()
    probe.spin_until(lambda: len(states) > 5 and len({stamp(each) for each in states[-5:]}) == 1)
    before = stamp(states[-1])
    button('Step').click()
    probe.spin_until(lambda: stamp(states[-1]) > before)
    assert stamp(states[-1]) - before == pytest.approx(1 / 60, abs=1e-6)
