"""Command lines that make no sense, and standard output that cannot be written."""

from .case import CLOSED, Case, Content
from .scene_text import FLAME


def _render(name: str, arguments: list[str], code: int | tuple[int, ...] = 2, words: str = "", scene: Content = FLAME, **more) -> Case:
    return Case("arguments", name, ["render", "scene.toml", "-o", "out/a.png", *arguments], code, rf"^error: .*({words})", {"scene.toml": scene}, **more)


def _frames() -> list[Case]:
    allowed = "allowed: 17, 0-239"
    many = ",".join(str(index) for index in range(0, 20_000, 2))
    refused = {
        "to the end of 64 bits": "0-9223372036854775807",
        "from the end of 64 bits": "9223372036854775807",
        "beyond 64 bits": "99999999999999999999999",
        "below 64 bits": "-9223372036854775808-0",
        "12 digits of them": "0-999999999999",
        "a hundred million": "0-99999999",
        "twice ten million": "0-9999999,0-9999999",
        "reversed": "9-0",
        "step of zero": "0-9x0",
        "step of 20 digits": "0-9x99999999999999999999",
        "step without a range": "5x2",
        "nothing": "",
        "a comma": ",",
        "a dash": "-",
        "1,000 dashes": "-" * 1000,
        "100,000 commas": "," * 100_000,
        "a fraction": "1.5",
        "an exponent": "1e3",
        "a plus sign": "+5",
        "hexadecimal": "0x10",
        "digits of other scripts": "٣-٥",
        "a word": "first",
    }
    return [
        *[_render(f"frames: {name}", ["--frames", spec], words=allowed) for name, spec in refused.items()],
        _render("frames: a newline", ["--frames", "1\n2"], places=[allowed]),
        _render("frames: far from the scene", ["--frames", "999999999999", "--size", "4x4"], (0, 2), ""),
        _render("frames: 10,000 of them, for a film of memory", ["--frames", many[:30_000].rstrip(","), "--size", "2x2", "--contact-sheet", "5000"], 2, "--contact-sheet"),
        _render("frames: one a hundred times", ["--frames", ",".join(["0"] * 100), "--size", "4x4"], 0),
    ]


def _numbers() -> list[Case]:
    sizes = ["0x0", "0x5", "5x0", "-1x5", "5", "5x", "x5", "5x5x5", "1e3x5", "99999x1", "99999999999999999999x1", "NaNxNaN", "", "٣x٣"]
    crops = ["0,0,0,0", "0,0,99,99", "31,23,2,2", "18446744073709551615,0,2,2", "-1,0,5,5", "1,2,3", "1,2,3,4,5", "", "a,b,c,d"]
    loops = ["0", "-1", "1e300", "1e-300", "nan", "inf", "3601", "", "soon"]
    return [
        *[_render(f"size {text!r}", [f"--size={text}"], words="1 to 16384") for text in sizes],
        *[_render(f"crop {text!r}", [f"--crop={text}"], words="allowed|beyond") for text in crops],
        *[_render(f"loop {text!r}", ["--loop", text], words="allowed") for text in loops],
        *[_render(f"threads {text!r}", [f"--threads={text}"], words="threads") for text in ("0", "-1", "1025", "99999999999999999999", "many")],
        *[_render(f"vector level {text!r}", [f"--vector-level={text}"], words="vector level.*allowed: ") for text in ("", "AVX2", "mmx", "simd128", "-1")],
        *[_render(f"seed {text!r}", ["--seed", text], words="allowed: a whole number") for text in ("-1", "18446744073709551616", "1.5", "")],
        *[_render(f"contact sheet of {text}", [f"--contact-sheet={text}"], words="contact-sheet") for text in ("0", "4097", "18446744073709551615", "-1")],
        *[_render(f"snapshot every {text}", ["--snapshots", "states", f"--snapshot-every={text}"], words="allowed|snapshot") for text in ("0", "-1", "99999999999999999999")],
        *[_render(f"memory for inputs of {text!r}", [f"--max-asset-memory={text}"], words="max-asset-memory") for text in ("0", "-1", "many", "1e400GiB", "99999999999999999999GiB", "nanGiB", "")],
        _render("16384 x 16384", ["--size", "16384x16384", "--frames", "0"], (2, 3), "GiB|allowed", signaled=True),
        _render("16384 x 16384 in 16 bits", ["--size", "16384x16384", "--frames", "0", "--bits", "16"], (2, 3), "GiB|allowed", signaled=True),
        _render("16384 x 16384 by the scene", ["--frames", "0"], 3, "picture.size.*(GiB|allowed)", FLAME.replace("[32, 24]", "[16384, 16384]"), signaled=True),
        _render("an overscan of 4096 pixels", ["--frames", "0", "-o", "out/a.exr"], 2, "", FLAME.replace("frames = 2", "frames = 2\noverscan = 4096")),
        _render("10,000,000 frames", ["--size", "1x1", "--progress", "none"], 143, "", FLAME.replace("frames = 2", "frames = 10000000"), signaled=True, endless=True),
    ]


def _words() -> list[Case]:
    sets = {
        "nothing": ("", "not an assignment"),
        "no value": ("picture.size", "not an assignment"),
        "no key": ("=5", "not an assignment"),
        "only an equals sign": ("=", "not an assignment"),
        "an unknown key": ("picture.framse=3", "did you mean `frames`"),
        "an unknown table": ("a.b.c=1", "not in the scene"),
        "a phenomenon that is not there": ("flame_sheet.7.height=2", ""),
        "a phenomenon at 2^64": ("flame_sheet.18446744073709551616.height=2", ""),
        "a value out of range": ("picture.frames=0", "out of range"),
        "a list that does not end": ("picture.size=[", "picture.size"),
        "a table in place of the scene": ("bansho={}", "bansho"),
        "a newline and a table": ("picture.frames=1\n[camera]\nroll_deg=99999", ""),
        "a key of dots": ("........=1", ""),
        "a key of 100,000 dots": ("a" + ".a" * 50_000 + "=1", ""),
        "a list 50,000 deep": ("picture.size=" + "[" * 50_000 + "]" * 50_000, ""),
        "NUL in a string": ("flame_sheet.name=\"a\\u0000b\"", "name"),
    }
    return [
        *[_render(f"set {name}", ["--set", text], words=words) for name, (text, words) in sets.items()],
        _render("1,000 times --set", ["--frames", "0", *[part for index in range(1000) for part in ("--set", f"flame_sheet.height={1 + index / 1000}")]], 0),
        _render("an unknown option", ["--frmes", "1"], places=["--frames"]),
        _render("an option of 100,000 letters", ["--" + "a" * 100_000], words=""),
        _render("an option that is no UTF-8", [b"--\xff".decode("utf-8", "surrogateescape")], words=""),
        _render("an unknown view", ["--view", "filmic"], places=["display, neutral, agx, standard, raw"]),
        _render("no frame in flight", ["--frames-in-flight", "0"], places=["auto, or a number of frames of at least 1"]),
        _render("12 bits", ["--bits", "12"], places=["8, 16"]),
        _render("layers in a PNG", ["--layers"], words=r"--layers.*\.exr"),
        _render("encoded alpha of raw pixels", ["--view", "raw", "--alpha", "encoded"], words="--alpha"),
        _render("two outputs", ["-o", "b.png"], words="cannot be used multiple times|--out"),
        Case("arguments", "nothing", [], 2, "", errors=0),
        Case("arguments", "an empty command", [""], 2, r"^error: "),
        Case("arguments", "an unknown command", ["rendr", "scene.toml"], 2, r"^error: .*rendr"),
        Case("arguments", "a shell that is none", ["completions", "csh"], 2, r"^error: .*csh"),
        Case("arguments", "schema of something", ["schema", "extra"], 2, r"^error: .*extra"),
        Case("arguments", "an example that is none", ["new", "a", "--from", "../../etc/passwd"], 2, r"^error: there is no example"),
        Case("arguments", "a phenomenon that is none", ["new", "a", "--kind", "snow"], 2, r"^error: there is no phenomenon `snow`"),
        Case("arguments", "a new scene in /proc", ["new", "/proc/a"], 1, r"^error: /proc/a\.toml: (cannot be written|no permission)"),
        Case("arguments", "a new scene without a name", ["new", ""], (1, 2), r"^error: "),
        Case("arguments", "a new scene named ..", ["new", ".."], (1, 2), r"^error: "),
    ]


def _others() -> list[Case]:
    def flipbook(name: str, arguments: list[str], words: str, code: int | tuple[int, ...] = 2, **more) -> Case:
        return Case("arguments", f"flipbook: {name}", ["flipbook", "scene.toml", "-o", "a.png", *arguments], code, rf"^error: .*({words})", {"scene.toml": FLAME}, **more)

    def streaks(name: str, arguments: list[str], words: str, code: int | tuple[int, ...] = 2, **more) -> Case:
        return Case("arguments", f"streaks: {name}", ["streaks", "-o", "s", *arguments], code, rf"^error: .*({words})", **more)

    return [
        flipbook("no grid", [], "", errors=1),
        flipbook("0 x 4", ["--grid", "0x4"], "up to 4096"),
        flipbook("65 x 64", ["--grid", "65x64"], "up to 4096"),
        flipbook("2^32 x 2^32", ["--grid", "4294967296x4294967296"], "up to 4096"),
        flipbook("a sheet of 131072 pixels", ["--grid", "8x8", "--size", "16384x16384"], "16384"),
        flipbook("a sheet of 16384 x 16384", ["--grid", "2x2", "--size", "8192x8192"], "GiB|allowed", (2, 3), signaled=True),
        flipbook("a loop of an hour's tenth", ["--grid", "1x2", "--loop", "1e-9"], "loop"),
        flipbook("a first frame at the end of 64 bits", ["--grid", "1x2", "--size", "4x4", "--first-frame", "9223372036854775807"], "", (0, 2)),
        flipbook("a film", ["--grid", "1x2", "-o", "a.gif"], r"multiple times|\.gif"),
        *[streaks(f"rates {text!r}", ["--rates", text], "allowed|ascend|empty|list") for text in ("", "x", "-1", "501", "nan", "5,1", "1,1", "1e308", ",".join(["1"] * 10_000))],
        *[streaks(f"diameters {text!r}", ["--diameters", text], "allowed|ascend|empty|list") for text in ("0", "1e308", "2,1", "inf")],
        *[streaks(f"size {text}", ["--size", text], "allowed|size") for text in ("0", "4097", "99999999999999999999")],
        *[streaks(f"exposure {text!r}", ["--exposure-time", text], "allowed") for text in ("0", "1/0", "0/0", "1e308", "-1/30")],
        *[streaks(f"box {text}", ["--cube-size", text], "allowed|cube") for text in ("0", "1e300", "nan")],
        streaks("half a billion drops", ["--cube-size", "99", "--rates", "500"], "drops"),
        streaks("10,000 rates", ["--rates", ",".join(f"{1 + index / 100:.2f}" for index in range(10_000)), "--size", "8", "--cube-size", "0.01"], "", (0, 2), endless=True, signaled=True),
        streaks("no light", ["--light-direction", "0,0,0"], "light"),
        streaks("light from not-a-number", ["--light-direction", "nan,0,0"], "allowed"),
        streaks("light from very far", ["--light-direction", "1e308,1e308,1e308"], "light", (0, 2)),
        streaks("0 variants", ["--variants", "0"], "variants"),
        streaks("a folder that is a file", ["--rates", "5", "--diameters", "2", "--size", "8", "--cube-size", "0.1", "-o", "/dev/null"], "", (1, 2)),
        Case("arguments", "simulate: nothing with particles", ["simulate", "scene.toml", "--particles", "a.ply"], 2, r"^error: this scene has no particles", {"scene.toml": FLAME}),
        Case("arguments", "simulate: another extension", ["simulate", "scene.toml", "--particles", "a.obj"], 2, r"^error: ", {"scene.toml": FLAME}),
        Case("arguments", "simulate: 10^12 particles", ["simulate", "scene.toml", "--particles", "a.ply"], 3, r"^error: scene\.toml:3:13: .*GiB", {"scene.toml": "bansho = 2\n[[flame_particles]]\nparticles = 1000000000000\n"}),
    ]


def _standard_output() -> list[Case]:
    full = r"^error: .*standard output: "
    lines = {
        "check": ["check", "scene.toml"],
        "schema": ["schema"],
        "new --list": ["new", "--list"],
        "new": ["new", "a"],
        "completions": ["completions", "bash"],
        "man": ["man"],
        "--help": ["--help"],
        "--version": ["--version"],
        "render --help": ["render", "--help"],
        "progress": ["render", "scene.toml", "-o", "out/a.png", "--progress", "json", "--threads", "2"],
        "progress of streaks": ["streaks", "--rates", "5", "--diameters", "2", "--size", "8", "--cube-size", "0.1", "-o", "s", "--progress", "json"],
        "progress of a simulation": ["simulate", "gas.toml", "--particles", "p/a.ply", "--progress", "json"],
        "progress of a flipbook": ["flipbook", "scene.toml", "--grid", "1x2", "--size", "8x8", "-o", "b/a.png", "--progress", "json"],
    }
    gas = "bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[[flame_particles]]\nparticles = 200\npreroll_s = 0.0\n"
    files: dict[str, Content] = {"scene.toml": FLAME, "gas.toml": gas}
    leaves = ["out/*", "s/*", "p/*", "b/*", "a.toml"]
    full_cases = [Case("standard output", f"full: {name}", line, 1, full, files, stdout="/dev/full", leaves=leaves) for name, line in lines.items()]
    closed_cases = [Case("standard output", f"closed: {name}", line, (0, 1), full, files, stdout=CLOSED, leaves=leaves) for name, line in lines.items() if name in ("check", "schema", "progress")]
    return full_cases + closed_cases


def cases() -> list[Case]:
    return _frames() + _numbers() + _words() + _others() + _standard_output()
