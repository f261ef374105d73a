"""A headless Chromium that shows the browser view, and what its scene contains."""

from __future__ import annotations

import base64
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Error, Page, sync_playwright
from ros import PATIENCE, Process

# Where screenshots are kept; a test keeps them in its temporary folder otherwise.
SCREENSHOTS = 'CLOTH_SCREENSHOTS'
NAMES = ('chromium', 'chromium-browser', 'google-chrome')
MISSING = 'there is no Chromium; install it: apt-get install chromium'
DESKTOP, LAPTOP = (1920, 1080), (1366, 768)
# Flags of what renders without a graphics processor: a part of Chromium, or Mesa, which takes half
# the time where it is installed (`apt-get install libegl-mesa0 libgl1-mesa-dri`).
RENDERERS = {
    'swiftshader': ('--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'),
    'mesa': ('--use-gl=angle', '--use-angle=gl-egl', '--ignore-gpu-blocklist', '--no-sandbox'),
}

# For root, Chromium would raise the priority of what draws, above that of the node.
_START = """#!/bin/sh
if [ "$(id -u)" = 0 ] && command -v setpriv > /dev/null; then
    exec setpriv --inh-caps=-sys_nice --bounding-set=-sys_nice nice -n 5 {path} "$@"
fi
exec nice -n 5 {path} "$@"
"""
# Reads the present corners of a mesh of the scene as base64.
_VERTICES = """name => {
    const mesh = window.__viserMutable.nodeRefFromName[name];
    let found = null;
    mesh.traverse(each => { if (each.isMesh && found === null) found = each; });
    const array = found.geometry.attributes.position.array;
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    let text = '';
    for (let i = 0; i < bytes.length; i += 8192)
        text += String.fromCharCode(...bytes.subarray(i, i + 8192));
    return btoa(text);
}"""
# Position on the page, in pixels, of a point in the frame of a node of the scene.
_PROJECT = """([name, point]) => {
    const mutable = window.__viserMutable, camera = mutable.camera;
    const node = mutable.nodeRefFromName[name];
    const vector = camera.position.clone().set(...point);
    node.updateWorldMatrix(true, false);
    vector.applyMatrix4(node.matrixWorld).project(camera);
    const box = mutable.canvas.getBoundingClientRect();
    return [box.x + (vector.x + 1) / 2 * box.width, box.y + (1 - vector.y) / 2 * box.height];
}"""
_RENDERER = """() => {
    const context = window.__viserMutable.canvas.getContext('webgl2');
    const names = context.getExtension('WEBGL_debug_renderer_info');
    return context.getParameter(names.UNMASKED_RENDERER_WEBGL);
}"""
_CASTS_SHADOW = """name => {
    let found = false;
    window.__viserMutable.nodeRefFromName[name].traverse(each => {
        found = found || (each.isLight && each.castShadow);
    });
    return found;
}"""
_SCENE = """() => window.__viserMutable && Object.entries(window.__viserMutable.nodeRefFromName)
    .filter(each => each[1]).map(each => each[0])"""


def chromium() -> str | None:
    """Return the path of the browser, if there is one."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def browsing(renderer: str = 'swiftshader') -> Iterator[Browser]:
    """Provide a browser, of lower priority than the node that it shows."""
    path = chromium()
    assert path is not None, MISSING
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        start = Path(folder) / 'chromium'
        start.write_text(_START.format(path=path))
        start.chmod(0o755)
        browser = playwright.chromium.launch(
            executable_path=start, args=list(RENDERERS[renderer]), timeout=1e3 * PATIENCE
        )
        try:
            yield browser
        finally:
            browser.close()


class View:
    """The browser view, opened in a browser."""

    def __init__(self, browser: Browser, address: str) -> None:
        width, height = LAPTOP
        self.page: Page = browser.new_page(viewport={'width': width, 'height': height})
        self.page.set_default_timeout(1e3 * PATIENCE)
        self.errors: list[str] = []
        self.viewer: Process | None = None  # that serves it
        self.page.on('pageerror', lambda error: self.errors.append(str(error)))
        self.page.goto(address)

    def wait_for(self, condition: Callable[[], object]) -> None:
        """Wait until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, 'the condition did not hold in time'
            self.page.wait_for_timeout(50)

    def nodes(self) -> list[str]:
        """Return the names of the nodes of the scene."""
        return self.page.evaluate(_SCENE) or []

    def wait_for_node(self, name: str) -> None:
        """Wait until the scene has a node."""
        self.wait_for(lambda: name in self.nodes())

    def wait_for_text(self, text: str) -> None:
        """Wait until the page shows a text."""
        self.page.get_by_text(text).first.wait_for()

    def renderer(self) -> str:
        """Return what draws the scene."""
        return self.page.evaluate(_RENDERER)

    def corners(self, name: str) -> np.ndarray:
        """Return the corners of a mesh, m, shape (count, 3)."""
        text = self.page.evaluate(_VERTICES, name)
        return np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 3).copy()

    def casts_shadow(self, light: str) -> bool:
        """Return whether a light of the scene casts shadows."""
        return self.page.evaluate(_CASTS_SHADOW, light)

    def slide(self, label: str, share: float) -> None:
        """Drag the thumb of a slider in the open tab to a share of its length, with the mouse."""
        shown = self.page.get_by_text(label, exact=True).locator('visible=true').first
        row = shown.locator('xpath=ancestor::*[.//*[@role="slider"]][1]')
        thumb, track = row.get_by_role('slider').first, row.locator('.mantine-Slider-track').first
        value = lambda: thumb.get_attribute('aria-valuenow')  # noqa: E731

        def drag() -> bool:
            # While it is built, the page replaces elements, and moves them.
            with suppress(Error):
                thumb.scroll_into_view_if_needed()
                before, start, whole = value(), thumb.bounding_box(), track.bounding_box()
                if start is not None and whole is not None:
                    y = start['y'] + start['height'] / 2
                    target = (whole['x'] + share * whole['width'], y)
                    self._drag((start['x'] + start['width'] / 2, y), target)
                    return value() != before
            return False

        self.wait_for(drag)

    def open_tab(self, label: str) -> None:
        """Show the controls and the plots of a cloth."""
        for tab in self.page.get_by_role('tab', name=label).all():
            tab.click()

    def drag_collider(self, name: str, start: list[float], end: list[float]) -> None:
        """Drag the handle of a collider from one point in its frame to another, m."""
        self.wait_for_node(name)
        self._drag(*(self.page.evaluate(_PROJECT, [name, point]) for point in (start, end)))

    def _drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        mouse = self.page.mouse
        mouse.move(*start)
        self.page.wait_for_timeout(300)  # what is under the mouse is found when it is drawn
        mouse.down()
        for share in (0.25, 0.5, 0.75, 1.0):
            mouse.move(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))
            self.page.wait_for_timeout(150)
        mouse.up()

    def keep_screenshot(self, folder: Path, name: str, size: tuple[int, int] = LAPTOP) -> Path:
        """Save a screenshot of a size in a folder, or in the one that the environment names."""
        if size != LAPTOP:  # only here: without a graphics processor, large pages are slow
            self.page.set_viewport_size({'width': size[0], 'height': size[1]})
            self.page.wait_for_timeout(3000)
        folder = Path(os.environ.get(SCREENSHOTS) or folder)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f'{name}.png'
        self.page.screenshot(path=path, timeout=1e3 * PATIENCE)
        return path


def address_of(output: str) -> str:
    """Return the address of the page from the log of a viewer."""
    (address,) = re.findall(r'open (http://\S+) in a browser', output)
    return address
