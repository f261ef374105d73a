"""The documentation: every command and every program in it runs, every scene is valid."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from ament_index_python.packages import get_package_prefix
from builders import ROOT
from package.documentation import PAGES, Block, blocks
from ros import NODE, PATIENCE, Process, environment, free_domain

from cloth_ros import Scene
from cloth_ros.model import check_scene

BLOCKS = [block for page in PAGES for block in blocks(page)]
PROGRAMS = [block for block in BLOCKS if block.kind in ('sh', 'python')]
SCENES = [block for block in BLOCKS if block.kind == 'yaml']
COMMAND = re.compile(r'^(\$ )?(ros2|make|python\S*|\.venv/\S+|pip|cloth_\w+) ', re.MULTILINE)


def test_no_command_is_in_a_block_that_is_not_run():
    assert len(PROGRAMS) > 20
    for block in BLOCKS:
        assert block.kind in ('sh', 'python', 'yaml', 'text', '') or '{' in block.kind, block.name
        if block.kind in ('text', ''):
            assert not COMMAND.search(block.text), block.name


def test_targets_of_make_in_the_text_exist():
    targets = re.findall(r'^([\w-]+):', (ROOT / 'Makefile').read_text(), re.MULTILINE)
    for page in PAGES:
        for target in re.findall(r'(?<=`)make ([a-z-]+)', page.read_text()):
            assert target in targets, page


def test_the_help_of_every_command_is_in_the_reference():
    commands = re.findall(r"'(\w+) = cloth_ros\.", (ROOT / 'setup.py').read_text())
    commands += [f'examples/{path.name}' for path in (ROOT / 'examples').glob('*.py')]
    page = (ROOT / 'docs' / 'commands.md').read_text()
    assert len(commands) >= 7
    for command in commands:
        assert f'\n## {command}\n' in page
        assert f'{command} --help\n' in page


@pytest.mark.parametrize('block', SCENES, ids=lambda block: block.name)
def test_the_scenes_are_valid(block):
    values = yaml.safe_load(block.text)
    check_scene(Scene.from_parameters(values.get('/**', {}).get('ros__parameters', values)))


@pytest.fixture(scope='module')
def folders(tmp_path_factory):
    """Return the folder of a page: a clone after `make run`, by links; blocks may write to it."""
    made: dict[Path, Path] = {}

    def folder(page: Path) -> Path:
        if page not in made:
            made[page] = clone = tmp_path_factory.mktemp(page.stem) / 'clone'
            for source, target in ((ROOT, clone), (Path(sys.prefix), clone / '.venv')):
                target.mkdir()
                for entry in source.iterdir():
                    if entry.name not in ('.venv', '.git', 'build', 'tradeoff'):
                        (target / entry.name).symlink_to(entry)
            # Else `make` would install this clone into the environment that is linked.
            for kind in ('run', 'viewer', 'test', 'docs', 'pictures', 'bench'):
                for ros in ('wheels', 'sourced'):
                    mark = clone / '.venv' / f'.ready-{kind}-{ros}'
                    mark.unlink(missing_ok=True)
                    mark.touch()
            shutil.copy(ROOT / 'config' / 'drop_on_sphere.yaml', clone / 'my_scene.yaml')
        for scene in SCENES:  # of this page, the last one is the user's
            if scene.page == page and scene.text.startswith('/**:'):
                (made[page] / 'my_scene.yaml').write_text(scene.text)
        return made[page]

    return folder


def run(block: Block, folder: Path, variables: dict[str, str]) -> None:
    """Run a block to its end, or until Ctrl-C; raises AssertionError if it fails."""
    command = [f'{folder}/.venv/bin/python', '-c'] if block.kind == 'python' else ['bash', '-ec']
    output = folder / 'output.txt'
    with output.open('w') as file:
        process = subprocess.Popen(
            [*command, block.text], cwd=folder, env=variables, stdin=subprocess.DEVNULL,
            stdout=file, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
    interrupted = block.until is not None or block.seconds is not None
    end = time.monotonic() + (block.seconds if block.seconds is not None else PATIENCE)
    try:
        while process.poll() is None and time.monotonic() < end:
            if block.until is not None and block.until in output.read_text():
                break
            time.sleep(0.05)
        text = output.read_text()
        assert (process.poll() is None) == interrupted, text
        assert block.until is None or block.until in text, text
        if interrupted:
            os.killpg(process.pid, signal.SIGINT)
        code = process.wait(60)
        # What Ctrl-C ends may say so: bash by 130, make by the signal.
        assert code in ((0, 130, -signal.SIGINT) if interrupted else (0,)), output.read_text()
        assert 'Traceback' not in output.read_text(), output.read_text()
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def is_installed(name: str) -> bool:
    """Return whether there is a command or a ROS package of this name."""
    if shutil.which(name) is not None:
        return True
    with suppress(LookupError, OSError):
        return bool(get_package_prefix(name))
    return False


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize('block', PROGRAMS, ids=lambda block: block.name)
def test_the_programs_run(block, folders):
    if block.reason is not None:
        pytest.skip(block.reason)
    if block.needs is not None and not is_installed(block.needs):
        pytest.skip(f'{block.needs} is not installed; it is not on PyPI')
    folder = folders(block.page)
    with free_domain() as domain:
        # Not this test's own PYTHONPATH and settings of make.
        inherited = ('PYTHONPATH', 'MAKEFLAGS', 'MFLAGS', 'MAKELEVEL')
        variables = {
            name: value for name, value in environment(domain).items() if name not in inherited
        }
        if block.scene is None:
            run(block, folder, variables)
            return
        # Not to replace the state that the user has saved.
        own = {**environment(domain), 'ROS_HOME': str(folder)}
        node = Process((*NODE, '--ros-args', '--params-file', block.scene), own)
        try:
            node.wait_for_output('publishing')
            if block.needs == 'ros2':  # whose daemon has to discover the node first
                found = 'until ros2 node list | grep -q /cloth; do sleep 0.1; done'
                block = block._replace(text=f'{found}\n{block.text}')
            run(block, folder, variables)  # ends the daemon, too
            assert node.alive
            assert 'rejected' not in node.output
        finally:
            node.end()


@pytest.mark.slow
def test_the_site_is_built_without_warnings_and_works_offline(tmp_path):
    options = ('--quiet', '--fail-on-warning', '--keep-going')
    command = [sys.executable, '-m', 'sphinx', *options, '-d', f'{tmp_path}/cache', 'docs']
    site = tmp_path / 'site'
    built = subprocess.run([*command, site], cwd=ROOT, text=True, capture_output=True)
    assert built.returncode == 0, built.stderr
    pages = list(site.rglob('*.html'))
    assert len(pages) > 20
    remote = r'<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)="(?:https?:)?//[^"]*'
    for page in pages:
        assert not re.findall(remote, page.read_text()), page
    for style in site.rglob('*.css'):
        assert not re.search(r'url\(["\']?(?:https?:)?//|@import', style.read_text()), style
    assert '<math' in (site / 'model.html').read_text()
