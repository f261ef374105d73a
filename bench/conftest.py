"""What a benchmark is said to have run on."""

from __future__ import annotations

from typing import Any

from cloth_ros.tradeoff.machine import describe


def pytest_benchmark_generate_machine_info() -> dict[str, str]:
    """Return processor and versions; the name of the host is nobody's business."""
    return describe()


def pytest_benchmark_generate_commit_info() -> dict[str, Any]:
    """Return nothing: results are kept in the repository, beside what they belong to."""
    return {}
