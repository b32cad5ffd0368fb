"""The adapter for the VOT toolkit: `vot test`, and the toolkit's own runtime over TraX."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("vot", reason="the package vot-toolkit cannot be had", exc_type=ImportError)

from vot.dataset import load_sequence  # noqa: E402
from vot.tracker import ObjectStatus, Registry  # noqa: E402

import bagtrack  # noqa: E402
from conftest import SEED, Clip, clock  # noqa: E402


@pytest.fixture
def registry(tmp_path: Path) -> Path:
    """A file of trackers that names the program which the package installs."""
    program = Path(sys.executable).parent / "bagtrack-trax"
    assert program.is_file()
    file = tmp_path / "trackers.ini"
    file.write_text(f"[bagtrack]\nlabel = bagtrack\nprotocol = trax\ncommand = {program} --seed {SEED}\n")
    return file


def sequence_of(clip: Clip, folder: Path, objects: dict[str, tuple]) -> Path:
    """A sequence as the toolkit stores it."""
    (folder / "color").mkdir(parents=True)
    for number, file in enumerate(clip.files, 1):
        (folder / "color" / f"{number:08}.png").symlink_to(file)
    for name, box in objects.items():
        line = ",".join(map(str, box)) + "\n"
        (folder / f"groundtruth{name}.txt").write_text(line * len(clip.files))
    (folder / "sequence").write_text("channels.color=color/%08d.png\nformat=default\nname=clip\nfps=30\n")
    return folder


def test_vot_test_passes(registry: Path, clip: Clip, tmp_path: Path) -> None:
    box = tuple(round(number) for number in clip.box)
    sequence = sequence_of(clip, tmp_path / "clip", {"": box})
    for more in ([], ["--sequence", str(sequence)]):
        command = [sys.executable, "-m", "vot", "--registry", str(registry), "test", "bagtrack", *more]
        finished = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
        output = finished.stdout + finished.stderr
        assert finished.returncode == 0, output
        # The toolkit writes errors into its log and ends as if nothing had happened.
        assert "Test concluded successfuly" in output, output
        assert f"Processing frame {49 if not more else len(clip.files) - 1}/" in output


def test_the_toolkits_runtime_gets_the_boxes_of_the_tracker(registry: Path, clip: Clip, tmp_path: Path) -> None:
    """Two objects: one that is followed, and one beside it. Their boxes are whole numbers, which TraX passes on as
    they are; it rounds those of the answers to four digits behind the point."""
    boxes = [tuple(round(number) for number in clip.box), (150, 60, 50, 40)]
    sequence = load_sequence(str(sequence_of(clip, tmp_path / "clip", {"_a": boxes[0], "_b": boxes[1]})))
    frames = clip.frames()
    trackers = [bagtrack.Tracker(seed=SEED) for _ in boxes]
    for tracker, box in zip(trackers, boxes):
        tracker.init(frames[0], box)
    runtime = Registry([str(registry)])["bagtrack"].runtime()
    try:
        new = [ObjectStatus(sequence.object(name, 0), {}) for name in ("a", "b")]
        states, _ = runtime.initialize(sequence.frame(0), new)
        with clock("vot-toolkit over TraX, two objects", len(sequence) - 1):
            found = [runtime.update(sequence.frame(number))[0] for number in range(1, len(sequence))]
        for number, states in enumerate(found, 1):
            for state, tracker in zip(states, trackers, strict=True):
                _, box = tracker.update(frames[number])
                region = state.region
                np.testing.assert_allclose([region.x, region.y, region.width, region.height], box, atol=1e-3)
    finally:
        runtime.stop()
