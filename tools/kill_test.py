#!/usr/bin/env python3
"""Kills renders that write checkpoints at random moments, and looks at what is left.

    tools/kill_test.py [--kills 200] [--every 0.2] [--seed 1] [--binary target/release/steradian] [--scene scenes/cornell.json] [OPTION...]

A render is started, killed with SIGKILL after a random time, and started again with --resume, until it ends; then comes the next one, until
that number of kills is reached. Reported are

* lost: kills whose checkpoint was older than one interval (and the time of the start, if there was none in this run);
* wrong: renders whose last state differs in any bit from that of a render that nobody killed (the blocks of the file: every sum, count and
  list of the film), or whose EXR has another pixel;
* unreadable: checkpoints that were refused after a kill;
* left: files on their way to a checkpoint or picture that a killed process left behind.

All four are to be 0 (the last where the file system has files without names). Further OPTIONs go to every render.
"""

import argparse
import json
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time


def state(path):
    """The header of a checkpoint and the bytes of its blocks."""
    data = open(path, "rb").read()
    assert data[:8] == b"STERFILM" and data[-40:-32] == b"STEREND\n", path
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[16 : 16 + length]), data[16 + length : -32]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--every", type=float, default=0.2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=float, default=1.5, help="longest time to a kill in seconds")
    parser.add_argument("--binary", default="target/release/steradian")
    parser.add_argument("--scene", default="scenes/cornell.json")
    arguments, options = parser.parse_known_args()
    chance = random.Random(arguments.seed)
    binary, scene = os.path.abspath(arguments.binary), os.path.abspath(arguments.scene)
    options = options or ["--size", "320x240", "--spp", "64", "--layers", "Z,N,P,albedo,variance,samples"]

    with tempfile.TemporaryDirectory() as folder:
        def render(name, *more):
            line = [binary, "render", scene, "-q", "--checkpoint", f"{name}.state", "-o", f"{name}.exr", *options, *more]
            return subprocess.Popen(line, cwd=folder, stderr=subprocess.PIPE)

        start = time.monotonic()
        assert render("whole").wait() == 0
        whole_seconds = time.monotonic() - start
        whole = state(f"{folder}/whole.state")
        # How long it takes until samples come: a kill before that loses nothing.
        kills = lost = wrong = unreadable = renders = left = 0
        oldest = 0.0
        while kills < arguments.kills:
            for name in ("a.state", "a.exr"):
                if os.path.exists(f"{folder}/{name}"):
                    os.remove(f"{folder}/{name}")
            renders += 1
            while True:
                began = time.time()
                process = render("a", "--resume", "--every", str(arguments.every))
                try:
                    code = process.wait(timeout=chance.uniform(0.02, arguments.longest) if kills < arguments.kills else None)
                except subprocess.TimeoutExpired:
                    killed = time.time()
                    process.send_signal(signal.SIGKILL)
                    process.wait()
                    kills += 1
                    left += sum(name.startswith(".steradian-") for name in os.listdir(folder))
                    there = os.path.exists(f"{folder}/a.state")
                    safe = max(began, os.stat(f"{folder}/a.state").st_mtime) if there else began
                    oldest = max(oldest, killed - safe)
                    # A run's first interval begins when the scene is loaded.
                    first = safe == began
                    lost += killed - safe > arguments.every + (0.5 if first else 0.1)
                    continue
                message = process.stderr.read().decode()
                if code == 6:
                    unreadable += 1
                    print(message, file=sys.stderr)
                elif code != 0:
                    sys.exit(f"exit code {code}: {message}")
                break
            header, blocks = state(f"{folder}/a.state")
            same = subprocess.run([binary, "compare", "whole.exr", "a.exr", "--json"], cwd=folder, capture_output=True, check=True)
            wrong += blocks != whole[1] or header["done"] != whole[0]["done"] or json.loads(same.stdout)["mse"] != 0.0
            if unreadable:
                break
        left += sum(name.startswith(".") for name in os.listdir(folder))
    print(f"{kills} kills in {renders} renders (of {whole_seconds:.1f} s alone), a checkpoint each {arguments.every} s of {len(whole[1]) / 1e6:.1f} MB")
    print(f"lost beyond one interval: {lost} (oldest checkpoint {oldest:.3f} s); wrong bits: {wrong}; unreadable: {unreadable}; files left: {left}")
    sys.exit(1 if lost or wrong or unreadable or left else 0)


main()
