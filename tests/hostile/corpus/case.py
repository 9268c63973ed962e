"""What a hostile case is: files, a command line, and what the program must do with them."""

import os
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

# The whole contents of a file, or a function that makes the file at the path that it is given.
Content = bytes | str | Callable[[str], None]

# Flags, and `-` for a scene, that programs before 0.3 lack.
NEW = ("--overwrite", "--max-asset-memory", "--asset-root", "-")

# A standard input that nobody writes to and nobody closes: a program that reads it waits until it is stopped.
OPEN_PIPE = "an open pipe"
# A standard input or output that is closed.
CLOSED = "closed"


@dataclass(frozen=True)
class Case:
    """One run of the program."""

    kind: str
    name: str
    # Without the program itself; run in the folder of the files.
    command: Sequence[str]
    # The exit code, or all that will do.
    code: int | tuple[int, ...]
    # A regular expression that the first line of every error must match.
    says: str = ""
    files: Mapping[str, Content] = field(default_factory=dict)
    # How many errors there must be where the exit code is not 0: any number where it is below 0; from 101 on 100, and how many more.
    errors: int = 1
    # Further regular expressions, each of which must match somewhere in stderr.
    places: Sequence[str] = ()
    # A file of the folder that is standard input, `CLOSED` or `OPEN_PIPE`; else nothing can be read.
    stdin: str = ""
    # A file that standard output goes to.
    stdout: str = ""
    # Variables that are set, or removed where they are `None`.
    environment: Mapping[str, str | None] = field(default_factory=dict)
    # Command lines that run before, without limits, and must succeed.
    setup: Sequence[Sequence[str]] = ()
    # Files that are made after those.
    damage: Mapping[str, Content] = field(default_factory=dict)
    # Names (globs) of files that may be new after a failure.
    leaves: Sequence[str] = ()
    # Names (globs) of files that may be changed.
    changes: Sequence[str] = ()
    # Whether it is stopped by a signal in a second run too.
    signaled: bool = False
    # Whether it works for so long that it is only run to be stopped.
    endless: bool = False
    # Files so large that another process makes them, since the memory of this one would count as the program's.
    large: bool = False

    @property
    def codes(self) -> tuple[int, ...]:
        """All exit codes that will do."""
        return self.code if isinstance(self.code, tuple) else (self.code,)


    @property
    def title(self) -> str:
        """What it is called, each by its own name."""
        return f"{self.kind}: {self.name}"

    @property
    def needs(self) -> list[str]:
        """Which new flags it uses."""
        return [flag for flag in NEW if flag in self.command]


def make(files: Mapping[str, Content], folder: str) -> None:
    """Makes files in a folder."""
    for name, content in files.items():
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        if callable(content):
            content(path)
        else:
            with open(path, "wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)


def with_mode(text: str, mode: int) -> Callable[[str], None]:
    """A file with rights of its own."""

    def write(path: str) -> None:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, mode)

    return write


def built(contents: Callable[[], bytes]) -> Callable[[str], None]:
    """A file whose contents are made only when it is."""

    def write(path: str) -> None:
        with open(path, "wb") as file:
            file.write(contents())

    return write


def pipe(path: str) -> None:
    """A named pipe that nobody writes to."""
    os.mkfifo(path)


def unix_socket(path: str) -> None:
    """A socket. Its name may have 107 bytes only, so it is made from within its folder."""
    here = os.open(".", os.O_RDONLY)
    try:
        os.chdir(os.path.dirname(path))
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(os.path.basename(path))
    finally:
        os.fchdir(here)
        os.close(here)


def folder(path: str) -> None:
    """A folder."""
    os.makedirs(path)


def link(target: str) -> Callable[[str], None]:
    """A symbolic link."""
    return lambda path: os.symlink(target, path)


def hard_link(target: str) -> Callable[[str], None]:
    """Another name of a file beside it."""
    return lambda path: os.link(os.path.join(os.path.dirname(path), target), path)


def sparse(length: int, head: bytes = b"") -> Callable[[str], None]:
    """A file of zeros that takes no room on the disk."""

    def write(path: str) -> None:
        with open(path, "wb") as file:
            file.write(head)
            file.truncate(length)

    return write


def parts(*pieces: tuple[bytes | str, int]) -> Callable[[str], None]:
    """A file of pieces, each repeated so many times."""

    def write(path: str) -> None:
        with open(path, "wb") as file:
            for piece, count in pieces:
                piece = piece.encode() if isinstance(piece, str) else piece
                at_once = max(1, (1 << 16) // max(1, len(piece)))
                for _ in range(count // at_once):
                    file.write(piece * at_once)
                file.write(piece * (count % at_once))

    return write


def lines(count: int, line: Callable[[int], str], head: str = "", tail: str = "") -> Callable[[str], None]:
    """A file of numbered lines or other pieces of text."""

    def write(path: str) -> None:
        with open(path, "w", encoding="utf-8") as file:
            file.write(head)
            for index in range(count):
                file.write(line(index))
            file.write(tail)

    return write
