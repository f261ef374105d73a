"""The service `~/reset`: back to the initial state."""

from __future__ import annotations

from std_srvs.srv import Trigger

from ..context import Context


def reset_cloth(context: Context) -> None:
    """Return to the initial state, with bodies where their frames are now, and grippers open."""
    context.frames.prepare_reset(context.live, context.node.get_clock().now().nanoseconds)
    context.live.reset()


def create_reset_service(context: Context) -> None:
    """Offer `~/reset`."""

    def reset(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        reset_cloth(context)
        response.success = True
        response.message = 'the cloth is back in its initial state'
        return response

    context.node.create_service(Trigger, '~/reset', reset)
