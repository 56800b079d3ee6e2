"""What the scripts for other renderers begin with: their arguments, and how they report what a render took."""

import argparse
import json
import os
import resource
import time

parser = argparse.ArgumentParser()
parser.add_argument("scene")
parser.add_argument("--spp", type=int)
parser.add_argument("--seed", type=int)
parser.add_argument("--threads", type=int, help="0: all")
parser.add_argument("--size", type=int, nargs=2)
parser.add_argument("--define", action="append", default=[], help="NAME=VALUE, a parameter of the scene")
parser.add_argument("--out")
arguments = parser.parse_args()

# Renderers write messages to standard output too, which is for the figures.
figures = os.dup(1)
os.dup2(2, 1)


def now():
    """Seconds, and processor seconds of all threads."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return time.monotonic(), usage.ru_utime + usage.ru_stime


def report(spent, **others):
    """Prints seconds and processor seconds of a render."""
    figures_of_render = dict(zip(("render_seconds", "processor_seconds"), spent), **others)
    os.write(figures, json.dumps(figures_of_render).encode() + b"\n")


