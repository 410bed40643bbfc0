"""Sphinx configuration of the documentation: Markdown pages (MyST), theme furo, no network at build or view time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from jupyter_client.manager import KernelManager

ROOT = Path(__file__).parent.parent

project = "tca-cosim"
author = "the tca-cosim authors"
copyright = author
version = release = re.search(r"project\(tca_cosim VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx-mathjax-offline", "sphinx_copybutton"]
exclude_patterns = ["_build"]
nitpicky = False

# Markdown
myst_enable_extensions = ["dollarmath", "attrs_inline", "colon_fence"]
myst_heading_anchors = 4

# Pages with {code-cell} blocks run at every build: a cache would keep results of older code. A cell that fails fails
# the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_show_tb = True
nb_merge_streams = True
if hasattr(KernelManager, "transport_encryption"):  # from jupyter_client 8.10 on; kernels warn of plain text otherwise
    KernelManager.transport_encryption.default_value = "auto"
copybutton_exclude = ".linenos, .gp, .go"

# Python API
autodoc_member_order = "groupwise"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes of data classes have entries of their own
napoleon_numpy_docstring = True

# HTML
html_theme = "furo"
html_title = f"tca-cosim {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_theme_options = {"top_of_page_buttons": []}


def setup(app: Any) -> None:
    """Leaves out docstrings of modules, which the pages replace."""
    app.connect("autodoc-process-docstring", lambda app, what, *rest: rest[-1].clear() if what == "module" else None)
