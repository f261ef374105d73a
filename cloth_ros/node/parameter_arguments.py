"""
Parameters in the arguments of the command line, rewritten in the types of the scene.

rcl finds the type of a value from its text alone, and refuses lists that mix integers and floats,
and empty lists.  Rewritten, a file or ``-p`` means for the node what it means for
`cloth_ros.Scene`.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BufferedWriter
from types import TracebackType
from typing import Any

from ..scene import parameter_file
from ..scene.parameter import (
    convert,
    declaration,
    format_value,
    invalid_value_error,
)
from ..scene.yaml_text import write

_RULE = re.compile(r'(?P<node>[^:]*:)?(?P<name>[^:]*):=(?P<value>.*)', re.DOTALL)
# Flags of ROS that are followed by a value.
_PARAMETER_FLAGS = ('-p', '--param')
_FILE_FLAG = '--params-file'
_OTHER_FLAGS = ('-r', '--remap', '-e', '--enclave', '--log-level', '--log-config-file')
_MOST_NAMES = 10  # of nodes, in a warning


@dataclass(frozen=True)
class _File:
    """A parameter file: its path, the nodes that it names, and wrong values in it."""

    path: str
    nodes: tuple[str, ...]
    errors: tuple[str, ...]


class ParameterArguments:
    """
    Arguments for rcl, with all parameters in types that it reads.

    Copies of parameter files are kept in memory until this context manager ends; rcl reads them
    by their file descriptors.

    Parameters
    ----------
    arguments
        As they were given.

    Attributes
    ----------
    arguments
        With parameters rewritten.

    Raises
    ------
    ValueError
        A file cannot be read or is no parameter file, or a value is not valid.

    """

    def __init__(self, arguments: Sequence[str]) -> None:
        self.arguments: list[str] = []
        self._files: list[_File] = []
        self._copies: list[BufferedWriter] = []
        try:
            for argument, value in _pairs(arguments):
                if value is None:
                    self.arguments.append(argument)
                elif argument == _FILE_FLAG:
                    self._add_file(value)
                else:
                    rule = _rewritten(value) if argument in _PARAMETER_FLAGS else value
                    self.arguments += [argument, rule]
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> ParameterArguments:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the copies of the files."""
        for copy in self._copies:
            copy.close()
        self._copies.clear()

    def located(self, error: Exception) -> str:
        """Return the text of an error about a value, with the file that the value is from."""
        text = str(error)
        paths = [file.path for file in self._files if text in file.errors]
        return f'{paths[0]}: {text}' if len(paths) == 1 else text

    def files_for_others(self, node: str) -> Iterator[str]:
        """Yield what to say of each file that has nothing for the node of this full name."""
        for file in self._files:
            if any(parameter_file.applies(name, node) for name in file.nodes):
                continue
            names = [parameter_file.format_path(name) for name in file.nodes[:_MOST_NAMES]]
            if len(file.nodes) > _MOST_NAMES:
                names.append('…')
            yield (
                f'{file.path} has parameters for {", ".join(names)}, but none for this node, '
                f'{node}; {_remedy(file.nodes, node)}'
            )

    def _add_file(self, path: str) -> None:
        try:
            found = parameter_file.sections(parameter_file.read_limited(path))
        except OSError as error:
            raise ValueError(f'{path}: {error.strerror}; give a file') from None
        except ValueError as error:
            raise ValueError(f'{path}: {error}') from None
        errors: list[str] = []
        lines = []
        for name, values in found:
            flat = {key: value for key, value in parameter_file.flat(values).items() if key}
            if not flat or not parameter_file.is_name(name):
                continue
            lines.append(f'{write(name)}:\n  ros__parameters:\n')
            for key, value in flat.items():
                text = _ros_text(key, value, errors)
                lines.append(f'    {write(key)}: {text}\n')
        self._files.append(_File(path, tuple(name for name, _ in found), tuple(errors)))
        if lines:
            copy = os.fdopen(os.memfd_create('cloth_ros_parameters'), 'wb')
            self._copies.append(copy)
            copy.write(''.join(lines).encode())
            copy.flush()
            self.arguments += [_FILE_FLAG, f'/proc/self/fd/{copy.fileno()}']


def _pairs(arguments: Sequence[str]) -> Iterator[tuple[str, str | None]]:
    """Yield arguments, those of ROS that take a value together with it."""
    remaining = iter(arguments)
    of_ros = False
    for argument in remaining:
        if argument == '--ros-args':
            of_ros = True
        elif argument == '--':
            of_ros = False
        takes_value = argument in (*_PARAMETER_FLAGS, _FILE_FLAG, *_OTHER_FLAGS)
        yield argument, next(remaining, None) if of_ros and takes_value else None


def _rewritten(rule: str) -> str:
    """Return ``name:=value`` in a type that rcl reads; raises ValueError for a wrong value."""
    match = _RULE.fullmatch(rule)
    if match is None:
        name, _, text = re.sub(r'\s*[:=]+\s*', '=', rule, count=1).partition('=')
        known = declaration(name)
        remedy = shlex.quote(f'{name}:={text or write(known.default if known else 0)}')
        raise invalid_value_error('the argument of -p', rule, 'NAME:=VALUE', f'write -p {remedy}')
    name, own = match['name'], match['node'] is None
    known = declaration(name)
    try:
        value = parameter_file.read_value(name, match['value'])
        if known is None:
            typed = value is None or isinstance(value, Mapping) or _is_ros_value(value)
            return rule if typed else f'{match["node"] or ""}{name}:={write(format_value(value))}'
        value = convert(name, value, known.default, known.spec)
    except ValueError as error:
        if not own or known is None:  # perhaps meant for another node
            return rule
        raise ValueError(str(error) if name in str(error) else f'{name}: {error}') from None
    return f'{match["node"] or ""}{name}:={_typed(value)}'


def _ros_text(name: str, value: Any, errors: list[str]) -> str:
    """Return a value from a file in a type that rcl reads, and note why it is wrong."""
    known = declaration(name)
    if known is not None:
        try:
            converted = convert(name, value, known.default, known.spec)
        except ValueError as error:
            errors.append(str(error))
        else:
            return _typed(converted)
    if isinstance(value, list) and all(map(_is_number, value)):
        whole = all(isinstance(item, int) for item in value)
        value = value if whole else [float(item) for item in value]
    if _is_ros_value(value):
        return write(value)
    # What ROS has no type for.  A list with such a text is valid for no parameter here either.
    return write([f'{format_value(value)}, no value of ROS'])


def _typed(value: Any) -> str:
    """Return the value of a parameter of a scene in YAML; rcl has no empty lists."""
    return write([''] if value == () else value)


def _is_number(value: object) -> bool:
    return _is_ros_value(value) and not isinstance(value, (bool, str, list))


def _is_ros_value(value: object) -> bool:
    """Return True if ROS has a type for a value."""
    if isinstance(value, list):
        return len({type(item) for item in value}) == 1 and all(
            not isinstance(item, list) and _is_ros_value(item) for item in value
        )
    if isinstance(value, int):
        return -(2**63) <= value < 2**63
    return isinstance(value, (float, str))


def _remedy(names: Sequence[str], node: str) -> str:
    """Return how a file with sections of these names is made to apply to a node."""
    remedy = f'name its section {node}'
    candidates = [name for name in names if '*' not in name and parameter_file.is_name(name)]
    if len(candidates) != 1:
        return remedy
    (namespace, _, last), (own, _, base) = candidates[0].rpartition('/'), node.rpartition('/')
    options = f' -r __ns:={namespace or "/"}' if namespace != own else ''
    options += f' -r __node:={last}' if last != base else ''
    return f'{remedy}, or start the node with{options}'
