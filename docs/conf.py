"""Configuration of Sphinx for the documentation: `make docs`."""

import os
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

ROOT = Path(__file__).parent.parent
# For the page of command lines, which shows what `--help` prints.
os.environ['PATH'] = f'{Path(sys.executable).parent}{os.pathsep}{os.environ.get("PATH", "")}'
os.environ['COLUMNS'] = '90'
sys.path.insert(0, str(ROOT))  # this clone, where the package is not installed

project = 'cloth_ros'
author = 'cloth_ros maintainers'
project_copyright = f'{author}, Apache-2.0'
version = release = ElementTree.parse(ROOT / 'package.xml').getroot().findtext('version')

extensions = [
    'myst_parser',
    'sphinx.ext.autodoc',
    'sphinx.ext.napoleon',
    'sphinx_copybutton',
    'sphinxcontrib.programoutput',
]
html_theme = 'furo'
html_title = f'cloth_ros {release}'
html_show_sourcelink = False
html_copy_source = False
html_static_path = ['static']
html_css_files = ['site.css']

myst_enable_extensions = ['dollarmath']
myst_heading_anchors = 4
myst_links_external_new_tab = False
source_suffix = {'.md': 'markdown', '.rst': 'restructuredtext'}
html_math_renderer = 'mathml'

autodoc_typehints = 'description'
autodoc_typehints_description_target = 'documented'
autodoc_member_order = 'bysource'
autodoc_class_signature = 'mixed'
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
default_role = 'code'  # docstrings have names in single quotes


def _formula(self: Any, node: Any, *, block: bool) -> None:
    """Write a formula as MathML, which browsers show without a script."""
    markup = tex2mathml(node.astext(), as_block=block)
    self.body.append(f'<div class="math">{markup}</div>' if block else markup)
    raise SkipNode


def _inline(self: Any, node: Any) -> None:
    _formula(self, node, block=False)


def _block(self: Any, node: Any) -> None:
    _formula(self, node, block=True)


def setup(app: Any) -> None:
    """Register the renderer of formulas."""
    app.add_html_math_renderer('mathml', (_inline, None), (_block, None))
