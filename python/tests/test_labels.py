"""Masks, boxes, and the records of COCO and YOLO."""

import contextlib
import io
import json

import numpy as np
import pytest

import bansho
from bansho import labels


@pytest.fixture(scope="module")
def frames() -> dict[str, bansho.Frame]:
    """Frames that are really drawn, by what is in them."""
    picture = bansho.Picture(size=(96, 64), exposure_ev100=12.0)
    smoking = bansho.FlameSheet(name="torch", smoke={"optical_depth": 1.0})
    scenes = {
        "fire": bansho.Scene([bansho.Picture(size=(96, 64)), smoking, bansho.Rain(rate_mm_per_h=50)]),
        "rain": bansho.Scene([picture, bansho.Sky(), bansho.Rain(rate_mm_per_h=50, opacity_gain=8.0), bansho.Camera(position=(0, 1.5, 4))]),
        "aurora": bansho.datasets.AllSkyAurora(2, size=64, seed=1, particles=2000).scene(0),
    }
    return {name: bansho.open(scene, aovs=True, layers=True).render(0) for name, scene in scenes.items()}


@pytest.fixture(scope="module")
def masks(frames) -> dict[str, dict[str, np.ndarray]]:
    """Masks by picture and category."""
    return {
        "fire.png": {category: labels.mask(frames["fire"], category) for category in ("fire", "smoke")},
        "rain.png": {"rain": labels.mask(frames["rain"], "rain", 0.1)},
        "aurora.png": {"aurora": labels.mask(frames["aurora"], "aurora")},
    }


def test_parts_of_a_mask_are_boxes():
    mask = np.zeros((6, 8), bool)
    mask[0, 0] = mask[1, 1] = mask[2, 0] = True
    mask[3:6, 4:7] = True
    mask[4, 5] = False
    assert labels.boxes(mask) == [labels.Box(4, 3, 3, 3, 8), labels.Box(0, 0, 2, 3, 3)]
    assert labels.boxes(mask, min_area=4) == [labels.Box(4, 3, 3, 3, 8)]
    assert labels.yolo({"rain": mask}, min_area=4) == "2 0.687500 0.750000 0.375000 0.500000\n"
    record = labels.coco([("a.png", {"fire": mask})])
    assert json.loads(json.dumps(record)) == record
    decoded = np.zeros(mask.size, bool)
    for annotation in record["annotations"]:
        ends = np.cumsum(annotation["segmentation"]["counts"])
        part = np.zeros(mask.size, bool)
        for start, end in zip(ends[::2], ends[1::2], strict=False):
            part[start:end] = True
        assert part.sum() == annotation["area"]
        decoded |= part
    assert np.array_equal(decoded.reshape(mask.shape, order="F"), mask)
    with pytest.raises(ValueError, match="masks of 'b.png': none; allowed: one or more"):
        labels.coco([("b.png", {})])


def test_every_part_is_found_whatever_its_form():
    random = np.random.default_rng(0)
    for _ in range(20):
        mask = random.random((23, 31)) < 0.4
        todo = {(int(y), int(x)) for y, x in zip(*np.nonzero(mask), strict=True)}
        areas = []
        while todo:
            stack, area = [todo.pop()], 0
            while stack:
                y, x = stack.pop()
                area += 1
                near = {(y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)} & todo
                todo -= near
                stack.extend(near)
            areas.append(area)
        assert sorted(areas, reverse=True) == [box.area for box in labels.boxes(mask)]


def test_masks_are_what_the_thresholds_say(frames):
    aovs = {name: {aov: np.asarray(values) for aov, values in frame.aovs.items()} for name, frame in frames.items()}
    fire, smoke = labels.mask(frames["fire"], "fire"), labels.mask(frames["fire"], "smoke")
    hot, dense = aovs["fire"]["torch.temperature_k"] >= 800, aovs["fire"]["torch.optical_depth"] >= 0.1
    assert fire.any() and np.array_equal(fire, hot)
    assert smoke.any() and np.array_equal(smoke, dense & ~hot) and (dense & hot).any()
    rows = [np.nonzero(mask)[0].mean() for mask in (smoke, fire)]
    assert rows[0] < rows[1], "smoke rises above the flame"
    assert labels.mask(frames["fire"], "smoke", 0.3).sum() < smoke.sum()
    assert np.array_equal(labels.mask(frames["rain"], "rain", 0.1), aovs["rain"]["rain.streak_opacity"] >= 0.1)
    assert labels.mask(frames["rain"], "rain", 0.001).sum() > labels.mask(frames["rain"], "rain", 0.1).sum() > 0
    assert np.array_equal(labels.mask(frames["aurora"], "aurora"), aovs["aurora"]["aurora.kilorayleigh_557"] >= 1.0)


def test_luminance_is_that_of_layers_against_the_rest(frames):
    for name, phenomenon in (("rain", "rain"), ("aurora", "aurora"), ("fire", "torch")):
        frame = frames[name]
        # The layers add up to the picture, so that the rest is the sum of the others.
        others = [layer for key, layer in frame.layers.items() if key != phenomenon]
        weights = [0.2722287, 0.6740818, 0.0536895]
        added, rest = (np.sum(layers, axis=0)[..., :3] @ weights for layers in ([frame.layers[phenomenon]], others))
        for ratio in (0.02, 0.5):
            clear = abs(added - ratio * rest) > 1e-3 * ratio * rest + 1e-6
            expected = added >= ratio * rest
            assert np.array_equal(labels.mask(frame, name, ratio, by="luminance")[clear], expected[clear]), (name, ratio)
    seen = [labels.mask(frames["aurora"], "aurora", ratio, by="luminance").sum() for ratio in (0.02, 0.5, 2.0)]
    assert seen[0] > seen[1] > seen[2] > 0
    assert np.array_equal(labels.luminance_mask(frames["aurora"], "aurora"), labels.mask(frames["aurora"], "aurora", by="luminance"))


def test_what_is_missing_or_wrong_is_told(frames):
    frame = frames["fire"]
    for call, message in [
        (lambda: labels.mask(frame, "snow"), "category: 'snow'; allowed: 'fire'"),
        (lambda: labels.mask(frame, "aurora"), "no AOV of aurora; allowed: .*aovs=True"),
        (lambda: labels.mask(frame, "aurora", by="luminance"), "the frame has no aurora; allowed: a frame of a scene with it"),
        (lambda: labels.mask(frame, "smoke", by="luminance"), "smoke, which is in the layer of its fire; allowed: 'fire', 'rain', 'aurora'"),
        (lambda: labels.mask(frame, "rain", by="eye"), "by: 'eye'; allowed: 'measure', 'luminance'"),
        (lambda: labels.mask(frame, "rain", "much"), "threshold: 'much'; allowed: a number"),
        (lambda: labels.luminance_mask(frame, "rain", -1), "ratio: -1; allowed: a number above 0"),
        (lambda: labels.luminance_mask(frame, []), "layers: none; allowed: one or more names"),
    ]:
        with pytest.raises(ValueError, match=message):
            call()
    with pytest.raises(KeyError, match="no layer 'snow'; allowed: torch, rain"):
        labels.luminance_mask(frame, "snow")


def test_yolo_has_the_boxes_of_drawn_frames(masks):
    names = ("fire", "smoke", "rain", "aurora")
    for by_category in masks.values():
        lines = labels.yolo(by_category).splitlines()
        assert len(lines) == sum(len(labels.boxes(mask)) for mask in by_category.values()) > 0
        for category, mask in by_category.items():
            height, width = mask.shape
            covered = np.zeros_like(mask)
            for line in lines:
                index, x, y, box_width, box_height = line.split()
                if names[int(index)] != category:
                    continue
                left, right = ((float(x) + sign * 0.5 * float(box_width)) * width for sign in (-1, 1))
                top, bottom = ((float(y) + sign * 0.5 * float(box_height)) * height for sign in (-1, 1))
                assert [left, right, top, bottom] == pytest.approx([round(edge) for edge in (left, right, top, bottom)], abs=1e-3), "at edges of pixels"
                inside = mask[round(top) : round(bottom), round(left) : round(right)]
                # A box touches its part on all sides.
                assert inside[0].any() and inside[-1].any() and inside[:, 0].any() and inside[:, -1].any()
                covered[round(top) : round(bottom), round(left) : round(right)] = True
            assert covered[mask].all(), category


# Its compiled part has the __array__ of numpy 1.
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_pycocotools_reads_the_masks_of_drawn_frames(masks, tmp_path):
    coco = pytest.importorskip("pycocotools.coco")
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(labels.coco(masks.items())))
    with contextlib.redirect_stdout(io.StringIO()):
        data = coco.COCO(str(path))
    # Trainers skip annotations of crowds.
    assert data.getAnnIds(iscrowd=True) == [] and len(data.getAnnIds(iscrowd=False)) >= 5
    for image in data.loadImgs(data.getImgIds()):
        by_category = masks[image["file_name"]]
        assert (image["height"], image["width"]) == next(iter(by_category.values())).shape
        for category, mask in by_category.items():
            annotations = data.loadAnns(data.getAnnIds(imgIds=[image["id"]], catIds=data.getCatIds(catNms=[category])))
            decoded = np.zeros(mask.shape, int)
            for annotation in annotations:
                part = data.annToMask(annotation)
                rows, columns = np.nonzero(part)
                box = [columns.min(), rows.min(), columns.max() - columns.min() + 1, rows.max() - rows.min() + 1]
                assert annotation["bbox"] == box and annotation["area"] == part.sum()
                decoded += part
            assert np.array_equal(decoded, mask), category


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_detector_is_evaluated_with_the_labels(masks, tmp_path):
    """Detections that are the labels have a precision of 1; crowds would not count."""
    coco = pytest.importorskip("pycocotools.coco")
    evaluation = pytest.importorskip("pycocotools.cocoeval")
    record = labels.coco(masks.items(), min_area=20)
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(record))
    with contextlib.redirect_stdout(io.StringIO()):
        data = coco.COCO(str(path))
        detections = [{key: entry[key] for key in ("image_id", "category_id", "bbox")} | {"score": 0.9} for entry in record["annotations"]]
        evaluated = evaluation.COCOeval(data, data.loadRes(detections), "bbox")
        evaluated.evaluate()
        evaluated.accumulate()
        evaluated.summarize()
    assert evaluated.stats[0] == pytest.approx(1.0)
