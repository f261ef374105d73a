"""`make demo`: node and viewer together, ended together."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from ros import PATIENCE

DEMO = (sys.executable, '-m', 'tools.demo')


def children(process):
    return [
        int(pid) for pid in Path(f'/proc/{process}/task/{process}/children').read_text().split()
    ]


def gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def test_one_signal_ends_node_and_viewer(start):
    demo = start(*DEMO, 'config/hanging.yaml', PORT='0')
    demo.wait_for_output('in a browser')
    demo.wait_for_output('showing /cloth')
    both = children(demo.process.pid)
    assert len(both) == 2
    assert demo.stop(signal.SIGINT) == 0
    assert all(map(gone, both))
    assert 'Traceback' not in demo.output


@pytest.mark.slow
def test_it_ends_when_the_node_does(start):
    demo = start(*DEMO, 'config/hanging.yaml', PORT='0')
    demo.wait_for_output('showing /cloth')
    node, viewer = children(demo.process.pid)
    os.kill(node, signal.SIGTERM)
    end = time.monotonic() + PATIENCE
    while demo.alive and time.monotonic() < end:
        time.sleep(0.05)
    assert not demo.alive
    assert gone(viewer)


def test_a_scene_that_does_not_exist_is_named(start):
    demo = start(*DEMO, 'config/none.yaml')
    assert demo.stop(0) == 1
    assert "there is no scene 'config/none.yaml'; ready ones are: config/box.yaml" in demo.output
