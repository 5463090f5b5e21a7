"""Results as tables, pictures and data of other libraries, and in a notebook."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["reports"],
    views={
        "result": "notebook_view:to_html",
        "mechanism": "notebook_view:mechanism_view",
        "scene": "notebook_view:scene_view",
        "data": "tables:data_of",
        "frame": "tables:frame_of",
        "arrays": "tables:arrays_of",
        "figure": "tables:figure_of",
    },
)
