"""Reads what the command and the page wrote with the readers of those it is for: python read.py FOLDER READER...

FOLDER has the sample's clip, `command` and `part` with the files of `bagtrack track`, `page` and `page-part` with those
of the page. Readers are the packages' names.
"""

import contextlib
import io
import json
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree
import zipfile
from xml.sax.saxutils import quoteattr

SIZE = (320, 240)
NAMES = ['a <thing> & "more"', "Object 2"]
FRAMES = 150
NEAR = 0.011
"""Formats with two places after the point are off by half a hundredth a side."""

Boxes = dict[tuple[int, int], list[float]]
"""What is where: the box (left, top, width, height) of a target in a frame."""


def main(folder: pathlib.Path, readers: list[str]) -> None:
    rows = [json.loads(line) for line in (folder / "command/rows.json").read_text().splitlines()]
    assert len(rows) == 2 * FRAMES and any(row["status"] == "lost" for row in rows)
    assert rows[-2]["target"] == 0 and rows[-2]["status"] != "lost", "it is not found again"
    if not (folder / "pictures").is_dir():
        pictures(folder)
        for mine, other in (("command", "page"), ("part", "page-part")):
            if (folder / other).is_dir():
                same_texts(folder / mine, folder / other)
                print(f"The {other} and the {mine} tell the same.")
    for reader in readers:
        for of in ("command", "page"):
            if (folder / of).is_dir():
                print(f"{reader}, {of}: {READERS[reader](folder / of, folder, rows)}", flush=True)


def pictures(folder: pathlib.Path) -> None:
    """The frames as pictures with the names that both give them."""
    into = folder / "pictures"
    into.mkdir()
    command = ["ffmpeg", "-v", "error", "-i", folder / "clip.mp4", "-vf", "settb=1/30,setpts=N", "-r", "30"]
    subprocess.run([*command, "-start_number", "0", into / "frame_%06d.jpg"], check=True)


def same_texts(mine: pathlib.Path, other: pathlib.Path) -> None:
    """Two folders have the same documents; of numbers the last place may be rounded otherwise."""
    if (other / "yolo.zip").is_file() and not (other / "yolo").is_dir():
        with zipfile.ZipFile(other / "yolo.zip") as archive:
            archive.extractall(other / "yolo")
    names = sorted(path.relative_to(mine) for path in mine.rglob("*") if path.is_file() and path.name != "rows.json")
    others = sorted(path.relative_to(other) for path in other.rglob("*") if path.is_file() and path.suffix != ".zip")
    assert names == others, (names[:5], others[:5])
    for name in names:
        one, two = (plain(path / name) for path in (mine, other))
        assert (difference := differ(one, two)) is None, (mine.name, name, difference)


def plain(path: pathlib.Path) -> object:
    """A document as lists, dictionaries, texts and numbers."""
    text = path.read_text()
    if path.suffix == ".json":
        return json.loads(text)
    if path.suffix == ".xml":
        return tree(xml.etree.ElementTree.fromstring(text))
    if path.suffix == ".txt":
        return [[float(value) for value in line.replace(",", " ").split()] for line in text.splitlines()]
    return text


def tree(element: xml.etree.ElementTree.Element) -> list[object]:
    number = lambda value: float(value) if value.replace(".", "").replace("-", "").isdigit() else value
    attributes = {name: number(value) for name, value in element.attrib.items()}
    return [element.tag, attributes, (element.text or "").strip(), [tree(child) for child in element]]


def differ(one: object, two: object, at: str = "") -> str | None:
    """Where two documents differ."""
    if isinstance(one, (int, float)) and isinstance(two, (int, float)):
        return None if abs(one - two) <= NEAR else f"{at}: {one} {two}"
    if type(one) is not type(two):
        return f"{at}: {one!r} {two!r}"
    if isinstance(one, (dict, list)):
        keys = sorted(one) if isinstance(one, dict) else range(len(one))
        if len(one) != len(two) or (isinstance(one, dict) and sorted(two) != keys):
            return f"{at}: {str(one)[:200]} {str(two)[:200]}"
        found = (differ(one[key], two[key], f"{at}/{key}") for key in keys)
        return next((difference for difference in found if difference), None)
    return None if one == two else f"{at}: {one!r} {two!r}"


def expected(rows: list[dict], *, lost: bool, cut: bool) -> Boxes:
    """The boxes of rows; `lost` also those of lost targets, `cut` only their parts in the frame."""
    boxes = {}
    for row in rows:
        x, y, width, height = (row["box"][side] for side in ("x", "y", "width", "height"))
        if cut:
            right, bottom = min(x + width, SIZE[0]), min(y + height, SIZE[1])
            x, y = max(x, 0), max(y, 0)
            width, height = right - x, bottom - y
        is_seen = row["status"] != "lost" and width > 0 and height > 0
        if lost or is_seen:
            boxes[row["frame"], row["target"]] = [x, y, width, height]
    return boxes


def same(found: Boxes, wanted: Boxes, by: float = NEAR) -> str:
    assert sorted(found) == sorted(wanted), sorted(set(found) ^ set(wanted))[:10]
    worst = max(abs(one - two) for key in wanted for one, two in zip(found[key], wanted[key]))
    assert worst <= by, worst
    return f"{len(found)} boxes, at most {worst:.3f} px off"


def motmetrics(of: pathlib.Path, _: pathlib.Path, rows: list[dict]) -> str:
    import motmetrics as package

    table = package.io.loadtxt(of / "mot.txt", fmt="mot15-2D", min_confidence=-1)
    found = {}
    for (frame, target), row in table.iterrows():
        # It counts pixels from 0, the file from 1.
        found[frame - 1, target - 1] = [row["X"], row["Y"], row["Width"], row["Height"]]
    return same(found, expected(rows, lost=True, cut=False), 0.001)


def trackeval(of: pathlib.Path, folder: pathlib.Path, _: list[dict]) -> str:
    """Against the sample's truth, as one target."""
    import trackeval as package

    place = folder / f"trackeval-{of.name}"
    truth, results = place / "gt/MOT15-train/clip/gt", place / "trackers/MOT15-train/bagtrack/data"
    truth.mkdir(parents=True)
    results.mkdir(parents=True)
    lines = [line.split(",") for line in (folder / "clip/groundtruth_rect.txt").read_text().split()]
    seen = [(at + 1, line) for at, line in enumerate(lines) if float(line[2]) > 0]
    (truth / "gt.txt").write_text("".join(f"{frame},1,{','.join(line)},1,1,1\n" for frame, line in seen))
    first = [line for line in (of / "mot.txt").read_text().splitlines() if line.split(",")[1] == "1"]
    (results / "clip.txt").write_text("\n".join(first) + "\n")
    settings = {"GT_FOLDER": str(place / "gt"), "TRACKERS_FOLDER": str(place / "trackers"), "BENCHMARK": "MOT15"}
    settings |= {"SEQ_INFO": {"clip": len(lines)}, "PRINT_CONFIG": False}
    quiet = {"PRINT_CONFIG": False, "PRINT_RESULTS": False, "TIME_PROGRESS": False, "BREAK_ON_ERROR": True}
    quiet |= {"OUTPUT_SUMMARY": False, "OUTPUT_DETAILED": False, "PLOT_CURVES": False, "OUTPUT_EMPTY_CLASSES": False}
    with contextlib.redirect_stdout(io.StringIO()):
        dataset = package.datasets.MotChallenge2DBox(settings)
        metrics = [package.metrics.HOTA(), package.metrics.CLEAR({"PRINT_CONFIG": False})]
        result, _ = package.Evaluator(quiet).evaluate([dataset], metrics)
    found = result["MotChallenge2DBox"]["bagtrack"]["clip"]["pedestrian"]
    assert found["CLEAR"]["CLR_TP"] >= 0.9 * len(seen) and found["CLEAR"]["IDSW"] == 0, found["CLEAR"]
    return f"{found['CLEAR']['CLR_TP']} of {len(seen)} boxes match, HOTA {found['HOTA']['HOTA'].mean():.3f}"


def pycocotools(of: pathlib.Path, _: pathlib.Path, rows: list[dict]) -> str:
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    with contextlib.redirect_stdout(io.StringIO()):
        dataset = COCO(str(of / "coco.json"))
        results = dataset.loadRes([note | {} for note in dataset.dataset["annotations"]])
        evaluation = COCOeval(dataset, results, "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    assert evaluation.stats[0] > 0.999, evaluation.stats
    assert [category["name"] for category in dataset.loadCats(dataset.getCatIds())] == NAMES
    frame_of = {image["id"]: image["frame_id"] for image in dataset.loadImgs(dataset.getImgIds())}
    assert sorted(frame_of.values()) == list(range(FRAMES))
    notes = dataset.loadAnns(dataset.getAnnIds())
    assert all(note["track_id"] == note["category_id"] for note in notes)
    found = {(frame_of[note["image_id"]], note["category_id"] - 1): note["bbox"] for note in notes}
    return same(found, expected(rows, lost=False, cut=True))


def label_studio_sdk(of: pathlib.Path, _: pathlib.Path, rows: list[dict]) -> str:
    """The SDK says whether the task fits a labelling, and makes boxes of all frames as the export does."""
    from label_studio_sdk._extensions.label_studio_tools.postprocessing.video import extract_key_frames
    from label_studio_sdk.label_interface import LabelInterface

    labels = "".join(f"<Label value={quoteattr(name)}/>" for name in NAMES)
    config = f"""<View><Video name="video" value="$video"/><VideoRectangle name="box" toName="video"/>
    <Labels name="kind" toName="video">{labels}</Labels></View>"""
    [task] = json.loads((of / "label-studio.json").read_text())
    interface = LabelInterface(config)
    for region in task["annotations"][0]["result"]:
        assert interface.validate_region(region), interface.validate_region(region, return_errors=True)
    found = {}
    lost = {(row["frame"], row["target"]) for row in rows if row["status"] == "lost"}
    for target, region in enumerate(extract_key_frames(task["annotations"][0]["result"])):
        assert region["value"]["labels"] == [NAMES[target]] and region["value"]["framesCount"] == FRAMES
        sequence = region["value"]["sequence"]
        for item in sequence:
            scaled = [item[side] * size / 100 for side, size in zip(("x", "y", "width", "height"), SIZE * 2)]
            found[item["frame"] - 1, target] = scaled
        # What Label Studio's editor shows: the last key frame that is enabled, and key frames themselves.
        for frame in range(1, FRAMES + 1):
            before = [item for item in sequence if item["frame"] <= frame]
            is_shown = before[-1]["frame"] == frame or before[-1]["enabled"]
            assert is_shown == ((frame - 1, target) not in lost), (frame, target)
    return same(found, expected(rows, lost=False, cut=False))


def datumaro(of: pathlib.Path, folder: pathlib.Path, rows: list[dict]) -> str:
    from datumaro import Dataset

    def boxes(dataset: Dataset, frame_of: object) -> Boxes:
        found = {}
        for item in dataset:
            for note in item.annotations:
                if not note.attributes.get("outside"):
                    found[frame_of(item), note.label] = list(note.get_bbox())
        return found

    cut = expected(rows, lost=False, cut=True)
    place = folder / f"datumaro-{of.name}"
    (place / "cvat").mkdir(parents=True)
    shutil.copy(of / "cvat.xml", place / "cvat/clip.xml")
    cvat = Dataset.import_from(str(place / "cvat"), "cvat")
    told = [same(boxes(cvat, lambda item: item.attributes["frame"]), expected(rows, lost=False, cut=False))]
    shutil.copytree(of / "yolo", place / "yolo")
    shutil.copytree(folder / "pictures", place / "yolo/images/train")
    yolo = Dataset.import_from(str(place / "yolo"), "yolo")
    told.append(same(boxes(yolo, lambda item: int(item.id.split("_")[-1])), cut))
    for dataset in (cvat, yolo):
        assert [label.name for label in next(iter(dataset.categories().values()))] == NAMES
    return "CVAT " + "; YOLO ".join(told)


READERS = {
    read.__name__: read for read in (motmetrics, trackeval, pycocotools, label_studio_sdk, datumaro)
}

if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2:])
