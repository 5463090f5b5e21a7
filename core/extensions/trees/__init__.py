"""Models of links in files of other programs: MJCF, URDF and SDF, read into one tree of
links.

A reader of another format fills a `Tree`, outer links first, or a `Graph` of links and joints in
any order, which is hung up as a tree. `case.case_of` makes the case of a tree. Messages name an
`Element`: a place in the file, by its line or in words.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["closing", "xml", "yaml"],
    readers={"mjcf": "reader:MJCF", "urdf": "reader:URDF", "sdf": "reader:SDF"},
)
