"""Scenes whose text is damaged, huge or absurd."""

from .case import Case, Content, lines, parts

FLAME = "bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[[flame_sheet]]\n"
HERE = r"^error: scene\.toml:\d+:\d+: "
MEBIBYTE = 1 << 20


def _checked(name: str, scene: Content, code: int | tuple[int, ...] = 3, says: str = HERE, **more) -> Case:
    return Case("text", name, ["check", "scene.toml"], code, says, {"scene.toml": scene}, **more)


def _at(line: int, column: int | str, words: str = "") -> str:
    return rf"^error: scene\.toml:{line}:{column}: .*{words}"


def _syntax() -> list[Case]:
    """Texts that are no TOML, or hardly."""
    return [
        _checked("empty", "", says=_at(1, 1, "`bansho = 2`")),
        _checked("only spaces", " \t\n" * 50, says=r"^error: scene\.toml:\d+:\d+: .*`bansho = 2`"),
        _checked("only a comment", "# nothing", says=_at(1, 1, "`bansho = 2`")),
        _checked("no format", "[[flame_sheet]]\n", says=_at(1, 1, "`bansho = 2`")),
        _checked("byte order mark", "\ufeff" + FLAME, 0),
        _checked("two byte order marks", "\ufeff\ufeff" + FLAME),
        _checked("UTF-16", FLAME.encode("utf-16"), says=r"^error: scene\.toml:1: .*UTF-8"),
        _checked("Latin-1 in a comment", b"bansho = 2\n# caf\xe9\n", says=r"^error: scene\.toml:2: .*UTF-8"),
        _checked("surrogate", b"bansho = 2\n[[flame_sheet]]\nname = \"\xed\xa0\x80\"\n", says=r"^error: scene\.toml:3: .*UTF-8"),
        _checked("overlong NUL", b"bansho = 2\n# \xc0\x80\n", says=r"^error: scene\.toml:2: .*UTF-8"),
        _checked("UTF-8 cut off", FLAME.encode() + "# é".encode()[:-1], says=r"^error: scene\.toml:6: .*UTF-8"),
        _checked("NUL", "bansho = 2\n\0\n", says=_at(2, r"\d+")),
        _checked("NUL in a string", 'bansho = 2\n[[flame_sheet]]\nname = "a\0b"\n', says=_at(3, r"\d+")),
        _checked("escape sequences of a terminal", 'bansho = 2\n[[flame_sheet]]\nname = "\x1b[2J\x1b]0;owned\x07"\n', says=_at(3, r"\d+")),
        _checked("escaped escape sequences", 'bansho = 2\n[[flame_sheet]]\nstage = "\\u001b[2J\\u001b]0;owned\\u0007"\n', says=_at(3, 9, "unknown value")),
        _checked("CRLF", FLAME.replace("\n", "\r\n"), 0),
        _checked("CRLF with a fault", FLAME.replace("\n", "\r\n") + "height = -1\r\n", says=_at(6, 10, "out of range")),
        _checked("lone carriage returns", FLAME.replace("\n", "\r")),
        _checked("vertical tabs", FLAME.replace(" = ", "\v=\v")),
        _checked("right-to-left override", 'bansho = 2\n[picture]\nframes = "\u202e6"\n', says=_at(3, 10, "a string")),
        _checked("wide characters before a fault", 'bansho = 2\n[[flame_sheet]]\n"\U0001f525\U0001f525" = 1\n', says=_at(3, 1, "unknown key")),
        _checked("unclosed table", "bansho = 2\n[picture\n", says=_at(2, r"\d+")),
        _checked("unclosed list of tables", "bansho = 2\n[[flame_sheet]\n", says=_at(2, r"\d+")),
        _checked("unclosed list", "bansho = 2\n[picture]\nsize = [32,\n", says=_at(r"\d+", r"\d+")),
        _checked("unclosed inline table", "bansho = 2\n[[flame_sheet]]\nshape = { sway = 0.1\n", says=_at(r"\d+", r"\d+")),
        _checked("unclosed string", 'bansho = 2\n[[flame_sheet]]\nname = "left\n', says=_at(3, r"\d+")),
        _checked("unclosed multi-line string", 'bansho = 2\n[[flame_sheet]]\nname = """left\n\n\n', says=_at(r"\d+", r"\d+")),
        _checked("key without a value", "bansho = 2\n[picture]\nframes =\n", says=_at(3, r"\d+")),
        _checked("key alone", "bansho = 2\n[picture]\nframes\n", says=_at(r"[34]", r"\d+")),
        _checked("value alone", "bansho = 2\n= 3\n", says=_at(2, r"\d+")),
        _checked("two values on a line", "bansho = 2 2\n", says=_at(1, r"\d+")),
        _checked("duplicate key", "bansho = 2\nbansho = 2\n", says=_at(2, 1, "duplicate")),
        _checked("duplicate table", "bansho = 2\n[picture]\n[camera]\n[picture]\n", says=_at(4, r"\d+", "duplicate")),
        _checked("table that is a key too", "bansho = 2\npicture.frames = 2\n[picture]\nframes = 3\n", says=_at(r"\d+", r"\d+")),
        _checked("list of tables that is a table too", "bansho = 2\n[rain]\n[[rain]]\n", says=_at(r"[23]", r"\d+")),
        _checked("bad escape", 'bansho = 2\n[[flame_sheet]]\nname = "\\q"\n', says=_at(3, r"\d+")),
        _checked("escape beyond Unicode", 'bansho = 2\n[[flame_sheet]]\nname = "\\UFFFFFFFF"\n', says=_at(3, r"\d+")),
        _checked("binary", bytes(range(256)) * 16, says=r"^error: scene\.toml:\d+(:\d+)?: "),
        _checked("a picture as a scene", b"\x89PNG\r\n\x1a\n" + bytes(1000), says=r"^error: scene\.toml:1: .*UTF-8"),
        Case("text", "cut at every eleventh byte", ["check", *(f"{at}.toml" for at in range(0, len(CUT), 11))], 3, r"^error: \d+\.toml:\d+:\d+: ",
             {f"{at}.toml": CUT[:at] for at in range(0, len(CUT), 11)}, errors=-1),
    ]


CUT = FLAME + """name = "left log"
position = { keys = [[0, [0, 0, 0]], [1.5, [0.25, 0, 0]]], interpolation = "linear" }
instances = [{ position = [1, 0, 0], scale = 0.5 }, { scale = 2 }]
[flame_sheet.texture]
threshold = [[0, 0], [0.25, 0.08], [1, 1]]
[camera]
position = [0.0, 0.8, 3.0]
"""


def _values() -> list[Case]:
    """Values of which each is TOML."""
    def value(name, table, text, words, line=3, column=r"\d+"):
        return _checked(name, f"bansho = 2\n{table}\n{text}\n", says=_at(line, column, words))

    return [
        _checked("format 1, with keys of its own", "bansho = 1\n[[flame_sheet]]\nturn_deg = 10\n", says=_at(1, 10, "format 1 .*allowed: 2")),
        _checked("format 99", "bansho = 99\n", says=_at(1, 10, "format 99 .*allowed: 2")),
        _checked("format of 64 bits", "bansho = 9223372036854775807\n", says=_at(1, 10, "allowed: 2")),
        _checked("format below zero", "bansho = -9223372036854775808\n", says=_at(1, 10, "allowed: 2")),
        _checked("format that is no number", 'bansho = "1"\n', says=_at(1, 10, "format")),
        _checked("format that is a date", "bansho = 1979-05-27\n", says=_at(1, 10, "format")),
        _checked("format that is a list", "bansho = [1]\n", says=_at(1, 10, "format")),
        value("whole number of 65 bits", "[picture]", "seed = 18446744073709551616", "", column=8),
        value("whole number of 10,000 digits", "[picture]", "seed = " + "9" * 10_000, "", column=8),
        value("number of 10,000 digits", "[picture]", "fps = 0." + "3" * 10_000 + "e9999", "", column=7),
        value("overflow", "[camera]", "roll_deg = 1e309", "", column=12),
        value("underflow", "[picture]", "fps = 1e-400", "out of range", column=7),
        value("infinity", "[picture]", "fps = inf", "out of range", column=7),
        value("no number", "[picture]", "fps = nan", "out of range", column=7),
        value("minus zero", "[picture]", "frames = -0", "", column=10),
        value("hexadecimal", "[picture]", "frames = 0xFFFFFFFFFFFF", "out of range", column=10),
        value("date and time", "[picture]", "seed = 2020-01-01T00:00:00Z", "expected a whole number", column=8),
        value("fraction by zero", "[picture]", 'fps = "30/0"', "", column=7),
        value("fraction of huge numbers", "[picture]", 'fps = "99999999999999999999999/1"', "", column=7),
        value("keys of nothing", "[camera]", "roll_deg = { keys = [] }", "has no points"),
        value("keys that go back", "[camera]", "roll_deg = { keys = [[1, 0], [0, 1]] }", "after point"),
        value("keys at one time", "[camera]", "roll_deg = { keys = [[1, 0], [1, 1]] }", "after point"),
        value("keys at no time", "[camera]", "roll_deg = { keys = [[nan, 0], [1, 1]] }", "finite|out of range"),
        value("keys at the end of time", "[camera]", "roll_deg = { keys = [[-1e308, 0], [1e308, 1]] }", "too steep or too long|out of range"),
        value("keys too near", "[camera]", "roll_deg = { keys = [[0, 0], [5e-324, 1]] }", "too steep"),
        value("keys of one number", "[camera]", "roll_deg = { keys = [[1]] }", ""),
        value("keys that are no list", "[camera]", "roll_deg = { keys = 5 }", ""),
        value("keys of an unknown interpolation", "[camera]", 'roll_deg = { keys = [[0, 0]], interpolation = "bouncy" }', "unknown value"),
        value("empty name", "[[rain]]", 'name = ""', "cannot be a name", column=8),
        value("name of 64 bytes", "[[rain]]", f'name = "{"a" * 64}"', "name of 64 bytes", column=8),
        value("name of a megabyte", "[[rain]]", f'name = "{"a" * MEBIBYTE}"', "name of 1048576 bytes", column=8),
        value("name with a path", "[[rain]]", 'name = "../../etc/passwd\\n"', "cannot be a name", column=8),
        value("reserved name", "[[rain]]", 'name = "plate"', "cannot be a name", column=8),
        _checked("Unicode name", 'bansho = 2\n[[rain]]\nname = "\U0001f525 雨"\n', 0),
        _checked("two of a name", 'bansho = 2\n[[rain]]\nname = "a"\n[[aurora]]\nname = "a"\n', says=_at(5, 8, "another phenomenon is already called")),
        value("unknown key of a megabyte", "[picture]", "a" * MEBIBYTE + " = 1", "unknown key", column=1),
        value("key of spaces", "[picture]", '"  " = 1', "unknown key", column=1),
        value("empty key", "[picture]", '"" = 1', "unknown key", column=1),
        value("dotted key of 10,000 parts", "[picture]", ".".join("a" * 10_000) + " = 1", ""),
        _checked("table of 10,000 parts", "bansho = 2\n[" + ".".join("a" * 10_000) + "]\n", says=_at(2, r"\d+")),
        _checked("a list for a phenomenon", "bansho = 2\nrain = [1, 2]\n", errors=-1, says=_at(2, r"\d+", "rain")),
        _checked("a table for a list of tables", "bansho = 2\n[rain]\n", says=_at(2, 1, r"\[\[rain\]\]")),
        _checked("a list of tables for a table", "bansho = 2\n[[camera]]\n", says=_at(2, r"\d+", "camera")),
        _checked("camera in its target", "bansho = 2\n[camera]\nposition = [0, 1, 0]\ntarget = [0, 1, 0]\n", says=_at(4, 10, "equals the camera's position")),
        _checked("lens wider than perspective allows", "bansho = 2\n[camera]\nfocal_length_mm = 0.1\nsensor_height_mm = 1000\n[[flame_sheet]]\n",
                 says=_at("[34]", r"\d+", "allowed")),
        _checked("lens that becomes too wide", "bansho = 2\n[camera]\nfocal_length_mm = { keys = [[0, 50], [1, 0.1]] }\n[[flame_sheet]]\n",
                 says=_at("3", r"\d+", "allowed")),
    ]


def _many() -> list[Case]:
    """Very much of something."""
    def sheets(count, text=""):
        return parts(("bansho = 2\n[picture]\nsize = [32, 24]\nframes = 1\n", 1), (f"[[flame_sheet]]\n{text}", count))

    def long_list(count, item, around="bansho = 2\n[[flame_sheet]]\n[flame_sheet.texture]\nthreshold = [{}]\n"):
        head, tail = around.split("{}")
        return lines(count, item, head, tail)

    deep = 100_000
    return [
        _checked("100 faults", sheets(100, "height = -1\n"), errors=100, places=[r"scene\.toml:6:10", r"scene\.toml:204:10"]),
        _checked("101 faults", sheets(101, "height = -1\n"), errors=101, places=[r"\b1 more\b"]),
        _checked("10,000 faults", sheets(10_000, "height = -1\n"), errors=10_000, places=[r"\b9,?900 more\b"], signaled=True),
        _checked("100,000 faults", sheets(100_000, "height = -1\n"), errors=100_000, places=[r"\b99,?900 more\b"], signaled=True),
        _checked("100,000 faults on one line", parts(("bansho = 2\npicture = {", 1), ("size = [], ", 1), ("}\nrain = [", 1), ("{rate_mm_per_h=-1},", 100_000), ("]\n", 1)),
                 errors=100_001, signaled=True, large=True),
        _checked("100,000 unknown keys", lines(100_000, lambda index: f"a{index} = 1\n", "bansho = 2\n[picture]\n"), errors=100_000, places=[r"\b99,?900 more\b"]),
        _checked("1,000,000 unknown keys", lines(1_000_000, lambda index: f"a{index} = 1\n", "bansho = 2\n[picture]\n"), errors=1_000_000, signaled=True, large=True),
        _checked("1,000,000 unknown tables", lines(1_000_000, lambda index: f"[a{index}]\n", "bansho = 2\n"), errors=1_000_000, signaled=True, large=True),
        _checked("1,000,000 times one key", parts((FLAME, 1), ("height = 1\n", 1_000_000)), says=_at(7, r"\d+", "duplicate"), signaled=True, large=True),
        _checked("1,000 sheets", sheets(1_000), 0, signaled=True),
        _checked("10,000 sheets", sheets(10_000), (0, 3), signaled=True),
        _checked("volume flame beyond memory", "bansho = 2\n[[flame_volume]]\nresolution = 2000\n[[flame_volume.burners]]\ndiameter = 900\n", says=_at(3, 14, "GiB")),
        _checked("volume flame of no size", "bansho = 2\n[[flame_volume]]\ndomain_min = [0, 0, 0]\ndomain_max = [0, 1, 1]\n", says=_at(4, 14, "empty")),
        _checked("volume flame without heat", "bansho = 2\n[[flame_volume]]\n[[flame_volume.burners]]\nheat_release_kw = 0\n", says=_at(4, 19, "out of range")),
        _checked("burner outside of its domain", "bansho = 2\n[[flame_volume]]\ndomain_max = [0.1, 2.0, 0.1]\n", says=_at(3, 14, "beyond")),
        _checked("1,000 volume flames", parts(("bansho = 2\n", 1), ("[[flame_volume]]\n", 1000)), (0, 3), r"^error: scene\.toml(:\d+:\d+)?: ", signaled=True),
        _checked("1,000 particle flames", parts(("bansho = 2\n", 1), ("[[flame_particles]]\nparticles = 100\n", 1000)), (0, 3), r"^error: scene\.toml(:\d+:\d+)?: ", signaled=True),
        _checked("10,000 lamps", parts((FLAME, 1), ("[[light]]\n", 10_000)), (0, 3), signaled=True),
        _checked("10,000 obstacles", parts((FLAME, 1), ("[[obstacle]]\n", 10_000)), (0, 3), signaled=True),
        _checked("10,000 rains", parts((FLAME, 1), ("[[rain]]\n", 10_000)), (0, 3), signaled=True),
        _checked("300 auroras", parts(("bansho = 2\n", 1), ("[[aurora]]\n", 300)), (0, 3), signaled=True),
        _checked("10,000 sheets of one name", sheets(10_000, 'name = "a"\n'), errors=9_999, signaled=True),
        _checked("10,000 instances", parts((FLAME, 1), ("[[flame_sheet.instances]]\n", 10_000)), says=_at(r"\d+", r"\d+", "0 to 1000 items")),
        _checked("1,000,000 control points", long_list(1_000_000, lambda index: f"[{index}e-6,0],"), (0, 3), signaled=True, large=True),
        _checked("1,000,000 control points that do not ascend", long_list(1_000_000, lambda _: "[0,0],"), signaled=True, large=True),
        _checked("1,000,000 control points that are wrong", long_list(1_000_000, lambda _: "[2,-1],"), signaled=True, large=True, errors=-1),
        _checked("1,000,000 keys", long_list(1_000_000, lambda index: f"[{index},0],", "bansho = 2\n[camera]\nroll_deg = {{keys=[{}]}}\n".replace("{{", "{").replace("}}", "}").replace("[{}]", "[{}]")), (0, 3), signaled=True, large=True),
        _checked("1,000,000 numbers for two", long_list(1_000_000, lambda index: f"{index},", "bansho = 2\n[picture]\nsize = [{}]\n"), says=_at(3, 8, "list of 2 numbers|2 items"), signaled=True, large=True),
        _checked("3,000,000 tables in a list", parts((FLAME + "instances = [", 1), ("{},", 3_000_000), ("]\n", 1)), says=_at(6, r"\d+", "0 to 1000 items|allowed: up to 1200000"), signaled=True, large=True),
        _checked("15 MB of comments", parts((FLAME, 1), ("# " + "a" * 97 + "\n", 150_000)), 0, signaled=True, large=True),
        _checked("15 MB of one comment", parts((FLAME + "# ", 1), ("a", 15_000_000)), 0, signaled=True, large=True),
        _checked("15 MB of one string", parts((FLAME + 'name = "', 1), ("a", 15_000_000), ('"\n', 1)), says=_at(6, 8, "name of 15000000 bytes"), signaled=True, large=True),
        _checked("15 MB of one unclosed string", parts((FLAME + 'name = "', 1), ("a", 15_000_000)), says=_at(6, r"\d+"), signaled=True, large=True),
        _checked("15 MB of newlines", parts((FLAME, 1), ("\n", 15_000_000)), 0, signaled=True, large=True),
        _checked("15 MB of brackets", parts((FLAME + "name = ", 1), ("[", 15_000_000)), says=_at(6, r"\d+"), signaled=True, large=True),
        _checked("15 MB of quotes", parts((FLAME + "name = ", 1), ('"', 15_000_000)), says=_at(r"\d+", r"\d+"), signaled=True, large=True),
        _checked("15 MB of an unknown word", parts((FLAME + 'stage = "', 1), ("a", 15_000_000), ('"\n', 1)), says=_at(6, 9, "unknown value"), signaled=True, large=True),
        _checked("17 MB of comments", parts((FLAME, 1), ("# " + "a" * 97 + "\n", 175_000)), says=r"^error: scene\.toml: .*(MiB|16777216|more than|allowed)", signaled=True, large=True),
        _checked("17 MB that are no UTF-8", parts((b"\xff", 17_800_000)), says=r"^error: scene\.toml(:1)?: .*(MiB|16777216|more than|UTF-8)", signaled=True, large=True),
        _checked("lists 100,000 deep", parts((FLAME + "name = ", 1), ("[", deep), ("]", deep), ("\n", 1)), says=_at(6, r"\d+")),
        _checked("inline tables 100,000 deep", parts((FLAME + "shape = ", 1), ("{a=", deep), ("1", 1), ("}", deep), ("\n", 1)), says=_at(6, r"\d+")),
        _checked("lists and tables 100,000 deep", parts((FLAME + "shape = ", 1), ("[{a=", deep), ("1", 1), ("}]", deep), ("\n", 1)), says=_at(6, r"\d+")),
        _checked("lists 100 deep", parts((FLAME + "name = ", 1), ("[", 100), ("]", 100), ("\n", 1)), says=_at(6, r"\d+")),
        _checked("tables 1,000 deep", parts((FLAME + "[", 1), ("a.", 1000), ("a]\n", 1)), says=_at(6, r"\d+")),
    ]


def cases() -> list[Case]:
    return _syntax() + _values() + _many()
