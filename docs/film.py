#!/usr/bin/env python3
"""The film of the gallery: thirty seconds of fire, rain and aurora, cut from the scenes. Needs the program `bansho` and ffmpeg with VP9.

    film.py [--bansho target/release/bansho] [--width 384] [--quality 44] [--only NAME] -o docs/src/gallery/film.webm

Each shot is rendered without loss at the rate of its scene, which may be a time lapse (`speed`: every so many frames one is kept), scaled to the width and joined to the
next by a crossfade.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SCENES = Path(__file__).resolve().parent.parent / "scenes"
# Frames of the film per second.
FPS = 30
# Length of a crossfade, s.
FADE_S = 0.5


@dataclass
class Shot:
    """Part of a scene."""

    scene: str
    # First frame in the scene.
    first: int
    # Length on the screen without the fades, s.
    seconds: float
    # Frames of the scene for each frame of the film.
    speed: int = 1

    def frames(self) -> range:
        count = round((self.seconds + FADE_S) * FPS)
        return range(self.first, self.first + count * self.speed, self.speed)


SHOTS = [
    Shot("worlds/campfire_in_camp", 40, 3.0),
    Shot("fire_in_court", 30, 3.0),
    Shot("volumes/bonfire", 0, 3.0),
    Shot("volumes/fireball", 4, 1.5),
    Shot("street_lamp", 30, 2.5),
    Shot("headlights_ahead", 20, 2.5),
    Shot("downpour_day", 30, 2.5),
    Shot("worlds/aurora_over_fjord", 30, 3.5, speed=2),
    Shot("red_aurora", 60, 2.5, speed=2),
    Shot("corona", 20, 2.5, speed=2),
    Shot("worlds/aurora_over_clearing", 40, 3.5, speed=2),
]


def run(command: list) -> None:
    print("+", *command, file=sys.stderr, flush=True)
    subprocess.run([str(part) for part in command], check=True)


def render(shot: Shot, arguments: argparse.Namespace, size: str, folder: Path) -> Path:
    """Writes the frames of a shot, and returns a film of them without loss."""
    frames = shot.frames()
    pictures = folder / "frame.####.png"
    spec = f"{frames.start}-{frames[-1]}x{frames.step}"
    run([arguments.bansho, "render", SCENES / f"{shot.scene}.toml", "--frames", spec, "--size", size, "-o", pictures])
    # Numbers of frames have gaps where not all are kept, which the pattern by name allows.
    film = folder / "shot.mkv"
    # Pictures of scenes without a background have alpha: they are laid over black.
    encode = ["-vf", "format=gbrap,premultiply=inplace=1", "-c:v", "ffv1", "-pix_fmt", "gbrp", film]
    run(["ffmpeg", "-v", "error", "-y", "-framerate", FPS, "-pattern_type", "glob", "-i", folder / "frame.*.png", *encode])
    return film


def joined(shots: list) -> str:
    """The ffmpeg filter that joins all inputs by crossfades, and fades the last one out."""
    steps, last, time = [], "0:v", 0.0
    for index, shot in enumerate(shots[:-1]):
        time += shot.seconds
        steps.append(f"[{last}][{index + 1}:v]xfade=transition=fade:duration={FADE_S}:offset={time}[joined{index}]")
        last = f"joined{index}"
    time += shots[-1].seconds
    steps.append(f"[{last}]fade=t=out:st={time}:d={FADE_S},format=yuv420p[film]")
    return ";".join(steps)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bansho", default="bansho", help="the program")
    parser.add_argument("--width", type=int, default=384, help="width of the film, pixels; a multiple of 32")
    parser.add_argument("--quality", type=int, default=47, help="of VP9, 0 (best) to 63")
    parser.add_argument("--only", help="only the shots of the scenes whose names contain this")
    parser.add_argument("-o", "--out", type=Path, required=True)
    arguments = parser.parse_args()
    if arguments.width <= 0 or arguments.width % 32:
        parser.error(f"--width {arguments.width}: a multiple of 32 is needed, so that the height is even")
    shots = [shot for shot in SHOTS if (arguments.only or "") in shot.scene]
    if not shots:
        parser.error(f"--only {arguments.only}: no shot; there are {', '.join(shot.scene for shot in SHOTS)}")
    size = f"{arguments.width}x{arguments.width * 9 // 16}"
    with tempfile.TemporaryDirectory() as folder:
        inputs = []
        for index, shot in enumerate(shots):
            place = Path(folder, str(index))
            place.mkdir()
            inputs += ["-i", render(shot, arguments, size, place)]
        encode = ["-c:v", "libvpx-vp9", "-crf", arguments.quality, "-b:v", 0, "-row-mt", 1, "-deadline", "good", "-cpu-used", 1]
        run(["ffmpeg", "-v", "error", "-y", *inputs, "-filter_complex", joined(shots), "-map", "[film]", *encode, arguments.out])


if __name__ == "__main__":
    main()
