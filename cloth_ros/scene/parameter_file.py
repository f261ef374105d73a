"""Reading scenes from ROS 2 parameter files, and writing them."""

from __future__ import annotations

import functools
import os
import re
import stat
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import yaml

from .parameter import (
    DEFAULTS,
    MEMBERS,
    declaration,
    format_value,
    invalid_value_error,
    one_line,
)
from .yaml_text import write_tree

NODE_NAME = 'cloth'
# Parameters that every ROS 2 node has; a scene file may set them, the model does not use them.
NODE_PARAMETERS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


# Bytes; a scene has a few hundred, and a file of this size takes two seconds to read.
_LARGEST = 200_000
# Lists of names, `y` and `on` among them.  Not pins: without quotes, "0,0" is two numbers.
_LISTS_OF_NAMES = ('names',)
_STRING, _NULL = 'tag:yaml.org,2002:str', 'tag:yaml.org,2002:null'
_PARAMETERS = 'ros__parameters'
# Names that ROS reads; in `/**` and `/*` each star stands for names.
_NODE = re.compile(r'/(?:\*\*|(?:\*\*/|(?:[A-Za-z_]\w*/)*)(?:\*|[A-Za-z_]\w*))', re.ASCII)


class _NotReadError(ValueError):
    """There is something in a file that ROS does not read."""

    def __init__(self, problem: str, mark: Any, remedy: str) -> None:
        super().__init__(f'{problem} in line {mark.line + 1}; {remedy}')


class _Loader(yaml.SafeLoader):
    """
    Loader of the YAML that ROS reads: numbers, strings, booleans, lists and mappings of them.

    ROS has neither aliases, a few lines of which can expand to more than any memory holds, nor
    tags, which name types to construct; and a duplicate key is a mistake.  Keys are strings.
    """

    bool_values: ClassVar[dict[str, bool]] = {**yaml.SafeLoader.bool_values, 'y': True, 'n': False}

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Refuse aliases and tags."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        mark = event.start_mark
        if isinstance(event, yaml.AliasEvent):
            raise _NotReadError('an alias', mark, 'write the value out')
        if event.tag not in (None, '!', _STRING):
            raise _NotReadError('a tag', mark, 'leave it out')
        return super().compose_node(parent, index)

    def construct_number(self, node: Any) -> Any:
        """Return a number; ROS does not take 1:30 and 1_000 for numbers."""
        if set(':_') & set(node.value):
            return self.construct_yaml_str(node)
        kind = node.tag.rpartition(':')[2]
        return getattr(self, f'construct_yaml_{kind}')(node)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Refuse duplicate keys; what is a string parameter is not read as a number."""
        keys: set[Any] = set()
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in keys:
                    problem = f'{format_value(key.value)} is given twice, again'
                    raise _NotReadError(problem, key.start_mark, 'leave one out')
                keys.add(key.value)
                key.tag = _STRING
                last = key.value.rpartition('.')[2]
                if last in _names_of_strings():
                    _take_as_string(value)
                elif last in _LISTS_OF_NAMES:
                    _take_items_as_strings(value)
        return super().construct_mapping(node, deep)


@functools.cache
def _names_of_strings() -> set[str]:
    """Return the names, without their groups, of the parameters that are strings."""
    fixed = {name.rpartition('.')[2]: value for name, value in DEFAULTS.items()}
    members = {
        name: known.default for fields in MEMBERS.values() for name, known in fields.items()
    }
    return {
        name
        for defaults in (fixed, members)
        for name, value in defaults.items()
        if isinstance(value, str)
    }


def _take_as_string(node: yaml.Node) -> None:
    if isinstance(node, yaml.ScalarNode) and node.tag != _NULL:
        node.tag = _STRING


def _take_items_as_strings(node: yaml.Node) -> None:
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _take_as_string(item)


# As for ROS, 1e-3 is a number, `y` a boolean, and a date a string.
_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$'),
    list('-+0123456789'),
)
_Loader.add_implicit_resolver('tag:yaml.org,2002:bool', re.compile('[yYnN]$'), list('yYnN'))
for _kind in ('int', 'float'):
    _Loader.add_constructor(f'tag:yaml.org,2002:{_kind}', _Loader.construct_number)
_Loader.yaml_implicit_resolvers = {
    first: [(tag, form) for tag, form in resolvers if not tag.endswith(':timestamp')]
    for first, resolvers in _Loader.yaml_implicit_resolvers.items()
}


def read_limited(
    path: str | os.PathLike[str], most: int = _LARGEST, usual: str = 'a scene has a few hundred'
) -> bytes:
    """
    Return the content of a file of limited size.

    Parameters
    ----------
    path
        Of the file.
    most, usual
        Bytes that it may have; and how many are usual, in words.

    Raises
    ------
    ValueError
        It is not a regular file, or larger than it may be.
    OSError
        The file cannot be read.

    """
    check_path(path)
    try:
        mode = os.stat(path).st_mode
    except ValueError:  # NUL in it, or what the file system cannot encode
        raise invalid_value_error('the path', path, 'the name of a file', 'correct it') from None
    # Checked before it is opened: opening a pipe waits for a writer.
    if not stat.S_ISREG(mode):
        raise ValueError(
            'this is not a regular file but a folder, a pipe or a device; give a file'
        )
    with open(path, 'rb') as file:
        text = file.read(most + 1)
    if len(text) > most:
        raise ValueError(f'this file has more than {most} bytes; {usual}')
    return text


def check_path(path: object) -> None:
    """Raise ValueError for what cannot be the path of a file."""
    if not isinstance(path, (str, os.PathLike)):
        raise invalid_value_error(
            'the path', path, 'a string or a path', 'give the name of a file'
        )


def format_path(path: object) -> str:
    """Return a path for an error message."""
    name = os.fsdecode(path) if isinstance(path, (str, os.PathLike)) else ''
    return name if name and name.isprintable() else format_value(path)


def _load(text: bytes | str, take: Callable[[yaml.Node], None] | None = None) -> Any:
    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            if take is not None and node is not None:
                take(node)
            return None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    except _NotReadError as error:
        raise ValueError(str(error)) from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = one_line(re.sub(r'in "<\w+ string>", ', 'in ', str(error)))
        raise ValueError(f'this is not YAML ({reason}); correct its syntax') from None


def read_value(name: str, text: str) -> Any:
    """
    Return the value of a parameter that is written as on the command line.

    Raises
    ------
    ValueError
        It is not YAML.

    """
    known = declaration(name)
    if name.rpartition('.')[2] in _LISTS_OF_NAMES:
        return _load(text, _take_items_as_strings)
    is_string = known is not None and isinstance(known.default, str)
    return _load(text, _take_as_string if is_string else None)


def sections(text: bytes) -> list[tuple[str, dict[str, Any]]]:
    """
    Return the names of nodes in a parameter file, and the parameters of each, nested as there.

    A name may be divided: ``lab: {cloth: {ros__parameters: …}}`` is ``/lab/cloth``.

    Raises
    ------
    ValueError
        It is not YAML, or not a ROS parameter file.

    """
    result = []
    waiting: list[tuple[str, Any]] = [('', _load(text))]
    while waiting:
        name, section = waiting.pop()
        if not isinstance(section, Mapping):
            continue
        if name and _PARAMETERS in section:
            values = section[_PARAMETERS]
            if not isinstance(values, Mapping):
                raise invalid_value_error(
                    f'{_PARAMETERS} of {name}', values, 'a mapping', 'write rate: 60.0 below it'
                )
            result.append((name, dict(values)))
        inner = [(_joined(name, key), part) for key, part in section.items() if key != _PARAMETERS]
        waiting += reversed(inner)
    if not result:
        raise ValueError(
            f'no parameters for the node {NODE_NAME!r} here; '
            f"a ROS parameter file begins with '/**:' and, indented below it, '{_PARAMETERS}:'"
        )
    return result


def _joined(namespace: str, name: str) -> str:
    """Return the absolute name of a node or of a namespace in another."""
    return f'{namespace}/{name.removeprefix("/")}'


def is_name(name: str) -> bool:
    """Return True if ROS reads this name of a section."""
    return bool(_NODE.fullmatch(name))


def applies(name: str, node: str) -> bool:
    """Return True if a section of this name is for the node of a full name, as rclpy decides."""
    return bool(is_name(name) and re.fullmatch(name.replace('/*', r'(/\w+)'), node))


def flat(values: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Return nested parameters by dotted names; a later one replaces an earlier one."""
    result: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping) and declaration(prefix + name) is None:
            result.update(flat(value, f'{prefix}{name}.'))
        else:
            result[prefix + name] = value
    return result


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """
    Return the parameters that a file gives to the node `cloth`, nested as in the file.

    Sections for ``/**``, ``cloth`` and ``/cloth`` apply, in the order of the file; a namespace
    before the name is accepted, because the model has none.

    Raises
    ------
    ValueError
        The file is not YAML, or not a ROS parameter file.
    OSError
        The file cannot be read.

    """
    parameters: dict[str, Any] = {}
    applied: set[str] = set()
    found = sections(read_limited(path))
    for name, values in found:
        last = name.rpartition('/')[2]
        if last not in ('**', '*', NODE_NAME):
            continue
        if not is_name(name):
            wildcard = '/**' if last == '**' else f'/**/{last}'
            raise ValueError(f'{name} is no name of a node that ROS reads; write {wildcard}')
        applied.add(name)
        _merge(parameters, values)
    named = sorted(name for name in applied if not name.endswith('*'))
    if len(named) > 1:
        raise ValueError(f'parameters for several cloths, {", ".join(named)}; give each a file')
    if not applied:
        others = ', '.join(format_path(name) for name, _ in found)
        raise ValueError(
            f'no parameters for the node {NODE_NAME!r} here, only for {others}; write /** instead'
        )
    for name in list(parameters):
        if name.split('.')[0] in NODE_PARAMETERS:
            del parameters[name]
    return parameters


def _merge(into: dict[str, Any], values: Mapping[str, Any]) -> None:
    for name, value in values.items():
        if isinstance(value, Mapping) and isinstance(into.get(name), dict):
            _merge(into[name], value)
        elif isinstance(value, Mapping):
            into[name] = {}
            _merge(into[name], value)
        else:
            into[name] = value


def text_of(parameters: Mapping[str, Any]) -> str:
    """Return the text of a file with nested parameters, for nodes of any name."""
    return write_tree({'/**': {_PARAMETERS: parameters}})


def save(path: str | os.PathLike[str], parameters: Mapping[str, Any]) -> None:
    """
    Write nested parameters to a file that `read` and ROS read; a file that exists is replaced.

    Raises
    ------
    ValueError
        The path is none, or the file would be larger than `read` accepts.
    OSError
        The file cannot be written.

    """
    check_path(path)
    text = text_of(parameters).encode()
    if len(text) > _LARGEST:
        raise ValueError(
            f'the scene is a file of {len(text)} bytes, but must be one of at most {_LARGEST}; '
            'write slices in pins, such as ["0,:"]'
        )
    with open(path, 'wb') as file:
        file.write(text)
