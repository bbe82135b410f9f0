"""Pictures on their way into a file, through ffmpeg in a process of its own."""

from __future__ import annotations

import queue
import subprocess
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from typing import Self

import numpy as np

from tussle.errors import MissingExtraError, ViewError
from tussle.view.export.whole_file import unwritable

WAITING = 3
"""Pictures that may wait for the encoder; more would only take memory."""
GIF_WIDTH, GIF_FPS = 640, 12.5
"""Most columns and pictures per second of a GIF: it knows no motion, and grows with each changed pixel."""
GIF_COLOURS = 128

H264 = ("-c:v", "libx264", "-preset", "veryfast", "-crf", "23", "-pix_fmt", "yuv420p", "-movflags", "+faststart")  # fmt: skip
"""What browsers, phones and slides play."""


def ffmpeg() -> str:
    """Path of the encoder.

    Raises:
        MissingExtraError: The package that brings it is not installed.
        ViewError: It is installed and has no encoder for this machine.
    """
    try:
        import imageio_ffmpeg  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingExtraError(
            "films need imageio-ffmpeg, which is not installed: pip install 'tussle[view]'"
        ) from error
    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise ViewError(f"films need ffmpeg, and imageio-ffmpeg brings none here: {error}") from error


class Encoder:
    """A file that pictures are written to; whole when it is closed, and not there when that fails.

    Args:
        path: The file, replaced where it is there.
        options: What ffmpeg is told of the file.
        drawn: Width and height of the pictures that it gets [pixels].
        fps: Pictures per second.

    Raises:
        MissingExtraError: There is no ffmpeg.
        ViewError: The file cannot be written.
    """

    def __init__(self, path: Path, options: tuple[str, ...], drawn: tuple[int, int], fps: float) -> None:
        self.path = path
        self._part = path.with_name(f".{path.name}.part")
        program = ffmpeg()
        if path.is_dir():
            raise unwritable(path, "it is a directory")
        try:
            self._part.touch()
        except OSError as error:
            raise unwritable(path, error) from error
        command = [
            *(program, "-hide_banner", "-loglevel", "error", "-y"),
            *("-f", "rawvideo", "-pix_fmt", "rgb0", "-s", f"{drawn[0]}x{drawn[1]}", "-r", f"{fps:g}", "-i", "-"),
            *options,
            str(self._part),
        ]  # fmt: skip
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stderr=pipe)  # noqa: S603 (words, and no shell)
        self._said = b""
        self._is_broken = False
        self._waiting: queue.Queue[np.ndarray | None] = queue.Queue(WAITING)
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._feed, self._listen)]
        for thread in self._threads:
            thread.start()

    def put(self, picture: np.ndarray) -> None:
        """Add a picture, (height, width, 4), uint8, which is not written to afterwards.

        Raises:
            ViewError: The file cannot be written.
        """
        if self._is_broken:
            self.close()
        self._waiting.put(picture)

    def _feed(self) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        while (picture := self._waiting.get()) is not None:
            if self._is_broken:
                continue  # or `put` would wait for ever
            try:
                pipe.write(picture.data)
            except OSError:  # it has ended; why, it says itself
                self._is_broken = True
        with suppress(OSError):
            pipe.close()

    def _listen(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as pipe:
            self._said = pipe.read()

    def close(self) -> None:
        """Wait for the last picture and put the file in its place.

        Raises:
            ViewError: It cannot be written.
        """
        code = self._end()
        if code != 0:
            self._part.unlink(missing_ok=True)
            said = self._said.decode(errors="replace").strip().splitlines()
            raise unwritable(self.path, said[0] if said else f"ffmpeg ended with code {code}")
        try:
            self._part.replace(self.path)
        except OSError as error:
            self._part.unlink(missing_ok=True)
            raise unwritable(self.path, error) from error

    def abandon(self) -> None:
        """Leave nothing behind. Does nothing once it is closed."""
        self._end()
        self._part.unlink(missing_ok=True)

    def _end(self) -> int:
        if self._threads:
            self._waiting.put(None)
            for thread in self._threads:
                thread.join()
            self._threads = []
        return self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()


def mp4_encoder(path: Path, drawn: tuple[int, int], size: tuple[int, int], fps: float) -> Encoder:
    """A film in H.264, of pictures that are drawn larger than they are shown."""
    return Encoder(path, ("-vf", scaling(drawn, size), *H264, "-f", "mp4"), drawn, fps)


def png_encoder(path: Path, drawn: tuple[int, int], size: tuple[int, int]) -> Encoder:
    """One picture."""
    return Encoder(
        path, ("-vf", scaling(drawn, size), "-frames:v", "1", "-c:v", "png", "-f", "image2pipe"), drawn, 1.0
    )


def scaling(drawn: tuple[int, int], size: tuple[int, int]) -> str:
    """The filter that makes a picture smaller."""
    return f"scale={size[0]}:{size[1]}:flags=area" if drawn != size else "null"


class GifEncoder(Encoder):
    """A GIF, with a palette of its own colours: a film without loss is made of it first, which is then read twice.

    Args:
        path: The file, replaced where it is there.
        drawn: Width and height of the pictures that it gets [pixels].
        size: Those of the film, which are kept where they are no larger than a GIF should be.
        fps: Pictures per second that it gets.
    """

    def __init__(self, path: Path, drawn: tuple[int, int], size: tuple[int, int], fps: float) -> None:
        self._gif = path
        if path.is_dir():
            raise unwritable(path, "it is a directory")
        share = min(1.0, GIF_WIDTH / size[0])
        small = (round(share * size[0]), round(share * size[1]))
        try:
            self._folder = tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}-")
        except OSError as error:
            raise unwritable(path, error) from error
        # One picture in a whole number, so that all are shown as long.
        thinned = fps / max(1, round(fps / GIF_FPS))
        lossless = ("-c:v", "libx264rgb", "-preset", "ultrafast", "-qp", "0", "-f", "matroska")
        options = ("-vf", f"fps={thinned:g},{scaling(drawn, small)}", *lossless)
        try:
            super().__init__(Path(self._folder.name) / "film.mkv", options, drawn, fps)
        except BaseException:
            self._folder.cleanup()
            raise

    def close(self) -> None:
        """Wait for the last picture, choose the colours, and put the file in its place.

        Raises:
            ViewError: It cannot be written.
        """
        try:
            super().close()
            palette = self.path.with_name("palette.png")
            self._run("-i", self.path, "-vf", f"palettegen=max_colors={GIF_COLOURS}:stats_mode=full", palette)
            beside = self.path.with_name("film.gif")
            mapping = "[0][1]paletteuse=dither=none:diff_mode=rectangle"
            self._run("-i", self.path, "-i", palette, "-lavfi", mapping, beside)
            beside.replace(self._gif)
        except OSError as error:
            raise unwritable(self._gif, error) from error
        finally:
            self._folder.cleanup()

    def _run(self, *arguments: str | Path) -> None:
        command = [ffmpeg(), "-hide_banner", "-loglevel", "error", "-y", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, check=False)  # noqa: S603 (words, and no shell)
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines()
            raise unwritable(self._gif, said[0] if said else f"ffmpeg ended with code {done.returncode}")

    def abandon(self) -> None:
        """Leave nothing behind."""
        super().abandon()
        self._folder.cleanup()
