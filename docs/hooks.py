"""Hooks of MkDocs: pages of extensions, pages and figures made by the code, formulas as MathML."""

import re
from html import unescape
from pathlib import Path

import collected
import figures
import generated
from latex2mathml.converter import convert
from mkdocs.structure.files import File

FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
FUNCTION = re.compile(r"^::: kincheck\.by_name\.(\w+)$", re.MULTILINE)
JOINTS = re.compile(r"<!-- joints:begin -->.*<!-- joints:end -->", re.DOTALL)


def on_config(config):
    """Add the pages of extensions to the navigation."""
    collected.add_to(config.nav)


def on_files(files, config):
    """Add the files of extensions, and the generated pages and figures."""
    for folder, uri in collected.files():
        files.append(File(uri, str(collected.ROOT / folder), config.site_dir, False))
    for made in (generated.PAGES, figures.FIGURES):
        for uri, content in made().items():
            files.append(File.generated(config, uri, content=content))
    return files


def on_page_markdown(markdown, page, **_):
    """Replace the table of joints and engines by that of a run of the installed engines, and
    functions by their arguments, which follow from the options of commands. Links to files become
    links in the site.
    """
    folder = Path(page.file.src_dir or collected.ROOT / collected.KERNEL)
    markdown = collected.in_site(markdown, folder.relative_to(collected.ROOT), page.file.src_uri)
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
