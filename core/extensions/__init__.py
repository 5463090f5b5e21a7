"""Extensions: one folder for each, with its code, its commands and its page. `EXTENSION` in the
folder's `__init__.py` is the only registration: an extension goes when its folder goes.
"""
