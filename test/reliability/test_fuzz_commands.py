"""Bad command lines of both commands."""

import contextlib
import io
import os
import random
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from reliability.invalid_values import times
from reliability.scene_files import HEAD, SCENES, bad_files
from ros import NODE, ROOT, Process, environment

from cloth_ros.tradeoff.main import main as tradeoff

P, QOS = '--ros-args -p', 'qos_overrides./cloth/particles.publisher'
# Each of these was accepted, or failed in another way, once.
INVALID = f"""
    --help
    config/gust.yaml
    --ros-args --foo
    {P} pins:=[]
    {P} pins:={'[' * 2000}
    {P} {QOS}.depth:=junk
    {P} {QOS}.depth:={2**63 - 1}
    {P} {QOS}.depth:=1e3
    {P} {QOS}.reliability:=1
    {P} {QOS}.history:=keep_all
    {P} qos_overrides./wind.subscription.history:=KEEP_ALL
    {P} sheet.rows:=1024 -p sheet.columns:=1024 -p markers.springs:=true -p \
qos_overrides./cloth/markers.publisher.depth:=1000
""".strip().splitlines()
VALUES = f"""
    rate fast .nan 0 1e400 true [60.0] [1 *a "60" !!python/object:os.system
    sheet.rows 0 1025 2.5 {'9' * 30} -1 {{}}
    gravity [1,2] [a,b,c] [[1]] {{a:1}} [.nan,0.0,0.0]
    pins [0] ["99,0"] "0,0" {' '.join(f'["{"9" * n},0"]' for n in (30, 300, 5000))}
    frame_id {'x' * 100_000} 3 "\\n" [a] \udcff
    {QOS}.depth -1 2000000000 {'9' * 18}
    {QOS}.reliability junk "" [a]
    {QOS}.history junk true
    solver.substeps 3
    wind.gust.speed [5.0,1.0]
""".strip().splitlines()
OPTIONS = """
    -p rate|-p rate:=|-p :=3|-p =|-r __ns:=//|-r __node:=|-r :=|foo|-p|-r|--params-file|-e a|
    --log-level junk|--log-level a:=b:=c|--log-level|--log-config-file none|
    --params-file none.yaml|--params-file /tmp|--params-file /dev/zero
"""
ARGUMENTS = [
    *(f'{P} {name}:={value}' for name, *values in map(str.split, VALUES) for value in values),
    *(f'--ros-args {option}' for option in OPTIONS.split('|')),
    *('-h', '--foo', '--', '\udcff', '--quick'),
]


def check_refusal(status: int, output: str, command: str) -> None:
    """Check for exit code 2 and one clear line; rcl writes lines of its own to its log."""
    logged = ('] [rcl', '[rcutils', '[INFO]')
    own = [line for line in output.splitlines() if not any(word in line for word in logged)]
    assert status == 2, output[-600:]
    assert len(own) == 1, output[-600:]
    assert own[0].startswith(f'{command}: ')
    assert own[0].isprintable()
    assert len(own[0]) <= 1500  # what rcl quotes included


def start_all(domain: int, lines: list[str], outcomes) -> None:
    """Start the node with command lines, some at a time; each is refused, or runs and ends."""
    at_once = os.cpu_count() or 1
    for first in range(0, len(lines), at_once):
        group = [
            Process([*NODE, *line.split()], environment(domain))
            for line in lines[first : first + at_once]
        ]
        try:
            for process in group:
                try:
                    process.wait_for_output('publishing')
                except AssertionError:  # it has ended
                    check_refusal(process.stop(0), process.output, 'cloth_node')
                    outcomes['refused'] += 1
                else:
                    assert process.stop() == 0, process.output
                    outcomes['ran'] += 1
        finally:
            for process in group:
                process.end()


def test_command_lines_of_the_node_known_to_be_invalid(domain, outcomes):
    """Command lines of cloth_node that ran or failed otherwise once: exit code 2 and one line."""
    start_all(domain, INVALID, outcomes)
    assert outcomes['refused'] == len(INVALID)


@pytest.mark.long
def test_command_lines_of_the_node(domain, tmp_path, outcomes):
    """Command lines and damaged files for cloth_node: exit code 2 and one line, or it runs."""
    lines = list(ARGUMENTS)
    for n, content in enumerate(random.Random(0).sample(bad_files(), 20)):
        path = tmp_path / f'{n}.yaml'
        path.write_bytes(content)
        lines.append(f'--ros-args --params-file {path}')
    start_all(domain, lines, outcomes)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A folder with scenes, most of which the study cannot take."""
    folder = tmp_path_factory.mktemp('study')
    for name, content in (
        ('good', SCENES[0]),
        ('bad', HEAD + b'    rate: -1\n'),
        ('full', HEAD + b'    pins: [":,:"]\n'),
        ('soft', HEAD + b'    springs: {structural: 0, shear: 0, bending: 0}\n'),
    ):
        (folder / f'{name}.yaml').write_bytes(content)
    return folder


@st.composite
def study_arguments(draw: st.DrawFn) -> list[str]:
    """Draw valid options, and after them one thing that makes the study refuse to begin."""
    options = (
        '--quick',
        '--fresh',
        '--seconds 0.5',
        '--over 0.2',
        '--sphere 0 0 1',
        '--out FOLDER/o',
    )
    chosen = ' '.join(draw(st.lists(st.sampled_from(options), unique=True, max_size=3))).split()
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
    return [*chosen, *draw(st.sampled_from(wrong))]


@times(0.4)
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
