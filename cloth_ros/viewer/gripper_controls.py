"""Buttons that let grippers grasp and release."""

from __future__ import annotations

from typing import Any

import viser

from .actions import Actions
from .cloth_client import ClothClient


class GripperControls:
    """
    A button for each gripper, in the folder that is open when this is made.

    Parameters
    ----------
    gui
        Of the page.
    client
        The cloth.
    actions
        Take what the user does.

    """

    def __init__(self, gui: viser.GuiApi, client: ClothClient, actions: Actions) -> None:
        self._gui, self._client, self._actions = gui, client, actions
        self._buttons: dict[str, viser.GuiButtonHandle] = {}

    def update(self) -> bool:
        """Show the present state; return whether there is a gripper."""
        grippers = self._client.grippers
        for name in self._buttons.keys() - set(grippers.names):
            self._buttons.pop(name).remove()
        for name in grippers.names:
            held = grippers.held(name)
            label = f'{name}: release {held}' if held else f'{name}: grasp'
            button = self._buttons.get(name)
            if button is None:
                self._buttons[name] = self._add(name, label)
            elif button.label != label:
                button.label = label
        return bool(self._buttons)

    def _add(self, name: str, label: str) -> viser.GuiButtonHandle:
        button = self._gui.add_button(label, icon=viser.Icon.HAND_GRAB)

        async def clicked(_: viser.GuiEvent[Any]) -> None:
            toggle = lambda: self._client.grippers.toggle(name)  # noqa: E731
            self._actions.put((self._client.name, f'{name} grasp'), toggle)

        button.on_click(clicked)
        return button
