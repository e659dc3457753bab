"""What ends a command: one sentence that a person can act on, and the exit code of the program's own table."""

BAD_USAGE = 2  # wrong arguments or configuration
BAD_INPUT = 3  # the data is not what it should be


class Failure(Exception):
    def __init__(self, code, sentence):
        super().__init__(sentence)
        self.code = code
