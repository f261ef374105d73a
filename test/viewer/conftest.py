"""A viewer as a process, and a browser that shows its page."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

import pytest
from ros import Process

VIEWER = (sys.executable, '-m', 'cloth_ros.viewer.main', '--port', '0')


@pytest.fixture
def start_viewer(start: Callable[..., Process]) -> Callable[..., Process]:
    """Start the viewer, and wait until it serves its page."""

    def start_process(*arguments: str) -> Process:
        viewer = start(*VIEWER, *arguments)
        viewer.wait_for_output('in a browser')
        return viewer

    return start_process


@pytest.fixture(scope='session')
def browser() -> Iterator[object]:
    """A headless Chromium."""
    pytest.importorskip('playwright', reason="pip install 'cloth_ros[test]'")
    from chromium import MISSING, browsing, chromium

    if chromium() is None:
        pytest.skip(MISSING)
    with browsing() as browser:
        yield browser


@pytest.fixture
def view(browser, start_viewer) -> Iterator[object]:
    """The page of a viewer in the browser, without errors until the end of the test."""
    from chromium import View, address_of

    viewer = start_viewer()
    view = View(browser, address_of(viewer.output))
    view.viewer = viewer
    yield view
    view.page.close()
    assert not view.errors
