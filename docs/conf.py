"""Sphinx configuration; `python3 start.py docs` builds, docs/_build/html/index.html is the front page.

Nothing is fetched, neither by the build nor by a reader's browser: MathJax lies beside the pages in one file, with its
fonts, and the theme brings its own. (MathML needs no script, but many systems have no font for it.) With the
environment variable EVOLVENT_INTERSPHINX, as in the project's workflow, inventories of other packages are fetched, and
their names in docstrings are links.
"""

import importlib.metadata
import os
import pathlib
import sys
import warnings

from sphinx_gallery.sorting import ExplicitOrder

import evolvent

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "_ext"))
# tutorials run without the IPython profile of whoever builds them, and their kernels log errors only
_profile = pathlib.Path(__file__).resolve().parent / "_build" / "ipython" / "profile_default"
_profile.mkdir(parents=True, exist_ok=True)
(_profile / "ipython_kernel_config.py").write_text('c = get_config()\nc.IPKernelApp.log_level = "ERROR"\n')
os.environ["IPYTHONDIR"] = str(_profile.parent)

# plug-ins of whoever builds the pages are not among what they list
os.environ["EVOLVENT_PLUGINS"] = "none"

# of no use to a reader of an example
warnings.filterwarnings("ignore", message="First-class function type")

# validation book, credibility, coverage of the truth
import made_pages  # noqa: E402  (docs/_ext/made_pages.py)
import pages  # noqa: E402  (docs/_ext/pages.py)

made_pages.write()
# one page a part, a case, a command, a module
pages.write()

# ------------------------------------------------------------------------------------------------ project

project = "evolvent"
author = "The evolvent developers"
copyright = author  # noqa: A001  (Sphinx's name for it)
version = release = evolvent.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "myst_nb",
    "evolvent.sphinxext",
    "reference",
    "links",
]
if os.environ.get("EVOLVENT_INTERSPHINX"):
    extensions.append("sphinx.ext.intersphinx")
    intersphinx_timeout = 30
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "scipy": ("https://docs.scipy.org/doc/scipy", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
    }
exclude_patterns = [
    "_build",
    "_ext",
    "images",
    "examples/*.ipynb",
    "examples/*.py",
    "**.ipynb_checkpoints",
    "jupyter_execute",
]
language = "en"
# `name` in a docstring is a link where there is such an object, and an argument or a letter of a formula elsewhere
default_role = "py:obj"
nitpicky = True
nitpick_ignore_regex = [
    ("py:obj", ".*"),
    # other packages' classes, whose inventories are not always there, and types that a user never writes
    ("py:class", r"(?!evolvent).*"),
    (
        "py:class",
        r"evolvent\.(assembly|model|analysis\.system\.Part|parts\.(?:drive|profile|expression)|design\.studies\.axes)\b.*",
    ),
    ("py:class", r"evolvent_massprops\.(inertia\.problem|(?!inertia|identification)\w+)\b.*"),
]

# ------------------------------------------------------------------------------------------------ pages

html_theme = "pydata_sphinx_theme"
html_title = f"evolvent {version}"
_mathjax = importlib.metadata.distribution("sphinx-mathjax-offline")
html_static_path = ["_static", str(_mathjax.locate_file("sphinx-mathjax-offline/static/mathjax/tex-svg-full.js"))]
mathjax_path = "tex-svg-full.js"
html_css_files = ["evolvent.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
# without summaries the search needs no fetch, which browsers refuse for pages that are files
html_show_search_summary = False
html_theme_options = {
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "header_links_before_dropdown": 7,
    "navigation_with_keys": False,
}
html_sidebars = {
    page: []
    for page in (
        "index",
        "quickstart",
        "gallery",
        "glossary",
        "changelog",
        "validation",
        "coverage",
        "credibility",
    )
}

# ------------------------------------------------------------------------------------------------ text, docstrings

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "amsmath"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
# docstrings say more: shapes, units, frames
autodoc_typehints = "none"
python_maximum_signature_line_length = 100
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_preprocess_types = False
toc_object_entries_show_parents = "hide"

# ------------------------------------------------------------------------------------------------ what runs

# tutorials and examples run at every build: their output is that of this version
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_excludepatterns = ["examples/*"]
nb_merge_streams = True
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",
    "run_stale_examples": True,
    "abort_on_example_error": True,
    "within_subsection_order": ExplicitOrder(
        [
            "heliogyro_python.py",
            "compose_by_hand.py",
            "hardening_spring.py",
            "payout_sweep.py",
            "rib_modes.py",
            "lenticular_rib.py",
            "torque_margins.py",
            "attitude_control.py",
            "*",
        ]
    ),
    "image_scrapers": ("matplotlib",),
    "reset_modules": ("matplotlib",),
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "download_all_examples": False,
    "plot_gallery": True,
}
