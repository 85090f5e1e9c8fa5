"""The exception types that the command line shows as one line, without a traceback."""


class InputError(ValueError):
    """A value from the user is not usable; the message is one line: what was given, what is allowed, how to mend it.

    The command line prints the message alone and exits with status 2.
    """


class KeyProblem(InputError):
    """An InputError about one key of a table, for readers of files, which know where the key stands."""

    def __init__(self, key: str, problem: str):
        super().__init__(f"{key}: {problem}")
        self.key, self.problem = key, problem


class SetupError(RuntimeError):
    """The machine lacks something that mpcam needs; the message is one line: what is wrong, how to mend it.

    The command line prints the message alone and exits with status 1; `mpcam doctor` tells more.
    """
