"""
Tables of docs/reliability.md and the README from the results of the reliability tests.

    python -m tools.reliability_page RESULTS.xml

The results are the junit file of `pytest -m reliability --long`; see test/reliability/conftest.py
for the properties that are recorded in it.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe

from .marked_block import fill

PAGE, README = Path('docs/reliability.md'), Path('README.md')
NAME = 'make reliability'


def properties(element: ElementTree.Element) -> dict[str, str]:
    """Return the properties of a test suite or of a test case."""
    found = element.findall('properties/property')
    return {each.attrib['name']: each.attrib['value'] for each in found}


def commit() -> str:
    """Return the commit, with a plus if files other than the pages were changed since."""
    git = ['git', 'describe', '--always', '--exclude=*']
    changed = ['git', 'status', '--porcelain', '--', '.', ':!docs', f':!{README}']
    name, changes = (
        subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
        for command in (git, changed)
    )
    return name + ('+' if changes else '')


def result(case: ElementTree.Element) -> str:
    """Return how a test ended."""
    if case.find('failure') is not None or case.find('error') is not None:
        return '**failed**'
    return 'skipped' if case.find('skipped') is not None else 'passed'


def cell(text: str) -> str:
    """Return a text that can stand in a table."""
    return ' '.join(text.replace('|', '/').split())


def rows(cases: list[ElementTree.Element]) -> list[tuple[str, str, str]]:
    """Return check, measurement and result of the tests of a section."""
    lines = []
    for case in cases:
        values = properties(case)
        check, variant = values['check'], values.get('variant', '')
        skipped = case.find('skipped')
        measured = values.get('measured', '') if skipped is None else skipped.get('message', '')
        lines.append((cell(f'{check} `{variant}`' if variant else check), cell(measured)))
    return [(*line, result(case)) for line, case in zip(lines, cases, strict=True)]


def main(path: str) -> None:
    """Fill the tables."""
    root = ElementTree.parse(path).getroot()
    (suite,) = root.iter('testsuite')
    sections: dict[str, list[ElementTree.Element]] = {}
    for case in suite.iter('testcase'):
        if 'section' in properties(case):
            sections.setdefault(properties(case)['section'], []).append(case)
    machine = describe()
    names = ('processor', 'vector instructions', 'cores', 'python')
    conditions = ', '.join(f'{name} {machine[name]}' for name in names)
    text, summary = [f'Measured with commit {commit()} on: {conditions}.'], []
    for section, cases in sections.items():
        found = rows(cases)
        passed = sum(row[-1] == 'passed' for row in found)
        run = sum(row[-1] != 'skipped' for row in found)
        seconds = sum(float(case.attrib['time']) for case in cases)
        text += [f'### {section}', table(('check', 'measured', 'result'), found)]
        summary.append((section, f'{passed} of {run}', f'{seconds:.0f} s'))
    fill(PAGE, NAME, '\n\n'.join(text))
    fill(README, NAME, table(('tests', 'checks passed', 'duration'), summary))
    print(PAGE)


if __name__ == '__main__':
    main(sys.argv[1])
