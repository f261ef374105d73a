"""The service `~/save`: the whole state of the cloth to a file."""

from __future__ import annotations

from std_srvs.srv import Trigger

from ..context import Context
from ..saved_state import save_state
from .answer import file_answer


def create_save_service(context: Context) -> None:
    """Offer `~/save`."""
    name = context.node.get_fully_qualified_name()

    def save(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return file_answer(response, lambda: save_state(context), name)

    context.node.create_service(Trigger, '~/save', save)
