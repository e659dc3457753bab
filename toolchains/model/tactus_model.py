#!/usr/bin/python3
"""Trains, quantises and exports the material network. See README.md in this folder."""

import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from failure import BAD_USAGE, Failure  # noqa: E402


def size(text):
    try:
        width, height = (int(n) for n in text.split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT") from None
    if width < 16 or height < 16 or width % 16 or height % 16:
        raise argparse.ArgumentTypeError(f"{text}: both sides must be multiples of 16")
    return width, height


def run_prepare(options):
    import sources
    from prepare import prepare

    found = []
    data = options.data
    if data is not None and not data.is_dir():
        raise Failure(3, f"{data}: there is no such folder.")
    if data is not None and (data / "nyuv2").is_dir():
        found.append(sources.nyuv2(data / "nyuv2", sources.TRAIN))
    if data is not None and (data / "rooms_rendered").is_dir():
        found.append(sources.rendered_rooms(data / "rooms_rendered", options.hold_out))
    if data is not None and (data / "minc").is_dir():
        found.append(sources.minc(data / "minc"))
    found += [sources.recording(folder) for folder in options.recording]
    if not found:
        raise Failure(3, f"{data}: holds none of nyuv2/, rooms_rendered/, minc/, and no --recording is given.")
    print("\n".join(prepare(found, options.out)))


def run_train(options):
    from train import Trainer

    Trainer(options).run()


def run_quantise(options):
    from quantise import quantise

    quantise(options)


def run_export(options):
    from export import export
    from quantise import load_quantised

    graph, report = load_quantised(options.run)
    ece = [sum(report[key]) / len(report[key]) for key in ("ece_before", "ece_after")]
    size_bytes, multiply_adds = export(graph, options.size, options.out, report["temperature"], ece, options.float)
    print(f"{options.out}: {size_bytes} bytes, {multiply_adds / 1e9:.2f} x 10^9 multiply-adds at "
          f"{options.size[0]}x{options.size[1]}")


def run_evaluate(options):
    import json

    from evaluate import evaluate, per_class, table

    results = evaluate(options)
    print(table(results) + "\n\n" + per_class(results))
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="tactus_model.py", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    path = pathlib.Path

    prepare = commands.add_parser("prepare", help="read and check labelled pictures, once")
    prepare.add_argument("--data", type=path, help="folder with any of nyuv2/, rooms_rendered/, minc/")
    prepare.add_argument("--recording", type=path, action="append", default=[], help="TUM layout with label/; may be repeated")
    prepare.add_argument("--hold-out", action="append", default=[], metavar="SCENE",
                         help="rendered scene for validation, with its variants; may be repeated (default living-room)")
    prepare.add_argument("--out", type=path, required=True)
    prepare.set_defaults(execute=run_prepare)

    train = commands.add_parser("train", help="train from a public network's weights; resumes what --out holds")
    train.add_argument("--prepared", type=path, required=True)
    train.add_argument("--start", type=path, required=True, help="DeepLabV3+ MobileNetV2 as .tflite (ADE20K)")
    train.add_argument("--out", type=path, required=True)
    train.add_argument("--steps", type=int, default=4000)
    train.add_argument("--head-steps", type=int, default=150, help="first steps that train the last layer alone")
    train.add_argument("--batch", type=int, default=4)
    train.add_argument("--rate", type=float, default=6e-4)
    train.add_argument("--check-every", type=int, default=500, help="steps between checkpoints with validation")
    train.add_argument("--threads", type=int, default=1)
    train.set_defaults(execute=run_train)

    quantise = commands.add_parser("quantise", help="choose int8 scales and the temperature")
    quantise.add_argument("--run", type=path, required=True, help="what train wrote")
    quantise.add_argument("--prepared", type=path, required=True)
    quantise.add_argument("--start", type=path, required=True, help="as for train")
    quantise.add_argument("--pictures", type=int, default=48, help="training pictures to look at")
    quantise.add_argument("--every", type=int, default=1, help="take every Nth validation picture")
    quantise.add_argument("--threads", type=int, default=1)
    quantise.set_defaults(execute=run_quantise)

    export = commands.add_parser("export", help="write the .tflite file and its class map")
    export.add_argument("--run", type=path, required=True, help="what quantise wrote")
    export.add_argument("--size", type=size, default=(480, 272), metavar="WIDTHxHEIGHT")
    export.add_argument("--out", type=path, required=True, metavar="FILE.tflite")
    export.add_argument("--float", action="store_true", help="float32 instead of int8, to compare")
    export.set_defaults(execute=run_export)

    evaluate = commands.add_parser("evaluate", help="score a .tflite file through the program's own int8 path")
    evaluate.add_argument("--model", default="builtin", metavar="FILE.tflite|builtin")
    evaluate.add_argument("--map", default="builtin", metavar="FILE.toml|builtin")
    evaluate.add_argument("--data", type=path, required=True)
    evaluate.add_argument("--set", action="append", choices=["bedroom_rendered", "nyuv2", "hand_labels", "rooms_rendered"],
                          help="may be repeated (default all)")
    evaluate.add_argument("--hold-out", action="append", default=[], metavar="SCENE")
    evaluate.add_argument("--tool", type=path, required=True, help="the built tests/bench/network_accuracy")
    evaluate.add_argument("--predictions", type=path, metavar="DIR")
    evaluate.add_argument("--json", type=path)
    evaluate.set_defaults(execute=run_evaluate)

    options = parser.parse_args(arguments)
    if hasattr(options, "hold_out") and not options.hold_out:
        options.hold_out = ["living-room"]
    try:
        options.execute(options)
    except Failure as failure:
        print(failure, file=sys.stderr)
        return failure.code
    return 0


if __name__ == "__main__":
    sys.exit(main())
