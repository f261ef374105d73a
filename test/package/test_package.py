"""The repository as a whole: documentation, versions, dependencies, size of files."""

import ast
import doctest
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from builders import ROOT, run_python

from cloth_ros import Cloth, Scene
from tools.launch_table import launch_table
from tools.parameter_table import parameter_table

CODE = ROOT / 'cloth_ros'
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md')])


def test_the_model_and_the_running_cloth_work_where_there_is_no_ros():
    code = """
import sys
for name in ('rclpy', 'sensor_msgs', 'geometry_msgs', 'std_msgs', 'std_srvs'):
    sys.modules[name] = None
import cloth_ros.live.live_cloth
from cloth_ros import Cloth, Scene
cloth = Cloth(Scene.from_yaml('config/gust.yaml'))
cloth.advance(0.1)
print(cloth.positions.shape)
"""
    result = run_python(code)
    assert result.stdout == '(36, 36, 3)\n', result.stderr


def test_table_of_parameters_is_that_of_the_scene():
    assert parameter_table() in (ROOT / 'docs' / 'parameters.md').read_text()


def test_table_of_launch_arguments_is_that_of_the_launch_file():
    assert launch_table() in (ROOT / 'docs' / 'commands.md').read_text()


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r'^#+ (.*)$', page.read_text(), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', text.lower()).replace(' ', '-') for text in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_and_pictures_exist(page):
    for link in re.findall(r'\]\(([^)]+)\)', page.read_text()):
        if link.startswith('http'):
            continue
        path, _, anchor = link.partition('#')
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_python_example_of_the_readme_runs(monkeypatch, tmp_path):
    (tmp_path / 'config').symlink_to(ROOT / 'config')
    monkeypatch.chdir(tmp_path)
    (example,) = re.findall(r'```python\n(.*?)```', (ROOT / 'README.md').read_text(), re.DOTALL)
    exec(compile(example, 'README.md', 'exec'), {})


@pytest.mark.parametrize('public', [Cloth, Scene])
def test_the_help_begins_with_an_example_that_runs(public, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(
        public.__doc__, {'Cloth': Cloth, 'Scene': Scene}, '', None, None
    )
    assert len(example.examples) >= 4
    assert public.__doc__.split('\n\n')[1].strip().startswith('>>> ')
    assert doctest.DocTestRunner().run(example).failed == 0


def test_layout_lists_every_module():
    layout = (ROOT / 'CONTRIBUTING.md').read_text()
    modules = [path for path in (ROOT / 'cloth_ros').rglob('*.py') if path.stem != '__init__']
    assert not [path.name for path in modules if path.name not in layout]


def test_paths_in_contributing_exist():
    text = (ROOT / 'CONTRIBUTING.md').read_text()
    paths = re.findall(r'`([\w/]+(?:\.py|/))`', text)
    assert paths
    assert not [
        path for path in paths if not (ROOT / path).exists() and not (CODE / path).exists()
    ]


def test_make_help_lists_every_target():
    listed = subprocess.run(['make', 'help'], cwd=ROOT, text=True, capture_output=True).stdout
    (targets,) = re.findall(r'\.PHONY: (.*?)\n\n', (ROOT / 'Makefile').read_text(), re.DOTALL)
    found = re.findall(r'^make ([\w-]+) ', listed, re.MULTILINE)
    assert sorted(found) == sorted(targets.replace('\\', '').split())


def test_the_version_is_the_same_everywhere():
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    version = package.findtext('version')
    assert f"version='{version}'" in (ROOT / 'setup.py').read_text()
    assert f'\n{version} (' in (ROOT / 'CHANGELOG.rst').read_text()


def test_what_is_imported_is_declared():
    """Every import of the package is a dependency of package.xml."""
    keys = {
        name: f'python3-{name}'
        for name in ('numpy', 'numba', 'yaml', 'matplotlib', 'scipy', 'tqdm')
    }
    keys['llvmlite'] = keys['numba']  # which is made on it
    keys['trimesh'] = 'python3-trimesh-pip'  # Ubuntu 24.04 has no package of it
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    declared = {element.text for element in package.findall('exec_depend')}
    imported = set()
    for path in [*(ROOT / 'cloth_ros').rglob('*.py'), *(ROOT / 'launch').glob('*.py')]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                imported.add(node.module.split('.')[0])
    # Itself; optional; by pip only.
    others = {'cloth_ros', 'tf2_ros', 'simulation_interfaces', 'viser', 'msgspec'}
    others |= {'rosbags', 'mcap', 'distributed', 'pxr', 'meshio'}  # of recordings
    outside = imported - set(sys.stdlib_module_names) - others
    assert {keys.get(name, name) for name in outside} <= declared


def test_files_hold_one_subject():
    folders = ('cloth_ros', 'bench', 'examples', 'launch', 'test', 'tools')
    paths = [path for folder in folders for path in (ROOT / folder).rglob('*.py')]
    assert len(paths) > 40
    assert not [path for path in paths if len(path.read_text().splitlines()) > 400]
