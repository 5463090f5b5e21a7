"""Hooks of MkDocs: pages and figures made by the code, and formulas as MathML."""

import re
from html import unescape

import figures
import generated
from latex2mathml.converter import convert
from mkdocs.structure.files import File

FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
FUNCTION = re.compile(r"^::: kincheck\.by_name\.(\w+)$", re.MULTILINE)
JOINTS = re.compile(r"<!-- joints:begin -->.*<!-- joints:end -->", re.DOTALL)


def on_files(files, config):
    """Add the generated pages and figures."""
    for made in (generated.PAGES, figures.FIGURES):
        for uri, content in made().items():
            files.append(File.generated(config, uri, content=content))
    return files


def on_page_markdown(markdown, page, **_):
    """Replace the table of joints and engines by that of a run of the installed engines, and
    functions by their arguments, which follow from the options of commands.
    """
    markdown = FUNCTION.sub(lambda found: generated.function(found[1]) or found[0], markdown)
    return JOINTS.sub(lambda _: generated.joints(), markdown)


def on_page_content(html, **_):
    """Replace formulas by MathML, which browsers show without scripts."""
    return FORMULA.sub(
        lambda found: convert(
            unescape(found["tex"]), display="inline" if found["tag"] == "span" else "block"
        ),
        html,
    )
