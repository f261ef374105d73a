"""Fixtures: a private ROS domain for each test, and a node as a process in it."""

from __future__ import annotations

import os

# Before NumPy is imported: its own threads would compete with live nodes and with other tests.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

from collections.abc import Callable, Iterator

import pytest
from hypothesis import HealthCheck, settings
from ros import NODE, Probe, Process, environment, free_domain, probing

# Examples of a property; tests that need more or fewer take a multiple of it.  Deadlines would
# depend on the machine.
for profile, count in (('short', 200), ('medium', 500), ('long', 10_000)):
    settings.register_profile(
        profile,
        max_examples=count,
        derandomize=profile == 'short',
        deadline=None,
        database=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption('--long', action='store_true', help='the long form of reliability tests')
    parser.addoption('--soak-seconds', type=float, default=3600.0, help='of the soak test, long')


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line('markers', 'reliability: random scenes, extremes, bad input, faults')
    config.addinivalue_line('markers', 'long: part of the long form only')
    config.addinivalue_line('markers', 'slow: not in `make test` but in `make test-all`')
    if not config.getoption('--hypothesis-profile', None):
        settings.load_profile('long' if config.getoption('--long') else 'short')


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption('--long'):
        for item in items:
            if item.get_closest_marker('long'):
                item.add_marker(pytest.mark.skip(reason='part of the long form, --long'))


@pytest.fixture
def domain() -> Iterator[int]:
    """A ROS domain that no other test on this machine uses meanwhile."""
    with free_domain() as number:
        yield number


@pytest.fixture
def start(domain: int) -> Iterator[Callable[..., Process]]:
    """Start a command in the domain, with environment variables; it is ended after the test."""
    started: list[Process] = []

    def start_process(*command: str, **variables: str) -> Process:
        process = Process(command, {**environment(domain), **variables})
        started.append(process)
        return process

    yield start_process
    for process in started:
        process.end()


@pytest.fixture
def start_cloth(start: Callable[..., Process]) -> Callable[..., Process]:
    """Start the node with parameters and other ROS arguments, and wait until it publishes."""

    def start_node(*ros_arguments: str, **parameters: object) -> Process:
        arguments = list(ros_arguments)
        for name, value in parameters.items():
            arguments += ['-p', f'{name.replace("__", ".")}:={value}']
        node = start(*NODE, '--ros-args', *arguments)
        node.wait_for_output('publishing')
        return node

    return start_node


@pytest.fixture
def probe(domain: int) -> Iterator[Probe]:
    """A node of the test's own in the domain."""
    with probing(domain) as node:
        yield node
