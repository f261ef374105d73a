"""Machine and software versions of a measurement."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path


def _processor() -> tuple[str, str]:
    """Return the name of the processor and its widest vector instructions."""
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine(), ''
    known: dict[str, str] = {}
    for line in lines:
        key, _, value = line.partition(':')
        known.setdefault(key.strip(), value.strip())
    flags = known.get('flags', '').split()
    widest = next((name for name in ('avx512f', 'avx2', 'avx', 'sse2') if name in flags), '')
    return known.get('model name', platform.machine()), widest


def describe() -> dict[str, str]:
    """Return processor, system and versions, by name."""
    name, vectors = _processor()
    versions = {}
    for package in ('cloth_ros', 'numpy', 'numba', 'llvmlite'):
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions[package] = 'unknown'
    return {
        'processor': name,
        'vector instructions': vectors,
        'cores': str(os.cpu_count()),
        'system': f'{platform.system()} {platform.machine()}',
        'python': platform.python_version(),
        **versions,
    }


def describe_in_a_line() -> str:
    """Return processor, system and versions as one line of text."""
    return ', '.join(f'{name} {value}' for name, value in describe().items())
