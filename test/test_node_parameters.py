"""The parameters of the running node."""

import math
import sys

import numpy as np
import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    SetParametersAtomically,
)
from ros import FLOATING, diagnosis, numbers, parameter_request, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2

from cloth_ros.model import memory
from cloth_ros.node.qos import QueueDepths
from cloth_ros.scene import Scene
from cloth_ros.scene.parameter import PARAMETERS


def test_parameters_are_described(start_cloth, probe):
    start_cloth()
    names = sorted(PARAMETERS)
    request = DescribeParameters.Request(names=names)
    descriptors = probe.call(DescribeParameters, '/cloth/describe_parameters', request).descriptors
    assert [descriptor.name for descriptor in descriptors] == names
    for descriptor in descriptors:
        known = PARAMETERS[descriptor.name]
        assert known.text in descriptor.description
        assert known.unit in descriptor.description
        assert descriptor.read_only == known.fixed
        assert descriptor.type != ParameterType.PARAMETER_NOT_SET
    by_name = {descriptor.name: descriptor for descriptor in descriptors}
    assert by_name['springs.shear'].floating_point_range[0].to_value == 1e8
    assert by_name['sheet.rows'].integer_range[0].to_value == 1024


def test_parameters_change_together_or_not_at_all(start_cloth, probe):
    start_cloth(solver__substeps=60, sphere__radius=1, sphere__position='[0.0, 0.0, 9.0]')
    (good,) = set_parameters(probe, drag=2)  # a whole number is a number
    assert good.successful, good.reason
    wanted = parameter_request({'drag': 3.0, 'springs.structural': 1e6})
    request = SetParametersAtomically.Request(parameters=wanted.parameters)
    both = probe.call(SetParametersAtomically, '/cloth/set_parameters_atomically', request).result
    assert not both.successful
    assert 'solver.substeps is 60' in both.reason
    assert 'at least' in both.reason
    names = ['drag', 'springs.structural']
    values = probe.call(
        GetParameters, '/cloth/get_parameters', GetParameters.Request(names=names)
    ).values
    assert [item.double_value for item in values] == [2.0, 500.0]
    bad = set_parameters(
        probe,
        springs__shear=-1.0,
        sheet__rows=5,
        pins=['99,0'],
        solver__method='magic',
        gravity=[0.0, math.nan, 0.0],
        wind__gust__speed=[3.0, 1.0],
        rate=0.0,
    )
    assert not any(result.successful for result in bad)
    assert all(result.reason for result in bad)
    for content in (5, True, 2.5, 'x', [1.0], ['0,0']):
        for name in ('pins', 'gravity', 'drag', 'sheet__rows', 'markers__springs', 'frame_id'):
            (result,) = set_parameters(probe, **{name: content})
            assert result.successful or result.reason
    assert "'99,0'" in bad[2].reason
    request.parameters += parameter_request({'solver.substeps': 0}).parameters
    both = probe.call(SetParametersAtomically, '/cloth/set_parameters_atomically', request).result
    assert both.successful, both.reason


REFUSED = [
    ({'rate': 0.0}, ['rate is 0.0', '1 to 1000 Hz', 'nearest']),
    ({'rate': 'fast'}, ["rate is 'fast'", 'a number']),
    ({'gravity': [1.0, 2.0]}, ['gravity is [1.0, 2.0]', '3 numbers']),
    ({'sheet.rows': 8}, ['sheet.rows is 8', '32, as the node was started', 'start the node']),
    ({'sheet.size': [1.0, 3.0]}, ['sheet.size is [1.0, 3.0]', 'as the node was started']),
    (
        {'qos_overrides./cloth/particles.publisher.depth': 7},
        ['depth is 7', 'but must be 3', 'start the node'],
    ),
]


def test_refusals_name_the_value_the_range_and_the_remedy_and_are_counted(start_cloth, probe):
    depth = 'qos_overrides./cloth/particles.publisher.depth'
    start_cloth('-p', f'{depth}:=3')
    for changes, parts in REFUSED:
        (result,) = set_parameters(probe, **changes)
        assert not result.successful
        for part in parts:
            assert part in result.reason
    assert diagnosis(probe)['rejected parameters'] == str(len(REFUSED))


def test_one_request_sets_a_parameter_once_and_whole_numbers_may_be_written_as_others(
    start_cloth, probe
):
    start_cloth()
    twice = (
        parameter_request({'drag': -1.0}).parameters + parameter_request({'drag': 1.0}).parameters
    )
    request = SetParametersAtomically.Request(parameters=twice)
    result = probe.call(
        SetParametersAtomically, '/cloth/set_parameters_atomically', request
    ).result
    assert "the number of 'drag' is 2, but must be 1; give it once" in result.reason
    (result,) = set_parameters(probe, wind__gust__seed=5.0)
    assert result.successful, result.reason
    (result,) = set_parameters(probe, wind__gust__seed=5.5)
    assert 'wind.gust.seed is 5.5, but must be a whole number' in result.reason


def test_what_was_dumped_from_a_node_can_be_loaded_again(start_cloth, probe):
    start_cloth()
    scene = Scene().flat()
    values = {name: list(v) if isinstance(v, tuple) else v for name, v in scene.items()}
    results = set_parameters(probe, **values)
    assert [result.reason for result in results if not result.successful] == []
    assert len(results) == len(scene)


def test_of_several_set_one_by_one_a_refusal_leaves_the_others(start_cloth, probe):
    start_cloth()
    results = set_parameters(probe, drag=2.0, springs__shear=-1.0, springs__bending=50.0)
    assert [result.successful for result in results] == [True, False, True]
    names = ['drag', 'springs.shear', 'springs.bending']
    request = GetParameters.Request(names=names)
    values = probe.call(GetParameters, '/cloth/get_parameters', request).values
    assert [item.double_value for item in values] == [2.0, Scene().springs.shear, 50.0]


def test_every_parameter_that_is_not_fixed_changes_while_running(start_cloth, probe):
    start_cloth(**FLOATING, sheet__orientation='[0.1, 0.2, 0.3, 0.4]')
    particles = probe.collect(PointCloud2, '/cloth/particles', depth=1000)
    changes = {
        'rate': 120.0,
        'sheet__mass': 0.3,
        'pins': [''],
        'springs__structural': 100.0,
        'springs__shear': 0.0,
        'springs__bending': 0.0,
        'springs__damping': 0.01,
        'drag': 0.1,
        'gravity': [0.0, 0.0, -1.0],
        'wind__velocity': [0.0, 1.0, 0.0],
        'wind__air_density': 1.0,
        'wind__drag_coefficient': 0.5,
        'wind__gust__period': 3.0,
        'wind__gust__duration': 0.5,
        'wind__gust__direction': [0.0, 0.0, 1.0],
        'wind__gust__speed': [1.0, 2.0],
        'wind__gust__seed': 7,
        'sphere__radius': 0.1,
        'sphere__position': [0.0, 0.0, 0.5],
        'sphere__friction': 0.1,
        'solver__method': 'position_verlet',
        'solver__substeps': 100,
        'solver__tolerance': 0.01,
        'solver__precision': 'single',
        'solver__threads': 2,
        'solver__max_tick': 0.2,
        'solver__overload': 'coarsen',
        'markers__rate': 10.0,
        'markers__springs': True,
    }
    fixed = {name for name, known in PARAMETERS.items() if known.fixed}
    assert {name.replace('__', '.') for name in changes} == set(PARAMETERS) - fixed
    for name, content in changes.items():
        (result,) = set_parameters(probe, **{name: content})
        assert result.successful, result.reason
    particles.clear()
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))
    assert np.isfinite(numbers(particles[-1])).all()
    assert numbers(particles[-1])[..., 5].min() < 0  # gravity is there now


def test_qos_can_be_overridden(start_cloth, probe):
    start_cloth(**{'qos_overrides./cloth/particles.publisher.reliability': 'best_effort'})
    probe.spin_until(lambda: probe.count_publishers('/cloth/particles'))
    (info,) = probe.get_publishers_info_by_topic('/cloth/particles')
    assert info.qos_profile.reliability.name == 'BEST_EFFORT'
    (info,) = probe.get_publishers_info_by_topic('/cloth/markers')
    assert info.qos_profile.reliability.name == 'RELIABLE'


def test_a_scene_that_is_not_valid_is_refused_in_one_line(start):
    node = start(sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', '-p', 'sheet.rows:=0')
    assert node.stop(0, patience=30.0) == 2
    assert 'sheet.rows is 0, but must be 1 to 1024' in node.output
    assert 'Traceback' not in node.output


def test_names_that_no_scene_has_are_pointed_out(start_cloth):
    node = start_cloth(**{'spring.shear': 3.0})
    assert "did you mean 'springs.shear'" in node.output


def test_a_queue_that_memory_has_no_room_for_is_refused(monkeypatch):
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


NOT_COMPILED = """
import sys
from cloth_ros import Cloth
from cloth_ros.node.main import main

warm_up = Cloth.warm_up

def failing(self, *kinds):
    if self.scene.drag == 3:
        raise OSError('no space left on device')
    return warm_up(self, *kinds)

Cloth.warm_up = failing
sys.exit(main())
"""


def test_kernels_that_cannot_be_compiled_leave_the_cloth_as_it_is(start, probe):
    node = start(sys.executable, '-c', NOT_COMPILED, '--ros-args', '-p', 'drag:=0.5')
    node.wait_for_output('publishing')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    (result,) = set_parameters(probe, drag=3.0)
    assert result.successful
    node.wait_for_output('no space left on device')
    particles.clear()
    probe.spin_until(lambda: len(particles) > 60)
    assert node.output.count('no space left on device') == 1, 'it is not tried again and again'
    results = set_parameters(probe, drag=2.0, rate=120.0)  # which is
    assert all(result.successful for result in results)
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))
    assert node.output.count('no space left on device') == 1
