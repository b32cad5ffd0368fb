"""`bagtrack-labelme`, whose files the real labelme reads, as it reads its own."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

labelme = pytest.importorskip("labelme", reason="the package labelme cannot be had", exc_type=ImportError)

from labelme import LabelFile  # noqa: E402

from bagtrack.adapters import labelme as adapter  # noqa: E402
from conftest import SEED, Clip, run  # noqa: E402


@pytest.fixture
def folder(clip: Clip, tmp_path: Path) -> Path:
    """The clip's images, whose names are not padded."""
    for index, file in enumerate(clip.files):
        shutil.copy(file, tmp_path / f"frame{index}.png")
    return tmp_path


def corners(box: tuple[float, ...]) -> list[list[float]]:
    x, y, width, height = box
    return [[x, y], [x + width, y + height]]


def rectangle(label: str, points: list[list[float]], **more: object) -> dict:
    shape = {"label": label, "points": points, "group_id": None, "description": "", "shape_type": "rectangle"}
    return {**shape, "flags": {"moving": True}, "mask": None, **more}


def annotate(folder: Path, index: int, shapes: list[dict]) -> Path:
    """Writes a file as labelme does."""
    file = folder / f"frame{index}.json"
    size = {"imageHeight": 240, "imageWidth": 320}
    document = {"version": labelme.__version__, "flags": {}, "shapes": shapes, "imageData": None, **size}
    file.write_text(json.dumps({**document, "imagePath": f"frame{index}.png"}))
    return file


def test_a_rectangle_goes_on_through_the_images(clip: Clip, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    point = rectangle("a point", [[3, 4]], shape_type="point")
    file = annotate(folder, 0, [rectangle("card", corners(clip.box)), point])
    adapter.main([str(file), "--seed", str(SEED), "--dry-run"])
    assert not (folder / "frame1.json").exists()
    adapter.main([str(file), "--seed", str(SEED)])
    assert capsys.readouterr().out.splitlines()[-1] == "99 files with new shapes, frame1.json to frame99.json"
    for index, answer in enumerate(clip.expected[1:], start=1):
        read = LabelFile(str(folder / f"frame{index}.json"))
        assert read.image_path == f"frame{index}.png" and read.image_data
        [shape] = read.shapes
        assert (shape["label"], shape["shape_type"], shape["flags"]) == ("card", "rectangle", {"moving": True})
        assert shape["other_data"]["score"] == pytest.approx(answer["score"], abs=1e-4)
        box = answer["box"]
        expected = corners((box["x"], box["y"], box["width"], box["height"]))
        assert sum(shape["points"], []) == pytest.approx(sum(expected, []), abs=0.0051)


def test_it_ends_before_what_somebody_has_drawn(clip: Clip, folder: Path) -> None:
    boxes = clip.boxes()
    other = rectangle("another", [[1, 2], [30, 40]])
    annotate(folder, 4, [other])
    annotate(folder, 6, [rectangle("card", corners(boxes[6]), group_id=7)])
    end = annotate(folder, 8, [rectangle("card", corners(boxes[8]))])
    before = end.read_text()
    changed = adapter.propagate(annotate(folder, 2, [rectangle("card", corners(boxes[2]))]))
    assert [file.name for file in changed] == [f"frame{index}.json" for index in (3, 4, 5, 6, 7)]
    assert end.read_text() == before
    # Other shapes stay, and one of the same label in another group is another object.
    assert [shape["label"] for shape in changed[folder / "frame4.json"]["shapes"]] == ["another", "card"]
    assert [shape["group_id"] for shape in changed[folder / "frame6.json"]["shapes"]] == [7, None]


def test_it_goes_backwards_and_beside_the_images(clip: Clip, folder: Path) -> None:
    notes = folder / "notes"
    notes.mkdir()
    file = annotate(folder, 10, [rectangle("card", corners(clip.boxes()[10])), rectangle("ground", [[5, 5], [45, 45]])])
    document = json.loads(file.read_text())
    (notes / "frame10.json").write_text(json.dumps({**document, "imagePath": "..\\frame10.png"}))
    adapter.main([str(notes / "frame10.json"), "--backwards", "--frames", "4"])
    assert sorted(path.name for path in notes.iterdir()) == sorted(f"frame{index}.json" for index in range(6, 11))
    read = LabelFile(str(notes / "frame6.json"))
    assert read.image_path == "../frame6.png"
    assert [shape["label"] for shape in read.shapes] == ["card", "ground"]
    (left, top), (right, bottom) = read.shapes[0]["points"]
    x, y, width, height = clip.boxes()[6]
    assert abs((left + right) / 2 - x - width / 2) < 5 and abs((top + bottom) / 2 - y - height / 2) < 5


def test_a_lost_target_gets_no_shape(tmp_path: Path) -> None:
    run("sample", "--out", tmp_path / "clip", "--scene", "leaves", "--frames", 90)
    images = tmp_path / "clip" / "img"
    truth = (tmp_path / "clip" / "groundtruth_rect.txt").read_text().split()
    x, y, width, height = (float(value) for value in truth[0].split(","))
    shapes = [rectangle("card", corners((x - 1, y - 1, width, height)))]
    document = {"version": labelme.__version__, "flags": {}, "shapes": shapes, "imageData": None}
    (images / "0001.json").write_text(json.dumps({**document, "imagePath": "0001.jpg"}))
    adapter.main([str(images / "0001.json")])
    gone = [index for index, line in enumerate(truth, start=1) if line.startswith("0,0,0,0")]
    without = [index for index in range(1, 91) if not (images / f"{index:04}.json").exists()]
    assert gone and set(without) & set(gone), (gone, without)
    for index in set(range(1, 91)) - set(without):
        [shape] = LabelFile(str(images / f"{index:04}.json")).shapes
        [(left, top), (right, bottom)] = shape["points"]
        assert 0 <= left < right <= 320 and 0 <= top < bottom <= 240


def test_a_full_disk_leaves_what_somebody_has_drawn(clip: Clip, folder: Path) -> None:
    resource = pytest.importorskip("resource")
    begun = annotate(folder, 0, [rectangle("card", corners(clip.box))])
    drawn = annotate(folder, 1, [rectangle("another", [[1, 2], [30, 40]])])
    before = drawn.read_text()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    # No file gets larger, as on a disk without room.
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(SystemExit, match="bagtrack-labelme: .*frame1.json cannot be written, and is as it was"):
            adapter.main([str(begun), "--frames", "1"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert drawn.read_text() == before
    assert sorted(path.name for path in folder.glob("*.json*")) == ["frame0.json", "frame1.json"]
    adapter.main([str(begun), "--frames", "1"])
    assert [shape["label"] for shape in json.loads(drawn.read_text())["shapes"]] == ["another", "card"]


def test_what_cannot_be_used_is_told(folder: Path) -> None:
    with pytest.raises(SystemExit, match="has no rectangle"):
        adapter.main([str(annotate(folder, 0, []))])
    (folder / "other.json").write_text("{}")
    with pytest.raises(SystemExit, match="is no file of labelme"):
        adapter.main([str(folder / "other.json")])
    (folder / "torn.json").write_text('{"shapes": [')
    with pytest.raises(SystemExit, match="torn.json cannot be read as JSON: Expecting value"):
        adapter.main([str(folder / "torn.json")])
    with pytest.raises(ValueError):
        adapter.propagate(annotate(folder, 0, [rectangle("card", [[400, 400], [500, 500]])]))
