"""Animations as GIF and MP4."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import lazy_loader as lazy
import numpy as np

from evolvent.exports.pictures import pictures
from evolvent.exports.request import Request, animation_of, shown_size, size_of
from evolvent.results import unfinished
from evolvent.view.animation import default_speed
from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_base.files import writing

if TYPE_CHECKING:
    from evolvent.results.motion import Motion
    from evolvent_base import sheets
else:
    sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)


class _Kind(NamedTuple):
    """A kind of film: pixels, frames in a second, the most of them in a second, and the most bytes that one takes."""

    size: tuple[int, int]
    rate: float
    most: float
    bytes: float


_GIF = _Kind((800, 600), 20.0, 50.0, 1e5)
_MP4 = _Kind((1280, 720), 30.0, 120.0, 4e4)


def gif(run: Any, path: str, request: Request) -> str:
    """Write the animation as GIF; returns what was written.

    Raises
    ------
    InputError
        If the run holds too little, or the file cannot be written.
    """
    motion = animation_of(run, request.clearance)
    time, speed, length = _times(motion, request, _GIF)
    request.allow(time.size * _GIF.bytes, f"{time.size} frames")

    def drawn(moments: np.ndarray) -> Iterator[sheets.Image.Image]:
        return (sheets.Image.fromarray(p[..., :3]) for p in _drawn(run, motion, moments, _GIF.size, request))

    # one palette for all frames, so that colours do not flicker
    width, height = _GIF.size
    sheet = sheets.Image.new("RGB", (width, 7 * height))
    sheet.paste(sheets.Image.fromarray(_swatches(width, height)), (0, 6 * height))
    for k, image in enumerate(drawn(np.linspace(time[0], time[-1], 6))):
        sheet.paste(image, (0, k * height))
    palette = sheet.quantize(colors=200)
    tones = np.array(palette.getpalette()).reshape(-1, 3)
    tones[(tones > 248).all(axis=1)] = 255  # white is not a mean of light tones
    palette.putpalette(tones.ravel().tolist())
    images = progress.track(drawn(time), "drawing frames", time.size)
    frames = (image.quantize(palette=palette, dither=sheets.Image.Dither.NONE) for image in images)
    # times are kept in hundredths of a second; rounding must not add up
    ends = np.round(100.0 * length * np.arange(time.size + 1) / max(time.size - 1, 1))
    with writing(path) as temporary:
        next(frames).save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=[int(10 * d) for d in np.diff(ends)],
            loop=0,
        )
    return _summary(path, time, speed, length)


def _swatches(width: int, height: int) -> np.ndarray:
    """A picture of the colours of values and forces, so that a palette has them even where they are rare."""
    ramp = (255.0 * sheets.mpl.colormaps["viridis"](np.linspace(0.0, 1.0, width))[:, :3]).astype(np.uint8)
    found = np.repeat(ramp[None], height, axis=0)
    for k, color in enumerate(("#c5281c", "#b00020", "#c0392b", "#2e8b57", "#2a6fbb", "#e26054", "#ffffff")):
        own = 255.0 * np.array(sheets.mpl.colors.to_rgb(color))
        found[k * height // 14 : (k + 1) * height // 14] = own.astype(np.uint8)
    return found


def mp4(run: Any, path: str, request: Request) -> str:
    """Write the animation as MP4 (H.264); returns what was written.

    Raises
    ------
    InputError
        If there is no ffmpeg, the run holds too little, or the file cannot be written.
    """
    program = ffmpeg()
    motion = animation_of(run, request.clearance)
    time, speed, length = _times(motion, request, _MP4)
    request.allow(time.size * _MP4.bytes, f"{time.size} frames")
    width, height = _MP4.size
    with writing(path) as temporary:
        given = [
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgba",
            "-s",
            f"{width}x{height}",
            "-r",
            f"{(time.size - 1) / length:.6g}",
        ]
        wanted = ["-an", "-c:v", "libx264", "-crf", "21", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
        command = [program, "-y", "-nostdin", "-loglevel", "error", *given, "-i", "-", *wanted, temporary]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdin is not None
            assert process.stderr is not None
            try:
                for picture in progress.track(
                    _drawn(run, motion, time, _MP4.size, request), "drawing frames", time.size
                ):
                    process.stdin.write(picture.tobytes())
                process.stdin.close()
            except BrokenPipeError:  # what it has to say comes below
                pass
            except BaseException:
                process.kill()
                raise
            output = process.stderr.read().decode(errors="replace").strip()
            if process.wait() != 0:
                reason = output.splitlines()[-1] if output else f"it ended with code {process.returncode}"
                raise InputError(f"cannot write {path!r}: ffmpeg says: {reason}")
    return _summary(path, time, speed, length)


def ffmpeg() -> str:
    """The program that makes videos."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe  # an extra

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        found = shutil.which("ffmpeg")
    if found is None:
        raise InputError(
            "--to mp4 needs ffmpeg, and there is none here; pip install 'evolvent[export]' brings it, "
            "and --to gif does without"
        )
    return found


def _times(motion: Motion, request: Request, kind: _Kind) -> tuple[np.ndarray, float, float]:
    """Moments of the frames, s; the speed; the time that it takes to show them, s."""
    span = float(motion.time[-1] - motion.time[0])
    speed = request.speed or default_speed(motion)
    length = span / speed
    frames = request.frames or max(2, round(length * kind.rate) + 1)
    if frames < 2:
        raise InputError("--frames is 1; an animation takes 2 or more")
    if (frames - 1) / length > kind.most:
        raise InputError(
            f"{frames} frames in {length:.3g} s are more than {kind.most:g} in a second; give fewer, or a lower --speed"
        )
    return np.linspace(motion.time[0], motion.time[-1], frames), speed, length


def _drawn(run: Any, motion: Motion, time: np.ndarray, size: tuple[int, int], request: Request) -> Iterator[np.ndarray]:
    return pictures(motion, time, size=size, inertial=request.axes != "body", label=unfinished(run))


def _summary(path: str, time: np.ndarray, speed: float, length: float) -> str:
    return f"{path}: {time.size} frames in {length:.3g} s, {speed:g} times real time, {shown_size(size_of(path))}"
