"""Responses of services that may fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from std_srvs.srv import SetBool, Trigger

from ...scene.parameter import one_line

R = TypeVar('R', Trigger.Response, SetBool.Response)


def answer(response: R, action: Callable[[], str]) -> R:
    """Fill a response with what an action returns, or with why it fails; return it."""
    try:
        response.message, response.success = action(), True
    except ValueError as error:
        response.message, response.success = one_line(str(error)), False
    return response


def file_answer(
    response: Trigger.Response, action: Callable[[], str], node: str
) -> Trigger.Response:
    """Do the same for an action with the file of `snapshot.file` of a node."""

    def checked() -> str:
        try:
            return action()
        except OSError as error:
            raise ValueError(
                f'{error.filename}: {error.strerror}; choose another file: ros2 param set {node} '
                'snapshot.file PATH'
            ) from None

    return answer(response, checked)
