"""`python -m solvers`: the command line."""

from solvers.cli.command import main

if __name__ == "__main__":
    raise SystemExit(main())
