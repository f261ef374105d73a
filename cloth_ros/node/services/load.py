"""The service `~/load`: continue from the state in a file."""

from __future__ import annotations

from std_srvs.srv import Trigger

from ..context import Context
from ..saved_state import load_state
from .answer import file_answer


def create_load_service(context: Context) -> None:
    """Offer `~/load`."""
    name = context.node.get_fully_qualified_name()

    def load(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return file_answer(response, lambda: load_state(context), name)

    context.node.create_service(Trigger, '~/load', load)
