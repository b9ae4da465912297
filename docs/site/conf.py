"""Sphinx configuration of the site; tools/make_site lays out the sources and sets the environment."""
import os
import pathlib
import re

SOURCE = pathlib.Path(os.environ["PANONAV_SOURCE"])
project = "panonav"
author = copyright = "the authors of panonav"
release = re.search(r"project\(panonav VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
version = release

extensions = ["myst_parser", "sphinx.ext.autodoc", "breathe"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_update_mathjax = False
breathe_projects = {"panonav": os.environ["PANONAV_XML"]}
breathe_default_project = "panonav"
highlight_language = "none"
autodoc_member_order = "groupwise"
autodoc_typehints = "none"

html_theme = "furo"
html_title = f"panonav {release}"
html_last_updated_fmt = None
html_show_sphinx = False
html_copy_source = False
html_static_path = ["_static"]
# KaTeX draws the formulas without the network; it takes the place of MathJax, which Sphinx knows.
html_css_files = ["katex/katex.min.css"]
html_js_files = ["katex/katex.min.js", "katex/auto-render.js"]
mathjax_path = "draw_formulas.js"
mathjax_options = {"defer": "defer"}


def setup(app):
    def escape(_app, _what, _name, _object, _options, lines):
        example = False
        for i, line in enumerate(lines):  # docstrings are plain text, but for examples, which end with an empty line
            example = line.lstrip().startswith(">>>") or (example and line.strip() != "")
            if not example:
                lines[i] = re.sub(r"([|*`_])", r"\\\1", line)

    app.connect("autodoc-process-docstring", escape)
