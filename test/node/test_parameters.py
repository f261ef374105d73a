"""Parameters of a running node."""

import math
import shlex

import pytest
from rcl_interfaces.msg import Parameter, ParameterType
from rcl_interfaces.srv import DescribeParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import get_parameter_value
from ros import diagnosis, parameter_request

from cloth_ros import Scene
from cloth_ros.model import memory
from cloth_ros.node.parameter_arguments import ParameterArguments
from cloth_ros.node.qos import QueueDepths
from cloth_ros.scene.parameter import PARAMETERS

CHANGES = {
    'rate': 125.0,
    'sheet.mass': 0.3,
    'pins': [''],
    'springs.structural': 100.0,
    'springs.shear': 0.0,
    'springs.bending': 0.0,
    'springs.damping': 0.01,
    'drag': 0.1,
    'gravity': [0.0, 0.0, -1.0],
    'wind.velocity': [0.0, 1.0, 0.0],
    'wind.air_density': 1.0,
    'wind.drag_coefficient': 0.5,
    'wind.gust.period': 3.0,
    'wind.gust.duration': 0.5,
    'wind.gust.direction': [0.0, 0.0, 1.0],
    'wind.gust.speed': [1.0, 2.0],
    'wind.gust.seed': 7,
    'sphere.radius': 0.2,
    'sphere.position': [0.0, 0.0, 0.5],
    'sphere.friction': 0.1,
    'collider.names': [''],
    'gripper.names': [''],
    'self_contact.friction': 0.5,
    'solver.method': 'position_verlet',
    'solver.substeps': 100,
    'solver.tolerance': 0.01,
    'solver.precision': 'single',
    'solver.threads': 2,
    'solver.max_tick': 0.2,
    'solver.overload': 'coarsen',
    'markers.rate': 10.0,
    'markers.meshes': 'file',
    'markers.springs': True,
    'particles.rate': 20.0,
    'particles.velocities': False,
    'clock.rate': 5.0,
    'snapshot.file': '/tmp/draped.snapshot',
}


def test_every_parameter_is_described(cloth):
    request = DescribeParameters.Request(names=list(PARAMETERS))
    answer = cloth.probe.call(DescribeParameters, '/cloth/describe_parameters', request)
    described = {descriptor.name: descriptor for descriptor in answer.descriptors}
    assert set(described) == set(PARAMETERS)
    for name, spec in PARAMETERS.items():
        assert spec.text in described[name].description
        assert spec.unit in described[name].description
        assert described[name].read_only == spec.fixed
        assert described[name].type != ParameterType.PARAMETER_NOT_SET
    assert described['springs.shear'].floating_point_range[0].to_value == 1e8
    assert described['sheet.rows'].integer_range[0].to_value == 1024


def test_every_parameter_that_is_not_fixed_changes_while_running(cloth):
    assert set(CHANGES) == {name for name, spec in PARAMETERS.items() if not spec.fixed}
    for name, value in CHANGES.items():
        assert cloth.set(**{name: value}) == ['']
    assert CHANGES.items() <= cloth.parameters().items()
    # Kernels may have to be compiled before the changes take effect.
    cloth.tick_until(lambda state: state[..., 2].max() < 1.0)
    cloth.tick(3, seconds=1 / CHANGES['particles.rate'])
    found = diagnosis(cloth.probe)
    assert float(found['tolerance [m]']) == CHANGES['solver.tolerance']
    assert float(found['sphere radius [m]']) == CHANGES['sphere.radius']


def test_parameters_read_from_a_node_can_be_set_again(cloth):
    """Those that are fixed, and keep their value, too: a dumped file contains all."""
    assert cloth.set(**cloth.parameters()) == [''] * len(PARAMETERS)


def test_several_parameters_are_set_together_or_not_at_all(cloth):
    assert cloth.set(solver__substeps=60, drag=2) == ['', '']  # a whole number is a number
    reason = cloth.set_together({'drag': 3.0, 'springs.structural': 1e6})
    assert 'solver.substeps is 60, but must be 0 or at least' in reason
    assert cloth.parameters()['drag'] == 2.0
    wanted = {'drag': 3.0, 'springs.structural': 1e6, 'solver.substeps': 0}
    assert cloth.set_together(wanted) == ''
    assert wanted.items() <= cloth.parameters().items()


def test_of_several_set_one_by_one_a_rejected_one_leaves_the_others(cloth):
    before = cloth.parameters()
    reasons = cloth.set(drag=2.0, springs__shear=-1.0, springs__bending=40.0)
    assert [not reason for reason in reasons] == [True, False, True]
    expected = before | {'drag': 2.0, 'springs.bending': 40.0}
    assert cloth.parameters() == expected


AS_TEXT = {
    'gravity': '[0, 0, -9.81]',
    'wind.velocity': '[1.5, 0, 0]',
    'wind.gust.speed': '[1, 2]',
    'solver.tolerance': '1e-4',
    'drag': '2',
    'solver.substeps': '2e2',
    'pins': '[]',
    'markers.springs': 'yes',
    'use_sim_time': 'true',
    'sheet.size': '[1, 1]',
}


def test_values_as_ros2_param_set_sends_them(cloth):
    """It sends text for numbers without a point, and for integers beside floats."""
    for name, text in AS_TEXT.items():
        message = Parameter(name=name, value=get_parameter_value(text))
        request = SetParameters.Request(parameters=[message])
        (result,) = cloth.probe.call(SetParameters, '/cloth/set_parameters', request).results
        assert result.reason == ''
    found = cloth.parameters()
    assert (found['gravity'], found['wind.velocity']) == ([0.0, 0.0, -9.81], [1.5, 0.0, 0.0])
    assert (found['wind.gust.speed'], found['solver.tolerance']) == ([1.0, 2.0], 1e-4)
    assert (found['drag'], found['solver.substeps'], found['pins']) == (2.0, 200, [])
    assert found['markers.springs'] is True


REJECTED = [
    ('spring.shear', 3.0, ["'spring.shear' is not a parameter", "did you mean 'springs.shear'?"]),
    ('use_sim_tim', True, ["did you mean 'use_sim_time'?"]),
    ('use_sim_time', 1, ['use_sim_time is 1, but must be true or false; write true']),
    ('start_type_description_service', False, ['as the node was started; start the node with -p']),
    ('rate', 0.0, ['rate is 0.0', '1 to 1000 Hz', 'nearest']),
    ('rate', 'fast', ["rate is 'fast'", 'a number']),
    ('gravity', [1.0, 2.0], ['gravity is [1.0, 2.0]', '3 numbers']),
    ('gravity', [0.0, math.nan, 0.0], ['gravity', 'nan', 'finite']),
    ('pins', ['99,0'], ["'99,0'"]),
    ('solver.method', 'magic', ["'magic'", 'position_verlet']),
    ('wind.gust.speed', [3.0, 1.0], ['wind.gust.speed is']),
    ('wind.gust.seed', 5.5, ['wind.gust.seed is 5.5, but must be a whole number']),
    ('sheet.rows', 8, ['is 8', '9, as the node was started', 'with -p sheet.rows:=8']),
    ('sheet.size', [1.0, 3.0], ['sheet.size is [1.0, 3.0]', 'as the node was started']),
]


def test_rejections_name_value_range_and_remedy_and_are_counted(cloth):
    key = 'rejected requests to set parameters'
    before, count = cloth.parameters(), int(diagnosis(cloth.probe)[key])
    for name, value, parts in REJECTED:
        (reason,) = cloth.set(**{name: value})
        for part in parts:
            assert part in reason
    # What the last one advises: reason ends with the arguments of the node.
    arguments = shlex.split(reason.partition('start the node with ')[2])
    assert ParameterArguments(['--ros-args', *arguments]).arguments[1:] == arguments
    twice = [each for x in (1.0, 2.0) for each in parameter_request({'drag': x}).parameters]
    request = SetParametersAtomically.Request(parameters=twice)
    service = '/cloth/set_parameters_atomically'
    result = cloth.probe.call(SetParametersAtomically, service, request).result
    assert "the number of 'drag' is 2, but must be 1; give it once" in result.reason
    assert cloth.parameters() == before
    expected = str(count + len(REJECTED) + 1)
    cloth.probe.spin_until(lambda: diagnosis(cloth.probe)[key] == expected)


@pytest.mark.parametrize('value', [5, True, 2.5, 'x', [1.0], ['0,0'], [True]])
def test_values_of_any_type_are_set_or_rejected_with_a_reason(cloth, value):
    for name in ('pins', 'gravity', 'drag', 'sheet.rows', 'markers.springs', 'frame_id'):
        before = cloth.parameters()[name]
        (reason,) = cloth.set(**{name: value})
        assert reason or cloth.parameters()[name] == value
        assert not reason or cloth.parameters()[name] == before


def test_a_queue_for_which_there_is_no_memory_is_refused(monkeypatch):
    scene = Scene(sheet={'rows': 100, 'columns': 100})  # 0.24 MB, and 1.44 MB of markers
    monkeypatch.setattr(memory, 'available', lambda: 400e6)
    QueueDepths({}).check(scene)
    QueueDepths({'particles': ('the depth', 500), 'markers': ('the depth', 30)}).check(scene)
    deep = QueueDepths({'markers': ('the depth', 150)})
    with pytest.raises(ValueError, match=r'the depth is 150, but must be .* 1\.44 MB'):
        deep.check(scene)
    deep.check(scene.with_parameters({'markers.rate': 0}))
    some = QueueDepths({'markers': ('the depth', 60)})
    some.check(scene)
    with pytest.raises(ValueError, match='the depth is 60'):
        some.check(scene.with_parameters({'markers.springs': True}))
