"""Bad scene files: what is read is bounded, and executes nothing."""

import os

import pytest
import yaml
from builders import examples
from hypothesis import given
from reliability.invalid_values import refusal
from reliability.scene_files import HEAD, bad_files, bomb, damaged_files
from ros import NODE

from cloth_ros import Scene
from cloth_ros.scene import parameter_file


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    return tmp_path_factory.mktemp('scenes') / 'scene.yaml'


def read(path, content: bytes) -> str | None:
    """Read a scene from a file of this content; return the refusal."""
    path.write_bytes(content)
    return refusal(lambda: Scene.from_yaml(path))


@examples(2)
@given(content=damaged_files())
def test_damaged_files(path, content, outcomes):
    """Scene files with parts removed, replaced or repeated: a clear error, or a valid scene."""
    outcomes['refused' if read(path, content) else 'valid'] += 1


def test_files_bad_as_a_whole(path, long, outcomes):
    """Files that are no scene, or have a strange value somewhere: the same."""
    for content in bad_files()[:: 1 if long else 3]:
        outcomes['refused' if read(path, content) else 'valid'] += 1


VALUES = (b'!!timestamp x', b'!!bool x', b'2020-99-99', b'9' * 5000)
TAGS = (b'object/apply', b'object/new', b'name')
INVALID = [
    (b'a: 1\n \xef\xbb\xbf b: 2\n', ''),
    (b'/**:\n  ros__parameters: [1]\n', ''),
    *((HEAD + b'    x: ' + value, '') for value in VALUES),
    (HEAD + b'    drag: 1.0\n    drag: 2.0\n', "'drag' is given twice"),
    *((bomb(merged=merged), 'alias') for merged in (False, True)),
    *((HEAD + b'    rate: !!python/%b:os.mkdir ["made"]\n' % tag, 'tag') for tag in TAGS),
]


def test_files_known_to_be_invalid(path, monkeypatch):
    """Files that were accepted or failed otherwise once, bombs, tags: a clear error."""
    monkeypatch.chdir(path.parent)
    for content, message in INVALID:
        assert message in (read(path, content) or pytest.fail('accepted'))
    assert not (path.parent / 'made').exists()


def test_a_file_too_large_is_not_read(path):
    """A file that no memory holds: a clear error."""
    with path.open('wb') as file:
        file.truncate(10**12)
    assert 'more than 200000 bytes' in refusal(lambda: Scene.from_yaml(path))


def test_lists_and_strings_are_bounded():
    """Lists and strings longer than any use: a clear error."""
    for values, message in (
        ({'pins': ['0,0'] * 5000}, 'length of pins is 5000, but must be at most 4096'),
        ({'frame_id': 'x' * 1000}, 'at most 256 characters'),
        ({'pins': ['9' * 10**6 + ',0']}, 'at most 256 characters'),
    ):
        refused = refusal(lambda: Scene(**values))  # noqa: B023
        assert message in refused
        assert len(refused) < 400


def test_paths_that_lead_to_no_file(tmp_path, outcomes):
    """Pipes, folders, devices, links, and what is no path: a clear error, without waiting."""
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'loop').symlink_to('loop')
    special = [tmp_path / 'pipe', tmp_path, '/dev/zero', '/dev/null', '/dev/full']
    missing = ['', '.', '\0', 'x\0y', tmp_path / 'none', tmp_path / 'loop', 'x' * 300, 'x/' * 5000]
    missing += ['\ud800', '/proc/self/mem', '/proc/kcore', '/proc/self/maps', '/dev/tty']
    missing += ['/dev/stdin'] * (not os.path.isfile('/dev/stdin'))
    others = [None, 0, 1, -1, 10**9, 1.5, True, b'scene.yaml', bytearray(b'x'), [], {}, object()]
    for path in special:
        assert 'regular file' in refusal(lambda: Scene.from_yaml(path)), path  # noqa: B023
    for path in (*missing, *others):
        try:
            assert refusal(lambda: Scene.from_yaml(path)), path  # noqa: B023
        except OSError:  # what cannot be opened, as documented
            assert path not in others
    outcomes['refused'] += len(special) + len(missing) + len(others)


@pytest.mark.skipif(os.geteuid() == 0, reason='root reads everything')
def test_a_file_that_may_not_be_read_is_an_oserror(path):
    """A file without permission to read it: PermissionError."""
    path.touch()
    path.chmod(0)
    with pytest.raises(PermissionError):
        Scene.from_yaml(path)


def test_the_node_does_not_wait_for_a_pipe(start, tmp_path):
    """A pipe as parameter file of the node: refused, where rcl would wait for ever."""
    os.mkfifo(tmp_path / 'pipe')
    node = start(*NODE, '--ros-args', '--params-file', str(tmp_path / 'pipe'))
    assert node.stop(0) == 2
    assert 'regular file' in node.output


def test_the_loader_is_a_safe_one():
    """The loader of YAML constructs no objects; ruff forbids exec, eval, pickle and shells."""
    assert issubclass(parameter_file._Loader, yaml.SafeLoader)
    assert not [tag for tag in parameter_file._Loader.yaml_constructors if 'python' in str(tag)]
