"""The 23 MINC classes, ids as in pipeline/label/material.hpp (a test compares the two)."""

NAMES = ("brick", "carpet", "ceramic", "fabric", "foliage", "food", "glass", "hair", "leather", "metal", "mirror", "other",
         "painted", "paper", "plastic", "polishedstone", "skin", "sky", "stone", "tile", "wallpaper", "water", "wood")
COUNT = len(NAMES)
UNKNOWN = 255
ID = {name: i for i, name in enumerate(NAMES)}
