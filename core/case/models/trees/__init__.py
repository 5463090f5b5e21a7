"""Models of links in files of other programs: MJCF, URDF, SDF, USD and OpenSim, read into
one tree of links.

A reader of another format fills a `Tree`, outer links first, or a `Graph` of links and joints in
any order, which is hung up as a tree. `case.case_of` makes the case of a tree. Messages name an
`Element`: a place in the file, by its line or in words.
"""

from .element import Element
from .graph import Graph, Joint, Loop
from .place import Place
from .tree import Closure, Coupling, Mass, Move, Spring, Strut, Tree

__all__ = [
    "Closure",
    "Coupling",
    "Element",
    "Graph",
    "Joint",
    "Loop",
    "Mass",
    "Move",
    "Place",
    "Spring",
    "Strut",
    "Tree",
]
