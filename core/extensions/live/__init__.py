"""The live page: a design answers while the user edits it.

    protocol    the messages between page and server, as JSON
    table       a table of hardpoints, whose numbers are inputs of one program
    model       a mechanism moved by its drivers
    server      one page and its sockets on this machine, with token and checks of origin
    saved       the page as one file, which the solver in it answers

The page owns the design: each of its messages holds all numbers. The server only answers.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["code", "designs", "hardpoints", "sweep", "explain"],
    commands={"serve": "command:Serve"},
    public={"live": "command:Serve"},
    schemas={"live": "protocol:live_schema"},
)
