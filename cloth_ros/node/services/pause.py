"""The service `~/pause`: stop the time of the cloth, or let it continue."""

from __future__ import annotations

from std_srvs.srv import SetBool

from ..context import Context


def create_pause_service(context: Context) -> None:
    """Offer `~/pause`."""

    def pause(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        context.live.paused = request.data
        response.success = True
        response.message = 'paused' if request.data else 'running'
        return response

    context.node.create_service(SetBool, '~/pause', pause)
