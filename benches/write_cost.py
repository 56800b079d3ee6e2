#!/usr/bin/env python3
"""What writing an EXR file with all layers costs in processor time.

    benches/write_cost.py [--binary FILE]... [--scene SCENE] [--size WxH] [--spp N] [--rounds N] [--compression NAME] [--render]

The first binary renders a shard; then `merge` writes its picture uncompressed, as PNG, and compressed. With `--render` whole renders take turns instead, whose
variation is in the figures. With several binaries they take turns too. The table has medians of processor seconds of all threads: of the program, of
what it takes longer than with uncompressed files, and of what it takes longer than with a PNG file of the colour alone; then the largest memory of a
process and the size of the file. Files go to TMPDIR.
"""

import argparse
import os
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(command):
    """Processor seconds and the most memory of a command, in MB."""
    process = subprocess.Popen([str(word) for word in command])
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(map(str, command))}: status {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--binary", action="append", default=[])
    parser.add_argument("--scene", default=str(ROOT / "scenes/cornell.json"))
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--spp", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--compression", default="zip")
    parser.add_argument("--render", action="store_true")
    arguments = parser.parse_args()
    binaries = arguments.binary or [str(ROOT / "target/release/steradian")]
    how = "render" if arguments.render else "merge"
    print(f"{Path(arguments.scene).name}, {arguments.size}, {arguments.spp} spp, {arguments.compression}, {how}, load {os.getloadavg()[0]:.1f}\n")
    print("| pixels | binary | program | longer than none | longer than PNG | memory | file |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        out = folder / "a.exr"
        outputs = {"none": out, "png": folder / "a.png", arguments.compression: out}
        shards = {name: folder / f"{name}.shard" for name in outputs}
        for pixels, options in [("half", []), ("float", ["--float"])]:
            def render(binary, name, file, *more):
                compression = [] if name == "png" else ["--exr", f"compression={name}"]
                command = [binary, "render", arguments.scene, "--size", arguments.size, "--spp", arguments.spp, "--layers", "all"]
                return run([*command, *options, *compression, *more, "-q", "-o", file])

            def write(binary, name):
                if arguments.render:
                    return render(binary, name, outputs[name])
                return run([binary, "merge", shards[name], "-q", "-o", outputs[name]])

            if not arguments.render:
                for name, shard in shards.items():
                    shard.unlink(missing_ok=True)
                    render(binaries[0], name, shard, "--shard", "1/1")
            results = {binary: {name: [] for name in outputs} for binary in binaries}
            sizes = {}
            for _ in range(arguments.rounds):
                for binary in binaries:
                    for name in outputs:
                        results[binary][name].append(write(binary, name))
                    sizes[binary] = out.stat().st_size
            for binary in binaries:
                seconds = {name: [time for time, _ in runs] for name, runs in results[binary].items()}
                median = lambda other: statistics.median(a - b for a, b in zip(seconds[arguments.compression], seconds[other]))
                whole = statistics.median(seconds[arguments.compression])
                memory = statistics.median(memory for _, memory in results[binary][arguments.compression])
                print(
                    f"| {pixels} | {Path(binary).name} | {whole:.2f} s | {median('none'):.2f} s | {median('png'):.2f} s "
                    f"| {memory:.0f} MB | {sizes[binary] / 1e6:.1f} MB |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
