"""Scenes as ROS 2 parameter files."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any

import yaml

NODE_NAME = 'cloth'
# Parameters that every ROS 2 node has; a scene file may set them, the model has no use for them.
NODE_PARAMETERS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


class _Loader(yaml.SafeLoader):
    """Reads 1e-3 as a number, as ROS does and YAML 1.1 does not."""


_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'[-+]?\d+(\.\d*)?[eE][-+]?\d+'), list('-+0123456789')
)


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """
    Return the parameters that a file gives to the node `cloth`, nested as in the file.

    Sections for ``/**``, ``cloth`` and ``/cloth`` apply, in the order of the file; a namespace
    before the name is accepted, for the model lives in none.

    Raises
    ------
    ValueError
        The file is not YAML, or not a ROS parameter file.
    OSError
        The file cannot be read.

    """
    with open(path, encoding='utf-8') as file:
        try:
            document = yaml.load(file, _Loader)
        except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
            reason = ' '.join(str(error).split())
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
            raise ValueError(f'ros__parameters of {name!r} must be a mapping of names to values')
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
