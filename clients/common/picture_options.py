"""What commands that draw a picture share: options and refusals."""

import argparse
import math
import sys

SUFFIXES = (".png", ".svg", ".pdf")


class Refused(Exception):
    """The reason in its text, or nothing where a program has said it."""


def positive(text):
    """A number of an option; argparse.ArgumentTypeError for others than finite ones above 0."""
    value = float(text)
    if not (value > 0 and math.isfinite(value)):
        raise argparse.ArgumentTypeError(f"got {text}, expected a number above 0")
    return value


def check_picture(parser, path):
    """Ends with the parser's error where no picture can have that name."""
    if path.suffix not in SUFFIXES:
        parser.error(f"--out: {path}, expected a name that ends with {', '.join(SUFFIXES)}")


def save(figure, path, **options):
    """The figure as a file, in a folder that is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, **options)


def end_with(main):
    """Ends the program with main's exit code; 2 for Refused, 1 for a file that cannot be read or written."""
    try:
        sys.exit(main())
    except Refused as refused:
        if str(refused):
            print(f"grouser: {refused}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        print(f"grouser: {error.filename}: {error.strerror}", file=sys.stderr)
        sys.exit(1)
