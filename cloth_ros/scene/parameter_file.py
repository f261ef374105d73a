"""Reading scenes from ROS 2 parameter files."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Mapping
from typing import Any

import yaml
from yaml.composer import ComposerError

from .parameter import format_value, invalid_value_error, one_line

NODE_NAME = 'cloth'
# Parameters that every ROS 2 node has; a scene file may set them, the model does not use them.
NODE_PARAMETERS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


# Bytes; a scene has a few hundred, and a file of this size takes two seconds to read.
_LARGEST = 200_000


class _Loader(yaml.SafeLoader):
    """
    Loader of the YAML that ROS reads: numbers, strings, booleans, lists and mappings of them.

    ROS has neither aliases, a few lines of which can expand to more than any memory holds, nor
    tags, which name types to construct; and a duplicate key is a mistake.
    """

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Refuse aliases and tags."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        mark = event.start_mark
        if isinstance(event, yaml.AliasEvent):
            raise ComposerError(None, None, 'an alias; write the value out', mark)
        if event.tag not in (None, '!', 'tag:yaml.org,2002:str'):
            raise ComposerError(None, None, 'a tag; leave it out', mark)
        return super().compose_node(parent, index)

    def construct_number(self, node: Any) -> Any:
        """Return a number; ROS does not take 1:30 and 1_000 for numbers."""
        if set(':_') & set(node.value):
            return self.construct_yaml_str(node)
        kind = node.tag.rpartition(':')[2]
        return getattr(self, f'construct_yaml_{kind}')(node)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Refuse duplicate keys."""
        keys: set[Any] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in keys:
                    problem = f'{format_value(key.value)} is given twice'
                    raise ComposerError(None, None, problem, key.start_mark)
                keys.add(key.value)
        return super().construct_mapping(node, deep)


# As for ROS, 1e-3 is a number, and a date is a string.
_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'[-+]?\d+(\.\d*)?[eE][-+]?\d+'), list('-+0123456789')
)
for _kind in ('int', 'float'):
    _Loader.add_constructor(f'tag:yaml.org,2002:{_kind}', _Loader.construct_number)
_Loader.yaml_implicit_resolvers = {
    first: [(tag, form) for tag, form in resolvers if not tag.endswith(':timestamp')]
    for first, resolvers in _Loader.yaml_implicit_resolvers.items()
}


def read_limited(path: str | os.PathLike[str]) -> bytes:
    """
    Return the content of a file of limited size.

    Raises
    ------
    ValueError
        It is not a regular file, or larger than any scene.
    OSError
        The file cannot be read.

    """
    if not isinstance(path, (str, os.PathLike)):
        raise invalid_value_error(
            'the path', path, 'a string or a path', 'give the name of a file'
        )
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
        text = file.read(_LARGEST + 1)
    if len(text) > _LARGEST:
        raise ValueError(f'this file has more than {_LARGEST} bytes; a scene has a few hundred')
    return text


def format_path(path: object) -> str:
    """Return a path for an error message."""
    name = os.fsdecode(path) if isinstance(path, (str, os.PathLike)) else ''
    return name if name and name.isprintable() else format_value(path)


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
    text = read_limited(path)
    try:
        document = yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = one_line(str(error))
        raise ValueError(f'this is not YAML ({reason}); correct its syntax') from None
    parameters: dict[str, Any] = {}
    names: set[str] = set()
    for name, section in document.items() if isinstance(document, Mapping) else ():
        if not isinstance(section, Mapping) or 'ros__parameters' not in section:
            continue
        if str(name).rsplit('/', 1)[-1] not in ('**', '*', NODE_NAME):
            continue
        values = section['ros__parameters']
        if not isinstance(values, Mapping):
            raise invalid_value_error(
                f'ros__parameters of {name}', values, 'a mapping', 'indent what it holds'
            )
        names.add(str(name))
        _merge(parameters, values)
    named = sorted(name for name in names if not name.endswith('*'))
    if len(named) > 1:
        raise ValueError(f'parameters for several cloths, {", ".join(named)}; give each a file')
    if not names:
        raise ValueError(
            f'no parameters for the node {NODE_NAME!r} here; '
            "a ROS parameter file begins with '/**:' and, indented below it, 'ros__parameters:'"
        )
    for name in list(parameters):
        if name.split('.')[0] in NODE_PARAMETERS:
            del parameters[name]
    return parameters


def _merge(into: dict[str, Any], values: Mapping[Any, Any]) -> None:
    for name, value in values.items():
        name = str(name)
        if isinstance(value, Mapping) and isinstance(into.get(name), dict):
            _merge(into[name], value)
        elif isinstance(value, Mapping):
            into[name] = {}
            _merge(into[name], value)
        else:
            into[name] = value
