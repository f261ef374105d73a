"""The command line of the viewer."""

import socket
import sys

import pytest

from cloth_ros.viewer.options import Options, free_address, parse

VIEWER = (sys.executable, '-m', 'cloth_ros.viewer.main')


def test_ros_arguments_are_left_to_ros():
    options = parse(['--port', '0', '--ros-args', '-r', '__ns:=/lab', '--', '--host', '::1'])
    assert options == Options('::1', 0, ['--ros-args', '-r', '__ns:=/lab', '--'])
    assert options.address == 'http://[::1]:0'


def test_it_listens_on_this_machine_only_unless_told_otherwise():
    assert parse([]).host == 'localhost'


def test_a_port_that_is_used_is_refused_with_one_that_is_not():
    with socket.create_server(('127.0.0.1', 0)) as used:
        port = used.getsockname()[1]
        with pytest.raises(ValueError, match=f'--port is {port}, .*write --port') as refusal:
            free_address(Options('127.0.0.1', port, []))
    remedy = int(str(refusal.value).rpartition(' ')[2])
    assert free_address(Options('127.0.0.1', remedy, [])).port == remedy


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--port', '70000'], "'70000', but must be a number from 0"),
        (['--host', 'no.such.host.invalid'], "'no.such.host.invalid', but must be"),
        (['--host', '192.0.2.1'], "'192.0.2.1', but must be an address of this machine"),
        (['--ros-args', '-r', 'nonsense'], 'nonsense'),
    ],
)
def test_bad_arguments_end_in_one_line(start, arguments, words):
    viewer = start(*VIEWER, *arguments)
    assert viewer.stop(0) == 2
    assert words in viewer.output.splitlines()[-1]
    assert 'Traceback' not in viewer.output


def test_help_has_an_example(start):
    viewer = start(*VIEWER, '--help')
    assert viewer.stop(0) == 0
    assert 'cloth_viewer --port 8090 --ros-args' in viewer.output
