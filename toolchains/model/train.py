"""Trains the network of materials_network.py. Resumable: everything that matters is in OUT/checkpoint.pt."""

import json
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
import torch.nn.functional as F

import materials
from failure import BAD_INPUT, Failure
from materials_network import from_deeplab
from samples import HEIGHT, WIDTH, augmented, open_prepared, whole
from scores import Confusion
from tflite_read import read_tflite
from torch_net import Net

SEED = 20180
# The image's byte b goes in as (b - 127) / 127.5, as the starting weights want it.
MEAN, STD = 127.0, 127.5

# The first convolutions see edges and colours, which rooms and their renderings share with the starting weights'
# pictures: without gradients there a step costs 40 % less. Operators up to stride 8 (expanded features included).
FROZEN_BACKBONE_OPS = 22

# Relative to the base rate: new layers fast, what has seen indoor scenes slowly.
RATES = {"scores": 5.0, "backbone": 0.4}


def to_tensor(images, device):
    x = torch.from_numpy(np.stack(images)).to(device).permute(0, 3, 1, 2).float()
    return ((x - MEAN) / STD).contiguous(memory_format=torch.channels_last)


def class_weights(prepared):
    """Rare materials count more, but mildly (power 0.35, held to 0.6..3): pixel accuracy counts as well as mean IU."""
    pixels = np.zeros(materials.COUNT)
    for source in prepared:
        share = (source.targets[:-1] * (source.pixels * source.weights[:-1])[:, None]).sum(0)
        pixels += share / share.sum()
    weights = (np.median(pixels[pixels > 0]) / np.maximum(pixels, 1e-6)) ** 0.35
    return np.clip(weights, 0.6, 3.0).astype(np.float32)


def soft_loss(scores, targets, weights, per_class):
    """Cross entropy against soft targets [n, h, w, 23], pixels weighted by `weights` and the classes they hold.

    Half of an ambiguous target is reweighted by what the network already believes (the E step of a mixture): a floor
    that is "wood or carpet" then pulls towards the one that it looks like, and only half to "45 % wood"."""
    log_p = F.log_softmax(F.interpolate(scores, size=targets.shape[1:3], mode="bilinear", align_corners=False), 1)
    log_p = log_p.permute(0, 2, 3, 1)
    believed = targets * log_p.detach().exp()
    believed = believed / believed.sum(-1, keepdim=True).clamp_min(1e-6)
    target = 0.5 * (targets + believed)
    weight = weights * (target * per_class).sum(-1)
    return -(weight * (target * log_p).sum(-1)).sum() / weight.sum().clamp_min(1.0)


class Batches:
    """Endless training samples: sources by their number of pictures, scenes of a source evenly (a rendered room and its
    variants show few things many times), pictures of a scene at random. One thread makes the next batch while the network
    is busy with the last."""

    def __init__(self, prepared, seed, step):
        self.rng = np.random.default_rng([seed, step])
        self.sources = []
        for source in prepared:
            scenes = {}
            for i in source.indices("train"):
                scenes.setdefault(source.pictures[i]["scene"], []).append(i)
            if scenes:
                self.sources.append((source, list(scenes.values())))
        counts = np.array([sum(len(scene) for scene in scenes) for _, scenes in self.sources], np.float64)
        if not counts.size:
            raise Failure(BAD_INPUT, "Nothing that is prepared is for training.")
        self.shares = counts / counts.sum()
        self.worker = ThreadPoolExecutor(1)
        self.coming = None

    def next(self, count):
        if self.coming is None:
            self.coming = self.worker.submit(self._make, count)
        batch, self.coming = self.coming.result(), self.worker.submit(self._make, count)
        return batch

    def _make(self, count):
        images, targets, weights = [], [], []
        for _ in range(count):
            source, scenes = self.sources[self.rng.choice(len(self.sources), p=self.shares)]
            scene = scenes[self.rng.integers(len(scenes))]
            i = scene[self.rng.integers(len(scene))]
            image, label = augmented(np.array(source.images[i]), np.array(source.labels[i]), self.rng)
            rows = source.rows_of(label)
            images.append(image)
            targets.append(source.targets[rows])
            weights.append(source.weights[rows])
        return images, np.stack(targets), np.stack(weights)


def validate(net, prepared, device, every=1):
    """Per source a confusion matrix over its validation pictures, at the label's stride."""
    results = {}
    with torch.no_grad():
        for source in prepared:
            confusion = Confusion()
            for i in source.indices("validation")[::every]:
                image, label = whole(source.images[i], source.labels[i])
                scores = net(to_tensor([image], device))
                best = F.interpolate(scores, size=label.shape, mode="bilinear", align_corners=False).argmax(1)[0]
                confusion.add(source.truth[source.rows_of(label)], best.cpu().numpy())
            results[source.name] = confusion
    return results


class Trainer:
    def __init__(self, options):
        self.options, self.out = options, options.out
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        torch.manual_seed(SEED)
        torch.set_num_threads(options.threads)
        self.prepared = open_prepared(options.prepared)
        graph = from_deeplab(read_tflite(options.start), np.random.default_rng(SEED))
        self.net = Net(graph).to(self.device)
        self.mean = {name: value.detach().clone() for name, value in self.net.state_dict().items()}
        self.per_class = torch.from_numpy(class_weights(self.prepared)).to(self.device)
        backbone = [op.output for op in graph.ops if op.output.startswith("backbone")]
        self.frozen = set(backbone[:FROZEN_BACKBONE_OPS])
        groups = {}
        for name, parameter in self.net.named_parameters():
            op = name.split(".", 1)[1]
            if op in self.frozen:
                parameter.requires_grad_(False)
                continue
            groups.setdefault(next((key for key in RATES if op.startswith(key)), "decoder"), []).append(parameter)
        self.optimizer = torch.optim.AdamW([{"params": parameters, "rate": RATES.get(key, 1.0)}
                                            for key, parameters in groups.items()], lr=1e-3, weight_decay=1e-3)
        self.step, self.seconds = 0, 0.0
        self.out.mkdir(parents=True, exist_ok=True)
        self._resume()

    def _resume(self):
        path = self.out / "checkpoint.pt"
        if not path.exists():
            return
        saved = torch.load(path, map_location=self.device)
        if saved["shapes"] != self._shapes():
            raise Failure(BAD_INPUT, f"{path}: belongs to another network; give another --out.")
        self.net.load_state_dict(saved["net"])
        self.mean = saved["mean"]
        self.optimizer.load_state_dict(saved["optimizer"])
        self.step, self.seconds = saved["step"], saved["seconds"]

    def _shapes(self):
        return {name: tuple(value.shape) for name, value in self.net.state_dict().items()}

    def save(self):
        temporary = self.out / "checkpoint.tmp"
        torch.save({"net": self.net.state_dict(), "mean": self.mean, "optimizer": self.optimizer.state_dict(),
                    "step": self.step, "seconds": self.seconds, "shapes": self._shapes(), "seed": SEED}, temporary)
        temporary.rename(self.out / "checkpoint.pt")

    def rate(self):
        """Warm-up over 100 steps, then half a cosine down to a fiftieth at the last step."""
        done = min(self.step / self.options.steps, 1.0)
        return self.options.rate * min(1.0, (self.step + 1) / 100) * (0.02 + 0.98 * 0.5 * (1 + np.cos(np.pi * done)))

    def averaged(self):
        """The network with the running mean of its weights."""
        net = Net(self.net.graph).to(self.device)
        net.load_state_dict(self.mean)
        return net

    def run(self):
        batches = Batches(self.prepared, SEED, self.step)
        loss_mean, started = None, time.monotonic()
        while self.step < self.options.steps:
            rate = self.rate()
            for group in self.optimizer.param_groups:
                group["lr"] = rate * group["rate"]
            images, targets, weights = batches.next(self.options.batch)
            # While the new layer is still noise, its gradients would only spoil the rest.
            frozen = self.frozen if self.step >= self.options.head_steps else {op.output for op in self.net.graph.ops} - {"scores"}
            scores = self.net(to_tensor(images, self.device), frozen)
            loss = soft_loss(scores, torch.from_numpy(targets).to(self.device), torch.from_numpy(weights).to(self.device),
                             self.per_class)
            self.optimizer.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.net.parameters(), 5.0)
            self.optimizer.step()
            keep = min(0.998, (1 + self.step) / (10 + self.step))
            with torch.no_grad():
                for name, value in self.net.state_dict().items():
                    self.mean[name].lerp_(value, 1 - keep)
            self.step += 1
            loss_mean = loss.item() if loss_mean is None else 0.98 * loss_mean + 0.02 * loss.item()
            if self.step % 50 == 0:
                now = time.monotonic()
                self.seconds += now - started
                started = now
                print(f"step {self.step}/{self.options.steps}  loss {loss_mean:.3f}  rate {rate:.2e}  "
                      f"{self.seconds / 60:.1f} min", flush=True)
            if self.step % self.options.check_every == 0 or self.step == self.options.steps:
                self.save()
                self.report()
                started = time.monotonic()

    def report(self):
        line = {"step": self.step, "minutes": round(self.seconds / 60, 1)}
        for name, confusion in validate(self.averaged(), self.prepared, self.device).items():
            if confusion.total():
                line[name] = confusion.metrics()
        with open(self.out / "log.jsonl", "a") as log:
            log.write(json.dumps(line) + "\n")
        print("  validation: " + "; ".join(
            f"{name} pixel accuracy {m['pixel_accuracy']:.3f} mean IU {m['mean_iu']:.3f}"
            for name, m in line.items() if isinstance(m, dict)), flush=True)


def load_averaged(run, start, device):
    """(the network with the running mean of a run's weights, steps that it was trained)."""
    path = run / "checkpoint.pt"
    if not path.exists():
        raise Failure(BAD_INPUT, f"{path}: is not there; run `train` first.")
    saved = torch.load(path, map_location=device)
    net = Net(from_deeplab(read_tflite(start), np.random.default_rng(SEED))).to(device)
    net.load_state_dict(saved["mean"])
    return net.eval(), saved["step"]
