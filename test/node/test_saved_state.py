"""Services ~/save and ~/load: the whole state in a file, or the cloth as it was."""

import numpy as np
import pytest
from node.conftest import PERIOD, SteppedCloth, at_rest
from rcl_interfaces.msg import ParameterEvent
from ros import (
    NODE,
    Process,
    diagnosis,
    environment,
    free_domain,
    numbers,
    pose,
    probing,
    stamp,
    wind,
)
from std_srvs.srv import Trigger

from cloth_ros import Cloth

RESTORED = 'a saved state is restored'


def call(cloth: SteppedCloth, service: str) -> Trigger.Response:
    return cloth.probe.call(Trigger, f'/cloth/{service}', Trigger.Request())


def saved(cloth: SteppedCloth) -> str:
    response = call(cloth, 'save')
    assert response.success, response.message
    return response.message


def loaded(cloth: SteppedCloth) -> str:
    response = call(cloth, 'load')
    assert response.success, response.message
    return response.message


def step(cloth: SteppedCloth, count: int) -> list[np.ndarray]:
    """Simulate ticks of the paused cloth; how far ticks of /clock get depends on the machine."""
    states = []
    for _ in range(count):
        first = len(cloth.states)
        assert call(cloth, 'step').success
        cloth.probe.spin_until(lambda: len(cloth.states) > first)  # noqa: B023
        states.append(numbers(cloth.states[first]))
    return states


@pytest.fixture
def moving(cloth, tmp_path):
    """The stepped node with a file, paused, while wind and sphere move the sheet."""
    assert cloth.set(snapshot__file=str(tmp_path / 'cloth.snapshot')) == ['']
    cloth.send('/wind', wind(x=3.0, z=-2.0))
    cloth.tick_until(lambda state: state[..., 5].min() < -0.01)
    cloth.send('/sphere_pose', pose(z=0.95))
    cloth.tick_until(lambda state: state[4, 4, 2] < 0.87)  # from above
    cloth.pause(True)
    cloth.tick()
    return cloth


def test_a_loaded_state_continues_with_the_same_bits(moving, tmp_path):
    """Also with parameters that were changed since, whose kernels may have to be compiled."""
    file = tmp_path / 'cloth.snapshot'
    text = saved(moving)
    assert f'saved {file}: {file.stat().st_size} bytes' in text
    expected = step(moving, 8)
    moving.pause(False)
    events: list[ParameterEvent] = moving.probe.collect(ParameterEvent, '/parameter_events')
    moving.send('/wind', wind(y=9.0))
    moving.tick_until(lambda state: state[..., 4].mean() > 0.1)
    moving.pause(True)
    assert moving.set(drag=2.0, springs__damping=1e-5, markers__rate=5.0) == [''] * 3
    before = moving.process.output.count(RESTORED)
    text = loaded(moving)
    assert f'loaded {file}: {file.stat().st_size} bytes' in text
    assert moving.parameters()['drag'] == 0.0
    assert moving.parameters()['snapshot.file'] == str(file)
    names = [{each.name for each in event.changed_parameters} for event in events]
    moving.probe.spin_until(lambda: {'drag', 'springs.damping', 'markers.rate'} in names)
    while moving.process.output.count(RESTORED) == before:  # kernels are being compiled
        moving.tick()
    assert np.array_equal(step(moving, 8), expected)
    # The model alone continues in the same way.
    alone = Cloth.load(file)
    assert alone.time == pytest.approx(float(text.split('time ')[1].split(' s')[0]))
    for state in expected:
        alone.advance(PERIOD)
        assert np.array_equal(state[..., :3], alone.positions.astype(np.float32))


def test_while_paused_a_state_is_saved_loaded_and_shown(moving):
    (before,) = moving.tick()
    saved(moving)
    moving.reset()
    assert at_rest(moving.tick()[0])
    first = stamp(moving.states[-1])
    loaded(moving)
    assert np.array_equal(moving.tick()[0], before)
    assert stamp(moving.states[-1]) > first
    assert diagnosis(moving.probe)['error estimate [m]'] == 'not yet sampled'


def test_what_cannot_be_loaded_leaves_the_cloth_as_it_was(moving, tmp_path):
    saved(moving)
    file = tmp_path / 'cloth.snapshot'
    whole = file.read_bytes()
    other = tmp_path / 'other.snapshot'
    Cloth(Cloth.load(file).scene.with_parameters({'sheet.rows': 10, 'sheet.columns': 8})).save(
        other
    )
    expected = step(moving, 4)
    loaded(moving)
    for content, reason in (
        (whole[:-1], 'incomplete'),
        (whole[:200] + bytes([whole[200] ^ 1]) + whole[201:], 'damaged'),
        (b'# a scene', 'not a snapshot'),
        (other.read_bytes(), '-p sheet.rows:=10 -p sheet.columns:=8'),
        (None, 'No such file'),
    ):
        file.unlink()
        if content is not None:
            file.write_bytes(content)
        response = call(moving, 'load')
        assert (response.success, reason in response.message) == (False, True), response.message
        assert str(file) in response.message
        assert response.message.isprintable()
        file.write_bytes(whole)
    assert np.array_equal(step(moving, 4), expected)


def test_what_cannot_be_saved_is_explained(moving, tmp_path):
    (tmp_path / 'file').touch()
    for wrong in ('none/a', 'file/a', 'file', '.'):
        assert moving.set(snapshot__file=str(tmp_path / wrong)) == ['']
        response = call(moving, 'save')
        assert not response.success
        assert str(tmp_path / wrong) in response.message
        assert 'snapshot.file' in response.message or 'give a file' in response.message
    assert [path.name for path in tmp_path.iterdir()] == ['file']
    assert (tmp_path / 'file').read_text() == ''


def test_without_a_file_name_each_node_has_its_own_in_the_folder_of_ros(tmp_path):
    with free_domain() as domain:
        variables = {**environment(domain), 'ROS_HOME': str(tmp_path / 'home')}
        small = ['-p', 'sheet.rows:=3', '-p', 'sheet.columns:=3']
        process = Process((*NODE, '--ros-args', '-r', '__ns:=/lab', *small), variables)
        try:
            process.wait_for_output('publishing')
            with probing(domain) as probe:
                response = probe.call(Trigger, '/lab/cloth/save', Trigger.Request())
                assert response.success, response.message
        finally:
            process.end()
    assert Cloth.load(tmp_path / 'home' / 'lab.cloth.snapshot').scene.sheet.rows == 3
