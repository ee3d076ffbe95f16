"""Calls of the command line within the test's own process."""

from solvers.cli.command import main


def call(capsys, *arguments):
    """The exit code, and what was printed and what went to stderr."""
    code = main([str(argument) for argument in arguments])
    streams = capsys.readouterr()
    return code, streams.out, streams.err
