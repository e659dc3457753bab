"""Training pictures as the network sees them: zoomed, flipped, lit by other lamps and taken by worse cameras."""

import json

import numpy as np
from PIL import Image, ImageFilter

from failure import BAD_INPUT, Failure
from materials import UNKNOWN

# The program stretches every colour image to the network's input, so training does too.
WIDTH, HEIGHT = 480, 272
# Training looks at parts of that size's picture: two thirds of the work a step, and more variety.
PART_WIDTH, PART_HEIGHT = 384, 224
# Labels are compared at a quarter of the input's size: the scores come at an eighth, and a full-size softmax over 23
# classes would cost as much time as the network.
LABEL_STRIDE = 4


class Prepared:
    """One source in the form that `prepare` writes."""

    def __init__(self, folder, name):
        description = json.loads((folder / f"{name}.json").read_text())
        self.name = name
        self.images = np.load(folder / f"{name}.images.npy", mmap_mode="r")
        self.labels = np.load(folder / f"{name}.labels.npy", mmap_mode="r")
        # One more row, of weight 0, for unlabelled pixels.
        self.targets = np.vstack([np.array(description["targets"], np.float32), np.zeros((1, 23), np.float32)])
        self.weights = np.append(np.array(description["weights"], np.float32), 0).astype(np.float32)
        self.truth = np.append(np.array(description["truth"], np.uint8), UNKNOWN).astype(np.uint8)
        self.pixels = np.array(description["pixels"], np.float64)
        self.pictures = description["pictures"]

    def indices(self, part):
        return [i for i, picture in enumerate(self.pictures) if picture["part"] == part]

    def rows_of(self, label):
        """Labels as rows of `targets`; unlabelled pixels get the last one."""
        return np.where(label == UNKNOWN, len(self.weights) - 1, label)


def open_prepared(folder):
    names = sorted(p.stem for p in folder.glob("*.json"))
    if not names:
        raise Failure(BAD_INPUT, f"{folder}: holds nothing prepared; run `prepare` first.")
    return [Prepared(folder, name) for name in names]


def whole(image, label, width=WIDTH, height=HEIGHT):
    """The picture as the program would show it to the network."""
    image = np.asarray(Image.fromarray(image).resize((width, height), Image.BILINEAR))
    label = np.asarray(Image.fromarray(label).resize((width // LABEL_STRIDE, height // LABEL_STRIDE), Image.NEAREST))
    return image, label




def augmented(image, label, rng):
    """A random part of a picture, as large as the network would see it (give or take a zoom), with its label at a
    quarter of the size."""
    height, width = label.shape
    zoom = np.exp(rng.uniform(np.log(0.75), np.log(1.8)))
    aspect = np.exp(rng.normal(0, 0.12))
    w = width * PART_WIDTH / WIDTH / (zoom * np.sqrt(aspect))
    h = height * PART_HEIGHT / HEIGHT / (zoom / np.sqrt(aspect))
    if w > width or h > height:  # zoomed out: a canvas of unlabelled grey around the picture
        canvas_w, canvas_h = max(int(np.ceil(w)), width), max(int(np.ceil(h)), height)
        x, y = rng.integers(0, canvas_w - width + 1), rng.integers(0, canvas_h - height + 1)
        big = np.full((canvas_h, canvas_w, 3), 127, np.uint8)
        big[y:y + height, x:x + width] = image
        big_label = np.full((canvas_h, canvas_w), UNKNOWN, np.uint8)
        big_label[y:y + height, x:x + width] = label
        image, label, width, height = big, big_label, canvas_w, canvas_h
        w, h = min(w, width), min(h, height)
    x, y = rng.uniform(0, width - w), rng.uniform(0, height - h)
    box = (x, y, x + w, y + h)
    picture = Image.fromarray(image).resize((PART_WIDTH, PART_HEIGHT), Image.BILINEAR, box=box)
    label = Image.fromarray(label)
    label = label.resize((PART_WIDTH // LABEL_STRIDE, PART_HEIGHT // LABEL_STRIDE), Image.NEAREST, box=box)
    if rng.random() < 0.5:
        picture, label = picture.transpose(Image.FLIP_LEFT_RIGHT), label.transpose(Image.FLIP_LEFT_RIGHT)
    return _recolour(picture, rng), np.asarray(label)


def _recolour(picture, rng):
    """Exposure, white balance, gamma, contrast, saturation; then blur and noise, as a cheap sensor adds them."""
    if rng.random() < 0.3:
        picture = picture.filter(ImageFilter.GaussianBlur(rng.uniform(0.3, 1.8)))
    gamma = np.exp(rng.normal(0, 0.25))
    gains = np.exp(rng.normal(0, 0.2) + rng.normal(0, 0.12, 3))
    contrast, pivot = np.exp(rng.normal(0, 0.15)), rng.uniform(0.3, 0.7)
    curve = (np.arange(256, dtype=np.float32) / 255) ** gamma
    tables = np.stack([np.clip((curve * gain - pivot) * contrast + pivot, 0, 1) * 255 for gain in gains]).astype(np.float32)
    pixels = np.asarray(picture)
    real = np.stack([tables[c][pixels[..., c]] for c in range(3)], -1)
    saturation = 0.0 if rng.random() < 0.04 else np.exp(rng.normal(0, 0.25))
    grey = real.mean(-1, keepdims=True)
    real = grey + (real - grey) * np.float32(saturation)
    if rng.random() < 0.5:
        real += rng.standard_normal(real.shape, np.float32) * np.float32(rng.uniform(1, 9))
    return np.clip(real, 0, 255).astype(np.uint8)
