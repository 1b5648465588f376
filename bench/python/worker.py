"""A job in a process of its own, in the environment whose sarfocus is to be timed: worker.py JOB SHAPE THREADS."""

from __future__ import annotations

import sys

from jobs import JOBS, noise, shape_of
from process import serve

import sarfocus


def main() -> None:
    name, shape, threads = sys.argv[1:]
    job = JOBS[name](shape_of(shape), int(threads))
    sarfocus.autofocus(noise((64, 64)), threads=int(threads))  # loads code and tables, 5 MiB that are not those of an image
    serve(job.call, lambda made: {"error": job.error(made), "unit": job.unit}, returned=False, restore=job.restore)


if __name__ == "__main__":
    main()
