"""What NumPy needs only to load a campaign's .npy files and take means and standard deviations."""

import pathlib
import sys

import numpy

for path in sorted(pathlib.Path(sys.argv[1]).glob("*.npy")):
    data = numpy.load(path)
    data.mean(axis=0)
    data.std(axis=0)
