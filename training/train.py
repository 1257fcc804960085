#!/usr/bin/env python3
"""Trains the people network on frames of `ygslam simulate --random`, from nothing or from a checkpoint.

    training/train.py --frames DIR [DIR ...] --validation DIR --out DIR [--samples N] [--start ONNX]

--start takes over the weights of an ONNX file that export.py wrote, as far as the network has them.
Writes OUT/checkpoint.pt every ten minutes, at the end and when told to stop (SIGINT, SIGTERM), and a
line of OUT/log.jsonl every --log-steps. Called again it goes on from the checkpoint; --samples and the
frames may have grown meanwhile.
"""
import argparse
import json
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional as F

import frames as frames_module
from network import WIDTHS, PeopleNet
from start import take_over

CHECKPOINT_S = 600
EMA = 0.995


class Samples(torch.utils.data.Dataset):
    """Sample i is the same for the same seed and frames, whoever loads it."""

    def __init__(self, frames, seed, coarse):
        self.folders, self.seed, self.coarse = frames, seed, coarse
        self.ends = np.cumsum([len(folder) for folder in frames])

    def __getitem__(self, i):
        rng = np.random.default_rng([self.seed, i])
        which = int(rng.integers(self.ends[-1]))
        folder = int(np.searchsorted(self.ends, which, side="right"))
        return frames_module.sample(self.folders[folder][which - int(self.ends[folder])], rng,
                                    coarse=i < self.coarse)


def loss_of(logits, target):
    """Cross entropy, heavier at outlines, and the overlap (Dice) of each image."""
    near = F.max_pool2d(target, 3, 1, 1) - -F.max_pool2d(-target, 3, 1, 1)
    entropy = F.binary_cross_entropy_with_logits(logits, target, weight=1 + 2 * near)
    p = torch.sigmoid(logits)
    both = (p * target).sum(dim=(1, 2, 3))
    dice = 1 - (2 * both + 20) / (p.sum(dim=(1, 2, 3)) + target.sum(dim=(1, 2, 3)) + 20)
    return 0.8 * entropy + 0.2 * dice.mean()


def rate(samples, total, highest):
    """Warm-up over 2 000 samples at most, level, and down to nothing over the last third."""
    warm_up = min(2000, max(1, total // 10))
    down = min(1.0, max(0.0, (total - samples) / (total / 3)))
    return highest * min(1.0, (samples + 1) / warm_up) * down


@torch.no_grad()
def validate(net, frames):
    """Overlap (IoU) of all people of these frames, as they are."""
    net.eval()
    return frames_module.overlap(lambda x: net(torch.from_numpy(x)).numpy() > 0, frames)


def averaged(net, ema, widths):
    """A network with the averaged weights."""
    copy = PeopleNet(widths)
    copy.load_state_dict(ema if ema else net.state_dict())
    return copy


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=Path, nargs="+", required=True)
    parser.add_argument("--validation", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=250_000)
    parser.add_argument("--coarse", type=int, default=150_000,
                        help="so many of them first, a quarter as large")
    parser.add_argument("--widths", type=int, nargs=4, default=WIDTHS, help="channels at 1/2, 1/4, 1/8, 1/16")
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--start", type=Path, help="ONNX file whose weights are the first ones")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=max(1, (os.cpu_count() or 2) - 1))
    parser.add_argument("--log-steps", type=int, default=400)
    parser.add_argument("--validation-frames", type=int, default=200)
    a = parser.parse_args()
    torch.manual_seed(a.seed)
    torch.set_num_threads(a.threads)
    a.out.mkdir(parents=True, exist_ok=True)
    frames = [frames_module.read_frames(folder) for folder in a.frames]
    held_out = frames_module.read_frames(a.validation)[:a.validation_frames]
    checkpoint = a.out / "checkpoint.pt"
    state = torch.load(checkpoint, weights_only=True) if checkpoint.exists() else None
    widths = tuple(state["widths"] if state else a.widths)
    net, step, ema, seconds = PeopleNet(widths), 0, None, 0.0
    optimiser = torch.optim.AdamW(net.parameters(), lr=a.rate, weight_decay=0.01)
    if state:
        net.load_state_dict(state["net"])
        optimiser.load_state_dict(state["optimiser"])
        step, ema, seconds = state["step"], state["ema"], state["seconds"]
    elif a.start:
        rng = np.random.default_rng(a.seed)
        several = [frames_module.sample(f, rng)[0] for f in frames[0][:200]]
        take_over(net, a.start, torch.from_numpy(np.stack(several)))
    net = net.to(memory_format=torch.channels_last)
    print(f"{sum(map(len, frames))} frames, {sum(p.numel() for p in net.parameters())} weights, "
          f"from step {step}", file=sys.stderr)

    stop = []
    for which in (signal.SIGINT, signal.SIGTERM):
        signal.signal(which, lambda *_: stop.append(1))

    def save():
        partial = checkpoint.with_suffix(".partial")
        torch.save({"net": net.state_dict(), "optimiser": optimiser.state_dict(), "step": step,
                    "ema": ema, "seconds": seconds + time.monotonic() - begin, "seed": a.seed,
                    "frames": sum(map(len, frames)), "widths": list(widths)}, partial)
        os.replace(partial, checkpoint)

    indices = range(step * a.batch, a.samples // a.batch * a.batch)
    samples = Samples(frames, a.seed, a.coarse // a.batch * a.batch)
    loader = torch.utils.data.DataLoader(samples, batch_size=a.batch, sampler=indices, drop_last=True)
    has_bf16 = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)()
    begin = saved = time.monotonic()
    losses = []
    for x, target in loader:
        net.train()
        for group in optimiser.param_groups:
            group["lr"] = rate(step * a.batch, a.samples, a.rate)
        optimiser.zero_grad(set_to_none=True)
        with torch.autocast("cpu", torch.bfloat16, enabled=has_bf16):
            logits = net(x.contiguous(memory_format=torch.channels_last))
        loss = loss_of(logits.float(), target)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
        step += 1
        losses.append(loss.item())
        with torch.no_grad():
            now = net.state_dict()
            keep = min(EMA, step / (step + 50))
            if ema is None:
                ema = {k: v.clone() for k, v in now.items()}
            for k, v in now.items():
                if v.is_floating_point():
                    ema[k].mul_(keep).add_(v, alpha=1 - keep)
        if step % a.log_steps == 0 or stop or step * a.batch == indices.stop:
            line = {"step": step, "samples": step * a.batch, "loss": round(float(np.mean(losses)), 4),
                    "validation_iou": round(validate(averaged(net, ema, widths), held_out), 4),
                    "seconds": round(seconds + time.monotonic() - begin)}
            losses = []
            with open(a.out / "log.jsonl", "a", encoding="utf-8") as log:
                log.write(json.dumps(line) + "\n")
            print(line, file=sys.stderr, flush=True)
        if time.monotonic() - saved > CHECKPOINT_S:
            save()
            saved = time.monotonic()
        if stop:
            break
    save()


if __name__ == "__main__":
    main()
