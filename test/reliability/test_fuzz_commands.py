"""Bad command lines of both commands."""

import contextlib
import io
import os
import subprocess
import sys

import pytest
from builders import examples
from hypothesis import given
from hypothesis import strategies as st
from reliability.invalid_values import NAMES
from reliability.scene_files import HEAD, SCENES, TOKENS, bad_files
from ros import NODE, ROOT, Process

from cloth_ros.tradeoff.main import main as tradeoff

SET, QOS = '--ros-args -p', 'qos_overrides./cloth/particles.publisher'
# Each of these was accepted, or failed in another way, once.
INVALID = f"""
    config/gust.yaml
    --ros-args --foo
    {SET} pins:=[0,0]
    {SET} sheet:=4
    {SET} pins:={'[' * 2000}
    {SET} {QOS}.depth:=junk
    {SET} {QOS}.depth:={2**63 - 1}
    {SET} {QOS}.depth:=1e3
    {SET} {QOS}.reliability:=1
    {SET} {QOS}.history:=keep_all
    {SET} qos_overrides./wind.subscription.history:=KEEP_ALL
    {SET} sheet.rows:=1024 -p sheet.columns:=1024 -p markers.springs:=true -p \
qos_overrides./cloth/markers.publisher.depth:=1000
""".strip().splitlines()


def check_refusal(status: int, output: str, command: str) -> None:
    """Check for exit code 2 and one clear line; rcl writes lines of its own to its log."""
    logged = ('] [rcl', '[rcutils', '[INFO]')
    own = [line for line in output.splitlines() if not any(word in line for word in logged)]
    assert status == 2, output[-600:]
    assert len(own) == 1, output[-600:]
    assert own[0].startswith(f'{command}: ')
    assert own[0].isprintable()
    assert len(own[0]) <= 1500  # what rcl quotes included


def check_node(node: Process) -> bool:
    """Check that a node refuses its command line, or runs; return True if it refuses it."""
    try:
        node.wait_for_output('publishing')
    except AssertionError:  # it has ended
        check_refusal(node.stop(0), node.output, 'cloth_node')
        return True
    assert node.stop() == 0, node.output
    return False


def test_command_lines_of_the_node_known_to_be_invalid(start, outcomes):
    """Command lines of cloth_node that ran or failed otherwise once: exit code 2 and one line."""
    at_once = os.cpu_count() or 1
    for n in range(0, len(INVALID), at_once):
        for node in [start(*NODE, *line.split()) for line in INVALID[n : n + at_once]]:
            outcomes['refused'] += check_node(node)
    assert outcomes['refused'] == len(INVALID)


WORDS = [token.decode('utf-8', 'surrogateescape') for token in TOKENS if b'\0' not in token]
WORDS += [
    '',
    'junk',
    '[1,2]',
    '[a,b,c]',
    '[[1]]',
    '0',
    '-1',
    '2.5',
    '1e400',
    'x' * 100_000,
    '/tmp',
]
FLAGS = ['-p', '-r', '-e', '--params-file', '--log-level', '--log-config-file', '--foo']
SETTABLE = [*NAMES, '__node', '__ns', 'wind', '', *(f'{QOS}.{x}' for x in ('depth', 'history'))]


@pytest.mark.long
@examples(0.02)
@given(
    words=st.tuples(st.sampled_from(WORDS))
    | st.tuples(st.just('--ros-args'), st.sampled_from(FLAGS), st.sampled_from(WORDS))
    | st.tuples(st.sampled_from(SETTABLE), st.sampled_from(WORDS)).map(
        lambda rule: ('--ros-args', '-p', ':='.join(rule))
    ),
    content=st.none() | st.sampled_from(bad_files()),
)
def test_command_lines_of_the_node(start, tmp_path, words, content, outcomes):
    """Command lines and damaged files for cloth_node: exit code 2 and one line, or it runs."""
    if content is not None:
        (tmp_path / 'scene.yaml').write_bytes(content)
        words = ('--ros-args', '--params-file', str(tmp_path / 'scene.yaml'))
    outcomes['refused' if check_node(start(*NODE, *words)) else 'ran'] += 1


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A folder with scenes, most of which the study cannot take."""
    folder = tmp_path_factory.mktemp('study')
    (folder / 'good.yaml').write_bytes(SCENES[0])
    (folder / 'bad.yaml').write_bytes(HEAD + b'    rate: -1\n')
    (folder / 'full.yaml').write_bytes(HEAD + b'    pins: [":,:"]\n')
    no_springs = b'    springs: {structural: 0, shear: 0, bending: 0}\n'
    (folder / 'soft.yaml').write_bytes(HEAD + no_springs)
    return folder


VALID = ['--quick', '--fresh', '--seconds 0.5', '--over 0.2', '--out FOLDER/out']


@st.composite
def study_arguments(draw: st.DrawFn) -> list[str]:
    """Draw valid options, and after them one thing that makes the study refuse to begin."""
    options = ' '.join(draw(st.lists(st.sampled_from(VALID), unique=True, max_size=3))).split()
    word, good = draw(st.text('abcdefgh', min_size=4, max_size=4)), 'FOLDER/good.yaml'
    number = draw(
        st.sampled_from(['', 'nan', 'inf', '-inf', '0', '1e400', '1e-999', '\udcff', '--', word])
        | (st.floats(61, 1e6) | st.floats(-1e6, 0)).map(str)
    )
    scenes = [f'FOLDER/{name}.yaml' for name in ('bad', 'full', 'soft')]
    paths = [*scenes, 'FOLDER', '/dev/zero', word, '', '\0', '\udcff', '--foo', '-q', '--quick=3']
    wrong = (
        *([path] for path in paths),
        *([], ['--sphere', '1'], ['--out'], ['--', '--out'], [good, good]),
        *([good, flag, number] for flag in ('--seconds', '--over')),
        [good, '--sphere', word, '0', number],
        *([good, '--out', out] for out in (good, f'/proc/{word}', '\0', '/dev/null/x')),
    )
    return [*options, *draw(st.sampled_from(wrong))]


@examples(0.4)
@given(arguments=study_arguments())
def test_command_lines_of_the_study(arguments, folder, outcomes):
    """Command lines of cloth_tradeoff that it cannot take: exit code 2 and one line."""
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        try:
            status = tradeoff([argument.replace('FOLDER', str(folder)) for argument in arguments])
        except SystemExit as ending:
            status = ending.code
    # As the standard error stream writes it.
    text = output.getvalue().encode('utf-8', 'backslashreplace').decode()
    check_refusal(status, text, 'cloth_tradeoff')
    outcomes['refused'] += 1


def test_the_study_as_a_process_refuses_in_one_line():
    """The same as a process of its own."""
    command = [sys.executable, '-m', 'cloth_ros.tradeoff.main', '/dev/zero']
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    check_refusal(done.returncode, done.stdout + done.stderr, 'cloth_tradeoff')
