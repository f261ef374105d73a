"""Every test of this folder is marked `reliability`, and records its result for the report."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker('reliability')


@pytest.fixture(scope='session')
def long(request: pytest.FixtureRequest) -> bool:
    """True in the long form."""
    return request.config.getoption('--long')


@pytest.fixture(scope='session')
def soak_seconds(request: pytest.FixtureRequest, long: bool) -> float:
    """Duration of a long run of a live node, s."""
    return request.config.getoption('--soak-seconds') if long else 5.0


@pytest.fixture(autouse=True)
def described(request: pytest.FixtureRequest, record_property: Callable[[str, str], None]) -> None:
    """Record what a test checks, for the report."""
    record_property('section', inspect.getdoc(request.module).splitlines()[0].rstrip('.'))
    record_property('check', ' '.join((inspect.getdoc(request.function) or '').split()))
    if parameters := getattr(request.node, 'callspec', None):
        record_property('variant', parameters.id)


@pytest.fixture
def measured(record_property: Callable[[str, str], None]) -> Callable[[str], None]:
    """Record in words what was measured, for the report."""

    def record(text: str) -> None:
        print(text)
        record_property('measured', text)

    return record


@pytest.fixture
def outcomes(measured: Callable[[str], None]) -> Iterator[Counter[str]]:
    """Count the outcomes of examples, for the report."""
    counts: Counter[str] = Counter()
    yield counts
    text = ', '.join(f'{count:,} {outcome}' for outcome, count in sorted(counts.items()))
    measured(f'{counts.total():,} cases: {text}')
