"""Where labelled pictures come from. Each source is a list of Picture: two files and what they are for."""

import hashlib
import pathlib
from dataclasses import dataclass

import numpy as np
from PIL import Image

import materials
from class_table import NYU40_FILE, ClassTable, exact_table, read_class_table
from failure import BAD_INPUT, Failure

TRAIN, VALIDATION, TEST = "train", "validation", "test"


@dataclass(frozen=True)
class Picture:
    image: pathlib.Path
    label: pathlib.Path
    scene: str
    part: str


@dataclass
class Source:
    name: str
    table: ClassTable
    pictures: list


def share_of(identifier):
    """A number in [0, 1) that depends on the identifier alone: the same split on every machine, whatever is added."""
    return int.from_bytes(hashlib.sha256(identifier.encode()).digest()[:8], "big") / 2**64


def _folder(path, what):
    if not path.is_dir():
        raise Failure(BAD_INPUT, f"{path}: there is no such folder; {what}.")
    return path


def nyuv2(folder, part):
    """`part` train: the 795 training pictures, of which a tenth (by hash) is for validation; test: the other 654.

    The two are never read together, so that no command can train on the test split by mistake."""
    import scipy.io

    for sub in ("rgb", "label40"):
        _folder(folder / sub, "NYUv2 is expected as rgb/NNNN.jpg, label40/NNNN.png and splits.mat")
    try:
        splits = scipy.io.loadmat(folder / "splits.mat")
        numbers = splits["trainNdxs" if part == TRAIN else "testNdxs"].ravel()
    except (OSError, KeyError, ValueError) as error:
        raise Failure(BAD_INPUT, f"{folder / 'splits.mat'}: cannot be read as the split of NYUv2 ({error})") from None
    pictures = []
    for number in numbers:
        name = f"{int(number) - 1:04d}"  # the split counts from 1, the files from 0
        to = part if part == TEST else VALIDATION if share_of(f"nyuv2/{name}") < 0.1 else TRAIN
        pictures.append(Picture(folder / "rgb" / f"{name}.jpg", folder / "label40" / f"{name}.png", "nyuv2", to))
    return Source("nyuv2", read_class_table(NYU40_FILE), pictures)


def rendered_rooms(folder, validation_scenes):
    """SCENE/rgb + SCENE/label. Split by scene: SCENE_v1 is SCENE with other materials, so it goes where SCENE goes."""
    scenes = sorted(p for p in _folder(folder, "rendered rooms are expected as SCENE/rgb and SCENE/label").iterdir()
                    if (p / "label").is_dir())
    names = {p.name.split("_v")[0] for p in scenes}
    for scene in validation_scenes:
        if scene not in names:
            raise Failure(BAD_INPUT, f"{folder}: has no scene '{scene}' to hold out; it has {', '.join(sorted(names))}.")
    pictures = []
    for scene in scenes:
        to = VALIDATION if scene.name.split("_v")[0] in validation_scenes else TRAIN
        for label in sorted((scene / "label").glob("*.png")):
            image = next((scene / "rgb" / f"{label.stem}{end}" for end in (".jpg", ".png")
                          if (scene / "rgb" / f"{label.stem}{end}").exists()), None)
            if image is None:
                raise Failure(BAD_INPUT, f"{label}: has no picture of its name in {scene / 'rgb'}")
            pictures.append(Picture(image, label, scene.name, to))
    return Source("rooms_rendered", exact_table(), pictures)


def recording(folder, every=12):
    """A recording in the TUM layout with label/, every 12th frame (neighbours show the same)."""
    for sub in ("rgb", "label"):
        _folder(folder / sub, "a recording needs rgb/ and label/ (`tactus convert synthetic:NAME DIR` writes both)")
    images = {p.stem: p for p in (folder / "rgb").iterdir()}
    pictures = [Picture(images[p.stem], p, folder.name, TRAIN)
                for p in sorted((folder / "label").glob("*.png"))[::every] if p.stem in images]
    if not pictures:
        raise Failure(BAD_INPUT, f"{folder}: no label has a picture of its name.")
    return Source(f"recording_{folder.name}", exact_table(), pictures)


def minc(folder):
    """images/ID.jpg + segments/ID.png (material ids, 255 unlabelled): 80 % train, 20 % validation by hash of the id, as
    the paper splits its 7061 pictures."""
    for sub in ("images", "segments"):
        _folder(folder / sub, "MINC is expected as images/ID.jpg and segments/ID.png")
    pictures = []
    for label in sorted((folder / "segments").glob("*.png")):
        pictures.append(Picture(folder / "images" / f"{label.stem}.jpg", label, "minc", minc_part(label.stem)))
    return Source("minc", exact_table(), pictures)


def minc_part(identifier):
    return VALIDATION if share_of(f"minc/{identifier}") < 0.2 else TRAIN


def read_picture(picture, table):
    """(rgb [h, w, 3], label [h, w]): both uint8, of one size, every label a row of the table or UNKNOWN."""
    arrays = []
    for path, mode in ((picture.image, "RGB"), (picture.label, "L")):
        try:
            arrays.append(np.asarray(Image.open(path).convert(mode)))
        except OSError as error:
            raise Failure(BAD_INPUT, f"{path}: cannot be read as a picture ({error})") from None
    image, label = arrays
    if image.shape[:2] != label.shape:
        raise Failure(BAD_INPUT, f"{picture.label}: is {label.shape[1]}x{label.shape[0]}, but its picture is "
                                 f"{image.shape[1]}x{image.shape[0]}.")
    known = label[label != materials.UNKNOWN]
    if known.size and known.max() >= len(table.names):
        raise Failure(BAD_INPUT, f"{picture.label}: holds class {known.max()}, but there are {len(table.names)} classes.")
    return image, label
