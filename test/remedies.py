"""Follow the remedies of error messages: do what they say to parameters, as a user would."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.parameter import get_parameter_value, parameter_value_to_python

from cloth_ros.scene import parameter_file
from cloth_ros.scene.parameter import format_value

MOST = 20  # remedies in a row: one value after the other
_WRITE = re.compile(
    r'(?:write slices, such as|write|the nearest allowed value is) (.*?)(?:, or .*|, and .*)?'
)
_NAME = re.compile(r"did you mean '(.*?)'(?:, with .*)?\?")


def as_in_a_file(name: str, text: str) -> Any:
    """Return a value as a parameter file delivers it."""
    return parameter_file.read_value(name, text)


def as_set(name: str, text: str) -> Any:
    """Return a value as `ros2 param set` delivers it: of some types, as text."""
    return parameter_value_to_python(get_parameter_value(text))


def remedied(values: Mapping[str, Any], error: str, typed: Callable[[str, str], Any]) -> dict:
    """Return parameters after the remedy of an error has been followed once."""
    remedy = error.rpartition('; ')[2]
    subject = error.partition(' is ')[0].removeprefix('the length of ')
    if match := _NAME.fullmatch(remedy):
        wrong = next(name for name in values if repr(name) == subject)
        return {match[1] if name == wrong else name: value for name, value in values.items()}
    match = _WRITE.fullmatch(remedy)
    assert match, f'no remedy to type in: {error}'
    subject, _, place = subject.partition('[')
    if assignment := re.fullmatch(r'([\w.]+): (.*)', match[1]):
        others = {name: value for name, value in values.items() if name != subject}
        return others | {assignment[1]: typed(*assignment.groups())}
    value = typed(subject, match[1])
    if place:  # of one item of a list
        items = list(values[subject])
        items[int(place.rstrip(']'))] = value
        value = items
    elif subject == 'pins' and isinstance(value, str):  # one of several pins
        shown = error.removeprefix('pins is ')
        value = [value if shown.startswith(format_value(pin)) else pin for pin in values['pins']]
    return {**values, subject: value}


def follow(
    values: Mapping[str, Any],
    attempt: Callable[[Mapping[str, Any]], object],
    typed: Callable[[str, str], Any] = as_in_a_file,
) -> list[str]:
    """Follow remedies until an attempt with the parameters succeeds; return the errors before."""
    errors: list[str] = []
    while len(errors) < MOST:
        try:
            attempt(values)
        except ValueError as error:
            errors.append(str(error))
            values = remedied(values, str(error), typed)
        else:
            return errors
    raise AssertionError(f'the remedies do not help: {errors}')
