"""From trained weights to int8: scales, then (with --steps) a short training with the rounding in it, then the
temperature. Result: OUT/quantised.pt."""

import json

import torch

import temperature
from calibrate import choose_ranges
from failure import BAD_INPUT, Failure
from samples import open_prepared
from train import load_averaged, validate


def mean_iu(results):
    return {name: round(confusion.metrics()["mean_iu"], 4) for name, confusion in results.items() if confusion.total()}


def quantise(options):
    torch.set_num_threads(options.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    prepared = open_prepared(options.prepared)
    net, step = load_averaged(options.run, options.start, device)
    real = validate(net, prepared, device, options.every)
    ranges = choose_ranges(net, prepared, device, options.pictures)
    net.ranges = ranges
    int8 = validate(net, prepared, device, options.every)
    sets = [temperature.scores_and_truth(net, source, device, options.every) for source in prepared
            if source.indices("validation")]
    if not sets:
        raise Failure(BAD_INPUT, f"{options.prepared}: holds no validation pictures to fit the temperature on.")
    fitted = temperature.fit(sets)
    ece = [[temperature.expected_calibration_error(*one, at) for one in sets] for at in (1.0, fitted)]
    report = {"steps": step, "mean_iu_float": mean_iu(real), "mean_iu_int8_simulated": mean_iu(int8),
              "temperature": fitted, "sources": [s.name for s in prepared if s.indices("validation")],
              "ece_before": ece[0], "ece_after": ece[1]}
    torch.save({"graph": net.to_graph(), "report": report}, options.run / "quantised.pt")
    print(json.dumps(report, indent=1))


def load_quantised(run):
    path = run / "quantised.pt"
    if not path.exists():
        raise Failure(BAD_INPUT, f"{path}: is not there; run `quantise` first.")
    saved = torch.load(path)
    return saved["graph"], saved["report"]


