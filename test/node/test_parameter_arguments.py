"""Parameter files and parameters on the command line mean the same for the node and the scene."""

import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import rclpy
from builders import examples
from hypothesis import example, given
from hypothesis import strategies as st
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from reliability.collider_values import collider_values
from reliability.invalid_values import NAMES, near
from reliability.scene_files import HEAD, bad_files, damaged_files
from remedies import follow
from ros import ROOT, dumped, free_domain

from cloth_ros import Scene
from cloth_ros.model import check_scene
from cloth_ros.node.command_line import check_rest
from cloth_ros.node.parameter_arguments import ParameterArguments
from cloth_ros.node.parameters import coerce_types, declare_scene
from cloth_ros.node.qos import check_policy
from cloth_ros.scene.parameter import DEFAULTS
from cloth_ros.scene.yaml_text import write

CONTEXT = Context()


@pytest.fixture(scope='module', autouse=True)
def _domain() -> Iterator[None]:
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with free_domain() as number:
        rclpy.init(context=CONTEXT, domain_id=number)
        yield
        rclpy.shutdown(context=CONTEXT)


@contextmanager
def started(*arguments: str) -> Iterator[tuple[Node, ParameterArguments]]:
    """Make a node with the parameters of `cloth_node`, without what publishes and simulates."""
    with ParameterArguments(['--ros-args', *arguments]) as parameters:
        node = Node(
            'cloth',
            context=CONTEXT,
            cli_args=parameters.arguments,
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=False,
            enable_rosout=False,
        )
    try:
        yield node, parameters
    finally:
        node.destroy_node()


def start(*arguments: str) -> Scene:
    """Return the scene of a node that is started with arguments; raises ValueError."""
    with started(*arguments) as (node, _):
        return declare_scene(node)[0]


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    return tmp_path_factory.mktemp('parameters') / 'scene.yaml'


FREE_NAMES = st.sampled_from(['world', 'null', '1e5', '007', 'y', 'on', '~', '', '0x1F', '1:30'])


@st.composite
def live_scenes(draw: st.DrawFn) -> tuple[Scene, dict[str, object]]:
    """Draw a scene reached by changes of parameters, and the values that the node then has."""
    names = draw(st.lists(st.sampled_from(NAMES), max_size=6, unique=True))
    changes = {name: draw(near(name)) for name in names}
    changes |= {'frame_id': draw(FREE_NAMES | st.text(max_size=4))}
    values = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in DEFAULTS.items()
    }
    scene = Scene()
    for name, value in changes.items():
        kind = Parameter.Type.STRING_ARRAY if value == [] else None
        (parameter,) = coerce_types([Parameter(name, kind, value)])
        try:
            scene = scene.with_parameters({name: parameter.value})
            check_scene(scene)
        except ValueError:
            continue
        values[name] = list(parameter.value) if type(value) is list else parameter.value
    return scene.with_parameters({name: values[name] for name in values}), values


@examples(0.3)
@given(drawn=live_scenes())
def test_a_scene_reached_by_live_changes_is_saved_and_started_again(drawn, path):
    scene, values = drawn
    check_scene(scene)
    path.write_text(dumped(values))
    assert Scene.from_yaml(path) == scene
    assert start('--params-file', str(path)) == scene
    scene.to_yaml(path)
    assert Scene.from_yaml(path) == scene
    assert start('--params-file', str(path)) == scene


@examples(0.3)
@given(values=collider_values())
def test_colliders_are_saved_and_started_again(values, path):
    scene = Scene.from_parameters(values)
    flat = {name: list(v) if isinstance(v, tuple) else v for name, v in scene.flat().items()}
    path.write_text(dumped(flat))
    with started('--params-file', str(path)) as (node, _):
        assert declare_scene(node)[0] == scene
        names = {name for name in flat if name.startswith('collider.')}
        assert names == {name for name in node.get_parameters_by_prefix('') if 'collider' in name}
    scene.to_yaml(path)
    assert start('--params-file', str(path)) == scene
    rules = [word for name, value in values.items() for word in ('-p', f'{name}:={write(value)}')]
    assert start(*rules) == scene


def outcome(make, *arguments: object) -> Scene | str:
    """Return a scene that can be simulated, or why there is none."""
    try:
        scene = make(*arguments)
        check_scene(scene)
    except ValueError as error:
        return str(error)
    return scene


def check_the_same(path) -> None:
    """Check that node and scene read the same from a file."""
    read = outcome(Scene.from_yaml, path)
    if isinstance(read, str) and ' is not a parameter of a scene' in read:
        return  # the node ignores them, as the file may be for several nodes
    if isinstance(read, str) and 'here, only for' in read:
        with started('--params-file', str(path)) as (_, parameters):
            assert len(list(parameters.files_for_others('/cloth'))) == 1
        return
    found = outcome(start, '--params-file', str(path))
    if isinstance(read, str):
        assert isinstance(found, str), (read, path.read_bytes())
    else:
        assert found == read


NUMBERS = '0 -0 5 +5 2.5 .5 5. 1e3 1.5e-3 .5e2 -1e-1 1_0 1:30 0x10 010 08 .inf .nan nan 1e400'
TEXTS = '~ null "" true True y N off "5" "1e-4" auto single "double" Double "a\\0b" \'[0,0,-1]\''
LISTS = '[] [0,0,-9.81] [6.0,1,0] [1.5,1] [1,2] ["1",2] [1e0,1,.5] [true] [y,n] ["0,0"] ["",""]'
OTHERS = '[0,0] ["0,0",5] [[0,0,1]] {} {x:1} [null] [,] 99999999999999999999'
WORDS = f'{NUMBERS} {TEXTS} {LISTS} {OTHERS}'.split()


@pytest.mark.parametrize('name', NAMES)
def test_node_and_scene_accept_the_same_values(name, path):
    # All words for each type, and some for each name.
    stride = 3 if isinstance(DEFAULTS[name], (int, str)) or name == 'pins' else 7
    for word in WORDS[NAMES.index(name) % stride :: stride]:
        path.write_text(f'/**:\n  ros__parameters:\n    {name}: {word}\n')
        check_the_same(path)


@examples(0.4)
@given(content=damaged_files() | st.sampled_from(bad_files()))
@example(content=HEAD + b'    gravity: [0.0, %b, 1.0]\n' % (b'9' * 400))
def test_node_and_scene_accept_the_same_files(content, path):
    path.write_bytes(content)
    check_the_same(path)


def test_sections_namespaces_and_several_files(tmp_path):
    first, second = tmp_path / 'first.yaml', tmp_path / 'second.yaml'
    first.write_text(
        'talker: {ros__parameters: {rate: fast, list: [], mixed: [1, a], "": 3}}\n'
        'not-a-name: {ros__parameters: {rate: 7}}\n'
        '/**: {ros__parameters: {rate: 30, drag: 1, pins: [], use_sim_time: true, foo: [1, 2.]}}\n'
        'lab: {cloth: {ros__parameters: {sheet: {rows: 4, size: [2, 1.5]}}}}\n'
        '/lab/*: {ros__parameters: {sheet.columns: 5}}\n'
        '/**/cloth: {ros__parameters: {gravity: [0, 0, -1.5]}}\n'
        '/other/cloth: {ros__parameters: {drag: 9.0}}\n'
    )
    second.write_text('/**: {ros__parameters: {rate: 40.0, wind: {gust: {seed: 7}}}}\n')
    files = ['--params-file', str(first), '--params-file', str(second)]
    with started(*files, '-p', 'drag:=0.25', '-r', '__ns:=/lab') as (node, parameters):
        assert node.get_parameter('use_sim_time').value is True
        assert not list(parameters.files_for_others('/lab/cloth'))
        scene, _ = declare_scene(node)
    # Of two types, as of 1 and 0.25 for drag, rcl would keep the first.
    assert (scene.rate, scene.drag, scene.pins, scene.gravity[2]) == (40.0, 0.25, (), -1.5)
    assert (scene.sheet.rows, scene.sheet.columns, scene.sheet.size) == (4, 5, (2.0, 1.5))
    assert scene.wind.gust.seed == 7
    assert start('-p', 'rate:=9', *files).rate == 40.0


@pytest.mark.parametrize(
    ('rule', 'expected'),
    [
        ('gravity:=[0, 0, -9.81]', (0.0, 0.0, -9.81)),
        ('cloth:gravity:=[0, 1, -9.5]', (0.0, 1.0, -9.5)),
        ('pins:=[]', ()),
        ('sheet.size:=["2", 1]', (2.0, 1.0)),
        ('drag:=2', 2.0),
        ('gravity:=[0, 0, 2.2e-313]', (0.0, 0.0, 0.0)),
        ('sheet.rows:="8"', 8),
        ('solver.tolerance:=1e-4', 1e-4),
        ('markers.springs:=y', True),
        ('frame_id:=5', '5'),
        ('talker:rate:=fast', 60.0),
    ],
)
def test_parameters_on_the_command_line(rule, expected):
    name = rule.removeprefix('cloth:').removeprefix('talker:').partition(':=')[0]
    assert start('-p', rule).flat()[name] == expected


def test_the_remedies_of_wrong_parameters_on_the_command_line_succeed():
    def attempt(values):
        start(*(word for item in values.items() for word in ('-p', ':='.join(item))))

    for name in set(NAMES) - {'pins', 'collider.names', 'gripper.names'}:
        for text in ('fast', '[1]', '-1e9', '{}', '', '1.5', '[[1]]', '.nan'):
            follow({name: text}, attempt, lambda _, typed: typed)


def test_what_is_not_for_ros_is_left_alone():
    given_arguments = ['--params-file', 'missing', '-p', 'x', '--ros-args', '-r', '-p', '--', '-p']
    with ParameterArguments(given_arguments) as parameters:
        assert parameters.arguments == given_arguments


def test_no_file_stays_open_or_is_left_behind(path):
    path.write_bytes(HEAD + b'    gravity: [0, 0, -9.81]\n')
    before = set(os.listdir('/proc/self/fd'))
    with ParameterArguments(['--ros-args', *['--params-file', str(path)] * 3]) as parameters:
        assert len(set(parameters.arguments)) == 5
    with pytest.raises(ValueError, match=r'none\.yaml: No such file or directory; give a file'):
        ParameterArguments(
            [
                '--ros-args',
                '--params-file',
                str(path),
                '--params-file',
                str(path.parent / 'none.yaml'),
            ]
        )
    assert set(os.listdir('/proc/self/fd')) == before


@pytest.mark.parametrize(
    ('content', 'options'),
    [
        ('flag: {ros__parameters: {rate: 30}}', '-r __node:=flag'),
        ('/lab/cloth: {ros__parameters: {rate: 30}}', '-r __ns:=/lab'),
        ('lab: {flag: {ros__parameters: {rate: 30}}}', '-r __ns:=/lab -r __node:=flag'),
    ],
)
def test_a_file_for_another_node_is_pointed_out_with_a_remedy(content, options, path):
    path.write_text(content)
    with started('--params-file', str(path)) as (node, parameters):
        (line,) = parameters.files_for_others(node.get_fully_qualified_name())
        assert declare_scene(node)[0] == Scene()
    assert line.endswith(f'name its section /cloth, or start the node with {options}')
    with started('--params-file', str(path), *options.split()) as (node, parameters):
        assert not list(parameters.files_for_others(node.get_fully_qualified_name()))
        assert declare_scene(node)[0].rate == 30.0
    path.write_text('/cloth: {ros__parameters: {rate: 30}}')
    assert start('--params-file', str(path)).rate == 30.0


def test_a_wrong_value_is_reported_with_its_file(path):
    path.write_bytes(HEAD + b'    rate: fast\n')
    with started('--params-file', str(path)) as (node, parameters):
        with pytest.raises(ValueError, match=r"^rate is 'fast'") as refusal:
            declare_scene(node)
        assert parameters.located(refusal.value) == f'{path}: {refusal.value}'


@pytest.mark.parametrize('value', ['junk', 1e3, 2.5, True, -1, 2**40, '5', 'keep_all', 'relaible'])
@pytest.mark.parametrize('policy', ['depth', 'history', 'reliability'])
def test_the_remedies_of_qos_overrides_succeed(policy, value):
    name = f'qos_overrides./wind.subscription.{policy}'
    follow({name: value}, lambda values: check_policy(name, values[name]))


@pytest.mark.parametrize('rule', ['rate=30', 'rate:30', 'rate = 30', 'rate==30'])
def test_the_remedy_of_a_wrong_assignment_succeeds(rule):
    with pytest.raises(ValueError, match=r"must be NAME:=VALUE; write -p '?rate") as refusal:
        start('-p', rule)
    assert start(*shlex.split(str(refusal.value).partition('; write ')[2])).rate == 30.0


def test_the_remedy_of_a_scene_without_a_flag_succeeds(monkeypatch):
    monkeypatch.chdir(ROOT)
    with pytest.raises(ValueError, match='give a scene so: ') as refusal:
        check_rest(['config/gust.yaml'])
    command, *arguments = shlex.split(str(refusal.value).partition('so: ')[2])
    assert command == 'cloth_node'
    check_rest(arguments)
    assert start(*arguments[1:]) == Scene.from_yaml('config/gust.yaml')
