"""Controls of one cloth on the page."""

from __future__ import annotations

from typing import Any

import viser

from . import words
from .actions import Actions
from .cloth_client import ClothClient
from .gripper_controls import GripperControls
from .parameter_slider import ParameterSlider, Range
from .scene_view import ClothView
from .sheet_view import COLOURINGS, TWO_SIDES
from .wind_controls import WindControls

_STIFFNESS = (
    Range('springs.structural', 'structural', 0.0, 1000.0),
    Range('springs.shear', 'shear', 0.0, 500.0),
    Range('springs.bending', 'bending', 0.0, 100.0),
)
_LOSSES = (
    Range('springs.damping', 'springs, Ns/m', 0.0, 0.1),
    Range('drag', 'drag, 1/s', 0.0, 5.0),
    Range('solver.tolerance', 'tolerance', 1e-5, 0.1, logarithmic=True),
)
_GREATEST_FRICTION = 1.5
_COLOURS = (TWO_SIDES, *COLOURINGS)


class Controls:
    """
    Buttons, sliders and texts of one cloth, in the tab that is open when this is made.

    Parameters
    ----------
    gui
        Of the page.
    client
        The cloth.
    view
        Its picture.
    actions
        Take what the user does.

    """

    def __init__(
        self, gui: viser.GuiApi, client: ClothClient, view: ClothView, actions: Actions
    ) -> None:
        self._gui, self._client, self._view, self._actions = gui, client, view, actions
        self._sliders: dict[str, ParameterSlider] = {}
        self._state = gui.add_html('')
        self._commands = gui.add_folder(None)
        with self._commands:
            self._pause = gui.add_button('Pause', icon=viser.Icon.PLAYER_PAUSE)
            self._step = gui.add_button('Step', icon=viser.Icon.PLAYER_TRACK_NEXT, visible=False)
            self._reset = gui.add_button('Reset', icon=viser.Icon.ROTATE)
        self._add_appearance()
        self._grippers_folder = gui.add_folder('Grippers', visible=False)
        with self._grippers_folder:
            self._grippers = GripperControls(gui, client, actions)
        self._wind_folder = gui.add_folder('Wind')
        with self._wind_folder:
            self._wind = WindControls(gui, client, actions)
        self._stiffness = gui.add_folder('Stiffness of the springs, N/m', visible=False)
        self._losses = gui.add_folder('Damping and accuracy', visible=False)
        self._friction = gui.add_folder('Friction of the colliders', visible=False)
        with gui.add_folder('Scene', expand_by_default=False):
            self._information = gui.add_html('')
        self._on_click(self._pause, 'pause', lambda: client.pause(not client.paused))
        self._on_click(self._reset, 'reset', client.reset)
        self._on_click(self._step, 'step', client.step)

    def _on_click(self, button: viser.GuiButtonHandle, key: str, command: object) -> None:
        async def clicked(_: viser.GuiEvent[Any]) -> None:
            self._actions.put((self._client.name, key), command)  # type: ignore[arg-type]

        button.on_click(clicked)

    def _add_appearance(self) -> None:
        gui, view, actions, name = self._gui, self._view, self._actions, self._client.name
        with gui.add_folder('Appearance'):
            colours = gui.add_dropdown('colours', _COLOURS)
            self._legend = gui.add_html('', visible=False)
            self._every = gui.add_checkbox(
                'every particle', False, visible=False,
                hint='off: of this large sheet, rows and columns are left out, which is faster',
            )  # fmt: skip
            shown = gui.add_checkbox('show this cloth', True)
            handles = gui.add_checkbox('handles of colliders and grippers', True)

        async def coloured(event: viser.GuiEvent[Any]) -> None:
            chosen = colours.value
            if event.client is not None and chosen in _COLOURS:
                actions.put((name, 'colours'), lambda: setattr(view.sheet, 'colouring', chosen))

        async def show(_: viser.GuiEvent[Any]) -> None:
            visible = bool(shown.value)
            actions.put((name, 'show'), lambda: setattr(view, 'visible', visible))

        async def show_handles(_: viser.GuiEvent[Any]) -> None:
            visible = bool(handles.value)
            actions.put((name, 'handles'), lambda: view.colliders.show_handles(visible))

        async def draw_every(_: viser.GuiEvent[Any]) -> None:
            wanted = bool(self._every.value)
            actions.put((name, 'every'), lambda: setattr(view.sheet, 'every_particle', wanted))

        colours.on_update(coloured)
        self._every.on_update(draw_every)
        shown.on_update(show)
        handles.on_update(show_handles)

    def update(self) -> None:
        """Show the present state; to be called some times a second."""
        client = self._client
        self._state.content = words.state(client)
        self._information.content = words.scene_information(client)
        commandable = client.can_be_commanded
        self._commands.visible = self._wind_folder.visible = commandable
        self._step.visible = client.can_step
        self._step.disabled = not client.paused
        label = 'Continue' if client.paused else 'Pause'
        if self._pause.label != label:
            self._pause.label = label
            self._pause.icon = viser.Icon.PLAYER_PLAY if client.paused else viser.Icon.PLAYER_PAUSE
        self._wind.update()
        with self._grippers_folder:
            self._grippers_folder.visible = self._grippers.update() and commandable
        self._every.visible = self._view.sheet.is_large
        self._legend.content = self._view.sheet.legend
        self._legend.visible = bool(self._view.sheet.legend)
        self._update_sliders()

    def _update_sliders(self) -> None:
        values = self._client.parameters.values
        commandable = self._client.can_be_commanded
        for folder, ranges in ((self._stiffness, _STIFFNESS), (self._losses, _LOSSES)):
            folder.visible = commandable and bool(values)
            with folder:
                for offered in ranges:
                    self._update_slider(offered)
        names = ['sphere'] if values.get('sphere.radius', 0.0) > 0 else []
        names += [f'collider.{name}' for name in values.get('collider.names', ()) if name]
        rubbing = [f'{name}.friction' for name in names]
        with self._friction:
            for name in rubbing:
                text = name.removeprefix('collider.').removesuffix('.friction')
                self._update_slider(Range(name, text, 0.0, _GREATEST_FRICTION))
        for name in [each for each in self._sliders if each.endswith('.friction')]:
            if name not in rubbing:
                self._sliders.pop(name).remove()
        self._friction.visible = commandable and bool(rubbing)

    def _update_slider(self, offered: Range) -> None:
        if offered.name in self._sliders:
            self._sliders[offered.name].update()
        elif isinstance(self._client.parameters.values.get(offered.name), float):
            self._sliders[offered.name] = ParameterSlider(
                self._gui, self._client, self._actions, offered
            )
