"""The adapter for the GOT-10k toolkit, in the toolkit's own experiments."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("got10k", reason="the package got10k cannot be had", exc_type=ImportError)

from got10k.datasets import OTB  # noqa: E402
from got10k.experiments import ExperimentGOT10k, ExperimentOTB  # noqa: E402

from bagtrack.adapters.got10k import BagTracker  # noqa: E402
from conftest import SEED, Clip  # noqa: E402


def one_based(boxes: list) -> np.ndarray:
    return np.array(boxes) + [1, 1, 0, 0]


def copy_frames(clip: Clip, folder: Path, digits: int) -> None:
    """The toolkit looks for names that end in .jpg; all readers tell the type by the bytes."""
    folder.mkdir(parents=True)
    for number, file in enumerate(clip.files, 1):
        shutil.copy(file, folder / f"{number:0{digits}}.jpg")


def test_an_experiment_of_otb_gets_the_librarys_boxes(clip: Clip, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    root = tmp_path / "OTB"
    # Folders that are there are not downloaded; without annotation they are left out.
    for name in OTB._OTB__version_dict[2013]:
        (root / name).mkdir(parents=True)
    shutil.rmtree(root / "Coke")
    copy_frames(clip, root / "Coke" / "img", 4)
    shutil.copy(clip.folder / "groundtruth_rect.txt", root / "Coke")
    tracker = BagTracker(seed=SEED)
    assert tracker.is_deterministic
    files = sorted(map(str, (root / "Coke" / "img").iterdir()))
    boxes, times = tracker.track(files, one_based([clip.box])[0])
    assert (boxes == one_based(clip.boxes())).all()
    assert (times > 0).all()
    print(f"got10k: {1000 * times[1:].mean():.2f} ms a frame")

    experiment = ExperimentOTB(root, 2013, tmp_path / "results", tmp_path / "reports")
    experiment.run(tracker)
    results = np.loadtxt(tmp_path / "results/OTB2013/bagtrack/Coke.txt", delimiter=",")
    np.testing.assert_allclose(results, one_based(clip.boxes()), atol=5.1e-4)
    experiment.report(["bagtrack"])
    report = json.loads((tmp_path / "reports/OTB2013/bagtrack/performance.json").read_text())
    assert report["bagtrack"]["overall"]["success_score"] > 0.7


def test_an_experiment_of_got_10k_gets_the_librarys_boxes(clip: Clip, tmp_path: Path) -> None:
    sequence = tmp_path / "GOT-10k/val/GOT-10k_Val_000001"
    copy_frames(clip, sequence, 8)
    (tmp_path / "GOT-10k/val/list.txt").write_text(f"{sequence.name}\n")
    shutil.copy(clip.folder / "groundtruth_rect.txt", sequence / "groundtruth.txt")
    lines = "".join("0\n" for _ in clip.files)
    for name in ("absence", "cut_by_image"):
        (sequence / f"{name}.label").write_text(lines)
    (sequence / "cover.label").write_text(lines.replace("0", "8"))
    (sequence / "meta_info.ini").write_text("[METAINFO]\nurl: none\n")
    experiment = ExperimentGOT10k(
        tmp_path / "GOT-10k", subset="val", result_dir=tmp_path / "results", report_dir=tmp_path / "reports"
    )
    experiment.run(BagTracker(seed=SEED))
    files = list((tmp_path / "results/GOT-10k/bagtrack").glob("*/*_001.txt"))
    results = np.loadtxt(files[0], delimiter=",")
    np.testing.assert_allclose(results, one_based(clip.boxes()), atol=5.1e-4)
