"""The service `~/step`: one tick of a paused cloth."""

from __future__ import annotations

from std_srvs.srv import Trigger

from ..context import Context
from .answer import answer


def create_step_service(context: Context) -> None:
    """Offer `~/step`."""
    node, live = context.node, context.live

    def advance() -> str:
        if not live.paused:
            pause = node.resolve_service_name('~/pause')
            raise ValueError(
                'the cloth is not paused; pause it: '
                f"ros2 service call {pause} std_srvs/srv/SetBool '{{data: true}}'"
            )
        context.step()
        return f'simulated time {live.time:.6g} s'

    def step(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return answer(response, advance)

    node.create_service(Trigger, '~/step', step)
