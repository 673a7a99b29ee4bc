"""What commands that draw a picture share: options and refusals."""

import argparse
import math

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
