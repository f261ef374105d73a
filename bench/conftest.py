"""Machine and software versions that pytest-benchmark records with its results."""

from __future__ import annotations

from typing import Any

from cloth_ros.tradeoff.machine import describe


def pytest_benchmark_generate_machine_info() -> dict[str, str]:
    """Return processor and versions, without the name of the host."""
    return describe()


def pytest_benchmark_generate_commit_info() -> dict[str, Any]:
    """Return nothing: results are committed together with the code that they belong to."""
    return {}
