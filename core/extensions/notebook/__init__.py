"""Results and mechanisms in a notebook."""

from ...doors import Extension

EXTENSION = Extension(
    __name__, views={"result": "notebook_view:to_html", "mechanism": "notebook_view:view"}
)
