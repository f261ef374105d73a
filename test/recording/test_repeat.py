"""Recorded ticks are repeated to the bit, and what was lost is seen."""

import itertools
import shutil

import numpy as np
import pytest
from builders import PRECISIONS, examples, scene_of
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer as McapWriter
from recordings import BEGIN, record

from cloth_ros.recording import run
from cloth_ros.recording.bag import Bag
from cloth_ros.recording.main import main
from cloth_ros.recording.output_bag import OutputBag

SHEET = {'sheet__rows': 8, 'sheet__columns': 9}
GUSTS = scene_of(**SHEET, wind__gust__period=0.3, wind__gust__duration=0.1)
SPHERE = scene_of(
    **SHEET, sphere__radius=0.2, sphere__position=(0.0, 0.0, 0.75), pins=[''], solver__threads=1
)
TICKS = 90


def repeat(path, node=None):
    return run.repeat(path, node, lambda *_: None)


def copy(source, bag, names):
    """Copy the messages of some topics of a cloth to another bag."""
    for message in Bag(source).messages():
        if message.topic.removeprefix('/cloth/') in names:
            bag.copy(message)


def commands(live, tick):
    """Move what can be moved, change parameters, reset; of all kinds, some in one tick."""
    live.set_wind((0.1 * tick, 3.0 * np.sin(tick), 0.3))
    if 'sphere' in live.colliders:
        live.bodies.move('sphere', (0.001 * tick, 0.0, 0.75 + 0.002 * tick))
        live.bodies.move('sphere', (0.001 * tick, 0.01, 0.75 + 0.002 * tick))
    if tick == 20:
        live.configure(live.requested.with_parameters({'springs.shear': 100.0, 'drag': 1.0}))
    if tick == 40:
        live.reset()
    if tick == 50:
        live.configure(live.requested.with_parameters({'gravity': (0.0, 1.0, -9.0)}))
        live.reset()
        live.set_wind((1.0, 1.0, 0.0))
    live.paused = 60 <= tick < 66
    if tick == 62:
        live.step()
    if tick == 70:
        commands.saved = live.snapshot()
    if tick == 80:
        assert live.restore(commands.saved)


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('scene', [GUSTS, SPHERE], ids=['gusts', 'sphere'])
def test_a_recording_is_repeated_to_the_bit(scene, precision, tmp_path):
    scene = scene.with_parameters({'solver.precision': precision})
    path = record(tmp_path / 'bag', scene, TICKS, commands, keyframes=25)
    outcome = repeat(path)
    assert outcome.identical, outcome.lines
    found = outcome.result
    # Behind the first keyframe; that of tick 1 is where it begins.
    assert (found['ticks'], found['states'], found['keyframes']) == (TICKS - 1, TICKS - 1, 3)
    assert not found['gaps'] + found['defects']


def test_a_difference_is_found_where_it_begins(tmp_path, capsys):
    """The records of one session, and the states of another with one tick of other wind."""

    def session(name, speed):
        def act(live, tick):
            live.set_wind((0.0, speed if tick == 30 else 2.0, 0.0))

        return record(tmp_path / name, GUSTS, 60, act, keyframes=25)

    mixed = tmp_path / 'mixed'
    bag = OutputBag(mixed, '/cloth', 'world')
    copy(session('true', 2.0), bag, ('ticks',))
    copy(session('other', 2.00001), bag, ('particles', 'keyframes'))
    bag.close()
    assert main([str(mixed)]) == 1
    printed = capsys.readouterr().out
    assert '59 ticks repeated: 31 of 59 states and 1 of 2 keyframes differ' in printed
    assert 'first difference: tick 30' in printed


@pytest.fixture(scope='module')
def complete(tmp_path_factory):
    path = tmp_path_factory.mktemp('complete') / 'bag'
    return record(path, GUSTS, 40, lambda live, tick: live.set_wind((0, tick, 0)), keyframes=8)


@given(data=st.data())
@examples(0.1)
def test_what_the_recorder_has_lost_is_seen_and_the_rest_repeated(
    complete, data, tmp_path_factory
):
    lost = frozenset(
        data.draw(
            st.sets(
                st.tuples(
                    st.sampled_from(['ticks', 'particles', 'keyframes']), st.integers(1, 40)
                ),
                max_size=6,
            )
        )
    )
    path = tmp_path_factory.mktemp('lost') / 'bag'
    part = OutputBag(path, '/cloth', 'world')
    for message in Bag(complete).messages():
        tick = round((message.received - BEGIN) * 60e-9)
        if (message.topic.removeprefix('/cloth/'), tick) not in lost:
            part.copy(message)
    part.close()
    # Numbers of the ticks that can be repeated: behind a keyframe, without a gap.
    expected, known = [], False
    for tick in range(1, 41):
        known = known and ('ticks', tick) not in lost
        if known:
            expected.append(tick)
        known = known or (tick % 8 == 1 and ('keyframes', tick) not in lost)
    if not expected:
        with pytest.raises(ValueError, match='nothing can be repeated'):
            repeat(path)
        return
    outcome = repeat(path)
    states = [tick for tick in expected if ('particles', tick) not in lost]
    assert outcome.identical or not states
    assert outcome.result['ticks'] == len(expected)
    assert outcome.result['states'] == len(states)
    pauses = sum(later - tick > 1 for tick, later in itertools.pairwise(expected))
    assert len(outcome.result['gaps']) >= pauses


def test_a_node_that_is_started_again_is_a_gap(complete, tmp_path):
    """Also with stamps that begin again, as those of simulated time."""
    for name, first, second in (('shorter', 40, 30), ('longer', 30, 40)):
        both = OutputBag(tmp_path / name, '/cloth', 'world')
        for run_ticks, offset in ((first, 0), (second, 10**12)):
            for message in Bag(complete).messages():
                if round((message.received - BEGIN) * 60e-9) <= run_ticks:
                    both.copy(message._replace(received=message.received + offset))
        both.close()
        outcome = repeat(tmp_path / name)
        assert outcome.identical, outcome.lines
        assert outcome.result['ticks'] == first + second - 2
        assert len(outcome.result['gaps']) == 1
        assert 'the node was started again' in outcome.result['gaps'][0]


def test_messages_that_are_not_in_the_order_of_time_are_read(complete, tmp_path):
    """As a recorder without chunks and index may write them."""
    path = tmp_path / 'bag.mcap'
    with path.open('wb') as file:
        writer = McapWriter(file, use_chunking=False)
        writer.start('ros2')
        channels = {}
        for number, message in enumerate(Bag(complete).messages()):
            if message.topic not in channels:
                schema = writer.register_schema(message.type, 'ros2msg', b'')
                channels[message.topic] = writer.register_channel(message.topic, 'cdr', schema)
            late = message.received - (50_000_000 if number % 7 == 3 else 0)
            writer.add_message(channels[message.topic], late, message.data, late)
        writer.finish()
    outcome = repeat(path)
    assert outcome.identical, outcome.lines
    assert outcome.result['ticks'] == 39


def test_files_of_a_bag_are_read_in_their_order(complete, tmp_path):
    """Of a recorder that was killed: bag_10 comes after bag_9."""
    messages = list(Bag(complete).messages())
    for part in range(12):
        folder = tmp_path / f'part {part}'
        each = OutputBag(folder, '/cloth', 'world')
        size = -(-len(messages) // 12)
        for message in messages[part * size : (part + 1) * size]:
            each.copy(message)
        each.close()
        (file,) = folder.glob('*.mcap')
        (tmp_path / 'bag').mkdir(exist_ok=True)
        file.rename(tmp_path / 'bag' / f'bag_{part}.mcap')
    outcome = repeat(tmp_path / 'bag')
    assert outcome.identical, outcome.lines
    assert outcome.result['ticks'] == 39


def test_a_damaged_keyframe_is_said_and_the_next_one_used(complete, tmp_path):
    damaged = OutputBag(tmp_path / 'bag', '/cloth', 'world')
    for message in Bag(complete).messages():
        tick = round((message.received - BEGIN) * 60e-9)
        if message.topic == '/cloth/keyframes' and tick == 1:
            data = bytearray(message.data)
            data[len(data) // 2] ^= 1
            message = message._replace(data=bytes(data))
        damaged.copy(message)
    damaged.close()
    outcome = repeat(tmp_path / 'bag')
    assert outcome.identical
    assert outcome.result['ticks'] == 40 - 9
    assert 'a keyframe on /cloth/keyframes is damaged' in outcome.lines[-1]


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    # Several chunks of a file.
    scene = SPHERE.with_parameters({'sheet.rows': 40, 'sheet.columns': 40})
    return record(tmp_path_factory.mktemp('bag') / 'bag', scene, TICKS, commands, keyframes=10)


def broken(bag, folder):
    path = folder / 'broken'
    shutil.copytree(bag, path)
    return path


def test_a_bag_of_a_killed_recorder_is_read_as_far_as_it_was_written(bag, tmp_path):
    path = broken(bag, tmp_path)
    (path / 'metadata.yaml').unlink()
    (file,) = path.glob('*.mcap')
    whole = file.read_bytes()
    outcome = repeat(path)
    assert outcome.identical
    assert outcome.result['ticks'] == TICKS - 1
    assert 'metadata.yaml is missing' in outcome.lines[-1]
    file.write_bytes(whole[: round(0.9 * len(whole))])
    outcome = repeat(path)
    assert outcome.identical
    assert TICKS / 2 < outcome.result['ticks'] < TICKS - 1
    assert 'ends after the message at' in outcome.lines[-1]
    file.write_bytes(whole[:100])
    with pytest.raises(ValueError, match='cannot be read'):
        repeat(path)


def refusal(capsys, *arguments):
    assert main([str(each) for each in arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_other_files_are_refused_in_one_line(bag, tmp_path, capsys):
    assert 'does not exist; give the folder of a bag' in refusal(capsys, tmp_path / 'none')
    assert 'has no metadata.yaml and no .mcap or .db3' in refusal(capsys, tmp_path)
    other = tmp_path / 'text.mcap'
    other.write_text('no bag')
    assert 'cannot be read: text.mcap: ' in refusal(capsys, other)
    assert 'is no bag; give' in refusal(capsys, __file__)
    assert '--cloth can be: /cloth' in refusal(capsys, bag, '--cloth', '/left/cloth')
    for kept, text in (
        (['particles'], 'record /cloth/ticks /cloth/keyframes'),
        ([], 'is no recording of a cloth; it has the topics: /points'),
    ):
        path = tmp_path / f'without {kept}'
        part = OutputBag(path, '/cloth', 'world')
        copy(bag, part, kept)
        if not kept:
            part.copy(next(Bag(bag).messages())._replace(topic='/points'))
        part.close()
        assert text in refusal(capsys, path)
    for arguments, text in (
        (['--set', 'drag'], 'write --set drag=VALUE'),
        (['--set', 'draf=1'], "'drag'"),
        (['--tolerance', '-1'], 'solver.tolerance'),
        (['--grid', '0'], '--grid is 0'),
        (['--grid', 'fine'], '--grid is fine'),
        (['--grid', '79x80'], 'write 79x79'),
        (['--grid', '2x2'], '--grid is 2x2'),
        (['--grid', '0.02'], '--grid is 0.02'),
    ):
        assert text in refusal(capsys, bag, *arguments, '--out', tmp_path / 'out')
