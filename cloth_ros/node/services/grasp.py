"""The services `NAME/grasp` of grippers: take what is within the radius, or release all."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rclpy.service import Service
from std_srvs.srv import SetBool

from ...scene import Scene
from ..context import Context
from .answer import answer


class GraspServices:
    """Offer a service for each gripper, which comes and goes with it."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._services: dict[str, Service] = {}

    def follow(self, scene: Scene) -> None:
        """Offer the services of the grippers of a scene, and no others."""
        names, node = scene.gripper.names, self._context.node
        for name in self._services.keys() - set(names):
            node.destroy_service(self._services.pop(name))
        for name in names:
            if name not in self._services:
                handle = partial(self._handle, name)
                self._services[name] = node.create_service(SetBool, f'{name}/grasp', handle)

    def _handle(
        self, name: str, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        action: Callable[[], str] = partial(self._grasp if request.data else self._release, name)
        return answer(response, action)

    def _grasp(self, name: str) -> str:
        return f'{name} holds {_particles(self._context.live.bodies.grasp(name))}'

    def _release(self, name: str) -> str:
        return f'{name} releases {_particles(self._context.live.bodies.release(name))}'


def _particles(count: int) -> str:
    return f'{count} particle' if count == 1 else f'{count} particles'
