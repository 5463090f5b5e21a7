"""The command kincheck without its start: a process with everything imported forks for each call.

    python command_server.py serve SOCKET     prints a line when it is ready
    python command_server.py SOCKET ARGUMENT ...

A caller passes its arguments, folder, environment and standard streams, and gets the exit status.
The pages of the documentation have some hundred commands; imports would take most of their time.
"""

import json
import os
import socket
import sys

LARGEST = 1 << 20
IN_PROCESS = ["--jobs", "0"]
"""Options of `run`: simulators are solved where they are imported already."""


def serve(address):
    """Answer callers until the process is ended."""
    import contextlib
    import gc
    import signal
    import traceback

    import scipy.interpolate  # noqa: F401
    from kincheck import adapters
    from kincheck.core.cli.main import main

    engines = [name for name in adapters.ENGINES if adapters.engine(name).version()]
    with (
        open(os.devnull, "w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
    ):
        report = ["--out", os.path.dirname(address)]
        main(["run", "five_bar", *IN_PROCESS, "--engine", *engines, *report])
        main(["explain", "rssr", "--samples", "3"])

    gc.freeze()  # what is imported is never searched again
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(address)
    listening.listen()
    print("ready", flush=True)
    while True:
        caller, _ = listening.accept()
        if os.fork():
            caller.close()
            continue
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        listening.close()
        message, streams, _, _ = socket.recv_fds(caller, LARGEST, 3)
        arguments, folder, environment = json.loads(message)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
        # the old ones know pipes, not files
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.path.insert(0, folder)
        try:
            own = IN_PROCESS if arguments[0] == "run" else []
            status = main([*arguments, *own])
        except BaseException:
            traceback.print_exc()
            status = 99
        sys.stdout.flush()
        sys.stderr.flush()
        caller.sendall(bytes([status]))
        os._exit(0)


def call(address, arguments):
    """Return the exit status of a command."""
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(address)
        message = json.dumps([arguments, os.getcwd(), dict(os.environ)]).encode()
        socket.send_fds(server, [message], [0, 1, 2])
        return server.recv(1)[0]


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(sys.argv[2])
    else:
        sys.exit(call(sys.argv[1], sys.argv[2:]))
