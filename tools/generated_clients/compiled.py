"""Tracks the sample clip with a client in another language, and compares: `PROGRAM URL NAME COMMAND…`.

The command gets the address, a folder of JPEGs, the box and the seed. It prints a line for each frame but the first,
and on its standard error the milliseconds that a frame took.
"""

import pathlib
import subprocess
import sys
import tempfile

from clip import SEED, Clip

program, url, name, *command = sys.argv[1:]
clip = Clip(program)
with tempfile.TemporaryDirectory() as folder:
    for number, frame in enumerate(clip.frames):
        pathlib.Path(folder, f"{number:04}.jpg").write_bytes(frame)
    arguments = [*command, url, folder, clip.box, str(SEED)]
    run = subprocess.run(arguments, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
answers = []
for line in run.stdout.splitlines():
    number, *box, status = line.split()
    answers.append((int(number), [float(side) for side in box], status))
clip.check(name, answers, float(run.stderr.split()[0]))
