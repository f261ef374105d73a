"""Bad input ends in a clear error or a counted refusal; `make fuzz` does more of the same."""

import array
import decimal
import math
import os
import sys
from itertools import count, repeat

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from ros import diagnosis, publish_until, set_parameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2

from cloth_ros import Cloth, Scene
from reliability import fuzz_commands, fuzz_files, fuzz_services, fuzz_topics, fuzz_values
from reliability.live import live
from reliability.tally import Tally, attempt

# What failed once: values of parameters, by what came of them.
FAILED = [
    {'wind.gust.seed': 2**53 + 1},  # accepted, out of range
    {'rate': b'60'},  # accepted
    {'rate': np.array([60.0])},  # accepted, with a warning
    {'rate': 10**5000},  # Python's complaint of its digits
    {'rate': decimal.Decimal('sNaN')},
    {'pins': ['9' * 5000 + ',0']},
    {'pins': ['0,0'] * 5000},
    {'gravity': range(10**30)},  # OverflowError
    {'gravity': np.full(3, 1 + 1j)},  # TypeError
    {'gravity': np.zeros((3, 3))},  # an error of several lines
    {'frame_id': '\ud800'},  # accepted, and no message can carry it
    {'frame_id': 'a\0b'},
    {'frame_id': 'x' * 10**6},
    {'x' * 10**5: 1},  # an error as long
    {10**5000: 1},
    {'sheet': 4, 'sheet.rows': 3},  # accepted, the 4 forgotten
    {'sheet.rows': array.array('d', [1.0])},
    None,
    [],
    'rate',
]


@pytest.mark.parametrize('changes', FAILED, ids=range(len(FAILED)))
@pytest.mark.parametrize('way', ['with_parameters', 'from_parameters'])
def test_values_that_failed_once(way, changes):
    tally = Tally('')
    fuzz_values.try_scene(tally, way, changes)
    assert (tally.refused, tally.wrong) == (1, [])


def test_a_group_given_twice_is_merged():
    scene = Scene.from_parameters({'sheet': Scene(sheet={'rows': 7}).sheet, 'sheet.columns': 9})
    assert (scene.sheet.rows, scene.sheet.columns) == (7, 9)


COMMANDS = [
    ('advance', None),  # TypeError
    ('advance', '0.1'),  # accepted
    ('advance', 10**400),  # OverflowError
    ('advance', [0.1]),
    ('advance', np.array([0.1])),
    ('wind', ['1', '2', '3']),  # accepted
    ('wind', [1j, 0, 0]),
    ('wind', np.zeros(3, complex)),  # a warning of NumPy
    ('wind', np.full(3, '1e4000', np.longdouble)),
    ('wind', [10**5000, 0, 0]),
    ('move_sphere', None),
    ('move_sphere', {0: 1}),
    ('positions', None),  # TypeError
    ('positions', [[1.0], [1.0, 2.0]]),
    ('positions', np.full((5, 6, 3), 'x')),
    ('positions', np.zeros((5, 6, 3), complex)),  # a warning
    ('positions', np.full((5, 6, 3), '1e4000', np.longdouble)),
    ('velocities', np.full((5, 6, 3), None)),
    ('velocities', [np.ma.masked]),  # a warning
]


@pytest.mark.parametrize(('command', 'value'), COMMANDS, ids=range(len(COMMANDS)))
def test_commands_that_failed_once(command, value):
    tally = Tally('')
    fuzz_values.Commanded(tally).give(command, value)
    assert (tally.refused, tally.wrong) == (1, [])


@pytest.mark.parametrize('path', [None, 0, b'x', '\0', '\ud800'], ids=ascii)
def test_paths_that_failed_once(path):
    tally = Tally('')
    attempt(tally, path, lambda: Scene.from_yaml(path))
    assert (tally.refused, tally.wrong) == (1, [])


@pytest.mark.parametrize('content', fuzz_files.whole(), ids=range(len(fuzz_files.whole())))
def test_files_bad_as_a_whole(tmp_path, content):
    tally = Tally('')
    fuzz_files.try_file(tally, tmp_path / 'scene.yaml', content)
    assert not tally.wrong


@pytest.mark.parametrize(
    'content',
    [
        b'a: 1\n \xef\xbb\xbf b: 2\n',  # an error that could not be printed
        b'/**:\n  ros__parameters:\n    x: !!timestamp x\n',  # AttributeError
        b'/**:\n  ros__parameters:\n    x: !!bool x\n',  # KeyError
        b'/**:\n  ros__parameters:\n    x: 2020-99-99\n',  # "month must be in 1..12"
        b'/**:\n  ros__parameters:\n    rate: ' + b'9' * 5000 + b'\n',
        b'/**:\n  ros__parameters: [1]\n',  # no remedy
    ],
)
def test_files_that_failed_once(tmp_path, content):
    tally = Tally('')
    fuzz_files.try_file(tally, tmp_path / 'scene.yaml', content)
    assert (tally.refused, tally.wrong) == (1, [])


def test_a_key_that_stands_twice_is_refused(tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text('/**:\n  ros__parameters:\n    drag: 1.0\n    drag: 2.0\n')
    with pytest.raises(ValueError, match="'drag' stands here twice"):
        Scene.from_yaml(path)


@pytest.mark.parametrize(
    ('fuzz', 'cases'),
    [
        (fuzz_values.parameters, 900),
        (fuzz_values.commands, 150),
        (fuzz_files.files, 700),
        (fuzz_commands.study, 100),
    ],
    ids=['parameters', 'commands', 'files', 'study'],
)
def test_bad_input_in_python(fuzz, cases):
    tally = fuzz(cases)
    assert not tally.wrong
    assert tally.cases == cases
    assert tally.refused > 0


@pytest.mark.skipif(os.geteuid() == 0, reason='root reads everything')
def test_a_file_that_may_not_be_read_is_an_oserror(tmp_path):
    (tmp_path / 'scene.yaml').touch(mode=0)
    with pytest.raises(PermissionError):
        Scene.from_yaml(tmp_path / 'scene.yaml')


def test_paths_that_lead_to_no_file():
    tally = fuzz_files.paths()
    assert not tally.wrong


def test_a_live_node_outlives_bad_messages_bytes_and_requests():
    with live(*fuzz_topics.SCENE) as running:
        tallies = [
            fuzz_topics.messages(running, 800),
            fuzz_topics.corrupted(running, 400),
            fuzz_topics.clocks(running, 200),
            fuzz_services.questions(running, 200),
            fuzz_services.parameters(running, 200),
        ]
        assert [tally.wrong for tally in tallies] == [[], [], [], [], []]
        assert tallies[0].refused > 100
        assert tallies[0].accepted > 100
        assert tallies[4].accepted > 10
        fuzz_services.restore(running)
        assert 'Traceback' not in running.node.output


def test_a_type_that_there_is_not_ends_no_node(start_cloth, probe):
    """rclpy's own service ends with it, and the node with the service."""
    node = start_cloth()
    strange = Parameter(name='rate', value=ParameterValue(type=99))
    good = Parameter(name='drag', value=ParameterValue(type=3, double_value=2.0))
    request = SetParameters.Request(parameters=[strange, good])
    first, second = probe.call(SetParameters, '/cloth/set_parameters', request).results
    assert not first.successful
    assert "'rate' is 99, but must be 0 to 9" in first.reason
    assert second.successful
    both = SetParametersAtomically.Request(parameters=[good, strange])
    service = '/cloth/set_parameters_atomically'
    assert not probe.call(SetParametersAtomically, service, both).result.successful
    assert node.alive


def test_a_clock_that_is_no_time_ends_no_node(start_cloth, probe):
    """rclpy's own subscription ends it with a negative second."""
    node = start_cloth(use_sim_time='true')
    clock = probe.publisher(Clock, '/clock')
    for sec, nanosec in ((-1, 0), (-(2**31), 2**32 - 1), (2**31 - 1, 2**32 - 1), (5, 10**9)):
        probe.spin_for(0.2)  # what is on its way is of the time before
        before = diagnosis(probe)['rejected clock']
        publish_until(
            lambda: diagnosis(probe)['rejected clock'] != before,  # noqa: B023
            probe,
            clock,
            repeat(Clock(clock=Time(sec=sec, nanosec=nanosec))),
        )
    assert 'rejected a message on clock' in node.output
    particles = probe.collect(PointCloud2, '/cloth/particles')
    for sec in (2**31 - 1, 7):  # the last second that a stamp can carry, and back
        publish_until(
            lambda: particles and particles[-1].header.stamp.sec == sec,  # noqa: B023
            probe,
            clock,
            (Clock(clock=Time(sec=sec, nanosec=n * 25_000_000 % 10**9)) for n in count()),
        )
    assert node.alive


def test_a_clock_that_is_no_time_is_refused_from_a_parameter_on_as_well(start_cloth, probe):
    node = start_cloth()
    (result,) = set_parameters(probe, use_sim_time=True)
    assert result.successful
    publish_until(
        lambda: 'rejected a message on clock' in node.output,
        probe,
        probe.publisher(Clock, '/clock'),
        repeat(Clock(clock=Time(sec=-1))),
    )
    (result,) = set_parameters(probe, use_sim_time=False)
    assert result.successful
    probe.spin_until(lambda: diagnosis(probe)['message'] == 'running in real time')


NOT_SENT = """
import sys
from itertools import count
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher
from cloth_ros.node.main import main

publish, tries = Publisher.publish, count()

def failing(self, message):
    if 'cloth' in self.topic_name and next(tries) < 10:
        raise rclpy_implementation.RCLError('failed to publish: a time-out')
    publish(self, message)

Publisher.publish = failing
sys.exit(main())
"""


def test_a_message_that_cannot_be_sent_ends_no_node(start, probe):
    node = start(sys.executable, '-c', NOT_SENT)
    node.wait_for_output('publishing')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 5)
    assert node.output.count('a message on particles was not sent') == 1
    assert diagnosis(probe)['messages not sent'] == '10'


FAILING = """
import sys
from cloth_ros import Cloth
from cloth_ros.node.main import main

def advance_stepwise(self, seconds, inputs=None):
    raise ZeroDivisionError('unforeseen')

Cloth.advance_stepwise = advance_stepwise
sys.exit(main())
"""


def test_an_error_that_no_one_foresaw_ends_the_node_aloud(start):
    """It must not go on with a state that may be half made; a launch file can start it again."""
    node = start(sys.executable, '-c', FAILING)
    assert node.process.wait(60.0) == 1
    assert 'ZeroDivisionError: unforeseen' in node.output


def test_changes_that_only_their_combination_forbids_are_refused_together(start_cloth, probe):
    start_cloth()
    request = SetParametersAtomically.Request(
        parameters=[
            Parameter(name=name, value=ParameterValue(type=3, double_value=number))
            for name, number in (('wind.gust.period', 2.0), ('wind.gust.duration', 3.0))
        ]
    )
    service = '/cloth/set_parameters_atomically'
    result = probe.call(SetParametersAtomically, service, request).result
    assert not result.successful
    assert 'at most wind.gust.period, 2 s' in result.reason
    (alone,) = set_parameters(probe, wind__gust__duration=3.0)
    assert alone.successful, 'there are no gusts: nothing was changed'


LARGEST = ('-p', 'sheet.rows:=1024', '-p', 'sheet.columns:=1024', '-p', 'markers.springs:=true')
STARTS = [
    ['--help'],  # ran
    ['config/gust.yaml'],  # ran, with another scene
    ['--ros-args', '-p', 'pins:=[]'],  # did not say what of
    ['--ros-args', '-p', 'qos_overrides./cloth/particles.publisher.depth:=junk'],  # AssertionError
    ['--ros-args', '-p', f'qos_overrides./cloth/particles.publisher.depth:={2**63 - 1}'],
    ['--ros-args', '-p', 'qos_overrides./cloth/particles.publisher.depth:=1e3'],
    ['--ros-args', '-p', 'qos_overrides./cloth/particles.publisher.reliability:=1'],
    # without end, or nearly so, for a reader that hangs
    ['--ros-args', '-p', 'qos_overrides./cloth/particles.publisher.history:=keep_all'],
    ['--ros-args', '-p', 'qos_overrides./wind.subscription.history:=KEEP_ALL'],
    ['--ros-args', *LARGEST, '-p', 'qos_overrides./cloth/markers.publisher.depth:=1000'],
    ['--ros-args', '-p', 'pins:=' + '[' * 2000],  # an error as long
    ['--ros-args', '--foo'],
]


@pytest.mark.parametrize('arguments', STARTS, ids=range(len(STARTS)))
def test_starts_of_the_node_that_failed_once(domain, arguments):
    tally = Tally('')
    fuzz_commands.try_node(tally, domain, arguments)
    assert (tally.refused, tally.wrong) == (1, [])


def test_the_study_as_a_process_says_no_in_one_line():
    status, output = fuzz_commands.study_process(['/dev/zero'])
    assert fuzz_commands.complaint(status, output, 'cloth_tradeoff') == ''


@pytest.mark.parametrize(
    'changes',
    [
        {'sheet.size': [1e-3, 1.0], 'sheet.columns': 1024, 'sheet.rows': 2},
        {'sheet.size': [1e3, 1e3]},
        {'sheet.mass': 1e9},
        {'wind.gust.seed': 2**53, 'wind.gust.period': 1e-3, 'wind.gust.duration': 1e-3},
        {'wind.gust.period': 1e6, 'wind.gust.duration': 1e6},
        {'rate': 1000.0},
        {'sheet.orientation': [1e6, -1e6, 1e6, 0.0]},
        {'sheet.position': [1e6, -1e6, 1e6]},
        {'wind.velocity': [1e4, -1e4, 1e4]},
        {'gravity': [1e4, 1e4, -1e4]},
        {'drag': 1e6},
        {'sphere.radius': 1e3, 'sphere.position': [0.0, 0.0, -1002.0]},
        {'sphere.radius': 1e-4, 'sphere.friction': 10.0},
        {'solver.tolerance': 1e-6},
        {'solver.tolerance': 1.0, 'solver.max_tick': 10.0},
        {'solver.threads': 64},
        {'solver.substeps': 1_000_000},
    ],
    ids=str,
)
def test_the_ends_of_the_ranges_are_handled(changes):
    cloth = Cloth(Scene(sheet={'rows': 6, 'columns': 6}).with_parameters(changes))
    cloth.advance(3 * cloth.substep)
    assert np.isfinite(cloth.positions).all()
    assert math.isfinite(cloth.energy())
