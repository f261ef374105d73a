"""The page: a server of viser, with one tab for each cloth."""

from __future__ import annotations

import time
from contextlib import redirect_stdout
from io import StringIO
from typing import Any, NamedTuple

import numpy as np
import viser

from . import words
from .actions import Actions
from .cloth_client import ClothClient
from .controls import Controls
from .plots import Plots
from .scene_view import ClothView, Stage

_SHOWN_FOR = 15.0  # s, of a notification
_UNWATCHED = 0.5  # s, from one state to the next while no browser shows the page


class _ClothPart(NamedTuple):
    client: ClothClient
    view: ClothView
    controls: Controls
    plots: Plots


class Page:
    """
    Show cloths, and take what users do.

    Everything but the callbacks of viser runs in the thread of the node.

    Parameters
    ----------
    host, port
        Address to listen on.
    domain
        ROS domain, which the page names while there is no cloth.
    actions
        Take what users do.

    """

    def __init__(self, host: str, port: int, domain: int, actions: Actions) -> None:
        self._actions = actions
        with redirect_stdout(StringIO()):  # the node logs the address
            self._server = viser.ViserServer(host=host, port=port, label='cloth', verbose=False)
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(59, 91, 158))
        gui.main_panel.dock_right()
        self._stage = Stage(self._server)
        self._parts: list[_ClothPart] = []
        self._framed: set[str] = set()  # names of cloths
        self._drawn = 0.0
        self._text = gui.add_markdown(words.no_cloth(domain))
        self._tabs: viser.GuiTabGroupHandle | None = None
        self._plots: viser.PanelHandle | None = None

    @property
    def port(self) -> int:
        """Port that it listens on."""
        return self._server.get_port()

    @property
    def watched(self) -> bool:
        """True while a browser shows the page."""
        return bool(self._server.get_clients())

    def stop(self) -> None:
        """End the server."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    def notify(self, text: str) -> None:
        """Show a text on every page for some seconds."""
        for client in self._server.get_clients().values():
            client.add_notification(
                'The node has refused this', text, color='orange', auto_close_seconds=_SHOWN_FOR
            )

    def add(self, client: ClothClient) -> None:
        """Show one more cloth."""
        gui = self._server.gui
        self._text.visible = False
        if self._tabs is None:
            self._tabs = gui.add_tab_group()
            self._add_shadows()
        if self._plots is None:
            self._plots = gui.add_panel()
            self._plots.dock_left()
            self._plots.set_width(290)
        view = ClothView(self._server.scene, client, self._actions)
        label = client.name.node.removeprefix('/')
        with self._tabs.add_tab(label):
            controls = Controls(gui, client, view, self._actions)
        with self._plots.add_tab(label):
            plots = Plots(gui, client)
        self._parts.append(_ClothPart(client, view, controls, plots))

    def _add_shadows(self) -> None:
        """Let users leave out the shadows of all cloths."""
        shadows = self._server.gui.add_checkbox(
            'shadows', True, hint='off: drawn more often where there is no graphics processor'
        )

        async def show(_: viser.GuiEvent[Any]) -> None:
            visible = bool(shadows.value)
            self._actions.put('shadows', lambda: self._stage.show_shadows(visible))

        shadows.on_update(show)

    def draw(self) -> None:
        """Draw the newest states; only now and then while nobody looks."""
        if not self.watched and time.monotonic() < self._drawn + _UNWATCHED:
            return
        self._drawn = time.monotonic()
        for part in self._parts:
            sheet = part.client.take_sheet()
            if sheet is not None and part.client.is_known:
                self._frame(part)
            with self._server.atomic():
                part.view.draw(sheet)

    def _frame(self, part: _ClothPart) -> None:
        """Direct the camera at all cloths when there is a new one."""
        if part.client.name.node not in self._framed:
            self._framed.add(part.client.name.node)
            known = [each for each in self._parts if each.client.name.node in self._framed]
            self._stage.frame(np.concatenate([each.view.points() for each in known]))

    def update(self) -> None:
        """Update texts, controls and plots; to be called some times a second."""
        for part in self._parts:
            part.controls.update()
            part.plots.update()
        self._stage.show_ground(not any(part.view.colliders.has_plane for part in self._parts))
