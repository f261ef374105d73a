"""What is read executes nothing, and is bounded."""

import ast
import os
import sys
import time

import pytest
import yaml
from ros import ROOT

from cloth_ros import Scene
from cloth_ros.scene import parameter_file
from reliability.fuzz_files import bomb, merge_bomb

SOURCES = sorted((ROOT / 'cloth_ros').rglob('*.py'))
HEAD = '/**:\n  ros__parameters:\n'
FORBIDDEN = {'eval', 'exec', 'execfile', 'compile', '__import__'}


def calls(path):
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: path.stem)
def test_no_source_executes_or_unpickles_what_it_reads(path):
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name.split('.')[0] for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [(node.module or '').split('.')[0]]
    assert not set(names) & {'pickle', 'dill', 'shelve', 'marshal', 'cloudpickle', 'joblib'}
    for call in calls(path):
        if isinstance(call.func, ast.Name):
            assert call.func.id not in FORBIDDEN
        written = ast.unparse(call.func)
        assert written not in ('os.system', 'os.popen', 'yaml.unsafe_load', 'yaml.full_load')
        for word in call.keywords:
            if word.arg in ('allow_pickle', 'shell'):
                assert ast.unparse(word.value) == 'False'
        if written in ('yaml.load', 'yaml.load_all'):
            assert ast.unparse(call.args[1]) == '_Loader'


def test_the_loader_is_a_safe_one():
    assert issubclass(parameter_file._Loader, yaml.SafeLoader)
    assert not [tag for tag in parameter_file._Loader.yaml_constructors if 'python' in str(tag)]


@pytest.mark.parametrize(
    'tag',
    ['!!python/object/apply:os.mkdir', '!!python/object/new:os.mkdir', '!!python/name:os.mkdir'],
)
def test_no_object_is_constructed(tmp_path, tag):
    made = tmp_path / 'made'
    path = tmp_path / 'scene.yaml'
    path.write_text(f'{HEAD}    rate: {tag} ["{made}"]\n')
    with pytest.raises(ValueError, match='tag'):
        Scene.from_yaml(path)
    assert not made.exists()


@pytest.mark.parametrize('content', [bomb(), merge_bomb()], ids=['lists', 'merged'])
def test_an_alias_bomb_is_refused_at_once(tmp_path, content):
    path = tmp_path / 'scene.yaml'
    path.write_bytes(content)
    with pytest.raises(ValueError, match='alias'):
        Scene.from_yaml(path)


def test_a_file_too_large_is_not_read(tmp_path):
    path = tmp_path / 'scene.yaml'
    with path.open('wb') as file:
        file.truncate(10**12)  # no disk holds it, nor memory
    with pytest.raises(ValueError, match='more than 200000 bytes'):
        Scene.from_yaml(path)


@pytest.mark.parametrize('name', ['pipe', 'folder', '/dev/zero', '/dev/stdin'])
def test_what_is_no_file_is_refused_without_waiting(tmp_path, name):
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'folder').mkdir()
    if name == '/dev/stdin' and os.path.isfile('/dev/stdin'):
        pytest.skip('standard input is a file here')
    with pytest.raises(ValueError, match='no file'):
        Scene.from_yaml(tmp_path / name)


def test_the_node_does_not_wait_for_a_pipe(start, tmp_path):
    """rcl would, for ever."""
    os.mkfifo(tmp_path / 'pipe')
    command = (sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', '--params-file')
    node = start(*command, str(tmp_path / 'pipe'))
    end = time.monotonic() + 30.0
    while node.process.poll() is None:
        assert time.monotonic() < end, 'it waits'
        time.sleep(0.05)
    assert node.process.returncode == 2
    assert 'no file' in node.output


def test_lists_and_strings_are_bounded():
    with pytest.raises(ValueError, match='length of pins is 5000, but must be at most 4096'):
        Scene(pins=['0,0'] * 5000)
    with pytest.raises(ValueError, match='at most 256 characters'):
        Scene(frame_id='x' * 1000)
    with pytest.raises(ValueError, match='at most 256 characters') as refusal:
        Scene(pins=['9' * 10**6 + ',0'])
    assert len(str(refusal.value)) < 400
